//! Tables and meshes beside the deck: `{ csv = "spine.csv" }` is replaced by the rows of the file, and
//! the triangles of mesh files follow at the end, so that all later steps have one whole text.

use super::beam::StationsWord;
use super::diagnostic::Severity;
use super::files::{ImportedTable, Unreadable, fingerprint};
use super::home::{Home, from_table};
use super::mesh_file::Triangles;
use super::{Diagnostic, Span, Words};
use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value};

/// Rows of a table, at most.
const MOST_ROWS: usize = 1_000_000;

/// Gives the content of a file that a deck names.
pub type Open<'o> = &'o dyn Fn(&str) -> Result<Vec<u8>, Unreadable>;

/// The text of a deck, and the tables that it imports.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// The text with the rows of all tables. Sections of a table and triangles follow at the end.
    pub text: String,
    /// The tables, in the order in which they are read
    pub(crate) tables: Vec<ImportedTable>,
}

impl Imported {
    /// Messages about the text with the rows of tables, as messages about the text `own` of the user.
    pub fn at_home(&self, own: &str, found: &[Diagnostic]) -> Vec<Diagnostic> {
        if found.is_empty() || self.tables.is_empty() {
            return found.to_vec();
        }
        let home = Home::new(own, &self.text, &self.tables);
        found.iter().map(|diagnostic| home.of(diagnostic.clone())).collect()
    }
}

/// Replaces everything that a deck imports by the rows of the files.
pub fn import(text: &str, open: Open) -> Result<Imported, Vec<Diagnostic>> {
    import_up_to(usize::MAX, text, open)
}

/// Replaces what a deck imports by the rows of the files, except tables of more rows than
/// `most_rows`, whose names stay in the text.
pub fn import_up_to(most_rows: usize, text: &str, open: Open) -> Result<Imported, Vec<Diagnostic>> {
    let unchanged = || Imported { text: text.into(), tables: Vec::new() };
    if !text.contains("csv") && !text.contains("mesh") {
        return Ok(unchanged());
    }
    // A deck that is no TOML is reported when it is read.
    let Ok(mut document) = text.parse::<DocumentMut>() else { return Ok(unchanged()) };
    let mut importer = Importer {
        text,
        open,
        most_rows,
        found: Vec::new(),
        sections: Vec::new(),
        meshes: Vec::new(),
        tables: Vec::new(),
    };
    importer.beams(&mut document);
    importer.outlines(&mut document);
    importer.surfaces(&mut document);
    importer.histories(&mut document);
    importer.meshes(&mut document);
    let Importer { found, sections, meshes, tables, .. } = importer;
    if !found.is_empty() {
        return Err(found);
    }
    if tables.is_empty() {
        return Ok(unchanged());
    }
    if !sections.is_empty() {
        let all = document.entry("section").or_insert(toml_edit::table());
        if let Some(all) = all.as_table_like_mut() {
            for (name, section) in sections {
                if all.insert(&name, section).is_some() {
                    let message = format!(
                        "the section name `{name}` is reserved for a station of a CSV table: rename the section"
                    );
                    return Err(vec![Diagnostic::whole(message)]);
                }
            }
        }
    }
    if !meshes.is_empty() {
        let all = document.entry("mesh").or_insert(toml_edit::table());
        if let Some(all) = all.as_table_like_mut() {
            meshes.into_iter().for_each(|(name, mesh)| drop(all.insert(&name, Item::Table(mesh))));
        }
    }
    Ok(Imported { text: document.to_string(), tables })
}

struct Importer<'a> {
    text: &'a str,
    open: Open<'a>,
    most_rows: usize,
    found: Vec<Diagnostic>,
    sections: Vec<(String, Item)>,
    /// `[mesh.NAME]` by the names of files
    meshes: Vec<(String, Table)>,
    tables: Vec<ImportedTable>,
}

impl Importer<'_> {
    fn beams(&mut self, document: &mut DocumentMut) {
        let Some(beams) = document.get_mut("beam").and_then(Item::as_array_of_tables_mut) else { return };
        for (number, beam) in beams.iter_mut().enumerate() {
            for key in ["through", "spline"] {
                if let Some(path) = self.named(beam.get(key))
                    && let Some(points) = self.table(&path, |table| table.points())
                {
                    beam.insert(key, Item::Value(points.into()));
                }
            }
            if let Some(path) = self.named(beam.get("section"))
                && let Some(table) = self.table(&path, |table| table.sections())
            {
                let Stations { unit, places: stations, sections, along } = table;
                for (key, values) in along {
                    if beam.get(key).is_some() {
                        let message = format!("`{key}` is given in the beam and as columns of {path}");
                        self.found.push(Diagnostic::error(message, self.place(&path)));
                    }
                    beam.insert(key, made(values, &path));
                }
                let name = beam.get("name").and_then(Item::as_str).map_or(number.to_string(), str::to_string);
                let names: Vec<String> = (1..=stations.len()).map(|k| format!("{name} {k}")).collect();
                beam.insert("section", Item::Value(names.iter().collect::<Array>().into()));
                beam.insert("stations", made(stations.into_iter().collect::<Array>(), &path));
                beam.insert("stations_in", made(unit.word(), &path));
                let sections = sections.into_iter().map(|(line, mut section)| {
                    section.decor_mut().set_suffix(from_table(&path, Some(line)));
                    Item::Table(section)
                });
                self.sections.extend(names.into_iter().zip(sections));
            }
        }
    }

    /// Outlines, holes and profiles of sections, and those of their regions.
    fn outlines(&mut self, document: &mut DocumentMut) {
        let Some(sections) = document.get_mut("section").and_then(Item::as_table_like_mut) else { return };
        for (_, section) in sections.iter_mut() {
            let Some(section) = section.as_table_like_mut() else { continue };
            self.outlines_of(section);
            let Some(regions) = section.get_mut("region") else { continue };
            if let Some(regions) = regions.as_array_of_tables_mut() {
                regions.iter_mut().for_each(|region| self.outlines_of(region));
            } else if let Some(regions) = regions.as_array_mut() {
                let tables = regions.iter_mut().filter_map(Value::as_inline_table_mut);
                tables.for_each(|region| self.outlines_of(region));
            }
        }
    }

    fn outlines_of(&mut self, table: &mut dyn TableLike) {
        for key in ["outline", "profile"] {
            if let Some(path) = self.named(table.get(key))
                && let Some(points) = self.table(&path, Csv::points_of_plane)
            {
                table.insert(key, Item::Value(points.into()));
            }
        }
        let holes = table.get_mut("holes").and_then(Item::as_array_mut);
        for hole in holes.into_iter().flat_map(Array::iter_mut) {
            if let Some(path) = self.file_of(hole.as_inline_table().map(|table| table as &dyn TableLike))
                && let Some(points) = self.table(&path, Csv::points_of_plane)
            {
                *hole = points.into();
            }
        }
    }

    /// Centre lines of tubes, with a radius for each point where there is such a column.
    fn surfaces(&mut self, document: &mut DocumentMut) {
        let Some(surfaces) = document.get_mut("surface").and_then(Item::as_array_of_tables_mut) else { return };
        for surface in surfaces.iter_mut() {
            let Some(path) = self.named(surface.get("through")) else { continue };
            let Some((points, radii)) = self.table(&path, |table| Ok((table.points()?, table.radii()))) else {
                continue;
            };
            surface.insert("through", Item::Value(points.into()));
            if let Some(radii) = radii.filter(|_| surface.get("radius").is_none()) {
                surface.insert("radius", made(radii, &path));
            }
        }
    }

    /// Files of triangles; those that stand in the text already are not read again.
    fn meshes(&mut self, document: &mut DocumentMut) {
        let known = |path: &str| document.get("mesh").and_then(|meshes| meshes.get(path)).is_some();
        let Some(surfaces) = document.get("surface") else { return };
        let tables = surfaces.as_array_of_tables().into_iter().flatten().map(|table| table as &dyn TableLike);
        let inline = surfaces.as_array().into_iter().flatten().filter_map(Value::as_inline_table);
        let all = tables.chain(inline.map(|table| table as &dyn TableLike));
        let is_mesh = |surface: &&dyn TableLike| surface.get("kind").and_then(Item::as_str) == Some("mesh");
        let paths = all.filter(is_mesh).filter_map(|surface| surface.get("file")?.as_str());
        let mut paths: Vec<String> = paths.filter(|path| !known(path)).map(str::to_string).collect();
        paths.sort();
        paths.dedup();
        for path in paths {
            let read = |content: &[u8]| {
                let triangles = Triangles::read(&path, content)?;
                Ok((triangles.encoded(), triangles.corners.len()))
            };
            if let Some(data) = self.file(&path, read) {
                let mut mesh = Table::new();
                mesh.insert("data", Item::Value(data.into()));
                self.meshes.push((path, mesh));
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
                history.insert("times", made(times, &path));
                history.insert("values", made(values, &path));
            }
        }
    }

    /// The file of `{ csv = "…" }`.
    fn named(&mut self, item: Option<&Item>) -> Option<String> {
        self.file_of(item?.as_table_like())
    }

    /// The file that a table names; other keys beside it are errors.
    fn file_of(&mut self, table: Option<&dyn TableLike>) -> Option<String> {
        let table = table?;
        let path = table.get("csv")?.as_str()?.to_string();
        let Some((key, _)) = table.iter().find(|(key, _)| *key != "csv") else { return Some(path) };
        let message = format!("`{key}` is not known beside `csv`: write {{ csv = \"{path}\" }}");
        self.found.push(Diagnostic::error(message, self.place(&path)));
        None
    }

    /// The place of the name of a file in the text.
    fn place(&self, path: &str) -> Span {
        let start = self.text.find(&format!("\"{path}\"")).map_or(0, |at| at + 1);
        start..start + path.len()
    }

    /// Reads a table of numbers; errors are reported at the name of its file.
    fn table<T>(&mut self, path: &str, of: impl Fn(&Csv) -> Result<T, String>) -> Option<T> {
        let wrong = |message: String| Unreadable { message, severity: Severity::Error };
        self.file(path, |content| {
            let not_text = |error: std::str::Utf8Error| format!("not UTF-8 text at byte {}", error.valid_up_to());
            let text = std::str::from_utf8(content).map_err(|error| wrong(not_text(error)))?;
            let table = Csv::read(text)?;
            Ok((of(&table).map_err(wrong)?, table.rows.len()))
        })
    }

    /// Reads a file, of which `of` gives the content and the number of rows; errors are reported at its
    /// name.
    fn file<T>(&mut self, path: &str, of: impl Fn(&[u8]) -> Result<(T, usize), Unreadable>) -> Option<T> {
        let read = (self.open)(path).and_then(|content| {
            let (found, rows) = of(&content)?;
            Ok((found, ImportedTable { name: path.into(), rows, hash: fingerprint(&content) }))
        });
        match read {
            Ok((_, table)) if table.rows > self.most_rows => None,
            Ok((found, table)) => {
                if !self.tables.contains(&table) {
                    self.tables.push(table);
                }
                Some(found)
            }
            Err(Unreadable { message, severity }) => {
                let names_file = message.split(": ").next().is_some_and(|first| first.ends_with(path));
                let message = if names_file { message } else { format!("{path}: {message}") };
                let error = Diagnostic::error(message, self.place(path));
                self.found.push(Diagnostic { severity, ..error });
                None
            }
        }
    }
}

/// A value of a line of its own, which says what table it is from.
fn made(value: impl Into<Value>, path: &str) -> Item {
    let mut value = value.into();
    value.decor_mut().set_suffix(from_table(path, None));
    Item::Value(value)
}

/// Stations along a beam, and the section at each.
struct Stations {
    /// The unit of the places
    unit: StationsWord,
    places: Vec<f64>,
    /// Lines of the file, and what stands there
    sections: Vec<(u64, Table)>,
    /// Keys of the beam with a value for each station
    along: Vec<(&'static str, Array)>,
}

/// A table of numbers, with names above it or without.
struct Csv {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
    /// The line of each row in the file, from 1
    lines: Vec<u64>,
}

impl Csv {
    fn read(content: &str) -> Result<Self, Unreadable> {
        let wrong = |message: String| Unreadable { message, severity: Severity::Error };
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(content.as_bytes());
        let mut table = Self { names: Vec::new(), rows: Vec::new(), lines: Vec::new() };
        for (number, record) in reader.records().enumerate() {
            let record = record.map_err(|error| wrong(error.to_string()))?;
            let line = record.position().map_or(number as u64 + 1, csv::Position::line);
            if number == 0 && record.iter().all(|cell| cell.parse::<f64>().is_err()) {
                table.names = record.iter().map(str::to_string).collect();
                continue;
            }
            table.rows.push(record.iter().map(|cell| number_of(cell, line)).collect::<Result<_, _>>().map_err(wrong)?);
            table.lines.push(line);
            if table.rows.len() > MOST_ROWS {
                let message = format!("more rows than the limit of {MOST_ROWS}");
                return Err(Unreadable { message, severity: Severity::Limit });
            }
        }
        if table.rows.is_empty() {
            return Err(wrong("the table contains no numbers".into()));
        }
        let twice = |k: &usize| table.names[..*k].contains(&table.names[*k]);
        match (0..table.names.len()).find(twice) {
            Some(k) => Err(wrong(format!("two columns are called `{}`", table.names[k]))),
            None => Ok(table),
        }
    }

    /// Refuses a column that does not increase from row to row.
    fn must_increase(&self, place: usize) -> Result<(), String> {
        match self.rows.windows(2).position(|rows| rows[1][place] <= rows[0][place]) {
            None => Ok(()),
            Some(k) => {
                let name = self.names.get(place).map_or(format!("column {}", place + 1), |name| format!("`{name}`"));
                let line = self.lines[k + 1];
                let before = self.rows[k][place];
                let after = self.rows[k + 1][place];
                Err(format!("line {line}: {name} must increase, but {after} comes after {before}"))
            }
        }
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
            _ => return Err("a table of points needs the columns `x`, `y`, `z`".into()),
        };
        let point = |row: &Vec<f64>| Value::from(places.iter().map(|&k| row[k]).collect::<Array>());
        Ok(self.rows.iter().map(point).collect())
    }

    /// Columns `x2`, `x3`, or `x`, `y`, or two without these names.
    fn points_of_plane(&self) -> Result<Array, String> {
        let of_names = |names: [&str; 2]| {
            let [first, second] = names.map(|name| self.place(name));
            first.zip(second)
        };
        let (first, second) = match of_names(["x2", "x3"]).or(of_names(["x", "y"])) {
            Some(places) => places,
            None if self.width() == 2 => (0, 1),
            None => return Err("a table of an outline needs the columns `x2`, `x3`".into()),
        };
        let point = |row: &Vec<f64>| Value::from([row[first], row[second]].into_iter().collect::<Array>());
        Ok(self.rows.iter().map(point).collect())
    }

    /// The column `radius`.
    fn radii(&self) -> Option<Array> {
        Some(self.column(self.place("radius")?).collect())
    }

    /// The first column over time, and the one that is named or the second.
    fn history(&self, column: Option<&str>) -> Result<(Array, Array), String> {
        let time = self.place("time").unwrap_or(0);
        let value = match column {
            Some(name) => {
                self.place(name).ok_or_else(|| format!("there is no column `{name}`, only {}", listed(&self.names)))?
            }
            // Of two the one that is not the time.
            None if self.width() == 2 => 1 - time,
            None => {
                return Err("the table does not have two columns: name the column of values (`column = \"…\"`); the \
                            first column is the time"
                    .into());
            }
        };
        self.must_increase(time)?;
        Ok((self.column(time).collect(), self.column(value).collect()))
    }

    /// Stations along a beam (`fraction` of its length, or `s` along it), and the section at each.
    fn sections(&self) -> Result<Stations, String> {
        let (unit, place) = match (self.place("fraction"), self.place("s")) {
            (Some(_), Some(_)) => return Err("give the column `fraction` or `s`, not both".into()),
            (Some(place), None) => (StationsWord::Fraction, place),
            (None, Some(place)) => (StationsWord::Length, place),
            (None, None) => {
                return Err("a table of stations needs a column `fraction` (of the length) or `s` (arc length)".into());
            }
        };
        if self.rows.len() < 2 {
            return Err("a beam needs at least two stations".into());
        }
        self.must_increase(place)?;
        let first = self.rows[0][place];
        if first != 0.0 {
            let line = self.lines[0];
            return Err(format!("line {line}: the stations must begin at 0 (the start of the beam), found {first}"));
        }
        let last = self.rows[self.rows.len() - 1][place];
        if unit == StationsWord::Fraction && last != 1.0 {
            let line = self.lines[self.rows.len() - 1];
            return Err(format!("line {line}: `fraction` must end at 1 (the end of the beam), found {last}"));
        }
        let known = |name: &str| {
            ["fraction", "s", "twist", "x2", "x3", "turn"].contains(&name)
                || RESULTANTS.contains(&name)
                || entry(name).is_some()
        };
        if let Some(unknown) = self.names.iter().find(|name| !known(name)) {
            return Err(format!(
                "`{unknown}` is not a column of a section: columns are {}, or C11 to C66 and M11 to M66; and twist, x2, \
                 x3, turn",
                RESULTANTS.join(", ")
            ));
        }
        let matrices = self.names.iter().any(|name| entry(name).is_some());
        if let Some(other) = self.names.iter().find(|name| matrices && RESULTANTS.contains(&name.as_str())) {
            return Err(format!(
                "a section is given either by `C11` to `C66` and `M11` to `M66`, or by `{other}` and others like it, \
                 not by both"
            ));
        }
        let rotary = ["rhoJ1", "rhoJ2", "rhoJ3"].map(|name| self.place(name).is_some());
        if rotary.contains(&true) && rotary.contains(&false) {
            return Err("rotary inertia needs the three columns `rhoJ1`, `rhoJ2`, `rhoJ3`".into());
        }
        let section = |(row, &line): (&Vec<f64>, &u64)| Ok((line, self.section(row)?));
        let sections = self.rows.iter().zip(&self.lines).map(section).collect::<Result<_, String>>()?;
        Ok(Stations { unit, places: self.column(place).collect(), sections, along: self.along() })
    }

    /// Twist of the axes, and offset and turn of the sections, where there are such columns.
    fn along(&self) -> Vec<(&'static str, Array)> {
        let mut along = Vec::new();
        for key in ["twist", "turn"] {
            along.extend(self.place(key).map(|place| (key, self.column(place).collect())));
        }
        let [x2, x3] = ["x2", "x3"].map(|name| self.place(name));
        if x2.is_some() || x3.is_some() {
            let at = |row: &Vec<f64>, place: Option<usize>| place.map_or(0.0, |place| row[place]);
            let offset = |row: &Vec<f64>| Value::from([at(row, x2), at(row, x3)].into_iter().collect::<Array>());
            along.push(("offset", self.rows.iter().map(offset).collect()));
        }
        along
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

/// A cell of a table as a finite number.
fn number_of(cell: &str, line: u64) -> Result<f64, String> {
    match cell.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(_) => Err(format!("line {line}: `{cell}` is not a finite number")),
        Err(_) => Err(format!("line {line}: `{}` is not a number", shortened(cell))),
    }
}

/// The beginning of a cell, for messages: a file that is no table may have very long ones.
fn shortened(cell: &str) -> String {
    /// Characters of a cell in a message, at most.
    const LONGEST: usize = 40;
    match cell.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &cell[..end]),
        None => cell.into(),
    }
}

/// Names of columns for messages: the first ones, and the number of the others.
fn listed(names: &[String]) -> String {
    /// Names in a message, at most.
    const MOST: usize = 20;
    match names.len().checked_sub(MOST) {
        None | Some(0) => names.join(", "),
        Some(more) => format!("{} and {more} more", names[..MOST].join(", ")),
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
        import(text, &|_| Ok(file.into())).map(|imported| imported.text)
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
        assert!(history.contains("times = [0.0, 1.0] # from f.csv\nvalues = [1.0, 3.0] #"), "{history}");
        let turned = with("[history.h]\ncsv = \"f.csv\"\n", "F,time\n5,0\n6,1\n").unwrap();
        assert!(turned.contains("times = [0.0, 1.0] # from f.csv\nvalues = [5.0, 6.0] #"), "{turned}");
        let outline =
            with("[section.s]\noutline = { csv = \"o.csv\" }\nholes = [{ csv = \"h.csv\" }]\n", "x2,x3\n0,1\n");
        let outline = outline.unwrap();
        assert!(outline.contains("outline = [[0.0, 1.0]]\nholes = [[[0.0, 1.0]]]"), "{outline}");
        let region = with("[[section.s.region]]\noutline = { csv = \"o.csv\" }\n", "0,1\n2,3\n").unwrap();
        assert!(region.contains("outline = [[0.0, 1.0], [2.0, 3.0]]"), "{region}");
        let section = "[[beam]]\nname = \"b\"\nsection = { csv = \"s.csv\" }\n";
        for wrong in ["s,C11,rhoA\n0,1,1\n1,1,1\n", "s,EA,rhoJ2\n0,1,1\n1,1,1\n", "s,EA\n0,1\n", "s,EB\n0,1\n1,1\n"] {
            assert!(with(section, wrong).is_err(), "{wrong}");
        }
        let whole = with(section, "s,EA,GA2,GA3,GJ,EI2,EI3,rhoA\n0,9,8,7,6,5,4,3\n2,1,1,1,1,1,1,1\n").unwrap();
        let stations = "stations = [0.0, 2.0] # from s.csv\nstations_in = \"length\" # from s.csv";
        assert!(whole.contains("section = [\"b 1\", \"b 2\"]") && whole.contains(stations), "{whole}");
        assert!(whole.contains("[section.\"b 1\"] # from s.csv, line 2\nEA = 9.0\nGA = [8.0, 7.0]"), "{whole}");
        let full = with(section, "fraction,C11,C12,C22\n0,9,1,8\n1,9,2,8\n").unwrap();
        assert!(full.contains("[[9.0, 2.0, 0.0, 0.0, 0.0, 0.0], [2.0, 8.0"), "{full}");
    }

    #[test]
    fn what_is_wrong_is_told_at_the_name_of_the_file() {
        let through = "[[beam]]\nthrough = { csv = \"a.csv\" }\n";
        for (file, told) in [
            ("x,y,z\n0,0,zero\n", "a.csv: line 2: `zero` is not a number"),
            ("x,y\n0,0\n", "columns `x`, `y`, `z`"),
            ("s,x,y\n0,0,0\n", "columns `x`, `y`, `z`"),
            ("O,0,0\n1,0,0\n", "line 1: `O` is not a number"),
            ("x,y,z\n", "no numbers"),
            ("", "no numbers"),
            ("x,y,z\n0,nan,0\n1,0,0\n", "line 2: `nan` is not a finite number"),
            ("nan,inf,nan\n1,0,0\n", "line 1: `nan` is not a finite number"),
            ("x,y,z\n0,1e999,0\n", "line 2: `1e999` is not a finite number"),
            ("x,y,x,z\n0,0,0,0\n", "two columns are called `x`"),
        ] {
            let found = with(through, file).unwrap_err();
            assert!(found[0].message.contains(told), "{}", found[0].message);
            assert_eq!(&through[found[0].span.clone().unwrap()], "a.csv");
        }
        let gone = || Unreadable { message: "there is no such file".into(), severity: Severity::File };
        let missing = import(through, &|_| Err(gone())).unwrap_err();
        let beside = |_: &str| Err(Unreadable { message: "decks/a.csv: gone".into(), severity: Severity::File });
        assert_eq!(import(through, &beside).unwrap_err()[0].message, "decks/a.csv: gone");
        let more = "[[beam]]\nthrough = { csv = \"a.csv\", foo = 2 }\n";
        assert!(import(more, &beside).unwrap_err()[0].message.starts_with("`foo` is not known"));
        assert!(missing[0].message.contains("no such file") && missing[0].severity == Severity::File);
    }

    #[test]
    fn rows_must_be_in_order() {
        let history = "[history.h]\ncsv = \"f.csv\"\n";
        for (file, told) in [
            ("time,F\n0,1\n2,1\n1,3\n", "f.csv: line 4: `time` must increase, but 1 comes after 2"),
            ("0,1\n0,3\n", "line 2: column 1 must increase, but 0 comes after 0"),
        ] {
            let found = with(history, file).unwrap_err();
            assert!(found[0].message.contains(told), "{}", found[0].message);
        }
        let section = "[[beam]]\nname = \"b\"\nsection = { csv = \"s.csv\" }\n";
        for (places, told) in [
            (["fraction", "0", "2"], "line 3: `fraction` must end at 1 (the end of the beam), found 2"),
            (["fraction", "0", "0.5"], "line 3: `fraction` must end at 1"),
            (["s", "0.5", "2"], "line 2: the stations must begin at 0"),
            (["s", "0", "-1"], "line 3: `s` must increase"),
        ] {
            let names = "EA,GA2,GA3,GJ,EI2,EI3\n";
            let file = format!("{},{names}{},1,1,1,1,1,1\n{},1,1,1,1,1,1\n", places[0], places[1], places[2]);
            let found = with(section, &file).unwrap_err();
            assert!(found[0].message.contains(told), "{}", found[0].message);
        }
        let both = with(section, "s,fraction,EA\n0,0,1\n1,1,1\n").unwrap_err();
        assert!(both[0].message.contains("`fraction` or `s`, not both"), "{}", both[0].message);
    }

    #[test]
    fn stations_have_angles_and_offsets() {
        let section = "[[beam]]\nname = \"b\"\nsection = { csv = \"s.csv\" }\n";
        let file = "s,twist,x3,turn,EA,GA2,GA3,GJ,EI2,EI3\n0,0.1,0.5,0,1,1,1,1,1,1\n2,0.2,0.6,0.3,1,1,1,1,1,1\n";
        let whole = with(section, file).unwrap();
        for line in ["twist = [0.1, 0.2]", "turn = [0.0, 0.3]", "offset = [[0.0, 0.5], [0.0, 0.6]]"] {
            assert!(whole.contains(line), "{whole}");
        }
        let twice = with(&format!("{section}twist = [0, 1]\n"), file).unwrap_err();
        assert!(twice[0].message.contains("`twist` is given in the beam and as columns of s.csv"), "{twice:?}");
        let spline = with("[[beam]]\nspline = { csv = \"a.csv\" }\n", "x,y,z\n0,0,0\n1,0,0\n").unwrap();
        assert!(spline.contains("spline = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]"), "{spline}");
    }

    #[test]
    fn tables_are_known_by_rows_and_fingerprint() {
        let history = "[history.h]\ncsv = \"f.csv\"\n[history.g]\ncsv = \"f.csv\"\n";
        let imported = import(history, &|_| Ok("0,1\n1,2\n".into())).unwrap();
        let table = ImportedTable { name: "f.csv".into(), rows: 2, hash: fingerprint(b"0,1\n1,2\n") };
        assert_eq!(imported.tables, [table]);
        let short = import_up_to(1, history, &|_| Ok("0,1\n1,2\n".into())).unwrap();
        assert_eq!((short.text.as_str(), short.tables.len()), (history, 0));
        assert_ne!(fingerprint(b"0,1\n1,2\n"), fingerprint(b"0,1\n1,3\n"));
    }

    #[test]
    fn messages_are_about_the_text_of_the_user() {
        let own = "title = \"a\"\n[section.s]\nEA = 5\n[[beam]]\nname = \"b\"\nsection = { csv = \"s.csv\" } # stations\nelements = 3\n\n\
                   [history.h]\ncsv = \"f.csv\"\ncolumn = \"F\"\nsmooth = true\n\n[history.g]\ncsv = \"g.csv\"\n\
                   [[beam]]\nthrough = { csv = \"p.csv\" }\nwrong = 1\n";
        let file = |path: &str| match path {
            "s.csv" => "# comment\ns,EA,GA2,GA3,GJ,EI2,EI3\n0,1,1,1,1,1,1\n2,-7,1,1,1,1,1\n",
            "p.csv" => "x,y,z\n0,0,0\n1,0,0\n",
            _ => "time,F\n0,1\n1,2\n",
        };
        for ends in ["\n", "\r\n"] {
            messages_are_told_at_home(&own.replace('\n', ends), &file);
        }
    }

    /// Checks what is said of parts of a deck with tables.
    fn messages_are_told_at_home(own: &str, file: &dyn Fn(&str) -> &'static str) {
        let imported = import(own, &|path| Ok(file(path).into())).unwrap();
        let told = |part: &str| {
            let start = imported.text.find(part).unwrap_or_else(|| panic!("{part} in {}", imported.text));
            let found = Diagnostic::error("wrong", start..start + part.len());
            let found = imported.at_home(own, &[found]).remove(0);
            (own[found.span.unwrap()].to_string(), found.label)
        };
        let plain = |part: &str| assert_eq!(told(part), (part.to_string(), String::new()));
        ["title", "name", "elements = 3", "smooth", "[history.g]", "wrong = 1"].into_iter().for_each(plain);
        assert_eq!(told("EA = -7.0"), ("s.csv".into(), "line 4 of this table".into()));
        assert_eq!(told("GJ = 1.0"), ("s.csv".into(), "line 3 of this table".into()));
        assert_eq!(told("stations = "), ("s.csv".into(), "in this table".into()));
        assert_eq!(told("[\"b 1\""), ("s.csv".into(), "in this table".into()));
        assert_eq!(told("[0.0, 1.0]"), ("f.csv".into(), "in this table".into()));
        assert_eq!(told("[[0.0, 0.0, 0.0]"), ("p.csv".into(), "in this table".into()));
    }

    #[test]
    fn decks_that_import_nothing_stay_as_they_are() {
        for text in ["title = \"csv\"\n[[beam]]\nthrough = [ 1,2 ]\n", "not = = toml csv"] {
            assert_eq!(with(text, "").unwrap(), text);
        }
    }
}
