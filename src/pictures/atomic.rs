//! Files, and folders of files, written whole or not at all.
//!
//! The bytes go to a temporary file in the destination's directory, which is renamed over the destination only once
//! everything is on disk. A reader sees the old file or the new one, never half of it. Permissions are those of any
//! new file (`0666` less the umask). A symbolic link stays a link: its target is replaced. Devices and pipes cannot
//! be renamed over and are written directly. A folder is filled under a temporary name beside its place and renamed
//! like a file; one that it replaces is moved aside first. A program about to end early calls [`abandon_files`], which
//! removes what is temporary of all threads and lets nothing else come into being. Of several processes that share
//! their work the first writes, and to the others it seems that they did. Not handled: a process killed outright
//! between the steps leaves a hidden `.halflight-*` file or folder behind, which then may be all there is of a folder
//! that was to be replaced.

use std::fs::{File, Permissions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::{fs, io};

use halflight_team as team;
use tempfile::{Builder, TempDir, TempPath};

/// What exists now under a temporary name, each removed when it is dropped.
struct Live {
    files: Vec<TempPath>,
    folders: Vec<TempDir>,
}

/// Held while one is made, renamed or removed, never while one is written.
static LIVE: Mutex<Live> = Mutex::new(Live { files: Vec::new(), folders: Vec::new() });

/// A file could not be written; whatever was there before is untouched.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("cannot write {}: {source}", path.display())]
#[diagnostic(
    code(halflight::write),
    help("check that the directory exists, that it and the file may be written, and that the disk has room")
)]
pub struct WriteError {
    /// The destination.
    pub path: PathBuf,
    /// The system's error.
    pub source: io::Error,
}

/// Writes `bytes` to `path`, replacing what is there, whole or not at all.
///
/// # Errors
/// [`WriteError`] where the directory is missing, the destination is a directory or read-only, or the disk is full.
pub fn write_whole(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), WriteError> {
    write_whole_by(path, |file| file.write_all(bytes))
}

/// Writes to `path` what `write` writes to the file it is given, whole or not at all.
///
/// # Errors
/// As [`write_whole`], and those of `write`.
pub fn write_whole_by(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), WriteError> {
    let path = path.as_ref();
    if !team::speaks() {
        return Ok(());
    }
    let written = target(path).and_then(|target| match target {
        None => {
            // A pipe has no places to go back to.
            let mut file = tempfile::tempfile()?;
            write(&mut file)?;
            file.seek(SeekFrom::Start(0))?;
            io::copy(&mut file, &mut File::options().write(true).open(path)?).map(drop)
        }
        Some(target) => {
            let mut file = Temporary::new(folder(&target))?;
            write(&mut file.file)?;
            file.file.sync_all()?;
            file.rename(&target)
        }
    });
    written.map_err(|source| WriteError { path: path.to_path_buf(), source })
}

/// Checks that [`write_whole`] could write to `path` now, before hours of work. Leaves nothing behind. Processes that
/// write nothing check nothing.
///
/// # Errors
/// [`WriteError`] where the directory is missing or not writable, the destination is a directory or read-only.
pub fn check_destination(path: impl AsRef<Path>) -> Result<(), WriteError> {
    let path = path.as_ref();
    if !team::speaks() {
        return Ok(());
    }
    let probe = target(path).and_then(|target| match target {
        None => Ok(()),
        Some(target) => Temporary::new(folder(&target)).map(drop),
    });
    probe.map_err(|source| WriteError { path: path.to_path_buf(), source })
}

/// Makes sure a directory exists and takes new files, so that what is written into it later need not fail; processes
/// that write nothing do nothing.
///
/// # Errors
/// [`WriteError`] where there is none and none can be made, or it may not be written.
pub fn make_directory(path: impl AsRef<Path>) -> Result<(), WriteError> {
    let path = path.as_ref();
    if !team::speaks() {
        return Ok(());
    }
    let made = match fs::metadata(path) {
        Ok(found) if !found.is_dir() => Err(io::ErrorKind::NotADirectory.into()),
        _ => fs::create_dir_all(path),
    };
    let probe = made.and_then(|()| Temporary::new(path).map(drop));
    probe.map_err(|source| WriteError { path: path.to_path_buf(), source })
}

/// Removes every temporary file and holds back all that would make, rename or remove one for as long as the returned
/// guard lives: end the process while holding it, and files are whole or not there.
///
/// Devices and pipes, which are written directly, may have taken a part.
#[must_use]
pub fn abandon_files() -> impl Drop {
    let mut live = live();
    live.files.clear();
    live.folders.clear();
    live
}

fn live() -> MutexGuard<'static, Live> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The file that a temporary one is renamed to; none for a device or a pipe, which is written directly.
fn target(path: &Path) -> io::Result<Option<PathBuf>> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => Ok(None),
        // A rename would replace a protected file; a plain write would not.
        Ok(found) if found.permissions().readonly() => Err(io::ErrorKind::PermissionDenied.into()),
        Ok(_) => fs::canonicalize(path).map(Some),
        Err(_) => Ok(Some(path.to_path_buf())),
    }
}

/// The directory a path lies in.
fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A temporary file in [`LIVE`]; removed when dropped.
struct Temporary {
    file: File,
    path: PathBuf,
}

impl Temporary {
    /// In a directory, with the permissions of an ordinary file.
    fn new(directory: &Path) -> io::Result<Temporary> {
        fs::metadata(directory)?;
        let mut live = live();
        let (file, path) = builder(0o666).tempfile_in(directory).map_err(plain)?.into_parts();
        let own = path.to_path_buf();
        live.files.push(path);
        Ok(Temporary { file, path: own })
    }

    fn rename(self, path: &Path) -> io::Result<()> {
        let mut live = live();
        let own = live.files.iter().position(|known| **known == *self.path);
        own.map_or(Ok(()), |own| live.files.swap_remove(own).persist(path).map_err(|refused| refused.error))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        live().files.retain(|known| **known != *self.path);
    }
}

/// A folder that is filled under a temporary name and then put in its place, whole or not at all; removed where it is
/// dropped before.
pub struct NewFolder {
    own: PathBuf,
    place: PathBuf,
}

impl NewFolder {
    /// An empty folder whose place will be `place`.
    ///
    /// # Errors
    /// [`WriteError`] where the folder above is missing or not writable.
    pub fn new(place: impl AsRef<Path>) -> Result<NewFolder, WriteError> {
        let place = place.as_ref();
        let make = || {
            fs::metadata(folder(place))?;
            let mut live = live();
            let made = builder(0o777).tempdir_in(folder(place)).map_err(plain)?;
            let own = made.path().to_path_buf();
            live.folders.push(made);
            Ok(own)
        };
        let failed = |source| WriteError { path: place.to_path_buf(), source };
        Ok(NewFolder { own: make().map_err(failed)?, place: place.to_path_buf() })
    }

    /// Where it is filled.
    pub fn path(&self) -> &Path {
        &self.own
    }

    /// Puts it in its place, instead of the folder that may be there.
    ///
    /// # Errors
    /// [`WriteError`] where it cannot be renamed; what is there stays.
    pub fn finish(self) -> Result<(), WriteError> {
        self.rename().map_err(|source| WriteError { path: self.place.clone(), source })
    }

    /// Moves it to its place; what is there is moved into another temporary folder, and back where that fails.
    fn rename(&self) -> io::Result<()> {
        let path = &self.place;
        let mut live = live();
        let Some(own) = live.folders.iter().position(|known| known.path() == self.own) else { return Ok(()) };
        let aside = builder(0o777).tempdir_in(folder(path)).map_err(plain)?;
        let before = aside.path().join("before");
        let is_there = fs::symlink_metadata(path).is_ok();
        if is_there {
            fs::rename(path, &before)?;
        }
        if let Err(refused) = fs::rename(&self.own, path) {
            if is_there {
                fs::rename(&before, path)?;
            }
            return Err(refused);
        }
        // It has gone from there, so nothing is removed.
        let _ = live.folders.swap_remove(own).keep();
        Ok(())
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        live().folders.retain(|known| known.path() != self.own);
    }
}

/// Names with our prefix, and the permissions of ordinary files or folders: tempfile's own default is owner only.
fn builder(mode: u32) -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(".halflight-");
    if let Some(permissions) = ordinary_permissions(mode) {
        builder.permissions(permissions);
    }
    builder
}

/// The system's error, without the name of the temporary file, which means nothing to anyone.
fn plain(error: io::Error) -> io::Error {
    use io::ErrorKind::{NotADirectory, PermissionDenied, ReadOnlyFilesystem, StorageFull};
    match error.kind() {
        kind @ (NotADirectory | PermissionDenied | ReadOnlyFilesystem | StorageFull) => kind.into(),
        _ => error,
    }
}

#[cfg(unix)]
fn ordinary_permissions(mode: u32) -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt;
    Some(Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn ordinary_permissions(_mode: u32) -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name();
        let entries = fs::read_dir(directory).unwrap().map(name);
        entries.map(|n| n.to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_file_is_replaced_and_nothing_else_stays() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("numbers.csv");
        write_whole(&path, b"a much longer first version").unwrap();
        write_whole(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(names(directory.path()), ["numbers.csv"]);
    }

    #[test]
    fn permissions_are_those_of_an_ordinary_file() {
        let directory = tempfile::tempdir().unwrap();
        let (ours, ordinary) = (directory.path().join("a"), directory.path().join("b"));
        write_whole(&ours, b"x").unwrap();
        fs::write(&ordinary, b"x").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions();
        assert_eq!(mode(&ours), mode(&ordinary));
    }

    #[test]
    fn a_missing_directory_is_named_and_not_made() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("absent/picture.png");
        for error in [write_whole(&path, b"x"), check_destination(&path)] {
            let error = error.unwrap_err();
            assert_eq!(error.path, path);
            assert_eq!(error.source.kind(), io::ErrorKind::NotFound);
            let message = error.to_string();
            assert!(message.contains("absent") && !message.contains(".halflight"));
        }
        assert!(names(directory.path()).is_empty());
    }

    #[test]
    fn read_only_files_and_directories_are_left_as_they_were() {
        let directory = tempfile::tempdir().unwrap();
        let (path, folder) = (directory.path().join("kept"), directory.path().join("d"));
        fs::write(&path, b"old").unwrap();
        fs::create_dir(&folder).unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        assert!(write_whole(&path, b"new").is_err());
        assert!(write_whole(&folder, b"new").is_err());
        assert!(check_destination(&path).is_err() && check_destination(&folder).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(directory.path()).len(), 2);
    }

    #[test]
    fn a_folder_is_replaced_whole_or_stays() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("kept");
        let fill = |name: &str| {
            let new = NewFolder::new(&path).unwrap();
            write_whole(new.path().join(name), b"x").unwrap();
            new
        };
        fill("a").finish().unwrap();
        fill("b").finish().unwrap();
        assert_eq!((names(directory.path()), names(&path)), (vec!["kept".into()], vec!["b".into()]));
        drop(fill("c"));
        assert_eq!((names(directory.path()), names(&path)), (vec!["kept".into()], vec!["b".into()]));
    }

    #[test]
    fn a_check_leaves_everything_as_it_was() {
        let directory = tempfile::tempdir().unwrap();
        let (old, new) = (directory.path().join("old"), directory.path().join("new"));
        fs::write(&old, b"old").unwrap();
        check_destination(&old).unwrap();
        check_destination(&new).unwrap();
        make_directory(directory.path()).unwrap();
        assert_eq!(fs::read(&old).unwrap(), b"old");
        assert_eq!(names(directory.path()), ["old"]);
    }

    #[test]
    fn a_file_is_no_directory() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        fs::write(&path, b"old").unwrap();
        let error = make_directory(&path).unwrap_err();
        assert_eq!(error.source.kind(), io::ErrorKind::NotADirectory);
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_stays_a_link() {
        let directory = tempfile::tempdir().unwrap();
        let (target, link) = (directory.path().join("t"), directory.path().join("l"));
        fs::write(&target, b"old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        write_whole(&link, b"new").unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
