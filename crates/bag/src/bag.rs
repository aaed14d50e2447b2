//! A bag: a folder of rosbag2 or a lone file, in MCAP or sqlite3.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::definition::{Definition, short_name};
use crate::standard::standard_definition;
use crate::{BagError, mcap_file, metadata, sqlite_file};

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Name, as `/joint_states`.
    pub name: String,
    /// Type, as `sensor_msgs/msg/JointState`; empty if the bag does not tell.
    pub type_name: String,
    /// Number of messages.
    pub count: u64,
    encoding: String,
    definition: String,
    serialization: String,
}

impl Topic {
    /// The definition that the bag carries for this topic's messages, else the standard one of its type.
    ///
    /// # Errors
    /// If there is neither, or it cannot be understood, or messages are not in CDR.
    pub fn definition(&self) -> Result<Definition, BagError> {
        let wrong = |reason: String| BagError::Definition {
            type_name: self.type_name.clone(),
            reason,
        };
        if self.serialization != "cdr" {
            let found = &self.serialization;
            return Err(wrong(format!(
                "expected messages in cdr, found \"{found}\""
            )));
        }
        if self.encoding == "ros2msg" && !self.definition.is_empty() {
            return Definition::parse(&self.type_name, &self.definition);
        }
        match standard_definition(&short_name(&self.type_name)) {
            Some(text) => Definition::parse(&self.type_name, text),
            None => Err(wrong(format!(
                "expected one in ros2msg in the bag, or a standard type; found encoding \"{}\"",
                self.encoding
            ))),
        }
    }
}

/// A message as the bag holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Index of its topic in [`Bag::topics`].
    pub topic: usize,
    /// When it was recorded, ns.
    pub log_time_ns: i64,
    /// CDR with its four bytes of encapsulation.
    pub data: Vec<u8>,
}

/// A bag that can be read.
#[derive(Debug)]
pub struct Bag {
    files: Vec<BagFile>,
    topics: Vec<Topic>,
    warnings: Vec<String>,
}

impl Bag {
    /// Opens a rosbag2 folder, with or without its `metadata.yaml`, or a lone `.mcap` or `.db3`, each also compressed
    /// with zstd as a whole; then looks through it for its topics.
    ///
    /// # Errors
    /// If there is no bag at `path`, or nothing in it can be read. A bag that can be read in part gives
    /// [`Bag::warnings`].
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let mut warnings = Vec::new();
        let mut topics = Topics::default();
        let mut files = Vec::new();
        let mut damage = None;
        for path in metadata::files_of(path, &mut warnings)? {
            let file = BagFile::open(path)?;
            let before = topics.messages();
            let faults = file.visit(&mut topics)?;
            let read = topics.messages() - before;
            let path = file.path.display();
            warnings.extend(
                faults.iter().map(|fault| {
                    format!("{path}: {fault}; {read} messages of this file can be read")
                }),
            );
            if let Some(reason) = faults.into_iter().next() {
                damage.get_or_insert((file.path.clone(), reason));
            }
            files.push(file);
        }
        if let (0, Some((path, reason))) = (topics.messages(), damage) {
            return Err(BagError::Damaged { path, reason });
        }
        for warning in &warnings {
            tracing::warn!("{warning}");
        }
        Ok(Self {
            files,
            topics: topics.found,
            warnings,
        })
    }

    /// Topics in the order of their appearance.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Index of the topic with this name; a missing slash at the start is forgiven.
    ///
    /// # Errors
    /// Names the topics that the bag has.
    pub fn topic(&self, name: &str) -> Result<usize, BagError> {
        let bare = name.trim_start_matches('/');
        self.topics
            .iter()
            .position(|topic| topic.name.trim_start_matches('/') == bare)
            .ok_or_else(|| BagError::NoTopic {
                wanted: name.to_owned(),
                found: self.topic_list(),
            })
    }

    /// All topics with their types, for people.
    pub fn topic_list(&self) -> String {
        let topics: Vec<_> = self
            .topics
            .iter()
            .map(|topic| format!("{} ({}, {})", topic.name, topic.type_name, topic.count))
            .collect();
        if topics.is_empty() {
            "no topics".to_owned()
        } else {
            topics.join(", ")
        }
    }

    /// What is wrong with the bag, though it can be read in part.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// All messages of the topics with these indices, in log-time order.
    ///
    /// # Errors
    /// If a file can no longer be read.
    pub fn messages(&self, topics: &[usize]) -> Result<Vec<Message>, BagError> {
        let mut collect = Collect {
            bag: self,
            wanted: topics,
            messages: Vec::new(),
        };
        for file in &self.files {
            file.visit(&mut collect)?;
        }
        let mut messages = collect.messages;
        messages.sort_by_key(|message| message.log_time_ns);
        Ok(messages)
    }
}

/// A topic as a file tells of it.
pub(crate) struct FoundTopic<'a> {
    pub(crate) name: &'a str,
    pub(crate) type_name: &'a str,
    /// Of the definition: `ros2msg`, `ros2idl` or empty.
    pub(crate) encoding: &'a str,
    pub(crate) definition: &'a str,
    /// Of the messages: `cdr`.
    pub(crate) serialization: &'a str,
}

/// Is shown what a file holds.
pub(crate) trait Visitor {
    /// Takes a topic and gives it a number.
    fn topic(&mut self, topic: FoundTopic<'_>) -> usize;
    /// Takes a message of the topic with this number.
    fn message(&mut self, topic: usize, log_time_ns: i64, data: &[u8]);
}

/// Gathers topics and counts their messages.
#[derive(Default)]
struct Topics {
    found: Vec<Topic>,
}

impl Topics {
    fn messages(&self) -> u64 {
        self.found.iter().map(|topic| topic.count).sum()
    }
}

impl Visitor for Topics {
    fn topic(&mut self, topic: FoundTopic<'_>) -> usize {
        index_of(&self.found, &topic).unwrap_or_else(|| {
            self.found.push(Topic {
                name: topic.name.to_owned(),
                type_name: topic.type_name.to_owned(),
                count: 0,
                encoding: topic.encoding.to_owned(),
                definition: topic.definition.to_owned(),
                serialization: topic.serialization.to_owned(),
            });
            self.found.len() - 1
        })
    }

    fn message(&mut self, topic: usize, _: i64, _: &[u8]) {
        if let Some(topic) = self.found.get_mut(topic) {
            topic.count += 1;
        }
    }
}

/// Gathers the messages of some topics.
struct Collect<'a> {
    bag: &'a Bag,
    wanted: &'a [usize],
    messages: Vec<Message>,
}

impl Visitor for Collect<'_> {
    fn topic(&mut self, topic: FoundTopic<'_>) -> usize {
        index_of(&self.bag.topics, &topic).unwrap_or(usize::MAX)
    }

    fn message(&mut self, topic: usize, log_time_ns: i64, data: &[u8]) {
        if self.wanted.contains(&topic) {
            self.messages.push(Message {
                topic,
                log_time_ns,
                data: decompress(data),
            });
        }
    }
}

fn index_of(topics: &[Topic], found: &FoundTopic<'_>) -> Option<usize> {
    topics
        .iter()
        .position(|topic| topic.name == found.name && topic.type_name == found.type_name)
}

/// First bytes of a zstd frame. CDR begins with a zero byte, so the two cannot be confused.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";
/// Longest message that is believed, bytes.
const MESSAGE_LIMIT: u64 = 1 << 30;

/// Undoes rosbag2's compression of single messages. A damaged message stays as it is, and will not decode.
fn decompress(data: &[u8]) -> Vec<u8> {
    let mut plain = Vec::new();
    let whole = data.starts_with(&ZSTD_MAGIC)
        && zstd::Decoder::new(data)
            .and_then(|decoder| decoder.take(MESSAGE_LIMIT).read_to_end(&mut plain))
            .is_ok();
    if whole { plain } else { data.to_vec() }
}

/// One file of a bag.
#[derive(Debug)]
struct BagFile {
    path: PathBuf,
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
    fn open(path: PathBuf) -> Result<Self, BagError> {
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
    fn visit(&self, visitor: &mut dyn Visitor) -> Result<Vec<String>, BagError> {
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
