//! A bag: a folder of rosbag2 or a lone file, in MCAP or sqlite3.

use std::path::Path;

use crate::definition::{Definition, short_name};
use crate::standard::standard_definitions;
use crate::storage::{BagFile, decompress};
use crate::{BagError, metadata};

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
    /// The definition that the bag carries for this topic's messages, else the known ones of its type, one a version.
    ///
    /// # Errors
    /// If there is none, or it cannot be understood, or messages are not in CDR.
    pub fn definitions(&self) -> Result<Vec<Definition>, BagError> {
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
        let parse = |text: &str| Definition::parse(&self.type_name, text);
        if self.encoding == "ros2msg" && !self.definition.is_empty() {
            return Ok(vec![parse(&self.definition)?]);
        }
        let short_name = short_name(&self.type_name);
        let known: Vec<_> = standard_definitions(&short_name)
            .map(parse)
            .collect::<Result<_, _>>()?;
        if known.is_empty() {
            let found = match self.encoding.as_str() {
                "" => "none (bags before ROS 2 Iron carry none)".to_owned(),
                encoding => format!("encoding \"{encoding}\""),
            };
            return Err(wrong(format!(
                "expected one in ros2msg in the bag, or a type that is known without; found {found}; \
                 `ros2 bag convert` on a machine with this message type writes it into a new bag"
            )));
        }
        Ok(known)
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
