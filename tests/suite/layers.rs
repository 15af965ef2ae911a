//! The order of the layers: what a module of the library may import, and where other crates may be used.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// From the bottom to the top; each imports only what stands before it, and `deck`, the words, only the names of failures and
/// warnings, and [`DECK_ROWS`].
#[rustfmt::skip]
const ORDER: [&str; 23] = [
    "failure", "warning", "interrupt", "threads", "sorting", "scalar", "tensor", "rotation", "kernel", "system", "effect", "model", "integrate", "solve", "section", "run", "probe",
    "deck", "scene", "import", "output", "study", "cli",
];

/// Kinds that the mechanics describe, each once: `deck` reads words for them, so that a new kind is a new word.
const DECK_ROWS: [&str; 2] = ["beamsim_core::effect::joint::JointKind", "beamsim_core::system::StageKind"];

/// Names that decks and runs share; all may import them.
const BELOW_ALL: [&str; 2] = ["failure", "warning"];

/// Crates that only some places may use; a place is a file or a folder.
const CRATES: [(&str, &[&str]); 23] = [
    ("rayon", &["core/src/threads.rs"]),
    (
        "faer",
        &[
            "core/src/solve/cholesky.rs",
            "core/src/solve/columns.rs",
            "core/src/solve/general.rs",
            "core/src/solve/krylov.rs",
            "core/src/solve/block/order.rs",
        ],
    ),
    ("saphyr_parser", &["src/import/yaml.rs"]),
    ("spade", &["core/src/section/triangulate.rs"]),
    ("toml", &["src/deck/"]),
    ("toml_edit", &["src/deck/"]),
    ("annotate_snippets", &["src/deck/"]),
    ("strsim", &["src/deck/"]),
    ("csv", &["src/output/", "src/study/", "src/deck/import.rs"]),
    ("resvg", &["src/output/plot/png.rs"]),
    ("notosans", &["src/output/plot/png.rs"]),
    ("cpu_time", &["src/study/cost/trial.rs"]),
    ("clap", &["src/cli/"]),
    ("indicatif", &["src/cli/"]),
    ("signal_hook", &["src/cli/"]),
    // The scene hands the resolved deck through to run.json.
    (
        "serde_json",
        &[
            "src/deck/",
            "src/scene/mod.rs",
            "src/scene/output.rs",
            "src/output/",
            "src/study/sweep/store.rs",
            "src/study/cost/journal.rs",
            "src/cli/json.rs",
        ],
    ),
    ("serde", &["src/output/", "src/study/", "src/cli/json.rs", "core/src/"]),
    ("postcard", &["src/output/checkpoint.rs"]),
    ("xxhash_rust", &["src/output/", "src/deck/files.rs"]),
    ("thiserror", &["src/output/", "src/study/", "src/cli/"]),
    ("base64", &["src/output/report/", "src/deck/mesh_file.rs"]),
    ("stl_io", &["src/deck/mesh_file.rs"]),
    ("tobj", &["src/deck/mesh_file.rs"]),
];

/// Files that may import one another, and why.
#[rustfmt::skip]
const ONE_THING: &[(&str, &[&str])] = &[
    ("an effect builds its form in a plane, which reads its elements", &[
        "core/src/effect/elasticity/beam.rs", "core/src/effect/elasticity/planar.rs",
    ]),
    ("an effect builds its form in a plane, which reads its bodies", &[
        "core/src/effect/inertia/planar.rs", "core/src/effect/inertia/rigid_body.rs",
    ]),
    ("the error of a step, and what steps carry along of it", &[
        "core/src/integrate/carried_error.rs", "core/src/integrate/time_error.rs",
    ]),
    ("parameters are read before what may name them", &["src/deck/parameters.rs", "src/deck/reader.rs"]),
    ("motions and loads share histories", &["src/scene/compose/mod.rs", "src/scene/constraints.rs"]),
    ("names are those of the mesh and its sections", &[
        "src/scene/computed.rs", "src/scene/mesh.rs", "src/scene/names.rs", "src/scene/section.rs",
    ]),
    ("one search: the points that it tries, and its rounds", &[
        "src/study/accuracy/candidates.rs", "src/study/accuracy/mod.rs", "src/study/accuracy/round.rs",
        "src/study/accuracy/search.rs",
    ]),
    ("a sweep, here or on a cluster", &["src/cli/sweep/mod.rs", "src/cli/sweep/plan.rs", "src/cli/sweep/slurm.rs"]),
];

/// Whether a module may import another one; `Err` for a module that nobody has given a place.
fn may_import(from: &str, to: &str) -> Result<bool, String> {
    let place = |name: &str| {
        let found = ORDER.iter().position(|layer| *layer == name);
        found.ok_or_else(|| format!("module `{name}` has no place in the order of layers"))
    };
    let (above, below) = (place(from)?, place(to)?);
    Ok(from == to || BELOW_ALL.contains(&to) || (from != "deck" && below < above))
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

/// A path of an import, segment by segment; the last one may be `*`.
type ImportPath = Vec<String>;

/// The paths of a tree such as `a::{b, c::{d as e, self}}` at the start of a text.
fn paths_of_tree(text: &str, before: &ImportPath, out: &mut Vec<ImportPath>) -> usize {
    let mut path = before.clone();
    let mut at = 0;
    loop {
        let rest = &text[at..];
        if rest.starts_with('{') {
            at += 1;
            loop {
                at += text[at..].len() - text[at..].trim_start_matches(|c: char| c.is_whitespace() || c == ',').len();
                if text[at..].is_empty() {
                    return at;
                }
                if text[at..].starts_with('}') {
                    return at + 1;
                }
                let length = paths_of_tree(&text[at..], &path, out);
                if length == 0 {
                    return at;
                }
                at += length;
            }
        }
        let word = if rest.starts_with('*') { "*" } else { leading_word(rest) };
        at += word.len();
        if !word.is_empty() && word != "self" {
            path.push(word.to_string());
        }
        let Some(after) = text[at..].strip_prefix("::") else { break };
        if !after.starts_with(|c: char| is_word(c) || c == '{' || c == '*') {
            break;
        }
        at += 2;
    }
    if let Some(renamed) = text[at..].strip_prefix(" as ") {
        at += " as ".len() + leading_word(renamed).len();
    }
    out.push(path);
    at
}

/// A file as its imports show it.
struct SourceFile {
    name: String,
    /// Its module's path, the package first
    module: ImportPath,
    /// Paths that it uses, from the package on
    uses: Vec<ImportPath>,
    /// Names that it hands on, with the paths that they come from
    exports: Vec<ImportPath>,
}

impl SourceFile {
    fn read(name: &str, code: &str) -> Self {
        let module = module_path(name);
        // Tests within a file may use what they like.
        let code = code.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
        let mut file = Self { name: name.to_string(), module, uses: Vec::new(), exports: Vec::new() };
        for root in ["crate", "super", "beamsim_core"] {
            for (_, before, after) in occurrences(code, root) {
                if after.starts_with("::") && !before.ends_with("::") && !before.ends_with("(in ") {
                    let line = before.rsplit([';', '}', ']']).next().unwrap_or_default().trim_start();
                    file.take(root, after.trim_start_matches("::"), line.starts_with("pub"));
                }
            }
        }
        for (_, before, after) in occurrences(code, "use") {
            let line = before.rsplit('\n').next().unwrap_or_default();
            let tree = after.trim_start();
            let is_other = ["crate", "super", "beamsim_core", "std"].contains(&leading_word(tree));
            if !is_other && (line.is_empty() || line.starts_with("pub")) {
                file.take("self", tree.trim_start_matches("self::"), line.starts_with("pub"));
            }
        }
        file
    }

    fn take(&mut self, root: &str, tree: &str, hands_on: bool) {
        let mut start = match root {
            "crate" => self.module[..1].to_vec(),
            "beamsim_core" => vec!["core".to_string()],
            "super" => self.module[..self.module.len().saturating_sub(1).max(1)].to_vec(),
            _ => self.module.clone(),
        };
        let mut tree = tree;
        while let Some(rest) = tree.strip_prefix("super::") {
            start.pop();
            tree = rest;
        }
        paths_of_tree(tree, &start, if hands_on { &mut self.exports } else { &mut self.uses });
    }
}

/// The path of a file's module: `core/src/run/levels.rs` is core, run, levels.
fn module_path(file: &str) -> ImportPath {
    let (package, below) = match file.strip_prefix("core/src/") {
        Some(below) => ("core", below),
        None => ("beamsim", file.trim_start_matches("src/")),
    };
    let below = below.trim_end_matches(".rs").trim_end_matches("/mod");
    std::iter::once(package).chain(below.split('/')).map(str::to_string).collect()
}

/// The file in which an imported name is defined; `None` for other crates.
fn home_of(path: &[String], files: &BTreeMap<ImportPath, SourceFile>, depth: usize) -> Option<String> {
    let known = (1..=path.len()).rev().find(|&length| files.contains_key(&path[..length]))?;
    let file = &files[&path[..known]];
    let Some(name) = path.get(known) else { return Some(file.name.clone()) };
    let handed_on = file.exports.iter().find(|export| export.last() == Some(name));
    match handed_on {
        Some(export) if depth > 0 => home_of(export, files, depth - 1),
        _ => Some(file.name.clone()),
    }
}

/// The groups of files that import one another in a circle, but for those that are one thing.
fn circles() -> Vec<Vec<String>> {
    let files = library().into_iter().map(|(name, code)| SourceFile::read(&name, &code));
    let files: BTreeMap<ImportPath, SourceFile> = files.map(|file| (file.module.clone(), file)).collect();
    let names: Vec<&str> = files.values().map(|file| file.name.as_str()).collect();
    let number_of = |name: &str| names.iter().position(|other| *other == name);
    let mut reaches = vec![vec![false; names.len()]; names.len()];
    for (from, file) in files.values().enumerate() {
        let homes = file.uses.iter().filter_map(|path| home_of(path, &files, 4));
        homes.filter_map(|home| number_of(&home)).for_each(|to| reaches[from][to] = to != from);
    }
    let imports = reaches.clone();
    for through in 0..names.len() {
        let onward = reaches[through].clone();
        for row in reaches.iter_mut().filter(|row| row[through]) {
            row.iter_mut().zip(&onward).for_each(|(reached, further)| *reached |= further);
        }
    }
    let mut found = Vec::new();
    let mut taken = vec![false; names.len()];
    for first in 0..names.len() {
        if taken[first] || !reaches[first][first] {
            continue;
        }
        let circle: Vec<usize> = (0..names.len()).filter(|&k| reaches[first][k] && reaches[k][first]).collect();
        circle.iter().for_each(|&k| taken[k] = true);
        let line = |&from: &usize| {
            let into: Vec<&str> = circle.iter().filter(|&&to| imports[from][to]).map(|&to| names[to]).collect();
            format!("{} -> {}", names[from], into.join(", "))
        };
        found.push(circle.iter().map(line).collect());
    }
    found
}

#[test]
fn no_files_import_one_another_in_a_circle() {
    let circles = circles();
    let is_in = |circle: &[String], group: &[&str]| {
        circle.iter().all(|line| group.iter().any(|file| line.starts_with(&format!("{file} "))))
    };
    let is_one_thing = |circle: &[String]| ONE_THING.iter().any(|(_, group)| is_in(circle, group));
    let faults: Vec<String> =
        circles.iter().filter(|circle| !is_one_thing(circle)).map(|circle| circle.join("\n")).collect();
    assert!(faults.is_empty(), "{} circles of imports:\n{}", faults.len(), faults.join("\n\n"));
    let idle = ONE_THING.iter().filter(|(_, group)| !circles.iter().any(|circle| is_in(circle, group)));
    let idle: Vec<&str> = idle.map(|(reason, _)| *reason).collect();
    assert!(idle.is_empty(), "no circles any more, to be taken out of the list: {}", idle.join("; "));
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
    assert_eq!(may_import("deck", "failure"), Ok(true));
    assert_eq!(may_import("run", "deck"), Ok(false));
    assert_eq!(may_import("scene", "deck"), Ok(true));
    assert_eq!(may_import("scene", "output"), Ok(false));
    assert_eq!(may_import("study", "cli"), Ok(false));
    assert!(may_import("kernel", "attic").is_err());
    assert_eq!(module_of("core/src/tensor.rs"), "tensor");
    assert_eq!(module_of("core/src/kernel/beam.rs"), "kernel");
}
