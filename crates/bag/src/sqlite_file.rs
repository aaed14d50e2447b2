//! Bags in sqlite3 files (rosbag2's `.db3`).

use std::collections::HashMap;
use std::path::Path;

use rusqlite::{Connection, OpenFlags};

use crate::bag::{FoundTopic, Visitor};

/// Shows every topic and message of a database to `visitor`, in log-time order.
pub(crate) fn visit(path: &Path, visitor: &mut dyn Visitor) -> rusqlite::Result<()> {
    let database = open(path)?;
    let definitions = definitions(&database);
    let mut topics = HashMap::new();
    let mut rows = database.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let mut rows = rows.query([])?;
    while let Some(row) = rows.next()? {
        let (name, type_name): (String, String) = (row.get(1)?, row.get(2)?);
        let serialization: String = row.get(3)?;
        let none = (String::new(), String::new());
        let (encoding, definition) = definitions.get(&type_name).unwrap_or(&none);
        let index = visitor.topic(FoundTopic {
            name: &name,
            type_name: &type_name,
            encoding,
            definition,
            serialization: &serialization,
        });
        topics.insert(row.get::<_, i64>(0)?, index);
    }
    let mut rows =
        database.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp")?;
    let mut rows = rows.query([])?;
    while let Some(row) = rows.next()? {
        if let Some(&topic) = topics.get(&row.get::<_, i64>(0)?) {
            let data = row.get_ref(2)?.as_blob_or_null()?.unwrap_or_default();
            visitor.message(topic, row.get(1)?, data);
        }
    }
    Ok(())
}

/// Opens read-only; on a medium that cannot be written, a write-ahead log asks for the immutable mode.
fn open(path: &Path) -> rusqlite::Result<Connection> {
    let database = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    if database
        .prepare("SELECT count(*) FROM sqlite_master")
        .and_then(|mut rows| rows.query_row([], |_| Ok(())))
        .is_ok()
    {
        return Ok(database);
    }
    let path = path.to_string_lossy();
    let path = path
        .replace('%', "%25")
        .replace('?', "%3f")
        .replace('#', "%23");
    Connection::open_with_flags(
        format!("file:{path}?immutable=1"),
        OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI,
    )
}

/// Encoding and text of each type's definition; none in bags older than ROS 2 Iron, which have no such table.
fn definitions(database: &Connection) -> HashMap<String, (String, String)> {
    let read = || -> rusqlite::Result<_> {
        database
            .prepare(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions",
            )?
            .query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?
            .collect()
    };
    read().unwrap_or_default()
}
