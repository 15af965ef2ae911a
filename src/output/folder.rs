//! A folder of results: one run at a time writes to it, and all files of a run get their names
//! together.
//!
//! While a run goes on its files end in `.part`. At its end run.json lists the others with their
//! lengths and checksums. The files of the run before are removed, run.json gets its name, and then
//! the others get theirs: a crash between two of these leaves files missing, never files of two
//! runs side by side, and the next command that opens the folder completes what was begun.

use super::files::{FIELDS, PARTIAL_FIELDS, is_at, remove_dead_parts};
use super::record::{FileRecord, Record};
use super::{OutputError, OutputKind, may_replace, refuse_no_folder, remove_fields, remove_if_there};
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The file that a run locks as long as it lasts.
const LOCK: &str = ".lock";
/// The name of the record.
const RECORD: &str = "run.json";
/// The file of a run that can be resumed.
pub const CHECKPOINT: &str = "checkpoint";
/// Names of a history, by its extent.
pub const HISTORY: [&str; 2] = ["history.csv", "history.partial.csv"];
/// Names of the table of largest stresses, by its extent.
pub const STRESS: [&str; 2] = ["stress.csv", "stress.partial.csv"];
/// Names of the table of resultants along beams, by its extent.
pub const PROFILE: [&str; 2] = ["profile.csv", "profile.partial.csv"];
/// The tables that a run may write, and their kinds.
const TABLES: [(&str, OutputKind); 8] = [
    (HISTORY[0], OutputKind::History),
    (HISTORY[1], OutputKind::History),
    ("modes.csv", OutputKind::Modes),
    ("buckling.csv", OutputKind::Buckling),
    (STRESS[0], OutputKind::Stress),
    (STRESS[1], OutputKind::Stress),
    (PROFILE[0], OutputKind::Profile),
    (PROFILE[1], OutputKind::Profile),
];
/// The names of tables.
fn tables() -> impl Iterator<Item = &'static str> {
    TABLES.into_iter().map(|(name, _)| name)
}
/// Names of the index of fields, by its extent.
pub const INDICES: [&str; 2] = ["fields.pvd", "fields.partial.pvd"];

/// How far the results of a run go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// The run finished, and all results so far could be written
    Whole,
    /// The run did not finish, or a result could not be written
    Partial,
}

impl Extent {
    /// Whole if a run or the writing of a result succeeded.
    pub fn of<T, E>(result: &Result<T, E>) -> Self {
        if result.is_ok() { Self::Whole } else { Self::Partial }
    }

    /// The extent after the next result was written.
    pub fn after<T, E>(self, result: &Result<T, E>) -> Self {
        match self {
            Self::Whole => Self::of(result),
            Self::Partial => Self::Partial,
        }
    }

    /// The name of a file among those of both extents.
    pub fn name(self, [whole, partial]: [&'static str; 2]) -> &'static str {
        match self {
            Self::Whole => whole,
            Self::Partial => partial,
        }
    }
}

/// The name of a file that is not complete.
fn part(name: &str) -> String {
    format!("{name}.part")
}

/// A folder of results that no other run writes to as long as this value lives.
#[derive(Debug)]
pub struct ResultFolder {
    path: PathBuf,
    /// The folder was not there before.
    is_new: bool,
    /// Locked; `None` where the file system has no locks
    lock: Option<File>,
}

impl ResultFolder {
    /// Claims a folder, which is created where it is missing. Fails where another run writes to it,
    /// or where something is in the way of the results. With `force` plain files of others are not.
    pub fn claim(path: &Path, force: bool) -> Result<Self, OutputError> {
        refuse_no_folder(path)?;
        let is_new = !path.exists();
        let folder = Self { path: path.into(), is_new, lock: lock(path)? };
        folder.refuse_obstacles(force)?;
        complete(path)?;
        // A checkpoint that is half written is of no use; the whole one before it is still there.
        remove_if_there(path, &part(CHECKPOINT))?;
        Ok(folder)
    }

    /// True if the folder has the checkpoint of a run that was stopped.
    pub fn has_checkpoint(&self) -> bool {
        self.path.join(CHECKPOINT).exists()
    }

    /// The path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes what runs that were killed have left unfinished.
    pub fn clean(&self) -> Result<(), OutputError> {
        remove_dead_parts(&self.path);
        for name in tables().chain([RECORD, CHECKPOINT]).chain(INDICES) {
            remove_if_there(&self.path, &part(name))?;
        }
        let fields = self.part(FIELDS);
        if fields.is_dir() {
            fs::remove_dir_all(&fields).map_err(|error| OutputError::file(&fields, error))?;
        }
        remove_if_there(&self.path, CHECKPOINT)
    }

    /// Takes space for a file that is written at the end, so that a disk that fills up meanwhile has
    /// room for it.
    pub fn reserve(&self, bytes: usize) -> Result<(), OutputError> {
        let written = self.create(RECORD)?.write_all(&vec![b' '; bytes]);
        written.map_err(|error| OutputError::file(&self.part(RECORD), error))
    }

    /// Creates a file, which gets its name with the others.
    pub fn create(&self, name: &str) -> Result<File, OutputError> {
        let path = self.part(name);
        remove_if_there(&self.path, &part(name))?;
        // A file or link that someone has put there is an error.
        File::create_new(&path).map_err(|error| OutputError::file(&path, error))
    }

    /// Writes a whole file, which gets its name with the others.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), OutputError> {
        let mut file = self.create(name)?;
        let written = file.write_all(content).and_then(|()| file.sync_all());
        written.map_err(|error| OutputError::file(&self.part(name), error))
    }

    /// Writes a whole file, which replaces the one of its name at once.
    pub fn replace(&self, name: &str, content: &[u8]) -> Result<(), OutputError> {
        self.write(name, content)?;
        rename_part(&self.path, name, name)?;
        sync(&self.path);
        Ok(())
    }

    /// The path of a file that is not complete.
    pub fn part(&self, name: &str) -> PathBuf {
        self.path.join(part(name))
    }

    /// Renames an incomplete file, which gets another name in the end.
    pub fn rename_part(&self, from: &str, to: &str) -> Result<(), OutputError> {
        rename_part(&self.path, from, &part(to))
    }

    /// Makes a complete file, or a folder, incomplete again.
    pub fn reopen(&self, name: &str, as_part_of: &str) -> Result<(), OutputError> {
        let from = self.path.join(name);
        fs::rename(&from, self.part(as_part_of)).map_err(|error| OutputError::file(&from, error))
    }

    /// Gives the files of a run their names, all together, with the record, which lists them.
    pub fn commit(&self, names: &[&str], record: &mut Record) -> Result<(), OutputError> {
        record.files = names.iter().map(|name| self.listed(name)).collect::<Result<_, _>>()?;
        self.write_over(RECORD, record.to_string().as_bytes())?;
        // Where no files of a run before are removed, a crash leaves new ones, or none.
        let of_runs = tables().chain([RECORD, CHECKPOINT, "report.html"]).chain(INDICES);
        if of_runs.into_iter().any(|name| fs::symlink_metadata(self.path.join(name)).is_ok()) {
            sync(&self.path);
        }
        give_names(&self.path, record)
    }

    /// Writes a whole file over the space that was taken for it.
    fn write_over(&self, name: &str, content: &[u8]) -> Result<(), OutputError> {
        let path = self.part(name);
        if !fs::symlink_metadata(&path).is_ok_and(|found| found.is_file()) {
            return self.write(name, content);
        }
        let written = File::options().write(true).open(&path).and_then(|mut file| {
            file.write_all(content)?;
            file.set_len(content.len() as u64)?;
            file.sync_all()
        });
        written.map_err(|error| OutputError::file(&path, error))
    }

    fn listed(&self, name: &str) -> Result<FileRecord, OutputError> {
        FileRecord::of(name, &self.part(name))
    }

    /// Refuses what stands in the way of results, before a run begins.
    fn refuse_obstacles(&self, force: bool) -> Result<(), OutputError> {
        let others = [(RECORD, OutputKind::Record), ("report.html", OutputKind::Page)];
        for (name, kind) in TABLES.into_iter().chain(others) {
            may_replace(&self.path.join(name), kind, force)?;
        }
        let parts = tables().chain([RECORD, CHECKPOINT]).chain(INDICES).map(part);
        may_replace(&self.path.join(CHECKPOINT), OutputKind::Checkpoint, force)?;
        for name in parts.chain(INDICES.map(String::from)) {
            refuse_obstacle(&self.path.join(name))?;
        }
        [FIELDS, PARTIAL_FIELDS].iter().try_for_each(|name| self.refuse_foreign_fields(name))
    }

    /// Refuses a folder of fields with files that its index does not list.
    fn refuse_foreign_fields(&self, name: &str) -> Result<(), OutputError> {
        let folder = self.path.join(name);
        let Ok(entries) = fs::read_dir(&folder) else {
            return match fs::symlink_metadata(&folder) {
                Ok(_) => Err(OutputError::content(&folder, "is in the way of the results: it is not a folder")),
                Err(_) => Ok(()),
            };
        };
        // A run that was killed may have given only the folder its name.
        let index = [format!("{name}.pvd"), part(&format!("{name}.pvd"))];
        let index = index.map(|index| fs::read_to_string(self.path.join(index)).unwrap_or_default()).concat();
        for entry in entries.flatten() {
            let file = entry.file_name();
            if !index.contains(&format!("file=\"{name}/{}\"", file.to_string_lossy())) {
                let reason = format!(
                    "is in the way of the results: the fields of a run would replace this folder, which contains {} \
                     (move it away)",
                    file.to_string_lossy()
                );
                return Err(OutputError::content(&folder, reason));
            }
        }
        Ok(())
    }
}

impl Drop for ResultFolder {
    fn drop(&mut self) {
        if self.lock.is_some() {
            // If it stays, the next run locks it again.
            let _ = fs::remove_file(self.path.join(LOCK));
        }
        if self.is_new {
            // This fails, as it should, if the folder has files.
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// Locks a folder. Locks of files hold between containers, and end with their process.
fn lock(folder: &Path) -> Result<Option<File>, OutputError> {
    let path = folder.join(LOCK);
    refuse_obstacle(&path)?;
    if fs::metadata(&path).is_ok_and(|found| found.len() > 0) {
        return Err(OutputError::content(&path, "is in the way of the results: it is not a lock (move it away)"));
    }
    loop {
        // The run before removes a folder that it has left empty.
        fs::create_dir_all(folder).map_err(|error| OutputError::file(folder, error))?;
        let file = match File::options().write(true).create(true).truncate(false).open(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => continue,
            opened => opened.map_err(|error| OutputError::file(&path, error))?,
        };
        match file.try_lock() {
            Ok(()) if is_at(&file, &path) => return Ok(Some(file)),
            // The run before has removed the file in the meantime.
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(OutputError::Locked(folder.into())),
            Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => return Ok(None),
            Err(TryLockError::Error(error)) => return Err(OutputError::file(&path, error)),
        }
    }
}

/// Refuses to replace what is not a plain file.
fn refuse_obstacle(path: &Path) -> Result<(), OutputError> {
    match fs::symlink_metadata(path) {
        Ok(found) if !found.is_file() => {
            let kind = if found.is_dir() {
                "a folder"
            } else if found.is_symlink() {
                "a link"
            } else {
                "a device or pipe"
            };
            Err(OutputError::content(path, format!("is in the way of the results: it is {kind} (move it away)")))
        }
        Ok(_) | Err(_) => Ok(()),
    }
}

/// Replaces the files of the run before by those of a complete record.
fn give_names(folder: &Path, record: &Record) -> Result<(), OutputError> {
    tables().try_for_each(|name| remove_if_there(folder, name))?;
    remove_if_there(folder, "report.html")?;
    remove_fields(folder)?;
    if !record.may_be_resumed() {
        remove_if_there(folder, CHECKPOINT)?;
    }
    rename_part(folder, RECORD, RECORD)?;
    record.files.iter().try_for_each(|file| give_name(folder, &file.name))?;
    sync(folder);
    Ok(())
}

/// Gives a file its name; the index of fields is preceded by their folder.
fn give_name(folder: &Path, name: &str) -> Result<(), OutputError> {
    if let Some(fields) = name.strip_suffix(".pvd").filter(|_| folder.join(part(FIELDS)).is_dir()) {
        rename_part(folder, FIELDS, fields)?;
    }
    rename_part(folder, name, name)
}

fn rename_part(folder: &Path, from: &str, to: &str) -> Result<(), OutputError> {
    let path = folder.join(to);
    fs::rename(folder.join(part(from)), &path).map_err(|error| OutputError::file(&path, error))
}

/// Completes a commit that was cut short, before or after the record got its name.
fn complete(folder: &Path) -> Result<(), OutputError> {
    let begun = Record::read_from(&folder.join(part(RECORD)));
    if let Some(record) = begun.ok().filter(|record| record.files.iter().all(|file| is_whole(folder, file))) {
        return give_names(folder, &record);
    }
    let Ok(record) = Record::read(folder) else { return Ok(()) };
    let is_open = |file: &&FileRecord| !folder.join(&file.name).exists() && is_whole(folder, file);
    record.files.iter().filter(is_open).try_for_each(|file| give_name(folder, &file.name))
}

/// True if a file of a record is there under its temporary name, and complete. A record from
/// elsewhere may name other files than those of a run: none of them is.
fn is_whole(folder: &Path, file: &FileRecord) -> bool {
    tables().chain(INDICES).any(|name| name == file.name)
        && FileRecord::of(&file.name, &folder.join(part(&file.name))).is_ok_and(|found| found == *file)
}

/// Completes in a folder what a run that was killed has left half-named, unless a run is at work.
pub fn settle(folder: &Path) {
    if folder.join(part(RECORD)).exists() || Record::read(folder).is_ok_and(|record| record.misses_files(folder)) {
        drop(ResultFolder::claim(folder, false));
    }
}

/// Asks the file system to keep the names of a folder.
fn sync(folder: &Path) {
    // Not every system can: then names are as safe as they are.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}
