//! What can be wrong with a bag.

use std::path::PathBuf;

/// Why a bag could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// A file or folder could not be read or written.
    #[error("{path}: {source}")]
    File {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The path holds nothing that could be a bag.
    #[error(
        "{path} is not a bag: expected a .mcap or .db3 file, or a folder with such files, found {found}"
    )]
    NotABag {
        /// The file or folder.
        path: PathBuf,
        /// What is there.
        found: String,
    },
    /// A bag's file is damaged so that nothing can be read.
    #[error("{path} is damaged: {reason}")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the expected and the found value.
        reason: String,
    },
    /// The database of a sqlite3 bag could not be read.
    #[error("{path} cannot be read as a sqlite3 bag: {source}")]
    Database {
        /// The file.
        path: PathBuf,
        /// The database's reason.
        source: rusqlite::Error,
    },
    /// The bag has no such topic.
    #[error("the bag has no topic {wanted}; it has {found}")]
    NoTopic {
        /// The topic that was asked for.
        wanted: String,
        /// Topics that the bag has, with their types.
        found: String,
    },
    /// No topic, or more than one, can serve as a source.
    #[error("{what}: {fitting}; name one with {option}. The bag has {found}")]
    Choice {
        /// What is looked for.
        what: &'static str,
        /// How many topics fit, and which.
        fitting: String,
        /// The option that names the topic.
        option: &'static str,
        /// Topics that the bag has, with their types.
        found: String,
    },
    /// A topic's type cannot be a source of joint positions or torques.
    #[error("topic {topic} is {found}, expected one of {expected}")]
    TopicType {
        /// The topic.
        topic: String,
        /// Types that can be read.
        expected: String,
        /// The topic's type.
        found: String,
    },
    /// The chosen topics gave no sample.
    #[error("no sample could be read: {reason}")]
    NoSample {
        /// Counts, and the first reason.
        reason: String,
    },
    /// A message definition cannot be understood.
    #[error("definition of {type_name}: {reason}")]
    Definition {
        /// The message type.
        type_name: String,
        /// What is wrong, with the expected and the found value.
        reason: String,
    },
    /// The bag could not be written.
    #[error("{path} cannot be written: {reason}")]
    Write {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        reason: String,
    },
}
