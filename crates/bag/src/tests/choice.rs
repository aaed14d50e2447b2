use super::*;

const NAMES: [&str; 2] = ["shoulder", "elbow"];

/// Writes one message a topic: its name, positions and efforts.
fn write_states(path: &Path, states: &[(&str, &[f64], &[f64])]) {
    let mut bag = BagWriter::create(path).unwrap();
    for (topic, position, effort) in states {
        let message = state(7, &NAMES, position, effort);
        bag.write(topic, 7, &message).unwrap();
    }
    bag.finish().unwrap();
}

#[test]
fn efforts_beside_positions_are_taken_only_by_name() {
    let (_folder, path) = place("bag.mcap");
    write_states(&path, &[("/joint_states", &[1.0, 2.0], &[3.0, 4.0])]);
    let error = read(&path).unwrap_err().to_string();
    assert_eq!(
        error,
        "external joint torques: no topic fits; name one with --torques. \
         The bag has /joint_states (sensor_msgs/msg/JointState, 1)"
    );
    let recording = read_chosen(&path, None, Some("joint_states")).unwrap();
    assert_eq!(recording.samples[0].external_torque, [3.0, 4.0]);
    assert_eq!(recording.samples[0].position, [1.0, 2.0]);
}

#[test]
fn torques_are_found_beside_gravity_laden_efforts() {
    let (_folder, path) = place("bag.mcap");
    let nan = [f64::NAN, f64::NAN];
    write_states(
        &path,
        &[
            ("/joint_states", &[1.0, 2.0], &[30.0, 40.0]),
            ("/broadcaster/joint_states", &nan, &[0.5, 0.25]),
        ],
    );
    let recording = read(&path).unwrap();
    assert_eq!(recording.torques.topic, "/broadcaster/joint_states");
    assert_eq!(recording.samples[0].external_torque, [0.5, 0.25]);
}

#[test]
fn several_that_fit_are_all_named() {
    let (_folder, path) = place("bag.mcap");
    write_states(
        &path,
        &[
            ("/a", &[1.0, 2.0], &[]),
            ("/b", &[1.0, 2.0], &[]),
            ("/torques", &[], &[1.0, 2.0]),
        ],
    );
    let error = read(&path).unwrap_err().to_string();
    assert!(
        error.starts_with("joint positions: 2 topics fit (/a, /b); name one with --positions."),
        "{error}"
    );
    let recording = read_chosen(&path, Some("/b"), None).unwrap();
    assert_eq!(recording.positions.topic, "/b");
}

#[test]
fn an_absent_topic_is_answered_with_those_that_are_there() {
    let (_folder, path) = place("bag.mcap");
    write_samples(&path);
    let error = read_chosen(&path, Some("/nowhere"), None).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the bag has no topic /nowhere; it has /joint_states (sensor_msgs/msg/JointState, 10), \
         /external_torques (sensor_msgs/msg/JointState, 10)"
    );
}

#[test]
fn a_topic_without_joints_is_refused_by_its_type() {
    let (_folder, path) = place("bag.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    bag.robot_description(1, "<robot/>").unwrap();
    bag.sample(&arm(), &samples()[0]).unwrap();
    bag.finish().unwrap();
    let error = read_chosen(&path, None, Some("/robot_description")).unwrap_err();
    let error = error.to_string();
    assert!(
        error.starts_with(
            "topic /robot_description is std_msgs/msg/String, expected one of sensor_msgs/msg/JointState, "
        ),
        "{error}"
    );
}

#[test]
fn names_decide_and_may_change_from_message_to_message() {
    let (_folder, path) = place("bag.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    for (time, names, values) in [
        (1, vec!["elbow", "gripper", "shoulder"], vec![2.0, 9.0, 1.0]),
        (2, vec!["shoulder", "elbow"], vec![1.0, 2.0]),
    ] {
        let (position, torque) = (
            state(time, &names, &values, &[]),
            state(time, &names, &[], &values),
        );
        bag.write("/joint_states", time, &position).unwrap();
        bag.write("/torques", time, &torque).unwrap();
    }
    bag.finish().unwrap();
    let recording = read(&path).unwrap();
    assert_eq!(recording.samples.len(), 2);
    for sample in recording.samples {
        assert_eq!(sample.position, [1.0, 2.0]);
        assert_eq!(sample.external_torque, [1.0, 2.0]);
    }
}

#[test]
fn what_cannot_be_used_is_counted_by_cause() {
    let (_folder, path) = place("bag.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    for time in 1..=5 {
        let position = state(time, &NAMES, &[1.0, 2.0], &[]);
        bag.write("/joint_states", time, &position).unwrap();
    }
    for (time, names, effort) in [
        (1, &NAMES[..], &[1.0, 2.0][..]),
        (2, &NAMES, &[f64::NAN, 2.0]),
        (3, &NAMES, &[1.0]),
        (4, &["shoulder", "wrist"], &[1.0, 2.0]),
        (5, &NAMES, &[1.0, 3.0]),
    ] {
        let torque = state(time, names, &[], effort);
        bag.write("/torques", time, &torque).unwrap();
    }
    bag.finish().unwrap();
    let recording = read(&path).unwrap();
    let unusable = recording.torques.unusable;
    assert_eq!(recording.samples.len(), 2);
    assert_eq!(
        (
            unusable.not_finite,
            unusable.wrong_length,
            unusable.names_missing,
            unusable.undecodable
        ),
        (1, 1, 1, 0)
    );
    let reason = unusable.first_reason.unwrap();
    assert_eq!(
        reason,
        "effort of shoulder is NaN, expected a finite number"
    );
}

#[test]
fn a_zero_stamp_gives_way_to_the_time_of_recording() {
    let (_folder, path) = place("bag.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    let log_time_ns = 1_000;
    bag.write("/p", log_time_ns, &state(0, &NAMES, &[1.0, 2.0], &[]))
        .unwrap();
    bag.write("/t", log_time_ns, &state(0, &NAMES, &[], &[1.0, 2.0]))
        .unwrap();
    bag.finish().unwrap();
    assert_eq!(read(&path).unwrap().samples[0].stamp_ns, log_time_ns);
}

#[test]
fn the_last_torque_is_paired_though_no_position_follows() {
    let (_folder, path) = place("bag.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    let (early, late) = (1_000_000_000, 1_000_000_000 + TOLERANCE_NS);
    bag.write("/p", early, &state(early, &NAMES, &[1.0, 2.0], &[]))
        .unwrap();
    bag.write("/t", late, &state(late, &NAMES, &[], &[1.0, 2.0]))
        .unwrap();
    let too_late = late + 1;
    bag.write("/t", too_late, &state(too_late, &NAMES, &[], &[1.0, 2.0]))
        .unwrap();
    bag.finish().unwrap();
    let recording = read(&path).unwrap();
    assert_eq!(recording.samples.len(), 1);
    assert_eq!(recording.losses.torque_without_position, 1);
}

#[test]
fn nothing_paired_is_an_error_with_its_reasons() {
    let (_folder, path) = place("bag.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    bag.write("/p", 1, &state(1, &NAMES, &[1.0, 2.0], &[]))
        .unwrap();
    let late = 1_000_000_000;
    bag.write("/t", late, &state(late, &NAMES, &[], &[1.0, 2.0]))
        .unwrap();
    bag.finish().unwrap();
    let error = read(&path).unwrap_err().to_string();
    assert!(
        error.ends_with("1 torques found no position near in time"),
        "{error}"
    );
}

#[test]
fn efforts_of_a_second_joint_state_are_not_taken_silently() {
    let (_folder, path) = place("bag.mcap");
    let state = (&[1.0, 2.0][..], &[30.0, 40.0][..]);
    write_states(
        &path,
        &[
            ("/joint_states", state.0, state.1),
            ("/arm/joint_states", state.0, state.1),
        ],
    );
    let error = read_chosen(&path, Some("/joint_states"), None).unwrap_err();
    assert!(
        matches!(
            error,
            BagError::Choice {
                option: "--torques",
                ..
            }
        ),
        "{error}"
    );
}
