//! Files that are written under a temporary name and renamed when they are complete.

use super::OutputError;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// An incomplete file: `name.<process>.part` beside its final place.
#[derive(Debug)]
pub struct PartFile {
    folder: PathBuf,
    part: PathBuf,
}

impl PartFile {
    /// Creates the folder, and in it the incomplete file.
    pub fn create(folder: &Path, name: &str) -> Result<(Self, File), OutputError> {
        fs::create_dir_all(folder).map_err(|error| OutputError::file(folder, error))?;
        // Two processes must not write into the same file.
        let part = folder.join(format!("{name}.{}.part", std::process::id()));
        let file = File::create(&part).map_err(|error| OutputError::file(&part, error))?;
        Ok((Self { folder: folder.into(), part }, file))
    }

    /// Writes the whole content, still under the temporary name.
    pub fn written(folder: &Path, name: &str, content: &[u8]) -> Result<(Self, File), OutputError> {
        let (part, mut file) = Self::create(folder, name)?;
        file.write_all(content).map_err(|error| OutputError::file(&part.part, error))?;
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

/// Removes a file of an earlier run, if it exists.
pub fn remove_if_there(folder: &Path, name: &str) -> Result<(), OutputError> {
    let path = folder.join(name);
    match fs::remove_file(&path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(OutputError::file(&path, error)),
        Ok(()) | Err(_) => Ok(()),
    }
}
