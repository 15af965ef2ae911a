//! `beamsim import`: decks from files of other programs.

use super::error::{CommandError, DeckError};
use super::status::Status;
use super::verdict::Verdict;
use super::{console, new};
use crate::import::{self, ImportError, Imported};
use std::path::{Path, PathBuf};

/// Bytes of a file of another program, at most.
const MOST_BYTES: u64 = 64 << 20;

/// The program whose files are read.
#[derive(clap::Subcommand)]
pub enum From {
    /// A blade of BeamDyn (OpenFAST): key points, 6x6 matrices, damping, loads
    Beamdyn {
        /// Primary input file, which names the blade file
        #[arg(value_name = "PRIMARY")]
        primary: PathBuf,
        /// Driver input file, with loads and times (default: a modal stage)
        #[arg(value_name = "DRIVER")]
        driver: Option<PathBuf>,
        /// File of the deck (default: the name of the primary file with `.toml`, here)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// The blade of a turbine of windIO 1 (IEA Wind Task 37): reference axis, twist, 6x6 matrices
    Windio {
        /// Turbine in YAML
        #[arg(value_name = "FILE")]
        input: PathBuf,
        /// File of the deck (default: the name of the turbine file with `.toml`, here)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Beams of an input file of Abaqus or CalculiX: *BEAM SECTION, nodes, supports, loads
    Abaqus {
        /// Input file
        #[arg(value_name = "FILE")]
        input: PathBuf,
        /// File of the deck (default: the name of the input file with `.toml`, here)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
}

/// Writes a deck; a file that exists is left as it is.
pub fn import(from: &From) -> Status {
    let mut verdict = Verdict::default();
    let (read, source, out) = match from {
        From::Beamdyn { primary, driver, out } => (beamdyn(primary, driver.as_deref()), primary, out),
        From::Windio { input, out } => (windio(input), input, out),
        From::Abaqus { input, out } => (abaqus(input), input, out),
    };
    let done = read.and_then(|imported| {
        for note in &imported.notes {
            console::note(&format!("note: {note}"));
        }
        let beside = || PathBuf::from(source.file_name().unwrap_or_default()).with_extension("toml");
        new::write(&imported.deck, &out.clone().unwrap_or_else(beside))
    });
    if let Err(error) = done {
        verdict.fail(error);
    }
    verdict.finish(1)
}

fn beamdyn(primary: &Path, driver: Option<&Path>) -> Result<Imported, CommandError> {
    let driver = match driver {
        None => None,
        Some(path) => Some(import::read_driver(&path.display().to_string(), &read(path)?).map_err(refuse)?),
    };
    let text = read(primary)?;
    let beside = |name: &str| {
        let path = primary.with_file_name("").join(name.replace('\\', "/"));
        match read(&path) {
            Ok(text) => Ok((path.display().to_string(), text)),
            Err(error) => Err(error.to_string()),
        }
    };
    let blade = import::read_blade(&primary.display().to_string(), &text, beside).map_err(refuse)?;
    Ok(import::blade_deck(&blade, driver.as_ref()))
}

fn windio(input: &Path) -> Result<Imported, CommandError> {
    let blade = import::read_windio(&input.display().to_string(), &read(input)?).map_err(refuse)?;
    Ok(import::blade_deck(&blade, None))
}

fn abaqus(input: &Path) -> Result<Imported, CommandError> {
    let model = import::read_abaqus(&input.display().to_string(), &read(input)?).map_err(refuse)?;
    import::abaqus_deck(&model).map_err(refuse)
}

/// The text of a file; bytes that are no UTF-8, such as of names in its comments, are replaced.
fn read(path: &Path) -> Result<String, CommandError> {
    let io = |why: String| CommandError::Io(format!("{}: {why}", path.display()));
    let about = std::fs::metadata(path).map_err(|error| io(error.to_string()))?;
    if !about.is_file() {
        return Err(io("is not a plain file".into()));
    }
    if about.len() > MOST_BYTES {
        return Err(io(format!("is longer than the limit of {MOST_BYTES} bytes")));
    }
    let bytes = std::fs::read(path).map_err(|error| io(error.to_string()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn refuse(error: ImportError) -> CommandError {
    CommandError::Deck(DeckError { message: error.to_string(), ..DeckError::default() })
}
