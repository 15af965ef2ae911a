//! Makes inputs from decks of the repository: changes that know the structure of TOML, tables of
//! numbers, `--set` settings and expressions.

use super::input::{Input, LARGEST, Language, TABLE};
use super::random::Random;
use beamsim::deck::entries;
use std::collections::BTreeSet;
use std::fs;
use std::ops::Range;
use std::path::Path;

/// Numbers and other values at the borders of what a reader takes.
#[rustfmt::skip]
const VALUES: [&str; 60] = [
    "0", "-0.0", "1", "-1", "2", "0.5", "1e308", "-1e308", "1.7976931348623157e308", "5e-324", "-5e-324", "2.3e-308", "1e-300", "1e-150",
    "1e-12", "1e12", "1e150", "1e200", "nan", "inf", "-inf", "9223372036854775807", "-9223372036854775808", "9223372036854775808",
    "18446744073709551616", "4294967296", "2147483647", "2000001", "1000001", "65536", "3.141592653589793", "6.283185307179586", "1_000",
    "0x7f", "0o17", "0b1", "1979-05-27", "07:32:00", "true", "false", "\"\"", "\" \"", "\"t\"", "\"sin(2*pi*t)\"", "\"sqrt(-1)\"", "\"0/0\"",
    "\"1e400\"", "[]", "[[]]", "{}", "[0, 0, 0]", "[0, 0, 1]", "[1e308, 1e308, 1e308]", "[5e-324, 0, 0]", "[1, 2]", "[0, 0, 0, 0, 0, 0]",
    "[1, \"t\", -0.0]", "{ csv = \"table.csv\" }", "{ name = \"h\", stages = [1] }", "'''\n'''",
];

/// Characters and pieces of text that break into any place.
#[rustfmt::skip]
const PIECES: [&str; 40] = [
    "\"", "'", "[", "]", "{", "}", "=", ",", ".", "#", "\n", "\r\n", "\r", "\t", " ", "\\", "\0", "\u{1}", "\u{1b}[31m", "\u{7f}", "\u{85}",
    "\u{feff}", "\u{202e}", "\u{301}", "é", "漢", "🦀", "\\u0000", "\\uD800", "\"\"\"", "'''", "-", "+", "1e999", "nan", "x.y", "[[beam]]\n",
    "[[", "]]\n", "@",
];

/// Factors that turn a number into a similar one.
const FACTORS: [f64; 10] = [0.5, 2.0, -1.0, 0.1, 10.0, 1e-3, 1e3, 1.0 + 1e-9, 3.0, 0.0];

const FUNCTIONS: [&str; 20] = [
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "log10", "sqrt", "abs",
    "min", "max", "floor", "", "sin cos",
];

/// Decks, tables and words of the repository, from which inputs are made.
pub struct Corpus {
    /// The lines of the decks, without comments; the first part of the list is accepted
    decks: Vec<Vec<String>>,
    /// The number of decks that are accepted
    accepted: usize,
    /// Name and content of the tables beside the decks
    tables: Vec<(String, String)>,
    /// Keys with a value, as lines
    keys: Vec<String>,
    /// Keys as `beam.elements`
    paths: Vec<String>,
    /// Words of the language and of other programs
    words: Vec<String>,
}

impl Corpus {
    /// Reads the decks of the repository.
    pub fn new(root: &Path) -> Self {
        let good = lines_of_decks(&root.join("decks"));
        let accepted = good.len();
        let tables = fs::read_dir(root.join("decks/tables")).into_iter().flatten().flatten().map(|entry| entry.path());
        let tables = tables.filter(|path| path.extension().is_some_and(|extension| extension == "csv"));
        let table = |path: &Path| Some((path.file_name()?.to_str()?.to_string(), fs::read_to_string(path).ok()?));
        let mut tables: Vec<_> = tables.filter_map(|path| table(&path)).collect();
        tables.sort();
        let entries = entries();
        let mut keys: Vec<String> = entries.iter().flat_map(|entry| entry.examples.clone()).collect();
        let paths: Vec<String> = entries.iter().map(|entry| entry.path.clone()).collect();
        let mut words: BTreeSet<String> = paths.iter().flat_map(|path| path.split('.')).map(str::to_string).collect();
        words.extend(entries.iter().flat_map(|entry| quoted(&entry.kinds)));
        words.extend(quoted(include_str!("../../src/deck/hints.rs")));
        keys.extend(words.iter().map(|word| format!("{word} = 1")));
        let words = words.into_iter().filter(|word| word.len() < 30 && !word.contains('\n')).collect();
        Self {
            decks: [good, lines_of_decks(&root.join("tests/bad_decks"))].concat(),
            accepted,
            tables,
            keys,
            paths,
            words,
        }
    }

    /// The table beside the decks of this name.
    pub fn table(&self, name: &str) -> Option<&str> {
        self.tables.iter().find(|(known, _)| known == name).map(|(_, content)| content.as_str())
    }

    /// Makes input `number` of a seed.
    pub fn input(&self, seed: u64, number: u64) -> Input {
        let random = &mut Random::of(seed, number);
        let input = match random.below(20) {
            0 | 1 => Input::new(Language::Expression, expression(random)),
            2 => Input::new(Language::History, mutated_table(&history(random), random)),
            3 | 4 => self.with_table(random),
            5..8 => {
                let settings = (0..random.few()).map(|_| self.setting(random)).collect();
                Input { settings, ..Input::new(Language::Deck, self.good(random).join("\n")) }
            }
            // Similar decks, most of which run.
            8..15 => Input::new(Language::Deck, self.similar(random)),
            _ => Input::new(Language::Deck, self.mangled(random)),
        };
        input.cut()
    }

    fn good(&self, random: &mut Random) -> Vec<String> {
        random.pick(&self.decks[..self.accepted]).clone()
    }

    /// A deck whose numbers and lines are similar to those of other decks.
    fn similar(&self, random: &mut Random) -> String {
        let mut lines = self.good(random);
        for _ in 0..2 * random.few() {
            match random.below(10) {
                0..5 => change_number(&mut lines, random, similar_number),
                5 | 6 => self.take_value(&mut lines, random),
                7 => self.take_section(&mut lines, random),
                8 => drop(lines.splice(section(&lines, random), [])),
                _ => change_number(&mut lines, random, |_, random| random.pick(&VALUES[..18]).to_string()),
            }
        }
        lines.join("\n")
    }

    /// A deck with any change to its structure, or to its bytes.
    fn mangled(&self, random: &mut Random) -> String {
        let mut lines = random.pick(&self.decks).clone();
        for _ in 0..random.few() {
            let at = random.below(lines.len());
            let other = random.below(lines.len());
            match random.below(16) {
                0 => drop(lines.splice(section(&lines, random), [])),
                1 => {
                    let twice = lines[section(&lines, random)].to_vec();
                    lines.splice(at..at, twice);
                }
                2 => self.take_section(&mut lines, random),
                3 => self.take_value(&mut lines, random),
                4 => change_number(&mut lines, random, |_, random| random.pick(&VALUES).to_string()),
                5 => change_number(&mut lines, random, |_, random| {
                    format!("\"{}\"", expression(random).escape_default())
                }),
                6 => self.change_word(&mut lines, random),
                7 => lines.insert(at, random.pick(&self.keys).clone()),
                8 if !lines.is_empty() => drop(lines.remove(at)),
                9 if !lines.is_empty() => lines.insert(other, lines[at].clone()),
                10 if !lines.is_empty() => lines.swap(at, other),
                11 if !lines.is_empty() => {
                    if let Some((key, _)) = lines[at].split_once('=') {
                        lines[at] = format!("{key}= {}", random.pick(&VALUES));
                    }
                }
                12 if !lines.is_empty() => {
                    if let Some((_, value)) = lines[at].split_once('=') {
                        lines[at] = format!("{} ={value}", random.pick(&self.words));
                    }
                }
                13 => lines.insert(at, self.large(random)),
                14 if !lines.is_empty() => {
                    let place = boundary(&lines[at], random.below(lines[at].len() + 1));
                    lines[at].insert_str(place, random.pick::<&str>(&PIECES));
                }
                _ => {
                    let mut text = lines.join("\n");
                    let start = boundary(&text, random.below(text.len() + 1));
                    let end = boundary(&text, (start + random.below(20)).min(text.len()));
                    text.replace_range(start..end.max(start), random.pick::<&str>(&PIECES));
                    lines = text.lines().map(str::to_string).collect();
                }
            }
        }
        lines.join(if random.one_in(20) { "\r\n" } else { "\n" })
    }

    /// Replaces a line by one of another deck with the same key.
    fn take_value(&self, lines: &mut [String], random: &mut Random) {
        let Some(line) = pick_mut(lines, random) else { return };
        let key = |line: &str| line.split_once('=').map(|(key, _)| key.trim().to_string());
        let Some(own) = key(line) else { return };
        let from = random.below(self.decks.len());
        let same = |other: &&String| key(other).as_ref() == Some(&own);
        if let Some(found) = self.decks[from..].iter().flatten().find(same) {
            line.clone_from(found);
        }
    }

    /// Inserts a table of another deck before one of this deck.
    fn take_section(&self, lines: &mut Vec<String>, random: &mut Random) {
        let other = random.pick(&self.decks);
        let new = other[section(other, random)].to_vec();
        let at = section(lines, random).start;
        lines.splice(at..at, new);
    }

    fn change_word(&self, lines: &mut [String], random: &mut Random) {
        let Some(line) = pick_mut(lines, random) else { return };
        let quotes: Vec<usize> = line.match_indices('"').map(|(at, _)| at).collect();
        let pairs: Vec<&[usize]> = quotes.chunks_exact(2).collect();
        if !pairs.is_empty() {
            let pair = random.pick(&pairs);
            line.replace_range(pair[0] + 1..pair[1], random.pick::<String>(&self.words));
        }
    }

    /// A line that is long, or deeply nested.
    fn large(&self, random: &mut Random) -> String {
        let count = [10, 100, 300, 3_000, 20_000][random.below(5)];
        let word = random.pick(&self.words);
        match random.below(8) {
            0 => format!("{word} = {}{}", "[".repeat(count), "]".repeat(count)),
            1 => format!("{word} = {}1{}", "{ a = ".repeat(count), " }".repeat(count)),
            2 => format!("title = \"{}\"", random.pick(&PIECES[24..27]).repeat(count)),
            3 => format!("[{word}{}]", ".a".repeat(count)),
            4 => format!("through = [{}]", "[0, 0, 0], ".repeat(count)),
            5 => format!("{word} = [{}]", "1, ".repeat(count)),
            6 => format!("x = \"{}\"", "1+".repeat(count)),
            _ => format!(
                "[param]\n{}",
                (0..count.min(3_000)).map(|k| format!("a{k} = \"a{}\"\n", k + 1)).collect::<String>()
            ),
        }
    }

    /// A deck that reads a changed table as the centre line of a beam, as its sections or as a
    /// history.
    fn with_table(&self, random: &mut Random) -> Input {
        let (name, table) = random.pick(&self.tables);
        let uses = |lines: &&Vec<String>| lines.iter().any(|line| line.contains(".csv\""));
        let lines = self.decks.iter().find(uses).cloned().unwrap_or_default();
        let text = lines.join("\n").replace(&format!("\"{name}\""), &format!("\"{TABLE}\""));
        Input { table: Some(mutated_table(table, random)), ..Input::new(Language::Deck, text) }
    }

    /// `KEY=VALUE`, often with a path that leads somewhere.
    fn setting(&self, random: &mut Random) -> String {
        let number = |random: &mut Random| {
            random.pick(&["0", "1", "2", "00", "-1", "1.5", "99999999999999999999", "", "\"0\""]).to_string()
        };
        let mut keys: Vec<String> = random.pick(&self.paths).split('.').map(str::to_string).collect();
        if random.one_in(8) {
            keys = vec!["param".into(), random.pick(&self.words).clone()];
        } else if keys.len() > 1 {
            keys.insert(1, number(random));
        }
        match random.below(10) {
            0 => keys.push(number(random)),
            1 => drop(keys.pop()),
            2 => keys.insert(0, random.pick(&self.words).clone()),
            3 => keys.push(random.pick(&PIECES).replace('\0', "")),
            _ => {}
        }
        let value = match random.below(4) {
            0 => random.pick(&self.words).clone(),
            1 => expression(random),
            2 => random.pick(&PIECES).replace('\0', ""),
            _ => random.pick(&VALUES).to_string(),
        };
        let equals = if random.one_in(20) { "" } else { "=" };
        format!("{}{equals}{value}", keys.join("."))
    }
}

/// The decks in a folder, line by line, without comments and empty lines.
fn lines_of_decks(folder: &Path) -> Vec<Vec<String>> {
    let texts = Input::paths(folder).into_iter().filter_map(|path| fs::read_to_string(path).ok());
    let is_kept = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let lines = |text: String| text.lines().filter(is_kept).map(str::to_string).collect();
    texts.filter(|text| text.len() <= LARGEST).map(lines).collect()
}

/// The texts between double quotes.
fn quoted(text: &str) -> Vec<String> {
    text.split('"').skip(1).step_by(2).map(str::to_string).collect()
}

fn pick_mut<'a>(lines: &'a mut [String], random: &mut Random) -> Option<&'a mut String> {
    let at = random.below(lines.len());
    lines.get_mut(at)
}

/// The largest place up to `at` between two characters.
fn boundary(text: &str, mut at: usize) -> usize {
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// The lines of a table of the deck, with its head.
fn section(lines: &[String], random: &mut Random) -> Range<usize> {
    let heads: Vec<usize> = (0..lines.len()).filter(|&k| lines[k].starts_with('[')).collect();
    let Some(number) = (!heads.is_empty()).then(|| random.below(heads.len())) else { return 0..lines.len() };
    heads[number]..heads.get(number + 1).copied().unwrap_or(lines.len())
}

/// The numbers in a line, by place.
fn numbers(line: &str) -> Vec<Range<usize>> {
    let bytes = line.as_bytes();
    let is_part = |at: usize| {
        let sign = matches!(bytes[at], b'+' | b'-') && at > 0 && matches!(bytes[at - 1], b'e' | b'E');
        bytes[at].is_ascii_digit() || matches!(bytes[at], b'.' | b'e' | b'E') || sign
    };
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let within_word = at > 0 && (bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
        let start = at;
        if bytes[at] == b'-' {
            at += 1;
        }
        if within_word || !bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at = start + 1;
            continue;
        }
        while at < bytes.len() && is_part(at) {
            at += 1;
        }
        found.push(start..at);
    }
    found
}

/// Replaces a number of one of the lines.
fn change_number(lines: &mut [String], random: &mut Random, new: impl Fn(&str, &mut Random) -> String) {
    let with_numbers: Vec<usize> = (0..lines.len()).filter(|&k| !numbers(&lines[k]).is_empty()).collect();
    if with_numbers.is_empty() {
        return;
    }
    let line = &mut lines[*random.pick(&with_numbers)];
    let place = random.pick(&numbers(line)).clone();
    let new = new(&line[place.clone()], random);
    line.replace_range(place, &new);
}

fn similar_number(number: &str, random: &mut Random) -> String {
    let factor = *random.pick(&FACTORS);
    match (number.parse::<i64>(), number.parse::<f64>()) {
        (Ok(integer), _) => ((integer as f64 * factor).round() as i64).to_string(),
        (_, Ok(float)) if (float * factor).is_finite() => format!("{:?}", float * factor),
        _ => number.into(),
    }
}

/// An expression of a grammar, at times with a fault.
fn expression(random: &mut Random) -> String {
    let depth = random.below(6);
    let text = term(random, depth);
    match random.below(12) {
        0 => {
            let at = boundary(&text, random.below(text.len() + 1));
            format!("{}{}{}", &text[..at], random.pick(&PIECES), &text[at..])
        }
        1 => text[..boundary(&text, random.below(text.len() + 1))].to_string(),
        2 => {
            let count = [40, 98, 101, 900, 30_000][random.below(5)];
            let (open, close) =
                *random.pick(&[("(", ")"), ("-", ""), ("sin(", ")"), ("2^", ""), ("1+", ""), ("- -", "")]);
            format!("{}{text}{}", open.repeat(count), close.repeat(count))
        }
        _ => text,
    }
}

fn term(random: &mut Random, depth: usize) -> String {
    if depth == 0 {
        return match random.below(6) {
            0 => "t".into(),
            1 => random.pick(&["pi", "deg", "L", "x", "_", "e", "é"]).to_string(),
            2 => random.pick(&VALUES[..20]).to_string(),
            _ => random.below(12).to_string(),
        };
    }
    let own = term(random, depth - 1);
    match random.below(6) {
        0 => format!("({own})"),
        1 => format!("-{own}"),
        2 => format!("{}({own})", random.pick(&FUNCTIONS)),
        3 => format!("{}({own}, {})", random.pick(&FUNCTIONS), term(random, depth - 1)),
        _ => format!("{own} {} {}", random.pick(&["+", "-", "*", "/", "^", "**", "%"]), term(random, depth - 1)),
    }
}

/// A stored history with a few rows.
fn history(random: &mut Random) -> String {
    let row = |k: usize, random: &mut Random| format!("1,{k}.0,1.0,{:?},0.5,1e-9\n", random.below(100) as f64 / 7.0);
    let rows: String = (0..random.below(6)).map(|k| row(k, random)).collect();
    format!("stage,time,load,tip.ux,tip.uy,tip.ux.err\n{rows}")
}

/// A table with changed cells, columns, rows or bytes.
fn mutated_table(table: &str, random: &mut Random) -> String {
    let mut rows: Vec<Vec<String>> = table.lines().map(|line| line.split(',').map(str::to_string).collect()).collect();
    for _ in 0..random.few() {
        if rows.is_empty() {
            break;
        }
        let at = random.below(rows.len());
        let column = random.below(rows[at].len());
        let names = ["x", "time", "s", "fraction", "EA", "C11", "C67", "M66", "rhoJ1", "", "é", "tip.ux.err", "nan"];
        match random.below(12) {
            0 => {
                rows.iter_mut().filter(|row| column < row.len()).for_each(|row| row.insert(column, row[column].clone()))
            }
            1 => rows.iter_mut().filter(|row| column < row.len()).for_each(|row| drop(row.remove(column))),
            2 => rows[at].push(random.pick(&VALUES).to_string()),
            3 => drop(rows[at].pop()),
            4 => drop(rows.remove(at)),
            5 => rows.insert(at, rows[at].clone()),
            6 => rows.swap(0, at),
            7 => rows[0].iter_mut().skip(column).take(1).for_each(|cell| *cell = random.pick(&names).to_string()),
            8 => rows.truncate(at),
            9 => rows[at].iter_mut().skip(column).take(1).for_each(|cell| *cell = random.pick(&PIECES).to_string()),
            _ => rows[at].iter_mut().skip(column).take(1).for_each(|cell| *cell = random.pick(&VALUES).to_string()),
        }
    }
    let separator = if random.one_in(15) { ";" } else { "," };
    let end = if random.one_in(10) { "\r\n" } else { "\n" };
    let lines: Vec<String> = rows.iter().map(|row| row.join(separator)).collect();
    let text = lines.join(end);
    match random.below(20) {
        0 => format!("\u{feff}{text}"),
        1 => format!("# comment\n\n{text}\n\n"),
        2 => format!("{text}{end}{}", "0,0,0\n".repeat(5_000)),
        _ => text,
    }
}
