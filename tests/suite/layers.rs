//! The order of the layers: what a module of the library may import, and where other crates may be used.

use std::fs;
use std::path::{Path, PathBuf};

/// From the bottom to the top; each imports only what stands before it, and `deck`, the words, only the names of warnings and
/// [`DECK_ROWS`].
#[rustfmt::skip]
const ORDER: [&str; 18] = [
    "warning", "threads", "scalar", "tensor", "rotation", "kernel", "system", "effect", "model", "integrate", "solve", "run", "probe",
    "deck", "scene", "output", "study", "cli",
];

/// Tables of data whose rows carry the deck's words: `deck` reads these words from the one table that the mechanics use, so that a new row
/// is a new word.
const DECK_ROWS: [&str; 1] = ["beamsim_core::effect::joint::JointKind"];

/// Crates that only some places may use; a place is a file or a folder.
const CRATES: [(&str, &[&str]); 16] = [
    ("rayon", &["core/src/threads.rs"]),
    (
        "faer",
        &[
            "core/src/solve/columns.rs",
            "core/src/solve/general.rs",
            "core/src/solve/krylov.rs",
            "core/src/solve/block/order.rs",
        ],
    ),
    ("toml", &["src/deck/"]),
    ("toml_edit", &["src/deck/"]),
    ("annotate_snippets", &["src/deck/"]),
    ("strsim", &["src/deck/"]),
    ("csv", &["src/output/", "src/study/", "src/deck/import.rs"]),
    ("kuva", &["src/output/plot.rs", "src/output/curves.rs"]),
    ("cpu_time", &["src/study/cost/trial.rs"]),
    ("clap", &["src/cli/"]),
    ("indicatif", &["src/cli/"]),
    ("ctrlc", &["src/cli/"]),
    ("signal_hook", &["src/cli/"]),
    // The scene hands the resolved deck through to run.json.
    (
        "serde_json",
        &[
            "src/deck/",
            "src/scene/mod.rs",
            "src/output/",
            "src/study/sweep/store.rs",
            "src/study/cost/journal.rs",
            "src/cli/json.rs",
        ],
    ),
    ("serde", &["src/output/", "src/study/", "src/cli/json.rs"]),
    ("thiserror", &["src/output/", "src/study/", "src/cli/"]),
];

/// Whether a module may import another one; `Err` for a module that nobody has given a place.
fn may_import(from: &str, to: &str) -> Result<bool, String> {
    let place = |name: &str| {
        let found = ORDER.iter().position(|layer| *layer == name);
        found.ok_or_else(|| format!("module `{name}` has no place in the order of layers"))
    };
    let (above, below) = (place(from)?, place(to)?);
    Ok(from == to || to == "warning" || (from != "deck" && below < above))
}

/// The files below a folder, in order.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("a readable entry").path()).collect();
    paths.sort();
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// The code without its comments, line for line.
fn without_comments(text: &str) -> String {
    let mut code = String::new();
    let mut inside = false;
    for line in text.lines() {
        let trimmed = line.trim_start();
        inside |= trimmed.starts_with("/*");
        if !inside {
            code.push_str(trimmed.split("//").next().unwrap_or_default());
        }
        inside &= !trimmed.contains("*/");
        code.push('\n');
    }
    code
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The word that a text begins with.
fn leading_word(text: &str) -> &str {
    text.split(|c: char| !is_word(c)).next().unwrap_or_default()
}

/// The first names of a list in braces that stands at the start of the text: `{a::b, c::{d, e}}` gives a and c.
fn names_in_braces(text: &str) -> Vec<&str> {
    let mut names = Vec::new();
    let (mut depth, mut expected) = (0, false);
    for (at, c) in text.char_indices() {
        match c {
            '{' => {
                depth += 1;
                expected = depth == 1;
            }
            '}' => depth -= 1,
            ',' => expected = depth == 1,
            c if expected && is_word(c) => {
                names.push(leading_word(&text[at..]));
                expected = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    names
}

/// Where a word stands on its own, not as a part of a longer one: line number and what follows it.
fn occurrences<'a>(code: &'a str, word: &'a str) -> impl Iterator<Item = (usize, &'a str, &'a str)> {
    code.match_indices(word).filter_map(move |(at, _)| {
        let (before, after) = (&code[..at], &code[at + word.len()..]);
        let alone = !before.ends_with(is_word) && !after.starts_with(is_word);
        alone.then(|| (1 + before.matches('\n').count(), before, after))
    })
}

/// The modules of the library that a text names, with their lines.
fn imported_modules(code: &str) -> Vec<(usize, String)> {
    let mut modules = Vec::new();
    let here = occurrences(code, "crate");
    for (line, _, after) in here.chain(occurrences(code, "beamsim_core")) {
        let Some(path) = after.strip_prefix("::") else { continue };
        if path.starts_with('{') {
            modules.extend(names_in_braces(path).into_iter().map(|name| (line, name.to_string())));
        } else {
            modules.push((line, leading_word(path).to_string()));
        }
    }
    modules
}

/// The lines that use a crate: `use name` or `name::`, but not `other::name`.
fn lines_with_crate(code: &str, name: &str) -> Vec<usize> {
    let mut lines = Vec::new();
    for (line, before, after) in occurrences(code, name) {
        let is_part =
            before.ends_with("::") && !before.trim_end_matches("::").ends_with([' ', '\n', '(', '<', '&', '{']);
        let is_use = before.ends_with("use ") || before.ends_with("use ::") || after.starts_with("::");
        if is_use && !is_part {
            lines.push(line);
        }
    }
    lines
}

/// Each file of the library: its path from the package's folder, and its code. `main.rs` and `lib.rs` see all.
fn library() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for path in [root.join("core/src"), root.join("src")].iter().flat_map(|folder| rust_files(folder)) {
        let below = path.strip_prefix(root).expect("a path below the package");
        let name = below.to_string_lossy().replace('\\', "/");
        if name == "src/main.rs" || name.ends_with("src/lib.rs") {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        files.push((name, without_comments(&text)));
    }
    assert!(files.len() > 20, "only {} files were found below {}", files.len(), root.display());
    files
}

/// The module that a file belongs to: `core/src/kernel/beam.rs` to kernel, `core/src/tensor.rs` to tensor.
fn module_of(file: &str) -> &str {
    leading_word(file.trim_start_matches("core/").trim_start_matches("src/"))
}

#[test]
fn imports_run_only_downward() {
    let mut faults = Vec::new();
    for (file, mut code) in library() {
        if module_of(&file) == "deck" {
            DECK_ROWS.iter().for_each(|row| code = code.replace(row, ""));
        }
        for (line, to) in imported_modules(&code) {
            match may_import(module_of(&file), &to) {
                Ok(true) => {}
                Ok(false) => faults.push(format!("{file}:{line}: {} must not import {to}", module_of(&file))),
                Err(message) => faults.push(format!("{file}:{line}: {message}")),
            }
        }
    }
    assert!(faults.is_empty(), "imports against the order of the layers:\n{}", faults.join("\n"));
}

#[test]
fn crates_are_used_only_in_their_rooms() {
    let mut faults = Vec::new();
    for (file, code) in library() {
        for (name, rooms) in CRATES {
            if rooms.iter().any(|room| file.starts_with(*room)) {
                continue;
            }
            for line in lines_with_crate(&code, name) {
                faults.push(format!("{file}:{line}: {name} belongs only in {}", rooms.join(", ")));
            }
        }
    }
    assert!(faults.is_empty(), "crates outside their rooms:\n{}", faults.join("\n"));
}

#[test]
fn the_reader_of_imports_reads() {
    let text = "//! [`crate::study`]\nuse beamsim_core::scalar::Real; // crate::cli\n/* crate::deck\n*/\nlet a = crate::tensor::Vec3::ZERO;\nuse crate::{kernel::{beam, load}, system};\nfn mycrate::x() {}\n";
    let found = imported_modules(&without_comments(text));
    let expected =
        [(5_usize, "tensor"), (6, "kernel"), (6, "system"), (2, "scalar")].map(|(line, name)| (line, name.to_string()));
    assert_eq!(found, expected);
    let text = "use toml::de;\nuse toml_edit::Item;\nlet a: toml::Value;\nuse super::toml::x;\nuse toml;\nlet toml = 1;\nx(::toml::y);\n";
    assert_eq!(lines_with_crate(text, "toml"), [1, 3, 5, 7]);
    assert_eq!(may_import("kernel", "rotation"), Ok(true));
    assert_eq!(may_import("kernel", "system"), Ok(false));
    assert_eq!(may_import("deck", "tensor"), Ok(false));
    assert_eq!(may_import("deck", "deck"), Ok(true));
    assert_eq!(may_import("deck", "warning"), Ok(true));
    assert_eq!(may_import("run", "deck"), Ok(false));
    assert_eq!(may_import("scene", "deck"), Ok(true));
    assert_eq!(may_import("scene", "output"), Ok(false));
    assert_eq!(may_import("study", "cli"), Ok(false));
    assert!(may_import("kernel", "attic").is_err());
    assert_eq!(module_of("core/src/tensor.rs"), "tensor");
    assert_eq!(module_of("core/src/kernel/beam.rs"), "kernel");
}
