//! Runs that have ended, kept on disk while a study is under way: one that was stopped goes on where it was.

use super::trial::{Seconds, Trial};
use crate::output::PartFile;
use csv::{ReaderBuilder, WriterBuilder};
use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The name of the file.
const NAME: &str = "cost.journal";

/// What stands at the end of a line that is whole: half a number is a number too.
const END: &str = ".";

/// Keeps runs by their settings.
#[derive(Default)]
pub struct Journal {
    known: HashMap<String, Trial>,
    file: Option<(PathBuf, File)>,
    /// Why nothing is written any more
    trouble: Option<io::Error>,
}

impl Journal {
    /// Opens the journal in a folder; what it holds of the study `identity` is known, what it holds of any other is forgotten.
    pub fn open(folder: &Path, identity: &str) -> io::Result<Self> {
        let path = folder.join(NAME);
        let known = fs::read(&path).ok().and_then(|bytes| read(&bytes, identity)).unwrap_or_default();
        // Written anew, as a whole: the last line of a stopped study may be half a line.
        let mut content = line(&[identity.to_string()]);
        known.iter().for_each(|(key, trial)| content.extend(line(&record(key, trial))));
        PartFile::write(folder, NAME, &content)?;
        let file = OpenOptions::new().append(true).open(&path)?;
        Ok(Self { known, file: Some((path, file)), trouble: None })
    }

    /// How many runs are known.
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// Whether no run is known.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// The run with these settings, where it is known.
    pub fn find(&self, key: &str) -> Option<Trial> {
        self.known.get(key).cloned()
    }

    /// Keeps a run. One that cannot be written is known all the same, and [`Journal::trouble`] tells.
    pub fn keep(&mut self, key: &str, trial: &Trial) {
        self.known.insert(key.into(), trial.clone());
        let written = self.file.as_mut().map_or(Ok(()), |(_, file)| file.write_all(&line(&record(key, trial))));
        if let Err(error) = written {
            self.file = None;
            self.trouble = Some(error);
        }
    }

    /// Why runs are not written any more.
    pub fn trouble(&self) -> Option<&io::Error> {
        self.trouble.as_ref()
    }

    /// The study is done: nothing is left to go on with.
    pub fn close(self) -> io::Result<()> {
        self.file.map_or(Ok(()), |(path, _)| fs::remove_file(path))
    }
}

fn line(fields: &[String]) -> Vec<u8> {
    let mut writer = WriterBuilder::new().flexible(true).from_writer(Vec::new());
    // Memory takes what it is given.
    let _ = writer.write_record(fields);
    writer.into_inner().unwrap_or_default()
}

fn record(key: &str, trial: &Trial) -> Vec<String> {
    let Trial { status, samples, steps, iterations, factorisations, seconds } = trial;
    let mut fields = vec![key.to_string(), status.clone()];
    fields.extend([steps, iterations, factorisations].map(u64::to_string));
    fields.extend([seconds.cpu, seconds.wall].map(|x| format!("{x:?}")));
    fields.push(samples.len().to_string());
    fields.extend(samples.iter().map(|x| format!("{x:?}")));
    fields.push(END.into());
    fields
}

/// `None` where it is the journal of another study.
fn read(bytes: &[u8], identity: &str) -> Option<HashMap<String, Trial>> {
    let mut reader = ReaderBuilder::new().flexible(true).has_headers(false).from_reader(bytes);
    let mut records = reader.records();
    (records.next()?.ok()?.get(0)? == identity).then_some(())?;
    Some(records.filter_map(|record| parse(&record.ok()?)).collect())
}

/// `None` for a line that was not finished.
fn parse(record: &csv::StringRecord) -> Option<(String, Trial)> {
    let whole = |k: usize| record.get(k)?.parse::<u64>().ok();
    let number = |k: usize| record.get(k)?.parse::<f64>().ok();
    let end = record.len().checked_sub(1).filter(|&end| end >= 8 && &record[end] == END)?;
    let samples: Vec<f64> = (8..end).map(number).collect::<Option<_>>()?;
    (samples.len() as u64 == whole(7)?).then_some(())?;
    let trial = Trial {
        status: record.get(1)?.into(),
        samples,
        steps: whole(2)?,
        iterations: whole(3)?,
        factorisations: whole(4)?,
        seconds: Seconds { cpu: number(5)?, wall: number(6)? },
    };
    Some((record.get(0)?.into(), trial))
}
