//! What came of points, a small file each: processes on several machines write beside each other, and one that was killed leaves nothing
//! half done.

use super::point::Outcome;
use crate::output::PartFile;
use serde_json::{Value, json};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The folder of a sweep's points.
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// In the folder of a sweep's results.
    pub fn of(folder: &Path) -> Self {
        Self { folder: folder.join("points") }
    }

    /// Where a point stands, its folder and its name: by what it is, not by its number, so that a sweep that grows finds what was run of it.
    fn place(&self, identity: &str) -> (PathBuf, String) {
        let mark = identity.rsplit(' ').next().unwrap_or(identity);
        (self.folder.join(&mark[..mark.len().min(2)]), format!("{mark}.json"))
    }

    /// Keeps what came of a point.
    pub fn keep(&self, identity: &str, outcome: &Outcome) -> io::Result<()> {
        let (folder, name) = self.place(identity);
        let (part, _) = PartFile::written(&folder, &name, record(identity, outcome).to_string().as_bytes())?;
        part.rename(&name)
    }

    /// What came of a point; `None` where nothing is there.
    pub fn find(&self, identity: &str) -> Option<Outcome> {
        let (folder, name) = self.place(identity);
        read(&serde_json::from_slice(&fs::read(folder.join(name)).ok()?).ok()?, identity)
    }

    /// Forgets what came of a point.
    pub fn forget(&self, identity: &str) -> io::Result<()> {
        let (folder, name) = self.place(identity);
        crate::output::remove_if_there(&folder, &name)
    }
}

/// Numbers stand as texts: the shortest that read back to the same.
fn record(identity: &str, outcome: &Outcome) -> Value {
    let texts = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>();
    json!({
        "identity": identity,
        "status": outcome.status,
        "message": outcome.message,
        "values": texts(&outcome.values),
        "errors": texts(&outcome.errors),
        "work": outcome.work,
        "seconds": outcome.seconds,
    })
}

fn read(record: &Value, identity: &str) -> Option<Outcome> {
    (record["identity"].as_str()? == identity).then_some(())?;
    let numbers = |key: &str| -> Option<Vec<f64>> {
        record[key].as_array()?.iter().map(|text| text.as_str()?.parse().ok()).collect()
    };
    let work: Vec<u64> = record["work"].as_array()?.iter().map(Value::as_u64).collect::<Option<_>>()?;
    Some(Outcome {
        status: record["status"].as_str()?.into(),
        message: record["message"].as_str()?.into(),
        values: numbers("values")?,
        errors: numbers("errors")?,
        work: work.try_into().ok()?,
        seconds: record["seconds"].as_f64()?,
    })
}
