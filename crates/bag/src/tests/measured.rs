//! Bags with measured torques beside positions.

use palpate_model::MeasuredSample;

use super::*;
use crate::{read_measured, topics};

fn measured(step: i64) -> MeasuredSample {
    MeasuredSample {
        stamp_ns: 1_000_000_000 + step * 10_000_000,
        position: vec![0.1 * step as f64, 0.2],
        velocity: vec![10.0, 0.0],
        torque: vec![30.0, -4.0 + step as f64],
    }
}

fn write_measured(path: &Path) {
    let mut bag = BagWriter::create(path).unwrap();
    for step in 0..5 {
        bag.measured(&arm(), &measured(step)).unwrap();
    }
    bag.finish().unwrap();
}

fn choice(positions: Option<&str>, torques: Option<&str>) -> TopicChoice {
    TopicChoice {
        positions: positions.map(str::to_owned),
        torques: torques.map(str::to_owned),
        ..TopicChoice::default()
    }
}

#[test]
fn positions_speeds_and_torques_of_a_message_stay_together() {
    let (_folder, path) = place("measured.mcap");
    write_measured(&path);
    let bag = Bag::open(&path).unwrap();
    for choice in [
        choice(None, None),
        choice(Some("/joint_states"), None),
        choice(None, Some("joint_states")),
    ] {
        let recording = read_measured(&bag, &arm(), &choice).unwrap();
        assert_eq!(recording.samples, (0..5).map(measured).collect::<Vec<_>>());
        assert_eq!(recording.topic.topic, "/joint_states");
        assert_eq!(recording.topic.messages, 5);
    }
    // Nobody takes them for external torques who was not told to.
    let said = read(&path).unwrap_err().to_string();
    assert!(said.contains("external joint torques"), "{said}");
}

#[test]
fn a_message_without_speeds_has_none_and_one_of_wrong_length_is_counted() {
    let (_folder, path) = place("silent.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    let names = ["shoulder", "elbow"];
    bag.write(
        topics::JOINT_STATES,
        1,
        &state(1, &names, &[0.1, 0.2], &[3.0, 4.0]),
    )
    .unwrap();
    bag.write(
        topics::JOINT_STATES,
        2,
        &state(2, &names, &[0.1, 0.2], &[3.0]),
    )
    .unwrap();
    bag.finish().unwrap();
    let bag = Bag::open(&path).unwrap();
    let recording = read_measured(&bag, &arm(), &choice(None, None)).unwrap();
    assert_eq!(recording.samples.len(), 1);
    assert!(recording.samples[0].velocity.is_empty());
    assert_eq!(recording.topic.unusable.wrong_length, 1);
}

#[test]
fn external_torques_on_a_topic_of_their_own_are_no_measured_ones() {
    let (_folder, path) = place("external.mcap");
    write_samples(&path);
    let bag = Bag::open(&path).unwrap();
    let say = |choice| {
        read_measured(&bag, &arm(), &choice)
            .unwrap_err()
            .to_string()
    };
    let said = say(choice(None, None));
    assert!(
        said.contains("measured torques") && said.contains("no topic fits"),
        "{said}"
    );
    let said = say(choice(Some("/joint_states"), Some("/external_torques")));
    assert!(said.contains("measured torques"), "{said}");
    let said = say(choice(Some("/joint_states"), None));
    assert!(
        said.contains("/joint_states") && said.contains("expected 2 values"),
        "{said}"
    );
}
