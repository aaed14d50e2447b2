//! Bags in MCAP files (<https://mcap.dev/spec>), also those that end too early.

use std::collections::HashMap;
use std::io::{self, Read};

use mcap::records::{Record, op};

use crate::bag::{FoundTopic, Visitor};

/// Longest record outside chunks that is believed, bytes.
const RECORD_LIMIT: u64 = 1 << 30;

/// Shows every topic and message of an MCAP stream to `visitor`, in file order. Returns what is wrong with the file,
/// if anything; what stands before the fault has been shown.
pub(crate) fn visit(mut source: impl Read, visitor: &mut dyn Visitor) -> Vec<String> {
    let mut magic = [0; mcap::MAGIC.len()];
    if source.read_exact(&mut magic).is_err() || magic != mcap::MAGIC {
        return vec![format!(
            "expected the MCAP magic bytes {:02x?}, found {magic:02x?}",
            mcap::MAGIC
        )];
    }
    let mut walk = Walk {
        visitor,
        schemas: HashMap::new(),
        channels: HashMap::new(),
        faults: Vec::new(),
    };
    match walk.records(&mut source, false) {
        Ok(End::DataEnd) => {}
        Ok(End::Nothing) => walk.fault("the file ends without its end record".to_owned()),
        Err(error) => walk.fault(format!("the file breaks off: {error}")),
    }
    walk.faults
}

/// Where a run of records ended.
enum End {
    DataEnd,
    Nothing,
}

struct Schema {
    name: String,
    encoding: String,
    text: String,
}

struct Walk<'v> {
    visitor: &'v mut dyn Visitor,
    schemas: HashMap<u16, Schema>,
    /// The visitor's index of each channel's topic.
    channels: HashMap<u16, usize>,
    faults: Vec<String>,
}

impl Walk<'_> {
    /// Keeps the first faults; a damaged file has thousands.
    fn fault(&mut self, fault: String) {
        if self.faults.len() < 8 {
            self.faults.push(fault);
        }
    }

    fn records(&mut self, source: &mut dyn Read, in_chunk: bool) -> io::Result<End> {
        let mut body = Vec::new();
        loop {
            let Some((opcode, length)) = read_start(source)? else {
                return Ok(End::Nothing);
            };
            let mut record = source.take(length);
            match opcode {
                op::DATA_END | op::FOOTER if !in_chunk => return Ok(End::DataEnd),
                op::CHUNK if !in_chunk => {
                    if let Err(error) = self.chunk(&mut record) {
                        self.fault(format!("a chunk is damaged: {error}"));
                    }
                }
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    if length > RECORD_LIMIT {
                        return Err(io::Error::other(format!(
                            "a record of {length} bytes, expected at most {RECORD_LIMIT}"
                        )));
                    }
                    body.clear();
                    record.read_to_end(&mut body)?;
                    if (body.len() as u64) < length {
                        return Err(too_short(length, body.len() as u64));
                    }
                    self.record(opcode, &body);
                }
                _ => {}
            }
            io::copy(&mut record, &mut io::sink())?;
            if record.limit() > 0 {
                return Err(too_short(length, length - record.limit()));
            }
        }
    }

    fn chunk(&mut self, record: &mut dyn Read) -> io::Result<()> {
        let mut sizes = [0; 28]; // start and end time, uncompressed size, checksum
        record.read_exact(&mut sizes)?;
        let name_length = read_u32(record)?;
        let mut compression = String::new();
        record
            .take(name_length.into())
            .read_to_string(&mut compression)?;
        let size = read_u64(record)?;
        let mut content = record.take(size);
        match compression.as_str() {
            "" => self.records(&mut content, true),
            "zstd" => self.records(&mut zstd::Decoder::new(content)?, true),
            "lz4" => self.records(&mut lz4::Decoder::new(content)?, true),
            other => Err(io::Error::other(format!(
                "expected compression zstd, lz4 or none, found \"{other}\""
            ))),
        }?;
        Ok(())
    }

    fn record(&mut self, opcode: u8, body: &[u8]) {
        match mcap::parse_record(opcode, body) {
            Ok(Record::Schema { header, data }) => {
                let schema = Schema {
                    name: header.name,
                    encoding: header.encoding,
                    text: String::from_utf8_lossy(&data).into_owned(),
                };
                self.schemas.insert(header.id, schema);
            }
            Ok(Record::Channel(channel)) => {
                let schema = self.schemas.get(&channel.schema_id);
                let index = self.visitor.topic(FoundTopic {
                    name: &channel.topic,
                    type_name: schema.map_or("", |schema| &schema.name),
                    encoding: schema.map_or("", |schema| &schema.encoding),
                    definition: schema.map_or("", |schema| &schema.text),
                    serialization: &channel.message_encoding,
                });
                self.channels.insert(channel.id, index);
            }
            Ok(Record::Message { header, data }) => match self.channels.get(&header.channel_id) {
                Some(&topic) => {
                    let log_time_ns = i64::try_from(header.log_time).unwrap_or(i64::MAX);
                    self.visitor.message(topic, log_time_ns, &data);
                }
                None => self.fault(format!(
                    "a message of unknown channel {}",
                    header.channel_id
                )),
            },
            Ok(_) => {}
            Err(error) => self.fault(format!("a record is damaged: {error}")),
        }
    }
}

/// Opcode and length of the next record; none at the very end.
fn read_start(source: &mut dyn Read) -> io::Result<Option<(u8, u64)>> {
    let mut opcode = [0];
    loop {
        match source.read(&mut opcode) {
            Ok(0) => return Ok(None),
            Ok(_) => return Ok(Some((opcode[0], read_u64(source)?))),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

fn read_u32(source: &mut dyn Read) -> io::Result<u32> {
    let mut bytes = [0; 4];
    source.read_exact(&mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}

fn read_u64(source: &mut dyn Read) -> io::Result<u64> {
    let mut bytes = [0; 8];
    source.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}

fn too_short(expected: u64, found: u64) -> io::Error {
    io::Error::other(format!(
        "a record of {expected} bytes ends after {found} bytes"
    ))
}
