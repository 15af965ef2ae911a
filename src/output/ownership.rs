//! Files that may be replaced: those that this program wrote, which their content shows.

use super::OutputError;
use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::path::Path;

/// The mark of pictures and pages: who wrote them.
pub const GENERATOR: &str = concat!("beamsim ", env!("CARGO_PKG_VERSION"));

/// Bytes at the start of a file in which its kind is looked for.
const HEAD: u64 = 4096;

/// Kinds of files of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputKind {
    /// history.csv
    History,
    /// run.json
    Record,
    /// modes.csv
    Modes,
    /// buckling.csv
    Buckling,
    /// stress.csv
    Stress,
    /// profile.csv
    Profile,
    /// effects.csv
    Effects,
    /// cost.csv
    Cost,
    /// sweep.csv
    Sweep,
    /// Plots as vectors
    Svg,
    /// Plots in pixels
    Png,
    /// Reports
    Page,
    /// checkpoint
    Checkpoint,
    /// Manual pages
    Manual,
}

impl OutputKind {
    /// True if the start of a file shows that it is of this kind, and that this program wrote it.
    fn is_shown_by(self, head: &[u8]) -> bool {
        let begins = |text: &str| head.starts_with(text.as_bytes());
        let holds = |text: &str| head.windows(text.len()).any(|part| part == text.as_bytes());
        match self {
            Self::History => begins("stage,time,load,") || begins("stage,time,load\n"),
            // The first key of the record.
            Self::Record => begins("{\n  \"version\": \"") && holds("\n  \"status\": \""),
            Self::Modes => begins("stage,mode,omega,"),
            Self::Buckling => begins("stage,mode,load,"),
            Self::Stress => begins("beam,fraction,length,section,vm,"),
            Self::Profile => begins("stage,time,load,beam,fraction,length,"),
            Self::Effects => begins("without,status,iterations,"),
            Self::Cost => begins("order,interpolation,scheme,elements,"),
            Self::Sweep => begins("point,") && head.split(|byte| *byte == b'\n').next().is_some_and(is_of_sweep),
            Self::Svg => begins("<svg ") && holds("<!-- beamsim "),
            Self::Png => begins_with_png(head) && holds("Software\0beamsim "),
            Self::Page => holds("<meta name=\"generator\" content=\"beamsim "),
            Self::Checkpoint => begins("beamsim checkpoint\n"),
            Self::Manual => holds(".TH beamsim"),
        }
    }
}

fn is_of_sweep(header: &[u8]) -> bool {
    String::from_utf8_lossy(header).ends_with("steps,iterations,factorisations,message")
}

fn begins_with_png(head: &[u8]) -> bool {
    head.starts_with(b"\x89PNG\r\n\x1a\n")
}

/// Refuses a path at which something stands that must not be replaced: a folder, a link, a device, a
/// pipe, a deck, and any file that this program did not write as a file of this kind. With `force`,
/// other plain files may be replaced. Empty files lose nothing.
pub fn may_replace(path: &Path, kind: OutputKind, force: bool) -> Result<(), OutputError> {
    let refuse = |reason: &str| Err(OutputError::Occupied { path: path.into(), reason: reason.into() });
    let found = match fs::symlink_metadata(path) {
        Ok(found) => found,
        Err(error) if error.kind() == ErrorKind::NotFound => return deck(path).map_or(Ok(()), refuse),
        Err(error) => return Err(OutputError::file(path, error)),
    };
    if found.is_symlink() {
        return refuse("is a link, which is not replaced: name the file itself");
    }
    if found.is_dir() {
        return refuse("is a folder: name a file");
    }
    if !found.is_file() {
        return refuse("is a device or a pipe, which is not replaced: name a plain file");
    }
    if let Some(reason) = deck(path) {
        return refuse(reason);
    }
    if force || found.len() == 0 {
        return Ok(());
    }
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.map_err(|error| OutputError::file(path, error))?;
    if kind.is_shown_by(&head) {
        return Ok(());
    }
    refuse("exists, and beamsim did not write it: choose another name, or replace it by --force")
}

/// Refuses a path for a folder of results at which something else stands. It need not exist.
pub fn refuse_no_folder(path: &Path) -> Result<(), OutputError> {
    // Other errors are met again, and told, where the folder is made.
    if fs::metadata(path).is_ok_and(|found| !found.is_dir()) {
        let reason = "is no folder: results are written into a folder".into();
        return Err(OutputError::Occupied { path: path.into(), reason });
    }
    Ok(())
}

/// The reason why a file with the name of a deck is never written as something else.
fn deck(path: &Path) -> Option<&'static str> {
    let is_deck = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    is_deck.then_some("has the name of a deck, which is never replaced by results")
}

/// The signature and the header of a PNG file, after which other parts may stand.
#[cfg(feature = "png")]
const PNG_START: usize = 8 + 25;

/// A PNG file with the mark of the generator.
#[cfg(feature = "png")]
pub fn marked_png(mut png: Vec<u8>) -> Vec<u8> {
    let body = ["tEXtSoftware\0", GENERATOR].concat().into_bytes();
    let length = (body.len() - 4) as u32;
    let part = [&length.to_be_bytes()[..], &body, &crc(&body).to_be_bytes()].concat();
    if png.len() >= PNG_START {
        png.splice(PNG_START..PNG_START, part);
    }
    png
}

/// The checksum of a part of a PNG file: CRC-32 of ISO 3309.
#[cfg(feature = "png")]
fn crc(bytes: &[u8]) -> u32 {
    let of_byte = |crc: u32, byte: &u8| {
        let shifted = |value: u32, _| if value & 1 == 1 { 0xedb8_8320 ^ (value >> 1) } else { value >> 1 };
        (0..8).fold((crc ^ u32::from(*byte)) & 0xff, shifted) ^ (crc >> 8)
    };
    !bytes.iter().fold(u32::MAX, of_byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_show_who_wrote_them() {
        let shown = [
            (OutputKind::History, "stage,time,load,tip.ux\n1,0,0,0\n"),
            (OutputKind::History, "stage,time,load\n"),
            (OutputKind::Record, "{\n  \"version\": \"0.1.0\",\n  \"status\": \"finished\",\n"),
            (OutputKind::Modes, "stage,mode,omega,growth\n"),
            (OutputKind::Sweep, "point,param.L,status,tip.uz,steps,iterations,factorisations,message\n1,"),
            (OutputKind::Svg, "<svg xmlns=\"\">\n<!-- beamsim 0.1.0 -->\n"),
            (OutputKind::Page, "<!doctype html>\n<meta name=\"generator\" content=\"beamsim 0.1.0\">"),
        ];
        for (kind, text) in shown {
            assert!(kind.is_shown_by(text.as_bytes()), "{kind:?}");
            let others = shown.iter().filter(|(other, _)| *other != kind);
            for (other, _) in others {
                assert!(!other.is_shown_by(text.as_bytes()), "{kind:?} is taken for {other:?}");
            }
        }
        let foreign =
            ["", "time,ux\n", "point,x\n", "{\"version\": 1}", "<svg >", "<html>beamsim</html>", "title = \"a\""];
        for text in foreign {
            assert!(shown.iter().all(|(kind, _)| !kind.is_shown_by(text.as_bytes())), "{text}");
        }
    }

    #[cfg(feature = "png")]
    #[test]
    fn the_checksum_is_that_of_the_standard() {
        assert_eq!(crc(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc(b"IEND"), 0xae42_6082);
    }
}
