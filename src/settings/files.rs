//! Files of a user, read with bounds.
//!
//! A scenario may name any file, and a message may show a part of it. So what is read is a regular
//! file (a device or pipe may never end, or block), of a bounded size, and its name ends as files of
//! its kind do: of another file, such as one of passwords, not a letter is read or shown.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// What is read of a kind of file.
#[derive(Clone, Copy, Debug)]
pub struct ReadLimit {
    /// What its name ends with, without the dot.
    pub ending: &'static str,
    /// The most bytes that are read.
    pub most_bytes: u64,
}

impl ReadLimit {
    /// Tunnels, vehicles, scenarios and studies. The lamps, devices and obstacles that a file may
    /// have take a tenth of this.
    pub const TOML: Self = Self {
        ending: "toml",
        most_bytes: 1 << 20,
    };
    /// Tables of measured values. In memory a value takes some 16 times its bytes.
    pub const CSV: Self = Self {
        ending: "csv",
        most_bytes: 8 << 20,
    };
    /// Recorded sensor data: a day of fixes at 10 Hz.
    pub const RECORDED: Self = Self {
        ending: "csv",
        most_bytes: 256 << 20,
    };
    /// Maps: the tracks of a country.
    pub const GEOJSON: Self = Self {
        ending: "geojson",
        most_bytes: 256 << 20,
    };
    /// Meshes: 200,000 triangles with normals and texture.
    pub const OBJ: Self = Self {
        ending: "obj",
        most_bytes: 32 << 20,
    };
    /// What the program itself has written about a study or a data set: a line for each input.
    pub const JSON: Self = Self {
        ending: "json",
        most_bytes: 8 << 20,
    };
}

/// Opens a file to be read; fails where it is a device, a pipe or a folder.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // To open a pipe would wait for its writer.
    if !fs::metadata(path)?.is_file() {
        return Err(refused("it is no regular file"));
    }
    File::open(path)
}

fn refused(why: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why.into())
}

/// Reads all of a file; fails where it is of another kind, no regular file, or too large.
pub fn read_bytes(path: &Path, kind: ReadLimit) -> io::Result<Vec<u8>> {
    // Links are followed: a link may have any name.
    let real = fs::canonicalize(path)?;
    let file = open_regular(&real)?;
    let ending = real.extension().unwrap_or_default();
    if !ending.eq_ignore_ascii_case(kind.ending) {
        return Err(refused(format!(
            "its name does not end with .{}, as that of such a file must",
            kind.ending
        )));
    }
    read_bounded(file, kind.most_bytes)
}

/// The size that a file system tells is no bound: some tell 0, and a file may grow.
fn read_bounded(source: impl Read, most_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.take(most_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most_bytes {
        let most = most_bytes >> 20;
        return Err(refused(format!("it is larger than {most} MiB")));
    }
    Ok(bytes)
}

/// As [`read_bytes`], of a text in UTF-8.
pub fn read_text(path: &Path, kind: ReadLimit) -> io::Result<String> {
    let bytes = read_bytes(path, kind)?;
    String::from_utf8(bytes).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        let why = format!("it is no text: byte {byte} is not UTF-8");
        io::Error::new(io::ErrorKind::InvalidData, why)
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Provokes: a device that never ends, a pipe that blocks, a file by another name or behind a
    /// link, one that is too large.
    #[test]
    fn only_bounded_regular_files_of_their_kind_are_read() {
        let folder = std::env::temp_dir().join(format!("metrotwin-files-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let refused = |path: &Path| read_text(path, ReadLimit::TOML).unwrap_err().to_string();
        let secret = folder.join("secret");
        fs::write(&secret, "root:x").unwrap();
        assert!(refused(&secret).contains(".toml"));
        assert!(refused(&folder).contains("no regular file"));
        let large = folder.join("large.toml");
        fs::write(&large, vec![b'#'; (1 << 20) + 1]).unwrap();
        assert!(refused(&large).contains("larger than 1 MiB"));
        let mut long = io::repeat(b'#').take(4 << 20);
        let error = read_bounded(&mut long, 1 << 20).unwrap_err();
        assert!(error.to_string().contains("larger than 1 MiB"), "{error}");
        assert_eq!(long.limit(), (3 << 20) - 1);
        #[cfg(unix)]
        {
            assert!(refused(Path::new("/dev/zero")).contains("no regular file"));
            let link = folder.join("link.toml");
            std::os::unix::fs::symlink(&secret, &link).unwrap();
            assert!(refused(&link).contains(".toml"));
            let pipe = folder.join("pipe.toml");
            let made = std::process::Command::new("mkfifo").arg(&pipe).status();
            if made.is_ok_and(|status| status.success()) {
                assert!(refused(&pipe).contains("no regular file"));
            }
        }
        fs::write(folder.join("right.toml"), "a = 1").unwrap();
        assert_eq!(
            read_text(&folder.join("right.toml"), ReadLimit::TOML).unwrap(),
            "a = 1"
        );
        fs::remove_dir_all(&folder).unwrap();
    }
}
