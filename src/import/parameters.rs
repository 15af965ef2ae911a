//! Parameters of the keywords of Abaqus and CalculiX that are read, and those that are not.

use super::keywords::{Block, Parameter};
use super::lines::{ImportError, Lines, shown};

/// The parameters of a keyword; all others are noted.
struct Known {
    keyword: &'static str,
    /// Read, or without influence on what is imported
    read: &'static [&'static str],
    /// Those that change geometry or material
    refused: &'static [&'static str],
}

const KNOWN: [Known; 18] = [
    Known { keyword: "NODE", read: &["NSET"], refused: &["SYSTEM", "INPUT"] },
    Known { keyword: "ELEMENT", read: &["TYPE", "ELSET"], refused: &["OFFSET", "INPUT", "FILE"] },
    Known {
        keyword: "NSET",
        read: &["NSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"],
        refused: &["ELSET", "INPUT"],
    },
    Known { keyword: "ELSET", read: &["ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"], refused: &["INPUT"] },
    Known {
        keyword: "BEAMSECTION",
        read: &["ELSET", "MATERIAL", "SECTION"],
        refused: &["OFFSET1", "OFFSET2", "ORIENTATION", "NODALTHICKNESS"],
    },
    Known { keyword: "MATERIAL", read: &["NAME"], refused: &[] },
    Known { keyword: "ELASTIC", read: &["TYPE"], refused: &["DEPENDENCIES"] },
    Known { keyword: "DENSITY", read: &[], refused: &["DEPENDENCIES"] },
    Known { keyword: "BOUNDARY", read: &[], refused: &[] },
    Known { keyword: "CLOAD", read: &[], refused: &[] },
    Known { keyword: "DLOAD", read: &[], refused: &[] },
    Known {
        keyword: "STEP",
        read: &["NAME", "NLGEOM", "INC", "PERTURBATION", "UNSYMM", "EXTRAPOLATION", "CONVERTSDI"],
        refused: &[],
    },
    Known { keyword: "STATIC", read: &["DIRECT", "SOLVER"], refused: &[] },
    Known {
        keyword: "FREQUENCY",
        read: &["EIGENSOLVER", "SOLVER", "NORMALIZATION", "STORAGE", "ACOUSTICCOUPLING", "NUMBERINTERVAL"],
        refused: &[],
    },
    Known { keyword: "DYNAMIC", read: &["DIRECT", "SOLVER"], refused: &[] },
    Known { keyword: "PART", read: &["NAME"], refused: &[] },
    Known { keyword: "INSTANCE", read: &["NAME", "PART"], refused: &["LIBRARY", "INSTANCE"] },
    Known { keyword: "ASSEMBLY", read: &["NAME"], refused: &[] },
];

/// Keywords that place nodes, turn their axes or make elements.
const REFUSED: [&str; 11] = [
    "INCLUDE",
    "SYSTEM",
    "TRANSFORM",
    "NORMAL",
    "NMAP",
    "NGEN",
    "NFILL",
    "NCOPY",
    "ELGEN",
    "ELCOPY",
    "BEAMSECTIONOFFSET",
];

/// Refuses a keyword, or a parameter of it, that changes geometry or material and is not imported.
/// Notes of the other parameters that are not read.
pub fn unread_parameters(lines: &Lines, block: &Block) -> Result<Vec<String>, ImportError> {
    if REFUSED.contains(&block.name.as_str()) {
        let message = format!("*{} is not imported: write out the nodes and elements that it stands for", block.name);
        return Err(lines.error(block.line, 1, message));
    }
    let Some(known) = KNOWN.iter().find(|known| known.keyword == block.name) else { return Ok(Vec::new()) };
    let mut notes = Vec::new();
    for parameter in &block.parameters {
        if known.read.contains(&parameter.name.as_str()) || is_default(parameter) {
            continue;
        }
        let named = format!("the parameter {} of *{} is not imported", shown(&parameter.name), block.name);
        if known.refused.contains(&parameter.name.as_str()) {
            return Err(lines.error(parameter.line, parameter.column, named));
        }
        notes.push(format!("line {}: {named}", parameter.line + 1));
    }
    Ok(notes)
}

/// True for a value that a program has without the parameter too.
fn is_default(parameter: &Parameter) -> bool {
    let value = parameter.value.text;
    match parameter.name.as_str() {
        "SYSTEM" => value.eq_ignore_ascii_case("R"),
        "OP" => value.eq_ignore_ascii_case("MOD"),
        "OFFSET1" | "OFFSET2" | "DEPENDENCIES" => value.parse() == Ok(0.0),
        _ => false,
    }
}
