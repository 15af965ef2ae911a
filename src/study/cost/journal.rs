//! Runs that have ended, saved on disk while a study is running, so that a stopped study can
//! continue.

use super::trial::Trial;
use crate::output::{OutputError, PartFile};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Saves runs by their settings, in a file of JSON: a line for the study and one for each run.
#[derive(Default)]
pub struct Journal {
    known: HashMap<String, Trial>,
    file: Option<OpenFile>,
    /// Why runs are no longer written
    write_error: Option<io::Error>,
}

struct OpenFile {
    path: PathBuf,
    file: File,
}

/// The first line of the file.
#[derive(Serialize, Deserialize)]
struct Heading<'a> {
    study: Cow<'a, str>,
}

/// The line of a run. A line that was cut off is no JSON, and read as the end.
#[derive(Serialize, Deserialize)]
struct Entry<'a> {
    settings: Cow<'a, str>,
    run: Cow<'a, Trial>,
}

impl Journal {
    /// Opens the journal of a name in a folder. Runs of the study `identity` are read, those of other studies
    /// are forgotten.
    pub fn open(folder: &Path, name: &str, identity: &str) -> Result<Self, OutputError> {
        let path = folder.join(name);
        let known = fs::read_to_string(&path).ok().and_then(|text| read(&text, identity)).unwrap_or_default();
        // The file is written anew, since the last line of a stopped study may be incomplete.
        let mut content = line(&Heading { study: identity.into() });
        for (key, trial) in &known {
            content.extend(line(&Entry { settings: key.into(), run: Cow::Borrowed(trial) }));
        }
        PartFile::write(folder, name, &content)?;
        let file = OpenOptions::new().append(true).open(&path).map_err(|error| OutputError::file(&path, error))?;
        Ok(Self { known, file: Some(OpenFile { path, file }), write_error: None })
    }

    /// The number of known runs.
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// True if no run is known.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// The run with these settings, where it is known.
    pub fn find(&self, key: &str) -> Option<Trial> {
        self.known.get(key).cloned()
    }

    /// Saves a run. If it cannot be written, it is only known in memory, and
    /// [`Journal::write_error`] gives the reason.
    pub fn keep(&mut self, key: &str, trial: &Trial) {
        self.known.insert(key.into(), trial.clone());
        let entry = line(&Entry { settings: key.into(), run: Cow::Borrowed(trial) });
        let written = self.file.as_mut().map_or(Ok(()), |OpenFile { file, .. }| file.write_all(&entry));
        if let Err(error) = written {
            self.file = None;
            self.write_error = Some(error);
        }
    }

    /// The reason why runs are no longer written.
    pub fn write_error(&self) -> Option<&io::Error> {
        self.write_error.as_ref()
    }

    /// Removes the file of a study that is finished.
    pub fn close(self) -> Result<(), OutputError> {
        match self.file {
            Some(OpenFile { path, .. }) => fs::remove_file(&path).map_err(|error| OutputError::file(&path, error)),
            None => Ok(()),
        }
    }
}

/// A line of JSON; texts and numbers cannot fail to be written.
fn line(content: &impl Serialize) -> Vec<u8> {
    let mut line = serde_json::to_vec(content).unwrap_or_default();
    line.push(b'\n');
    line
}

/// The runs of a journal; `None` where it belongs to another study.
fn read(text: &str, identity: &str) -> Option<HashMap<String, Trial>> {
    let mut lines = text.lines();
    let heading: Heading = serde_json::from_str(lines.next()?).ok()?;
    if heading.study != identity {
        return None;
    }
    let entries = lines.map_while(|line| serde_json::from_str::<Entry>(line).ok());
    Some(entries.map(|Entry { settings, run }| (settings.into_owned(), run.into_owned())).collect())
}
