//! Bags that are cut short or changed: read in part with a warning, or refused with a reason; never a panic.

use rusqlite::Connection;

use super::*;

/// Reads whatever is there as every user of the crate would.
fn read_all(path: &Path) -> Result<Vec<JointSample>, BagError> {
    let bag = Bag::open(path)?;
    let everything: Vec<_> = (0..bag.topics().len()).collect();
    bag.messages(&everything)?;
    Ok(read_samples(&bag, &arm(), &TopicChoice::default(), TOLERANCE_NS)?.samples)
}

/// An MCAP in small chunks, so that a cut leaves some of them whole.
fn many_chunks(path: &Path) -> Vec<u8> {
    let options = mcap::WriteOptions::new().chunk_size(Some(300));
    let mut bag = BagWriter::with_options(path, options).unwrap();
    for sample in samples() {
        bag.sample(&arm(), &sample).unwrap();
    }
    bag.finish().unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn a_cut_mcap_gives_what_is_left_and_says_so() {
    let (_folder, path) = place("bag.mcap");
    let whole = many_chunks(&path);
    let mut most = 0;
    for length in (0..whole.len()).step_by(7) {
        std::fs::write(&path, &whole[..length]).unwrap();
        match Bag::open(&path) {
            Ok(bag) => {
                let recording = read_samples(&bag, &arm(), &TopicChoice::default(), TOLERANCE_NS);
                let read = recording.map_or(0, |recording| recording.samples.len());
                assert!(read >= most, "{length} bytes gave {read}, fewer {most}");
                most = read;
                // Past the end of the data only indices are lost.
                assert!(most == 10 || !bag.warnings().is_empty(), "{length} bytes");
            }
            Err(BagError::Damaged { .. } | BagError::NotABag { .. }) => assert_eq!(most, 0),
            Err(error) => panic!("{length} bytes: {error}"),
        }
    }
    assert_eq!(most, 10);
}

#[test]
fn a_cut_file_does_not_spoil_the_others() {
    let (_folder, path) = place("bag");
    write_samples(&path);
    let file = path.join("bag_0.mcap");
    let whole = std::fs::read(&file).unwrap();
    std::fs::remove_file(path.join("metadata.yaml")).unwrap();
    std::fs::write(path.join("bag_1.mcap"), &whole[..40]).unwrap();
    assert_eq!(read(&path).unwrap().samples, samples());
    assert!(!Bag::open(&path).unwrap().warnings().is_empty());
}

#[test]
fn a_cut_database_is_refused_with_a_reason() {
    let (_folder, path) = place("bag.db3");
    let database = Connection::open(&path).unwrap();
    let text = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
        INSERT INTO topics VALUES (1, '/a', 'std_msgs/msg/String', 'cdr');";
    database.execute_batch(text).unwrap();
    let insert = "INSERT INTO messages VALUES (NULL, 1, 0, zeroblob(1000))";
    for _ in 0..50 {
        database.execute(insert, ()).unwrap();
    }
    drop(database);
    let whole = std::fs::read(&path).unwrap();
    assert_eq!(Bag::open(&path).unwrap().topics()[0].count, 50);
    for length in [100, whole.len() / 3, whole.len() / 2] {
        std::fs::write(&path, &whole[..length]).unwrap();
        let error = Bag::open(&path).unwrap_err().to_string();
        assert!(error.contains("cannot be read as a sqlite3 bag"), "{error}");
    }
}

#[test]
fn changed_bytes_never_panic() {
    let (folder, path) = place("bag.mcap");
    let mut whole = vec![many_chunks(&path)];
    let plain = mcap::WriteOptions::new().compression(None);
    let lz4 = mcap::WriteOptions::new().compression(Some(mcap::Compression::Lz4));
    for options in [plain, lz4] {
        let mut bag = BagWriter::with_options(&path, options).unwrap();
        for sample in samples() {
            bag.sample(&arm(), &sample).unwrap();
        }
        bag.finish().unwrap();
        whole.push(std::fs::read(&path).unwrap());
    }
    let database = folder.path().join("bag.db3");
    Connection::open(&database)
        .unwrap()
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
             INSERT INTO topics VALUES (1, '/a', 'sensor_msgs/msg/JointState', 'cdr');
             INSERT INTO messages VALUES (1, 1, 0, x'00010000');",
        )
        .unwrap();
    whole.push(std::fs::read(&database).unwrap());

    let mut random = Random(7);
    let (mut read, mut refused) = (0, 0);
    for round in 0..2_000 {
        let mut bytes = whole[round % whole.len()].clone();
        for _ in 0..=random.below(4) {
            let at = random.below(bytes.len());
            bytes[at] = [0, 0xff, random.below(256) as u8][random.below(3)];
        }
        if random.below(4) == 0 {
            bytes.truncate(random.below(bytes.len()));
        }
        std::fs::write(&path, &bytes).unwrap();
        match read_all(&path) {
            Ok(_) => read += 1,
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
    }
    // Both ways must have been taken, or the changes were too mild or too harsh.
    assert!(
        read > 200 && refused > 200,
        "{read} read, {refused} refused"
    );
}

#[test]
fn changed_messages_and_definitions_never_panic() {
    let text = crate::definition::full_definition("visualization_msgs/MarkerArray").unwrap();
    let message = crate::encode::Encoder::message(&crate::message::MarkerArray {
        markers: vec![Default::default(); 3],
    });
    let mut random = Random(11);
    let (mut decoded, mut refused) = (0, 0);
    for round in 0..20_000 {
        let (mut text, mut message) = (text.clone().into_bytes(), message.clone());
        let change = if round % 2 == 0 {
            &mut text
        } else {
            &mut message
        };
        for _ in 0..=random.below(3) {
            let at = random.below(change.len());
            change[at] = random.below(256) as u8;
        }
        let definition = crate::Definition::parse(
            "visualization_msgs/msg/MarkerArray",
            &String::from_utf8_lossy(&text),
        );
        match definition.map(|definition| crate::decode(&definition, &message).is_ok()) {
            Ok(true) => decoded += 1,
            _ => refused += 1,
        }
    }
    assert!(
        decoded > 1_000 && refused > 1_000,
        "{decoded} decoded, {refused} refused"
    );
}
