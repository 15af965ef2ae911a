//! Files that are written under a temporary name and renamed when they are complete.

use super::OutputError;
use std::fs::{self, File, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The folder of the fields of a run that finished.
pub const FIELDS: &str = "fields";
/// The folder of the fields of a run that did not.
pub const PARTIAL_FIELDS: &str = "fields.partial";

/// Digits of the number of an incomplete file.
const DIGITS: usize = 16;

/// An incomplete file: `name.<number>.part` beside its final place, with a random number.
#[derive(Debug)]
pub struct PartFile {
    folder: PathBuf,
    part: PathBuf,
}

impl PartFile {
    /// Creates the folder, and in it the incomplete file.
    pub fn create(folder: &Path, name: &str) -> Result<(Self, File), OutputError> {
        fs::create_dir_all(folder).map_err(|error| OutputError::file(folder, error))?;
        loop {
            // Process numbers are those of a container: two of them may write into one folder.
            let number = RandomState::new().hash_one(name);
            let part = folder.join(format!("{name}.{number:0DIGITS$x}.part"));
            // What exists is neither opened nor followed.
            match File::create_new(&part) {
                // The lock tells others that the file is not left by a dead process.
                Ok(file) => match file.try_lock() {
                    // Another process has taken the new file for one of a dead process.
                    Err(TryLockError::WouldBlock) => {}
                    Ok(()) if !is_at(&file, &part) => {}
                    // Without locks nobody looks for dead processes.
                    Ok(()) | Err(TryLockError::Error(_)) => return Ok((Self { folder: folder.into(), part }, file)),
                },
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(OutputError::file(&part, error)),
            }
        }
    }

    /// Writes the whole content, still under the temporary name.
    pub fn written(folder: &Path, name: &str, content: &[u8]) -> Result<(Self, File), OutputError> {
        let (part, mut file) = Self::create(folder, name)?;
        file.write_all(content).map_err(|error| {
            // A file that is half written is of no use.
            let _ = fs::remove_file(&part.part);
            OutputError::file(&part.part, error)
        })?;
        Ok((part, file))
    }

    /// Writes a whole file.
    pub fn write(folder: &Path, name: &str, content: &[u8]) -> Result<(), OutputError> {
        let (part, file) = Self::written(folder, name, content)?;
        part.finish(&file, name)
    }

    /// Writes a whole file at a path of the command line.
    pub fn write_to(path: &Path, content: &[u8]) -> Result<(), OutputError> {
        let name = path.file_name().ok_or_else(|| OutputError::NoFileName(path.into()))?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self::write(folder, &name.to_string_lossy(), content)
    }

    /// Gives the file, which must be flushed, its final name when its content is safe on the disk.
    pub fn finish(self, file: &File, name: &str) -> Result<(), OutputError> {
        file.sync_all().map_err(|error| OutputError::file(&self.part, error)).and_then(|()| self.rename(name))
    }

    /// Gives the file its final name at once: for content that can be made again if the machine
    /// loses it.
    pub fn rename(self, name: &str) -> Result<(), OutputError> {
        let done = self.folder.join(name);
        fs::rename(&self.part, &done).map_err(|error| OutputError::file(&done, error))
    }
}

/// True if a path still leads to an open file.
#[cfg(unix)]
pub fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(own), Ok(there)) => place(own) == place(there),
        (Err(_), _) | (_, Err(_)) => false,
    }
}

/// True if a path still leads to an open file: elsewhere open files cannot be removed.
#[cfg(not(unix))]
pub fn is_at(_: &File, _: &Path) -> bool {
    true
}

/// Removes the incomplete files that dead processes have left in a folder: those that nobody has
/// locked. It is no error if one cannot be removed.
pub fn remove_dead_parts(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let number = name.strip_suffix(".part").and_then(|name| name.rsplit('.').next());
        let is_numbered = number.is_some_and(|n| n.len() == DIGITS && n.bytes().all(|c| c.is_ascii_hexdigit()));
        if !is_numbered || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let opened = File::options().write(true).open(entry.path());
        if opened.is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Removes a file of an earlier run, if it exists.
pub fn remove_if_there(folder: &Path, name: &str) -> Result<(), OutputError> {
    let path = folder.join(name);
    match fs::remove_file(&path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(OutputError::file(&path, error)),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Removes the fields of an earlier run: the files that its index lists, and nothing else.
pub fn remove_fields(folder: &Path) -> Result<(), OutputError> {
    for name in [FIELDS, PARTIAL_FIELDS] {
        let index = format!("{name}.pvd");
        let Ok(listed) = fs::read_to_string(folder.join(&index)) else { continue };
        for file in listed.split("file=\"").skip(1).filter_map(|rest| rest.split('"').next()) {
            if Path::new(file).parent() == Some(Path::new(name)) {
                remove_if_there(folder, file)?;
            }
        }
        let _ = fs::remove_dir(folder.join(name));
        remove_if_there(folder, &index)?;
    }
    Ok(())
}
