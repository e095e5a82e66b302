//! `export.json`: which files in a folder an export of ours wrote, so that the next one can tell them from all others.
//!
//! A file counts as ours while it has the size that was written down; one that somebody has changed since is theirs. What
//! an export is about to write is listed before it is written, so that one that is cut short leaves nothing unlisted.

use super::twin_obj;
use crate::error::IoError;
use crate::files::{Durability, read_whole, write_whole};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Name of the file.
pub(super) const LISTING: &str = "export.json";
const FORMAT: &str = "charcloth-export";
const VERSION: u32 = 1;

/// Files that several formats have, and that come out the same for all of them if their frames are the same.
const SHARED: [&str; 1] = [twin_obj::NAME];

/// Sizes of files by name [bytes]; none while a file is being written.
type Sizes = BTreeMap<String, Option<u64>>;

/// What `export.json` says.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Listing {
    format: String,
    version: u32,
    /// Files by the format they are of.
    exports: BTreeMap<String, Sizes>,
}

/// An export into a folder, from the look at what is there to the list of what was written.
#[derive(Debug)]
pub(super) struct Claim<'a> {
    folder: &'a Path,
    format: &'a str,
    listing: Listing,
    /// Files of the export before.
    before: Sizes,
    /// Files that another format has, too.
    shared: Vec<String>,
}

impl<'a> Claim<'a> {
    /// Looks whether files of these names may be written, and says in the folder that they are ours. With `force`, files
    /// of others are taken, too.
    pub fn begin(folder: &'a Path, format: &'a str, names: &[String], force: bool) -> Result<Self, IoError> {
        let mut listing = read(folder)?;
        let before = listing.exports.remove(format).unwrap_or_default();
        let is_shared = |name: &&String| {
            let path = folder.join(name);
            let listed = |sizes: &Sizes| sizes.get(*name).is_some_and(|size| is_ours(&path, *size));
            !force && SHARED.contains(&name.as_str()) && listing.exports.values().any(listed)
        };
        let shared: Vec<String> = names.iter().filter(is_shared).cloned().collect();
        let theirs = names.iter().filter(|name| !shared.contains(name)).find(|name| {
            let path = folder.join(name);
            path.symlink_metadata().is_ok() && !before.get(*name).is_some_and(|size| is_ours(&path, *size))
        });
        if let Some(name) = theirs.filter(|_| !force) {
            let of_other = listing.exports.iter().find_map(|(other, sizes)| Some((other, *sizes.get(name)?)));
            let problem = match (of_other, before.contains_key(name)) {
                (Some((other, size)), _) if is_ours(&folder.join(name), size) => {
                    format!("an export in the format {other} wrote this file")
                }
                (Some(_), _) | (None, true) => "this file has been changed since it was exported".to_string(),
                (None, false) => "there is a file that no export wrote".to_string(),
            };
            let hint = "export into another folder with --output, or replace it with --force";
            return Err(IoError::content(&folder.join(name), problem, hint));
        }
        for sizes in listing.exports.values_mut() {
            sizes.retain(|name, _| !names.contains(name) || shared.contains(name));
        }
        let mut claim = Self { folder, format, listing, before, shared };
        let mut claimed = claim.before.clone();
        claimed.extend(names.iter().map(|name| (name.clone(), None)));
        claim.write(claimed)?;
        Ok(claim)
    }

    /// Files that an export in another format wrote and still needs: they may be kept, not changed.
    pub fn shared(&self) -> &[String] {
        &self.shared
    }

    /// Removes what the export before wrote and this one has not, and lists what there is now. Says how many files went.
    pub fn finish(mut self, written: &[PathBuf]) -> Result<usize, IoError> {
        let mut sizes = Sizes::new();
        for path in written {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let size = fs::metadata(path).map_err(|error| IoError::system("read", path, &error))?.len();
            sizes.insert(name, Some(size));
        }
        let mut removed = 0;
        for (name, size) in std::mem::take(&mut self.before) {
            let path = self.folder.join(&name);
            let is_needed = sizes.contains_key(&name) || self.shared.contains(&name);
            if is_needed || !is_plain(&name) || !is_ours(&path, size) {
                continue;
            }
            match fs::remove_file(&path) {
                Ok(()) => removed += 1,
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(error) => return Err(IoError::system("remove", &path, &error)),
            }
        }
        self.write(sizes)?;
        Ok(removed)
    }

    /// After an error: lists what is there, of this export and of the one before, so that the next can go on. An export
    /// that left nothing leaves no list either.
    pub fn abandon(mut self) {
        let listed = self.listing.exports.remove(self.format).unwrap_or_default();
        let there: Sizes = listed.into_iter().filter(|(name, _)| self.folder.join(name).exists()).collect();
        // The error to report is the one that ended the export.
        let _ = match there.is_empty() && self.listing.exports.is_empty() {
            true => fs::remove_file(self.folder.join(LISTING)).map_err(|_| ()),
            false => self.write(there).map_err(|_| ()),
        };
    }

    fn write(&mut self, sizes: Sizes) -> Result<(), IoError> {
        self.listing.exports.insert(self.format.to_string(), sizes);
        self.listing.exports.retain(|_, sizes| !sizes.is_empty());
        (self.listing.format, self.listing.version) = (FORMAT.to_string(), VERSION);
        write_whole(&self.folder.join(LISTING), Durability::Process, |out| {
            serde_json::to_writer_pretty(&mut *out, &self.listing)?;
            out.write_all(b"\n")
        })
    }
}

/// Whether a name is that of a file in the folder itself: a listing that was tampered with must not reach elsewhere.
fn is_plain(name: &str) -> bool {
    Path::new(name).file_name().is_some_and(|plain| plain == name)
}

/// Whether a file is still as it was listed.
fn is_ours(path: &Path, size: Option<u64>) -> bool {
    path.symlink_metadata().is_ok_and(|there| there.is_file() && size.is_none_or(|size| there.len() == size))
}

fn read(folder: &Path) -> Result<Listing, IoError> {
    let path = folder.join(LISTING);
    if !path.exists() {
        return Ok(Listing::default());
    }
    let hint = "export into another folder with --output, or remove it";
    let listing: Listing = serde_json::from_slice(&read_whole(&path)?)
        .map_err(|error| IoError::at_line(&path, error.line(), format!("not a list of exports ({error})"), hint))?;
    if listing.format != FORMAT || listing.version != VERSION {
        return Err(IoError::content(&path, "not a list of exports that this program reads", hint));
    }
    Ok(listing)
}
