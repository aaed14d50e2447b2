use rusqlite::Connection;

use super::*;
use crate::definition::full_definition;
use crate::encode::Encoder;

/// Messages of [`samples`], as topic number (1 positions, 2 torques), stamp and CDR.
fn messages() -> Vec<(i64, i64, Vec<u8>)> {
    let names = ["shoulder", "elbow"];
    let both = |sample: &JointSample| {
        let stamp = sample.stamp_ns;
        let position = state(stamp, &names, &sample.position, &[]);
        let torque = state(stamp, &names, &[], &sample.external_torque);
        [
            (1, stamp, Encoder::message(&position)),
            (2, stamp, Encoder::message(&torque)),
        ]
    };
    samples().iter().flat_map(both).collect()
}

/// Writes a database as rosbag2 does: before Iron it had no definitions.
fn write_sqlite(path: &Path, messages: &[(i64, i64, Vec<u8>)], definitions: Option<&str>) {
    let database = Connection::open(path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT,
                 offered_qos_profiles TEXT);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
             INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', '');
             INSERT INTO topics VALUES (2, '/torques', 'sensor_msgs/msg/JointState', 'cdr', '');",
        )
        .unwrap();
    for (topic, stamp, data) in messages {
        let insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
        database.execute(insert, (topic, stamp, data)).unwrap();
    }
    if let Some(text) = definitions {
        let create = "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT,
             encoded_message_definition TEXT, type_description_hash TEXT)";
        database.execute(create, ()).unwrap();
        let insert = "INSERT INTO message_definitions VALUES (1, 'sensor_msgs/msg/JointState', 'ros2msg', ?1, '')";
        database.execute(insert, [text]).unwrap();
    }
}

fn assert_reads_samples(path: &Path) {
    let recording = read(path).unwrap();
    assert_eq!(recording.samples, samples());
}

#[test]
fn a_database_is_read_with_and_without_definitions() {
    let full = full_definition("sensor_msgs/JointState").unwrap();
    for definitions in [None, Some(full.as_str())] {
        let (_folder, path) = place("bag.db3");
        write_sqlite(&path, &messages(), definitions);
        assert_reads_samples(&path);
    }
}

#[test]
fn the_definition_in_the_bag_goes_before_the_standard_one() {
    let (_folder, path) = place("bag.db3");
    // Positions and efforts change places.
    let text = full_definition("sensor_msgs/JointState").unwrap();
    let swapped = text
        .replace("] position\n", "] x\n")
        .replace("] effort\n", "] position\n")
        .replace("] x\n", "] effort\n");
    write_sqlite(&path, &messages(), Some(&swapped));
    let recording = read(&path).unwrap();
    assert_eq!(recording.positions.topic, "/torques");
    assert_eq!(recording.samples[0].position, samples()[0].external_torque);
}

#[test]
fn messages_of_a_database_come_in_the_order_of_their_stamps() {
    let (_folder, path) = place("bag.db3");
    let mut reversed = messages();
    reversed.reverse();
    write_sqlite(&path, &reversed, None);
    assert_reads_samples(&path);
}

#[test]
fn single_messages_may_be_compressed() {
    let (_folder, path) = place("bag.db3");
    let compressed: Vec<_> = messages()
        .into_iter()
        .map(|(topic, stamp, data)| {
            let data = zstd::encode_all(data.as_slice(), 0).unwrap();
            (topic, stamp, data)
        })
        .collect();
    write_sqlite(&path, &compressed, None);
    assert_reads_samples(&path);
}

#[test]
fn whole_files_may_be_compressed() {
    let (folder, path) = place("bag.db3");
    write_sqlite(&path, &messages(), None);
    let lone = folder.path().join("bag.mcap");
    write_samples(&lone);
    for path in [path, lone] {
        let plain = std::fs::read(&path).unwrap();
        let compressed = PathBuf::from(format!("{}.zstd", path.display()));
        std::fs::write(&compressed, zstd::encode_all(plain.as_slice(), 0).unwrap()).unwrap();
        assert_reads_samples(&compressed);
    }
}

/// Writes the messages one by one with the given way of compressing chunks.
fn write_mcap(path: &Path, messages: &[(i64, i64, Vec<u8>)], options: mcap::WriteOptions) {
    let mut file = options
        .create(std::fs::File::create(path).unwrap())
        .unwrap();
    let text = full_definition("sensor_msgs/JointState").unwrap();
    let schema = file
        .add_schema("sensor_msgs/msg/JointState", "ros2msg", text.as_bytes())
        .unwrap();
    let channels = ["/joint_states", "/torques"].map(|topic| {
        file.add_channel(schema, topic, "cdr", &Default::default())
            .unwrap()
    });
    for (topic, stamp, data) in messages {
        let header = mcap::records::MessageHeader {
            channel_id: channels[*topic as usize - 1],
            sequence: 0,
            log_time: *stamp as u64,
            publish_time: 0,
        };
        file.write_to_known_channel(&header, data).unwrap();
    }
    file.finish().unwrap();
}

#[test]
fn chunks_may_be_compressed_in_any_way_or_absent() {
    let options = mcap::WriteOptions::new;
    for options in [
        options().compression(Some(mcap::Compression::Zstd)),
        options().compression(Some(mcap::Compression::Lz4)),
        options().compression(None),
        options().use_chunks(false),
        options().chunk_size(Some(100)),
    ] {
        let (_folder, path) = place("bag.mcap");
        write_mcap(&path, &messages(), options);
        assert_reads_samples(&path);
    }
}

#[test]
fn several_files_are_one_bag() {
    let halves = messages();
    let (first, second) = halves.split_at(9); // between the two messages of one sample
    for metadata in [
        None,
        Some(
            "rosbag2_bagfile_information:\n  version: 4\n  relative_file_paths: [b_1.mcap, a/b_0.mcap]\n",
        ),
        Some("rosbag2_bagfile_information: {version: 9, unknown: [1, 2]}"),
        Some("{ not yaml"),
    ] {
        let (_folder, path) = place("bag");
        std::fs::create_dir(&path).unwrap();
        write_mcap(&path.join("b_0.mcap"), first, mcap::WriteOptions::new());
        write_mcap(&path.join("b_1.mcap"), second, mcap::WriteOptions::new());
        if let Some(text) = metadata {
            std::fs::write(path.join("metadata.yaml"), text).unwrap();
        }
        assert_reads_samples(&path);
    }
}

#[test]
fn only_listed_files_belong_to_the_bag_and_missing_ones_are_told() {
    let (_folder, path) = place("bag");
    write_samples(&path);
    std::fs::write(path.join("other.mcap"), "not a bag").unwrap();
    assert_reads_samples(&path);
    let metadata = path.join("metadata.yaml");
    let text = std::fs::read_to_string(&metadata).unwrap();
    let text = text.replace(
        "relative_file_paths:\n",
        "relative_file_paths:\n    - gone.mcap\n",
    );
    std::fs::write(&metadata, text).unwrap();
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.warnings().len(), 1);
    assert!(bag.warnings()[0].contains("gone.mcap, which is not there"));
}

#[test]
fn files_are_taken_in_the_order_of_their_numbers() {
    let (_folder, path) = place("bag");
    std::fs::create_dir(&path).unwrap();
    for number in 0..12 {
        std::fs::write(path.join(format!("bag_{number}.mcap")), "").unwrap();
    }
    let files = crate::metadata::files_of(&path, &mut Vec::new()).unwrap();
    let names: Vec<_> = files
        .iter()
        .map(|file| file.file_name().unwrap().to_str().unwrap().to_owned())
        .collect();
    let expected: Vec<_> = (0..12).map(|number| format!("bag_{number}.mcap")).collect();
    assert_eq!(names, expected);
}

#[test]
fn what_is_no_bag_is_told_what_it_is() {
    let (folder, path) = place("file.mcap");
    let reason = |content: &[u8]| {
        std::fs::write(&path, content).unwrap();
        Bag::open(&path).unwrap_err().to_string()
    };
    assert!(reason(b"").ends_with("found an empty file"));
    assert!(reason(b"#ROSBAG V2.0\n").ends_with("found a bag of ROS 1, which cannot be read"));
    assert!(reason(b"hello").ends_with("begins with the bytes [68, 65, 6c, 6c, 6f]"));
    std::fs::remove_file(&path).unwrap();
    std::fs::write(folder.path().join("notes.txt"), "").unwrap();
    let error = Bag::open(folder.path()).unwrap_err().to_string();
    assert!(error.ends_with("found notes.txt"), "{error}");
    let error = Bag::open(&folder.path().join("absent")).unwrap_err();
    assert!(matches!(error, BagError::File { .. }), "{error}");
}
