//! Which files of a folder a command has written: a list in the folder, `files.txt`, that names each
//! file before it is begun. So it holds after a kill too, and nothing that it does not name is ever
//! removed or written over.

use super::whole::{locked, open_in_place, part_name, remove, taken, write_whole};
use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Component, Path, PathBuf};

/// Name of the list in its folder.
pub(crate) const LIST: &str = "files.txt";

/// The list of a folder, being written; as long as it is open, no other command opens it.
#[derive(Debug)]
pub(crate) struct Listing {
    folder: PathBuf,
    command: &'static str,
    file: File,
    /// What an interrupted command before this one has listed.
    earlier: BTreeSet<String>,
    /// What this one has.
    announced: BTreeSet<String>,
}

impl Listing {
    /// What the command has listed in a folder before; `None` where it has not.
    pub fn read(folder: &Path, command: &str) -> io::Result<Option<BTreeSet<String>>> {
        let path = folder.join(LIST);
        match fs::symlink_metadata(&path) {
            Ok(about) if about.is_file() => Ok(parse(&fs::read(&path)?, command)),
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => Ok(None),
        }
    }

    /// Goes on with the list of a folder, or begins one. `command` is the one whose files they are.
    pub fn open(folder: &Path, command: &'static str) -> io::Result<Self> {
        let path = folder.join(LIST);
        let file = open_in_place(&path, OpenOptions::new().read(true).append(true))?;
        let mut file = locked(file, &path)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let earlier = parse(&bytes, command).ok_or_else(|| of_another(&path, &bytes, command))?;
        let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
        file.set_len(whole as u64)?;
        if whole == 0 {
            file.write_all(heading(command).as_bytes())?;
        }
        Ok(Self {
            folder: folder.to_owned(),
            command,
            file,
            earlier,
            announced: BTreeSet::new(),
        })
    }

    /// Goes on with the list of a folder, or begins one, with names of files that are about to be written.
    /// In a folder where one of them is somebody else's nothing is made.
    pub fn claim(folder: &Path, command: &'static str, names: Vec<String>) -> io::Result<Self> {
        if let Some(name) = foreign(folder, command, names.iter().map(String::as_str))? {
            return Err(why_foreign(folder, command, name));
        }
        let mut listing = Self::open(folder, command)?;
        listing.announce(names)?;
        Ok(listing)
    }

    /// Lists files that are about to be written, by their paths below the folder. One that is there and
    /// not listed is somebody else's, and an error; so is one in a folder that is a link.
    pub fn announce(&mut self, names: impl IntoIterator<Item = String>) -> io::Result<()> {
        let mut lines = String::new();
        for name in names {
            if !is_plain(&name) {
                let what = format!("`{}` is no name that can be listed", name.escape_debug());
                return Err(io::Error::new(ErrorKind::InvalidInput, what));
            }
            let is_listed = self.earlier.contains(&name) || self.announced.contains(&name);
            if let Some(path) = in_the_way(&self.folder, &name, is_listed) {
                return Err(taken(&path));
            }
            if !is_listed {
                lines += &format!("{name}\n");
            }
            self.announced.insert(name);
        }
        if !lines.is_empty() {
            self.file.write_all(lines.as_bytes())?;
            self.file.sync_data()?;
        }
        Ok(())
    }

    /// Removes what is listed and was not announced this time, and lists the rest in order.
    pub fn close(self) -> io::Result<()> {
        let stale = self.earlier.difference(&self.announced);
        remove_all(&self.folder, &stale.cloned().collect())?;
        let text = text(self.command, &self.announced);
        write_whole(&self.folder.join(LIST), text.as_bytes())
    }

    /// Removes all that the command has listed in a folder, and the list; folders that are empty then
    /// go too.
    #[cfg(any(test, feature = "twin"))]
    pub fn clear(folder: &Path, command: &str) -> io::Result<()> {
        if let Some(listed) = Self::read(folder, command)? {
            remove_all(folder, &listed)?;
            remove(&folder.join(LIST))?;
        }
        Ok(())
    }
}

/// The first of some names below a folder that is taken by a file which the command has not listed.
pub(crate) fn foreign<'a>(
    folder: &Path,
    command: &str,
    names: impl IntoIterator<Item = &'a str>,
) -> io::Result<Option<&'a str>> {
    let listed = Listing::read(folder, command)?;
    let is_ours = |name: &str| match &listed {
        Some(listed) => name == LIST || listed.contains(name),
        None => false,
    };
    let mut names = names.into_iter().chain([LIST]);
    Ok(names.find(|name| in_the_way(folder, name, is_ours(name)).is_some()))
}

/// Also of a link that leads nowhere.
fn is_there(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// What keeps a file from being written: a folder above it that is a link, and where it is not listed,
/// what has its name.
fn in_the_way(folder: &Path, name: &str, is_listed: bool) -> Option<PathBuf> {
    let path = folder.join(name);
    let own = [part_name(&path), path];
    let own = own.into_iter().filter(|path| !is_listed && is_there(path));
    links(folder, name).chain(own).next()
}

/// Folders between a folder and a file below it that are links.
fn links(folder: &Path, name: &str) -> impl Iterator<Item = PathBuf> {
    let above = Path::new(name).ancestors().skip(1);
    let above = above.filter(|path| !path.as_os_str().is_empty());
    let above = above.map(|path| folder.join(path));
    above.filter(|path| path.is_symlink())
}

/// The names in a list; `None` of what the command has not written. What follows the last line break was
/// cut by a loss of power, before its files were begun.
fn parse(bytes: &[u8], command: &str) -> Option<BTreeSet<String>> {
    let text = String::from_utf8_lossy(bytes);
    let heading = heading(command);
    if heading.starts_with(&*text) {
        return Some(BTreeSet::new());
    }
    let lines = text.strip_prefix(&heading)?;
    let whole = lines.rsplit_once('\n').map_or("", |(whole, _)| whole);
    let names = whole.lines().filter(|name| is_plain(name));
    Some(names.map(str::to_owned).collect())
}

const WRITTEN_BY: &str = "# Written here by ";
const MAY_REMOVE: &str = ", which may remove it again:";

fn heading(command: &str) -> String {
    format!("{WRITTEN_BY}{command}{MAY_REMOVE}\n")
}

/// Why the command may not write a file which [`foreign`] has found.
pub(crate) fn why_foreign(folder: &Path, command: &str, name: &str) -> io::Error {
    let path = in_the_way(folder, name, false).unwrap_or_else(|| folder.join(name));
    let is_list = path.file_name().is_some_and(|name| name == LIST);
    let is_file = fs::symlink_metadata(&path).is_ok_and(|about| about.is_file());
    let list = (is_list && is_file).then(|| fs::read(&path));
    match list {
        Some(Ok(list)) => of_another(&path, &list, command),
        _ => taken(&path),
    }
}

/// That a list is another command's, and which one's if it says.
fn of_another(path: &Path, list: &[u8], command: &str) -> io::Error {
    let list = String::from_utf8_lossy(list);
    let heading = list.lines().next().unwrap_or_default();
    let other = heading.strip_prefix(WRITTEN_BY);
    let other = other.and_then(|rest| rest.strip_suffix(MAY_REMOVE));
    let Some(other) = other.filter(|other| *other != command) else {
        return taken(path);
    };
    let folder = path.parent().unwrap_or(path).display();
    let what = format!("{folder} holds the files of `{}`", other.escape_debug());
    io::Error::new(ErrorKind::AlreadyExists, what)
}

fn text(command: &str, names: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let names = names.into_iter();
    names.fold(heading(command), |text, name| text + name.as_ref() + "\n")
}

/// A path that leads to below the folder, on one line.
fn is_plain(name: &str) -> bool {
    let parts = Path::new(name).components();
    !name.is_empty()
        && !name.contains(char::is_control)
        && parts
            .into_iter()
            .all(|part| matches!(part, Component::Normal(_)))
}

/// Removes files below a folder, and the folders that are empty then. Nothing is reached through a
/// link.
fn remove_all(folder: &Path, names: &BTreeSet<String>) -> io::Result<()> {
    let mut folders = BTreeSet::new();
    for name in names {
        if links(folder, name).next().is_some() {
            continue;
        }
        remove(&folder.join(name))?;
        let above = Path::new(name).ancestors().skip(1);
        let above = above.filter(|path| !path.as_os_str().is_empty());
        folders.extend(above.map(|path| folder.join(path)));
    }
    // The deepest first. One that is not empty stays.
    for folder in folders.iter().rev() {
        fs::remove_dir(folder).ok();
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// Fails where a foreign file is removed or written over, a stale one stays, a list leads out of its
    /// folder, or a list that was cut is not read.
    #[test]
    fn only_what_is_listed_is_removed() {
        let base = std::env::temp_dir().join(format!("metrotwin-list-{}", std::process::id()));
        let folder = base.join("folder");
        fs::create_dir_all(folder.join("images/left")).unwrap();
        let write = |name: &str| fs::write(folder.join(name), name).unwrap();
        write("images/holiday.jpg");
        write("notes.txt");
        fs::write(base.join("outside"), "kept").unwrap();
        let names = ["images/left/1.png", "images/left/2.png", "meta.json"].map(str::to_owned);

        let mut first = Listing::open(&folder, "one").unwrap();
        first.announce(names.clone()).unwrap();
        names.iter().for_each(|name| write(name));
        assert!(first.announce(["notes.txt".to_owned()]).is_err());
        assert!(first.announce(["../outside".to_owned()]).is_err());
        assert!(Listing::open(&folder, "one").is_err());
        write("theirs.part");
        assert!(first.announce(["theirs".to_owned()]).is_err());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&base, folder.join("link")).unwrap();
            assert!(first.announce(["link/new".to_owned()]).is_err());
            let found = foreign(&folder, "one", ["link/new"]).unwrap();
            assert_eq!(found, Some("link/new"));
        }
        drop(first);
        // As after a kill: the list goes on, and another command does not take it for its own.
        let error = Listing::open(&folder, "two").unwrap_err().to_string();
        assert!(error.ends_with("holds the files of `one`"), "{error}");
        let claimed = Listing::claim(&folder, "two", vec!["new".to_owned()]);
        assert_eq!(claimed.unwrap_err().to_string(), error);
        let list = fs::read_to_string(folder.join(LIST)).unwrap();
        fs::write(folder.join(LIST), list.clone() + "../outside\nimages/ho").unwrap();
        let mut second = Listing::open(&folder, "one").unwrap();
        second.announce([names[0].clone()]).unwrap();
        second.close().unwrap();
        let there = |name: &str| folder.join(name).exists();
        assert!(there(&names[0]) && !there(&names[1]) && !there(&names[2]));
        assert_eq!(
            foreign(&folder, "one", ["notes.txt"]).unwrap(),
            Some("notes.txt")
        );
        assert_eq!(
            foreign(&folder, "one", [&*names[0], &names[1]]).unwrap(),
            None
        );

        Listing::clear(&folder, "one").unwrap();
        assert!(!there("images/left") && !there(LIST));
        assert!(there("images/holiday.jpg") && there("notes.txt"));
        assert!(base.join("outside").exists());
        fs::remove_dir_all(&base).unwrap();
    }
}
