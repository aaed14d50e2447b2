//! Samples and estimates on disk: rosbag2 bags in MCAP and sqlite3, read by the definitions that they carry.

mod bag;
mod cdr;
mod choice;
mod definition;
mod encode;
mod error;
mod mcap_file;
mod measured;
mod message;
mod metadata;
mod reading;
mod record;
mod samples;
mod sqlite_file;
mod standard;
mod storage;
#[cfg(test)]
mod tests;
mod value;
mod writer;

pub use bag::{Bag, Message, Topic};
pub use cdr::{CdrError, decode};
pub use choice::TopicChoice;
pub use definition::Definition;
pub use error::BagError;
pub use measured::{MeasuredRecording, read_measured};
pub use record::topics;
pub use samples::{Recording, TopicReport, Unusable, read_samples};
pub use value::Value;
pub use writer::BagWriter;
