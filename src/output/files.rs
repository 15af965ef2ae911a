//! Files that are written under another name and renamed when they are whole.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// A file in the making: `name.<process>.part` beside its final place.
#[derive(Debug)]
pub struct PartFile {
    folder: PathBuf,
    part: PathBuf,
}

impl PartFile {
    /// Creates the folder, and in it the part.
    pub fn create(folder: &Path, name: &str) -> io::Result<(Self, File)> {
        fs::create_dir_all(folder).map_err(|e| about(folder, &e))?;
        // Two runs at once must not write into each other's parts.
        let part = folder.join(format!("{name}.{}.part", std::process::id()));
        let file = File::create(&part).map_err(|e| about(&part, &e))?;
        Ok((Self { folder: folder.into(), part }, file))
    }

    /// A part with all its content, still without its name.
    pub fn written(folder: &Path, name: &str, content: &[u8]) -> io::Result<(Self, File)> {
        let (part, mut file) = Self::create(folder, name)?;
        io::Write::write_all(&mut file, content).map_err(|e| about(&part.part, &e))?;
        Ok((part, file))
    }

    /// A whole file at once.
    pub fn write(folder: &Path, name: &str, content: &[u8]) -> io::Result<()> {
        let (part, file) = Self::written(folder, name, content)?;
        part.finish(&file, name)
    }

    /// A whole file at a path that a user names.
    pub fn write_to(path: &Path, content: &[u8]) -> io::Result<()> {
        let name = path.file_name().ok_or_else(|| about(path, &io::Error::other("this names no file")))?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self::write(folder, &name.to_string_lossy(), content)
    }

    /// Gives the part, which must be flushed, its final name, when it is safe on the disk.
    pub fn finish(self, file: &File, name: &str) -> io::Result<()> {
        file.sync_all().map_err(|e| about(&self.part, &e)).and_then(|()| self.rename(name))
    }

    /// Gives the part its final name at once: for what can be made again if the machine loses it.
    pub fn rename(self, name: &str) -> io::Result<()> {
        let done = self.folder.join(name);
        fs::rename(&self.part, &done).map_err(|e| about(&done, &e))
    }
}

/// Removes a file of an earlier run.
pub fn remove_if_there(folder: &Path, name: &str) -> io::Result<()> {
    let path = folder.join(name);
    match fs::remove_file(&path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(about(&path, &error)),
        _ => Ok(()),
    }
}

/// The same error with the name of the file.
pub(super) fn about(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}
