//! Bags written as MCAP: a lone file, or a rosbag2 folder.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};

use crate::BagError;
use crate::definition::full_definition;
use crate::encode::Encoder;
use crate::message::TopicMessage;

/// Writes a bag: profile `ros2`, messages in CDR, their definitions as `ros2msg`, chunks compressed with zstd. The
/// same messages give the same bytes.
pub struct BagWriter {
    path: PathBuf,
    folder: Option<PathBuf>,
    mcap: Writer<BufWriter<File>>,
    channels: HashMap<String, Channel>,
    /// Stamps of the first and the last message, ns.
    span_ns: Option<(u64, u64)>,
}

struct Channel {
    id: u16,
    type_name: String,
    count: u32,
}

impl BagWriter {
    /// Starts a bag at `path`: a lone file where the name ends in `.mcap`, else a rosbag2 folder with one file. An
    /// earlier bag of the same name is replaced.
    ///
    /// # Errors
    /// If a file or folder cannot be made.
    pub fn create(path: &Path) -> Result<Self, BagError> {
        Self::with_options(path, WriteOptions::new())
    }

    /// Starts a bag with another way of compressing.
    pub(crate) fn with_options(path: &Path, options: WriteOptions) -> Result<Self, BagError> {
        let lone = path
            .extension()
            .is_some_and(|extension| extension == "mcap");
        let file = if lone {
            path.to_owned()
        } else {
            fs::create_dir_all(path).map_err(|error| failed(path, &error))?;
            let name = path.file_name().unwrap_or("bag".as_ref());
            path.join(format!("{}_0.mcap", name.to_string_lossy()))
        };
        let options = options
            .profile("ros2")
            .library(concat!("palpate ", env!("CARGO_PKG_VERSION")))
            .compression_threads(0);
        let mcap = File::create(&file)
            .map_err(McapError::from)
            .and_then(|file| options.create(BufWriter::new(file)))
            .map_err(|error| mcap_failed(&file, &error))?;
        Ok(Self {
            path: file,
            folder: (!lone).then(|| path.to_owned()),
            mcap,
            channels: HashMap::new(),
            span_ns: None,
        })
    }

    /// Writes one message, recorded at `stamp_ns`.
    pub(crate) fn write<M: TopicMessage>(
        &mut self,
        topic: &str,
        stamp_ns: i64,
        message: &M,
    ) -> Result<(), BagError> {
        let time_ns = u64::try_from(stamp_ns).unwrap_or(0);
        let (channel_id, sequence) = self.channel::<M>(topic)?;
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.mcap
            .write_to_known_channel(&header, &Encoder::message(message))
            .map_err(|error| mcap_failed(&self.path, &error))?;
        self.span_ns = Some(match self.span_ns {
            Some((first, last)) => (first.min(time_ns), last.max(time_ns)),
            None => (time_ns, time_ns),
        });
        Ok(())
    }

    /// Number of the topic's channel, and of its next message.
    fn channel<M: TopicMessage>(&mut self, topic: &str) -> Result<(u16, u32), BagError> {
        if !self.channels.contains_key(topic) {
            let type_name = M::TYPE.replacen('/', "/msg/", 1);
            let definition = full_definition(M::TYPE)?;
            let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), String::new())]);
            let id = self
                .mcap
                .add_schema(&type_name, "ros2msg", definition.as_bytes())
                .and_then(|schema| self.mcap.add_channel(schema, topic, "cdr", &metadata))
                .map_err(|error| mcap_failed(&self.path, &error))?;
            let channel = Channel {
                id,
                type_name,
                count: 0,
            };
            self.channels.insert(topic.to_owned(), channel);
        }
        let channel = self.channels.get_mut(topic);
        Ok(channel.map_or((0, 0), |channel| {
            channel.count += 1;
            (channel.id, channel.count)
        }))
    }

    /// Completes the bag. A bag that is dropped without this still holds its messages, but a folder lacks its
    /// `metadata.yaml`.
    ///
    /// # Errors
    /// If the rest cannot be written.
    pub fn finish(mut self) -> Result<(), BagError> {
        self.mcap
            .finish()
            .map_err(|error| mcap_failed(&self.path, &error))?;
        match &self.folder {
            Some(folder) => {
                let path = folder.join("metadata.yaml");
                fs::write(&path, self.metadata()).map_err(|error| failed(&path, &error))
            }
            None => Ok(()),
        }
    }

    /// rosbag2's metadata, version 9. Strings are quoted as JSON quotes them, which YAML reads too.
    fn metadata(&self) -> String {
        let mut topics: Vec<_> = self.channels.iter().collect();
        topics.sort_by_key(|(_, channel)| channel.id);
        let (first, last) = self.span_ns.unwrap_or((0, 0));
        let duration = last - first;
        let count: u64 = topics
            .iter()
            .map(|(_, channel)| u64::from(channel.count))
            .sum();
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let mut text = format!(
            "rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  duration:
    nanoseconds: {duration}
  starting_time:
    nanoseconds_since_epoch: {first}
  message_count: {count}
  compression_format: \"\"
  compression_mode: \"\"
  relative_file_paths:
    - {name:?}
  files:
    - path: {name:?}
      starting_time:
        nanoseconds_since_epoch: {first}
      duration:
        nanoseconds: {duration}
      message_count: {count}
  custom_data: ~
  ros_distro: jazzy
  topics_with_message_count:
"
        );
        for (topic, channel) in topics {
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "    - topic_metadata:
        name: {topic:?}
        type: {:?}
        serialization_format: cdr
        offered_qos_profiles: []
        type_description_hash: \"\"
      message_count: {}
",
                channel.type_name, channel.count
            );
        }
        text
    }
}

fn failed(path: &Path, error: &std::io::Error) -> BagError {
    BagError::Write {
        path: path.to_owned(),
        reason: error.to_string(),
    }
}

/// Says what the system said, where it was the system.
fn mcap_failed(path: &Path, error: &McapError) -> BagError {
    match error {
        McapError::Io(error) => failed(path, error),
        error => BagError::Write {
            path: path.to_owned(),
            reason: error.to_string(),
        },
    }
}
