//! `--set key=value`: changes a deck before it is read.

use toml_edit::{DocumentMut, Item, Key, Value};

/// Applies `key=value` pairs to the text of a deck and gives the changed text.
///
/// Keys are paths as in TOML; arrays of tables are indexed by number (`stage.0.step`). A value is read as TOML, and as a
/// text where that fails.
pub fn apply(text: &str, settings: &[String]) -> Result<String, String> {
    if settings.is_empty() {
        return Ok(text.to_string());
    }
    // A deck that is no TOML is reported when it is read, with the line.
    let Ok(mut document) = text.parse::<DocumentMut>() else { return Ok(text.to_string()) };
    for setting in settings {
        let Some((path, value)) = setting.split_once('=') else {
            return Err(format!("--set {setting}: expected KEY=VALUE"));
        };
        let keys = Key::parse(path.trim()).map_err(|_| format!("--set {setting}: `{path}` is no key"))?;
        set(document.as_item_mut(), &keys, read_value(value.trim()))
            .map_err(|why| format!("--set {setting}: {why}"))?;
    }
    Ok(document.to_string())
}

fn read_value(text: &str) -> Value {
    text.parse().unwrap_or_else(|_| Value::from(text))
}

fn set(root: &mut Item, keys: &[Key], value: Value) -> Result<(), String> {
    let (last, parents) = keys.split_last().ok_or("an empty key")?;
    let mut item = root;
    for (depth, key) in parents.iter().enumerate() {
        // `param` may be wanted where the deck has none.
        if depth == 0 && key.get() == "param" && item.get("param").is_none() {
            item["param"] = toml_edit::table();
        }
        item = descend(item, key.get())?;
    }
    if let Ok(index) = last.get().parse::<usize>()
        && let Some(array) = item.as_array_mut()
    {
        let length = array.len();
        let entry = array.get_mut(index).ok_or(format!("there is no entry {index}: the list has {length}"))?;
        *entry = value;
        return Ok(());
    }
    let table = item.as_table_like_mut().ok_or(format!("`{}` has no keys", last.get()))?;
    match table.get_mut(last.get()) {
        Some(Item::Value(old)) => {
            let decor = old.decor().clone();
            *old = value;
            *old.decor_mut() = decor;
        }
        Some(_) => return Err(format!("`{}` is a table", last.get())),
        None => {
            table.insert(last.get(), Item::Value(value));
        }
    }
    Ok(())
}

fn descend<'a>(item: &'a mut Item, key: &str) -> Result<&'a mut Item, String> {
    if let Some(tables) = item.as_array_of_tables() {
        let count = tables.len();
        let index: usize =
            key.parse().map_err(|_| format!("`{key}` must be a number from 0 to {}", count.max(1) - 1))?;
        if index >= count {
            return Err(format!("there is no entry {index}: there are {count}"));
        }
        return Ok(&mut item[index]);
    }
    // A key that is missing comes as an empty item.
    match item.get_mut(key).filter(|found| !found.is_none()) {
        Some(found) => Ok(found),
        None => Err(format!("the deck has no `{key}`")),
    }
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
    fn paths_that_lead_nowhere_are_refused() {
        assert!(with("stage.2.step=1").unwrap_err().contains("there is no entry 2"));
        assert!(with("sections.leg.EA=1").unwrap_err().contains("no `sections`"));
        assert!(with("param.L").unwrap_err().contains("KEY=VALUE"));
    }
}
