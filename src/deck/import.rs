//! Tables beside the deck: `{ csv = "spine.csv" }` is replaced by the rows of the file, so that all
//! later steps have one whole text.

use super::Diagnostic;
use toml_edit::{Array, DocumentMut, Item, Table, Value};

/// Rows of a table, at most.
const MOST_ROWS: usize = 1_000_000;

/// Gives the text of a file that a deck names.
pub type Open<'o> = &'o dyn Fn(&str) -> Result<String, String>;

/// The text of a deck with everything that it imports. Lines keep their numbers; sections of a
/// table follow at the end.
pub fn import(text: &str, open: Open) -> Result<String, Vec<Diagnostic>> {
    if !text.contains("csv") {
        return Ok(text.into());
    }
    // A deck that is no TOML is reported when it is read.
    let Ok(mut document) = text.parse::<DocumentMut>() else { return Ok(text.into()) };
    let mut importer = Importer { text, open, found: Vec::new(), sections: Vec::new(), imported: false };
    importer.beams(&mut document);
    importer.histories(&mut document);
    let Importer { found, sections, imported, .. } = importer;
    if !found.is_empty() {
        return Err(found);
    }
    if !imported {
        return Ok(text.into());
    }
    if !sections.is_empty() {
        let all = document.entry("section").or_insert(toml_edit::table());
        if let Some(all) = all.as_table_like_mut() {
            for (name, section) in sections {
                if all.insert(&name, section).is_some() {
                    let message =
                        format!("the deck has a section `{name}`, which is what a station of a table is called");
                    return Err(vec![Diagnostic::whole(message)]);
                }
            }
        }
    }
    Ok(document.to_string())
}

struct Importer<'a> {
    text: &'a str,
    open: Open<'a>,
    found: Vec<Diagnostic>,
    sections: Vec<(String, Item)>,
    imported: bool,
}

impl Importer<'_> {
    fn beams(&mut self, document: &mut DocumentMut) {
        let Some(beams) = document.get_mut("beam").and_then(Item::as_array_of_tables_mut) else { return };
        for (number, beam) in beams.iter_mut().enumerate() {
            if let Some(path) = named(beam.get("through"))
                && let Some(points) = self.table(&path, |table| table.points())
            {
                beam.insert("through", Item::Value(points.into()));
            }
            if let Some(path) = named(beam.get("section"))
                && let Some((stations, sections)) = self.table(&path, |table| table.sections())
            {
                let name = beam.get("name").and_then(Item::as_str).map_or(number.to_string(), str::to_string);
                let names: Vec<String> = (1..=stations.len()).map(|k| format!("{name} {k}")).collect();
                beam.insert("section", Item::Value(names.iter().collect::<Array>().into()));
                beam.insert("stations", Item::Value(stations.into_iter().collect::<Array>().into()));
                self.sections.extend(names.into_iter().zip(sections.into_iter().map(Item::Table)));
            }
        }
    }

    fn histories(&mut self, document: &mut DocumentMut) {
        let Some(histories) = document.get_mut("history").and_then(Item::as_table_like_mut) else { return };
        let names: Vec<String> = histories.iter().map(|(name, _)| name.to_string()).collect();
        for name in names {
            let Some(history) = histories.get_mut(&name).and_then(Item::as_table_like_mut) else { continue };
            let Some(path) = history.get("csv").and_then(Item::as_str).map(str::to_string) else { continue };
            let column = history.get("column").and_then(Item::as_str).map(str::to_string);
            if let Some((times, values)) = self.table(&path, |table| table.history(column.as_deref())) {
                history.remove("csv");
                history.remove("column");
                history.insert("times", Item::Value(times.into()));
                history.insert("values", Item::Value(values.into()));
            }
        }
    }

    /// Reads a file; errors are reported at its name.
    fn table<T>(&mut self, path: &str, of: impl Fn(&Csv) -> Result<T, String>) -> Option<T> {
        self.imported = true;
        let read = (self.open)(path).and_then(|content| Csv::read(&content)).and_then(|table| of(&table));
        read.map_err(|why| {
            let start = self.text.find(&format!("\"{path}\"")).map_or(0, |at| at + 1);
            self.found.push(Diagnostic::error(format!("{path}: {why}"), start..start + path.len()));
        })
        .ok()
    }
}

/// The file of `{ csv = "…" }`.
fn named(item: Option<&Item>) -> Option<String> {
    Some(item?.as_table_like()?.get("csv")?.as_str()?.to_string())
}

/// A table of numbers, with names above it or without.
struct Csv {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Csv {
    fn read(content: &str) -> Result<Self, String> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(content.as_bytes());
        let mut names = Vec::new();
        let mut rows = Vec::new();
        for (number, record) in reader.records().enumerate() {
            let record = record.map_err(|error| error.to_string())?;
            let line = record.position().map_or(number as u64 + 1, csv::Position::line);
            let numbers: Vec<Option<f64>> =
                record.iter().map(|cell| cell.parse().ok().filter(|x: &f64| x.is_finite())).collect();
            match numbers.iter().position(Option::is_none) {
                None => rows.push(numbers.into_iter().flatten().collect()),
                Some(_) if number == 0 && numbers.iter().all(Option::is_none) => {
                    names = record.iter().map(str::to_string).collect()
                }
                Some(column) => return Err(format!("line {line}: `{}` is no number", &record[column])),
            }
            if rows.len() > MOST_ROWS {
                return Err(format!("more than the largest supported {MOST_ROWS} rows"));
            }
        }
        if rows.is_empty() { Err("there are no numbers".into()) } else { Ok(Self { names, rows }) }
    }

    fn width(&self) -> usize {
        self.rows[0].len()
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    fn column(&self, place: usize) -> impl Iterator<Item = f64> {
        self.rows.iter().map(move |row| row[place])
    }

    /// Columns `x`, `y`, `z`, or three without names.
    fn points(&self) -> Result<Array, String> {
        let places = match ["x", "y", "z"].map(|name| self.place(name)) {
            [Some(x), Some(y), Some(z)] => [x, y, z],
            _ if self.names.is_empty() && self.width() == 3 => [0, 1, 2],
            _ => return Err("a line of points has the columns `x`, `y`, `z`".into()),
        };
        let point = |row: &Vec<f64>| Value::from(places.iter().map(|&k| row[k]).collect::<Array>());
        Ok(self.rows.iter().map(point).collect())
    }

    /// The first column over time, and the one that is named or the second.
    fn history(&self, column: Option<&str>) -> Result<(Array, Array), String> {
        let time = self.place("time").unwrap_or(0);
        let value = match column {
            Some(name) => self
                .place(name)
                .ok_or_else(|| format!("there is no column `{name}`, only {}", self.names.join(", ")))?,
            // Of two the one that is not the time.
            None if self.width() == 2 => 1 - time,
            None => return Err("it has not two columns: name one (`column = \"…\"`); the first is the time".into()),
        };
        Ok((self.column(time).collect(), self.column(value).collect()))
    }

    /// Stations along a beam (`fraction` of its length, or `s` along it), and the section at each.
    fn sections(&self) -> Result<(Vec<f64>, Vec<Table>), String> {
        let place = self.place("fraction").or(self.place("s"));
        let place = place.ok_or("stations have a column `fraction` (of the length), or `s` (along it)")?;
        if self.rows.len() < 2 {
            return Err("a beam has two stations or more".into());
        }
        let known =
            |name: &str| ["fraction", "s"].contains(&name) || RESULTANTS.contains(&name) || entry(name).is_some();
        if let Some(unknown) = self.names.iter().find(|name| !known(name)) {
            return Err(format!(
                "a section has no `{unknown}`: columns are {}, or C11 to C66 and M11 to M66",
                RESULTANTS.join(", ")
            ));
        }
        let matrices = self.names.iter().any(|name| entry(name).is_some());
        if let Some(other) = self.names.iter().find(|name| matrices && RESULTANTS.contains(&name.as_str())) {
            return Err(format!(
                "a section is given by `C11` to `C66` and `M11` to `M66`, or by `{other}` and the like, not by both"
            ));
        }
        let rotary = ["rhoJ1", "rhoJ2", "rhoJ3"].map(|name| self.place(name).is_some());
        if rotary.contains(&true) && rotary.contains(&false) {
            return Err("rotary inertia has the three columns `rhoJ1`, `rhoJ2`, `rhoJ3`".into());
        }
        let sections = self.rows.iter().map(|row| self.section(row)).collect::<Result<_, _>>()?;
        Ok((self.column(place).collect(), sections))
    }

    fn section(&self, row: &[f64]) -> Result<Table, String> {
        let get = |name: &str| self.place(name).map(|k| row[k]);
        let mut table = Table::new();
        let mut insert = |key: &str, value: Value| drop(table.insert(key, Item::Value(value)));
        let several = |names: &[&str]| {
            names
                .iter()
                .map(|name| get(name).ok_or_else(|| format!("there is no column `{name}`")))
                .collect::<Result<Array, _>>()
        };
        if self.names.iter().any(|name| entry(name).is_some()) {
            insert("stiffness", self.matrix(row, 'C').into());
            if self.names.iter().any(|name| name.starts_with('M')) {
                insert("mass", self.matrix(row, 'M').into());
            }
            return Ok(table);
        }
        for (key, names) in [("EA", &["EA"][..]), ("GA", &["GA2", "GA3"]), ("GJ", &["GJ"]), ("EI", &["EI2", "EI3"])] {
            let values = several(names)?;
            insert(key, if values.len() == 1 { values.get(0).cloned().unwrap_or(0.0.into()) } else { values.into() });
        }
        if let Some(mass) = get("rhoA") {
            insert("rhoA", mass.into());
        }
        if get("rhoJ1").is_some() {
            insert("rhoJ", several(&["rhoJ1", "rhoJ2", "rhoJ3"])?.into());
        }
        Ok(table)
    }

    /// A symmetric matrix, of which one half may be left out; what is in neither is zero.
    fn matrix(&self, row: &[f64], letter: char) -> Array {
        let get = |i: usize, j: usize| self.place(&format!("{letter}{}{}", i + 1, j + 1)).map(|k| row[k]);
        let line = |i: usize| Value::from((0..6).map(|j| get(i, j).or(get(j, i)).unwrap_or(0.0)).collect::<Array>());
        (0..6).map(line).collect()
    }
}

/// Columns of a section by resultants.
const RESULTANTS: [&str; 10] = ["EA", "GA2", "GA3", "GJ", "EI2", "EI3", "rhoA", "rhoJ1", "rhoJ2", "rhoJ3"];

/// Row and column of `C12`, `M45`.
fn entry(name: &str) -> Option<(char, usize, usize)> {
    let mut letters = name.chars();
    let letter = letters.next()?;
    let i = letters.next()?.to_digit(10)?;
    let j = letters.next()?.to_digit(10)?;
    let fits = ['C', 'M'].contains(&letter) && (1..=6).contains(&i) && (1..=6).contains(&j) && letters.next().is_none();
    fits.then_some((letter, i as usize - 1, j as usize - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(text: &str, file: &str) -> Result<String, Vec<Diagnostic>> {
        import(text, &|_| Ok(file.to_string()))
    }

    #[test]
    fn points_histories_and_sections_stand_in_the_text() {
        let beam = "[[beam]]\nname = \"b\"\nthrough = { csv = \"a.csv\" } # spine\nelements = 3\n";
        let whole = with(beam, "x, y, z\n0, 0, 0\n1, 0.5, 0\n").unwrap();
        assert!(
            whole.contains("through = [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]]") && whole.contains("elements = 3"),
            "{whole}"
        );
        let history = with("[history.h]\ncsv = \"f.csv\"\ncolumn = \"F\"\n", "time,F,G\n0,1,2\n1,3,4\n").unwrap();
        assert!(history.contains("times = [0.0, 1.0]\nvalues = [1.0, 3.0]") && !history.contains("csv"), "{history}");
        let turned = with("[history.h]\ncsv = \"f.csv\"\n", "F,time\n5,0\n6,1\n").unwrap();
        assert!(turned.contains("times = [0.0, 1.0]\nvalues = [5.0, 6.0]"), "{turned}");
        let section = "[[beam]]\nname = \"b\"\nsection = { csv = \"s.csv\" }\n";
        for wrong in ["s,C11,rhoA\n0,1,1\n1,1,1\n", "s,EA,rhoJ2\n0,1,1\n1,1,1\n", "s,EA\n0,1\n", "s,EB\n0,1\n1,1\n"] {
            assert!(with(section, wrong).is_err(), "{wrong}");
        }
        let whole = with(section, "s,EA,GA2,GA3,GJ,EI2,EI3,rhoA\n0,9,8,7,6,5,4,3\n2,1,1,1,1,1,1,1\n").unwrap();
        assert!(whole.contains("section = [\"b 1\", \"b 2\"]") && whole.contains("stations = [0.0, 2.0]"), "{whole}");
        assert!(whole.contains("[section.\"b 1\"]\nEA = 9.0\nGA = [8.0, 7.0]"), "{whole}");
        let full = with(section, "fraction,C11,C12,C22\n0,9,1,8\n1,9,2,8\n").unwrap();
        assert!(full.contains("[[9.0, 2.0, 0.0, 0.0, 0.0, 0.0], [2.0, 8.0"), "{full}");
    }

    #[test]
    fn what_is_wrong_is_told_at_the_name_of_the_file() {
        let through = "[[beam]]\nthrough = { csv = \"a.csv\" }\n";
        for (file, told) in [
            ("x,y,z\n0,0,zero\n", "a.csv: line 2: `zero` is no number"),
            ("x,y\n0,0\n", "columns `x`, `y`, `z`"),
            ("s,x,y\n0,0,0\n", "columns `x`, `y`, `z`"),
            ("O,0,0\n1,0,0\n", "line 1: `O` is no number"),
            ("x,y,z\n", "no numbers"),
        ] {
            let found = with(through, file).unwrap_err();
            assert!(found[0].message.contains(told), "{}", found[0].message);
            assert_eq!(&through[found[0].span.clone().unwrap()], "a.csv");
        }
        let missing = import(through, &|_| Err("there is no such file".into())).unwrap_err();
        assert!(missing[0].message.contains("no such file"));
    }

    #[test]
    fn decks_that_import_nothing_stay_as_they_are() {
        for text in ["title = \"csv\"\n[[beam]]\nthrough = [ 1,2 ]\n", "not = = toml csv"] {
            assert_eq!(with(text, "").unwrap(), text);
        }
    }
}
