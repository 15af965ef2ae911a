//! `--set key=value`: changes a deck before it is read.

use super::hints::nearest;
use super::scheme::{COEFFICIENTS, SchemeName};
use super::words::Words;
use toml_edit::{DocumentMut, Item, Key, Table, TableLike, Value};

/// Applies `key=value` pairs to the text of a deck and gives the changed text.
///
/// Keys are paths as in TOML; arrays of tables are indexed by number (`stage.0.step`). A value is
/// read as TOML, and as a text where that fails.
pub fn apply(text: &str, settings: &[String]) -> Result<String, String> {
    if settings.is_empty() {
        return Ok(text.to_string());
    }
    // A deck that is no TOML is reported when it is read, with the line.
    let Ok(mut document) = text.parse::<DocumentMut>() else { return Ok(text.to_string()) };
    let mut given = Vec::new();
    for setting in settings {
        let Some((path, value)) = setting.split_once('=') else {
            return Err(format!("--set {setting}: expected KEY=VALUE"));
        };
        let keys = Key::parse(path.trim()).map_err(|_| format!("--set {setting}: `{path}` is not a key"))?;
        refuse_unused(text, &document, &keys).map_err(|why| format!("--set {setting}: {why}"))?;
        set(document.as_item_mut(), &keys, read_value(value.trim()))
            .map_err(|why| format!("--set {setting}: {why}"))?;
        given.push(keys.iter().map(|key| key.get().to_string()).collect::<Vec<_>>());
    }
    for path in &given {
        if let [list, number, key] = &path[..]
            && (list.as_str(), key.as_str()) == ("stage", "scheme")
        {
            let is_given = |key: &str| given.iter().any(|path| path[..] == ["stage", number, key]);
            drop_coefficients(&mut document, number, is_given);
        }
    }
    Ok(document.to_string())
}

/// Refuses a parameter that the deck does not have, unless the deck uses it.
fn refuse_unused(text: &str, document: &DocumentMut, keys: &[Key]) -> Result<(), String> {
    let [table, name] = keys else { return Ok(()) };
    if table.get() != "param" {
        return Ok(());
    }
    let known = document.get("param").and_then(Item::as_table_like);
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    if known.is_some_and(|known| known.contains_key(name.get())) || text.split(|c| !is_word(c)).any(|w| w == name.get())
    {
        return Ok(());
    }
    let meant = nearest(name.get(), known.into_iter().flat_map(|known| known.iter().map(|(name, _)| name)));
    let hint = meant.map_or(String::new(), |meant| format!(": did you mean `{meant}`?"));
    Err(format!("the deck has no parameter `{}`{hint}", name.get()))
}

/// Takes the coefficients of the scheme that a stage had before out of it, unless they are given as
/// well.
fn drop_coefficients(document: &mut DocumentMut, number: &str, is_given: impl Fn(&str) -> bool) {
    let Ok(number) = number.parse::<usize>() else { return };
    let stage: Option<&mut dyn TableLike> = match document.get_mut("stage") {
        Some(Item::ArrayOfTables(stages)) => stages.get_mut(number).map(|stage| stage as &mut dyn TableLike),
        Some(Item::Value(Value::Array(stages))) => {
            stages.get_mut(number).and_then(Value::as_inline_table_mut).map(|stage| stage as &mut dyn TableLike)
        }
        _ => None,
    };
    let Some(stage) = stage else { return };
    let Some(scheme) = stage.get("scheme").and_then(Item::as_str).map(str::to_string) else { return };
    // An unknown scheme is reported when the deck is read.
    let Some(scheme) = SchemeName::of(&scheme) else { return };
    for key in COEFFICIENTS.into_iter().filter(|key| !scheme.coefficients().contains(key) && !is_given(key)) {
        stage.remove(key);
    }
}

fn read_value(text: &str) -> Value {
    text.parse().unwrap_or_else(|_| Value::from(text))
}

/// Tables that may be wanted where the deck has none.
const MADE: [&str; 9] = ["param", "output", "effects", "cost", "units", "point", "history", "section", "material"];

fn set(item: &mut Item, keys: &[Key], new: Value) -> Result<(), String> {
    set_below(item, keys, new, keys.first().is_some_and(|key| MADE.contains(&key.get())))
}

/// Goes down one key; `make` says whether tables that are missing on the way are made.
fn set_below(item: &mut Item, keys: &[Key], new: Value, make: bool) -> Result<(), String> {
    let (key, rest) = keys.split_first().ok_or("an empty key")?;
    let key = key.get();
    if let Item::Value(value) = item {
        return set_in_value(value, keys, new);
    }
    if let Item::ArrayOfTables(tables) = item {
        let count = tables.len();
        let table = tables.get_mut(index(key, count)?).ok_or_else(|| no_entry(key, count))?;
        return set_in_table(table, rest, new, make);
    }
    match item.as_table_mut() {
        Some(table) => set_in_table(table, keys, new, make),
        None => Err(format!("`{key}` is not a table and has no keys")),
    }
}

fn set_in_table(table: &mut Table, keys: &[Key], new: Value, make: bool) -> Result<(), String> {
    let (key, rest) = keys.split_first().ok_or("a table cannot be replaced")?;
    let name = key.get();
    if !rest.is_empty() {
        if !table.contains_key(name) {
            if !make {
                return Err(format!("the deck has no `{name}`"));
            }
            table.insert(name, toml_edit::table());
        }
        return set_below(&mut table[name], rest, new, make);
    }
    match table.get_mut(name) {
        Some(Item::Value(old)) => replace(old, new),
        Some(Item::None) | None => {
            table.insert(name, Item::Value(new));
        }
        Some(_) => return Err(format!("`{name}` is a table")),
    }
    Ok(())
}

fn set_in_value(value: &mut Value, keys: &[Key], new: Value) -> Result<(), String> {
    let Some((key, rest)) = keys.split_first() else {
        replace(value, new);
        return Ok(());
    };
    let key = key.get();
    match value {
        Value::Array(array) => {
            let count = array.len();
            let entry = array.get_mut(index(key, count)?).ok_or_else(|| no_entry(key, count))?;
            set_in_value(entry, rest, new)
        }
        Value::InlineTable(table) => match table.get_mut(key) {
            Some(entry) => set_in_value(entry, rest, new),
            None if rest.is_empty() => {
                table.insert(key, new);
                Ok(())
            }
            None => Err(format!("the deck has no `{key}`")),
        },
        _ => Err(format!("`{key}` is not a table and has no keys")),
    }
}

/// A new value in the place of the old one, with its spaces and comments.
fn replace(old: &mut Value, new: Value) {
    let decor = old.decor().clone();
    *old = new;
    *old.decor_mut() = decor;
}

fn index(key: &str, count: usize) -> Result<usize, String> {
    key.parse().map_err(|_| format!("`{key}` must be a number from 0 to {}", count.max(1) - 1))
}

fn no_entry(key: &str, count: usize) -> String {
    format!("there is no entry {key}: the list has {count}, counted from 0")
}

#[cfg(test)]
mod tests {
    use super::*;

    const DECK: &str = "[param]\nL = 10 # metres\n\n[[stage]]\nkind = \"static\"\n\n[[stage]]\nstep = 0.1\n";

    fn with(setting: &str) -> Result<String, String> {
        apply(DECK, &[setting.to_string()])
    }

    #[test]
    fn values_are_replaced_where_they_stand() {
        assert_eq!(with("param.L=12").unwrap(), DECK.replace("10", "12"));
        assert_eq!(with("stage.1.step=0.01").unwrap(), DECK.replace("0.1", "0.01"));
        assert_eq!(with("param.L=2*pi").unwrap(), DECK.replace("10", "\"2*pi\""));
    }

    #[test]
    fn nested_lists_inline_tables_and_missing_tables_are_reached() {
        let deck = "through = [[0, 0], [1, 0]]\nstage = [{ step = 1 }]\nat = { load = 0.5 }\n";
        let with = |setting: &str| apply(deck, &[setting.to_string()]).unwrap();
        assert!(with("through.1.0=5").contains("[[0, 0], [5, 0]]"));
        assert!(with("stage.0.step=2").contains("{ step = 2 }"));
        assert!(with("at.load=1").contains("{ load = 1 }"));
        assert!(with("output.every=2").contains("[output]\nevery = 2"));
        assert!(with("history.h.expr=t").contains("expr = \"t\""));
    }

    #[test]
    fn another_scheme_has_other_coefficients() {
        let tables = "[[stage]]\nscheme = \"generalized_alpha\"\nrho_inf = 0.5\nstep = 1\n";
        let inline = "stage = [{ scheme = \"newmark\", beta = 0.3, gamma = 0.6, step = 1 }]\n";
        let with = |deck: &str, settings: &[&str]| {
            apply(deck, &settings.iter().map(|s| s.to_string()).collect::<Vec<_>>()).unwrap()
        };
        let newmark = with(tables, &["stage.0.scheme=newmark"]);
        assert!(!newmark.contains("rho_inf") && newmark.contains("scheme = \"newmark\"") && newmark.contains("step"));
        // The same coefficient, and what is said to be wanted, stay.
        assert!(with(tables, &["stage.0.scheme=lie_generalized_alpha"]).contains("rho_inf = 0.5"));
        assert!(with(tables, &["stage.0.scheme=newmark", "stage.0.rho_inf=0.8"]).contains("rho_inf = 0.8"));
        assert!(with(tables, &["stage.0.scheme=newmerk"]).contains("rho_inf"));
        let hht = with(inline, &["stage.0.alpha=0.1", "stage.0.scheme=hht"]);
        assert!(!hht.contains("beta") && !hht.contains("gamma") && hht.contains("alpha = 0.1"), "{hht}");
    }

    #[test]
    fn paths_that_lead_nowhere_are_refused() {
        assert!(with("stage.2.step=1").unwrap_err().contains("there is no entry 2"));
        assert!(with("sections.leg.EA=1").unwrap_err().contains("no `sections`"));
        assert!(with("param.L").unwrap_err().contains("KEY=VALUE"));
        assert!(with("param.l=1").unwrap_err().contains("no parameter `l`: did you mean `L`?"));
        // A deck may leave a parameter open.
        assert!(apply("[section.s]\nEA = \"2*E\"\n", &["param.E=3".into()]).unwrap().contains("E = 3"));
    }
}
