//! The files of a bag: their format and compression, told by their first bytes.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::bag::Visitor;
use crate::{BagError, mcap_file, sqlite_file};

/// First bytes of a zstd frame. CDR begins with a zero byte, so the two cannot be confused.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";
/// Longest message that is believed, bytes.
const MESSAGE_LIMIT: u64 = 1 << 30;

/// Undoes rosbag2's compression of single messages. A damaged message stays as it is, and will not decode.
pub(crate) fn decompress(data: &[u8]) -> Vec<u8> {
    let mut plain = Vec::new();
    let whole = data.starts_with(&ZSTD_MAGIC)
        && zstd::Decoder::new(data)
            .and_then(|decoder| decoder.take(MESSAGE_LIMIT).read_to_end(&mut plain))
            .is_ok();
    if whole { plain } else { data.to_vec() }
}

/// One file of a bag.
#[derive(Debug)]
pub(crate) struct BagFile {
    pub(crate) path: PathBuf,
    format: Format,
}

#[derive(Debug)]
enum Format {
    Mcap,
    CompressedMcap,
    Sqlite,
    /// Unpacked, because a database cannot be read as a stream.
    CompressedSqlite(NamedTempFile),
}

impl BagFile {
    /// Tells the format by the first bytes, not by the name.
    pub(crate) fn open(path: PathBuf) -> Result<Self, BagError> {
        let format = Self::format(&path).map_err(|source| BagError::File {
            path: path.clone(),
            source,
        })?;
        match format {
            Ok(format) => Ok(Self { path, format }),
            Err(found) => Err(BagError::NotABag { path, found }),
        }
    }

    /// The format, or else what the file is instead.
    fn format(path: &Path) -> io::Result<Result<Format, String>> {
        let start = first_bytes(File::open(path)?)?;
        if start.starts_with(mcap::MAGIC) {
            return Ok(Ok(Format::Mcap));
        }
        if start.starts_with(SQLITE_MAGIC) {
            return Ok(Ok(Format::Sqlite));
        }
        if !start.starts_with(&ZSTD_MAGIC) {
            return Ok(Err(describe(&start)));
        }
        let start = first_bytes(zstd::Decoder::new(File::open(path)?)?)?;
        if start.starts_with(mcap::MAGIC) {
            return Ok(Ok(Format::CompressedMcap));
        }
        if !start.starts_with(SQLITE_MAGIC) {
            return Ok(Err(format!("compressed, {}", describe(&start))));
        }
        let mut unpacked = NamedTempFile::new()?;
        io::copy(&mut zstd::Decoder::new(File::open(path)?)?, &mut unpacked)?;
        Ok(Ok(Format::CompressedSqlite(unpacked)))
    }

    /// Shows the file to `visitor`; returns what is wrong with it.
    pub(crate) fn visit(&self, visitor: &mut dyn Visitor) -> Result<Vec<String>, BagError> {
        let open = || File::open(&self.path);
        let failed = |source| BagError::File {
            path: self.path.clone(),
            source,
        };
        let database = match &self.format {
            Format::Mcap => {
                let source = BufReader::new(open().map_err(failed)?);
                return Ok(mcap_file::visit(source, visitor));
            }
            Format::CompressedMcap => {
                let source = open().and_then(zstd::Decoder::new).map_err(failed)?;
                return Ok(mcap_file::visit(BufReader::new(source), visitor));
            }
            Format::Sqlite => self.path.as_path(),
            Format::CompressedSqlite(unpacked) => unpacked.path(),
        };
        match sqlite_file::visit(database, visitor) {
            Ok(()) => Ok(Vec::new()),
            Err(source) => Err(BagError::Database {
                path: self.path.clone(),
                source,
            }),
        }
    }
}

fn describe(start: &[u8]) -> String {
    if start.is_empty() {
        "an empty file".to_owned()
    } else if start.starts_with(b"#ROSBAG") {
        "a bag of ROS 1, which cannot be read".to_owned()
    } else {
        format!("a file that begins with the bytes {start:02x?}")
    }
}

fn first_bytes(source: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source
        .take(SQLITE_MAGIC.len() as u64)
        .read_to_end(&mut bytes)?;
    Ok(bytes)
}
