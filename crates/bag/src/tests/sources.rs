//! Bags with the message types of drivers. Databases, because those are without definitions where a bag is old.

use palpate_model::Source;
use rusqlite::Connection;

use super::*;
use crate::encode::{Encode, Encoder};

/// Fields of a message, one after another.
struct Fields(Vec<Box<dyn Encode>>);

impl Encode for Fields {
    fn encode(&self, out: &mut Encoder) {
        self.0.iter().for_each(|field| field.encode(out));
    }
}

macro_rules! fields {
    ($($field:expr),* $(,)?) => { Fields(vec![$(Box::new($field)),*]) };
}

/// A topic to write: name, type, definition if the bag is to carry it, and messages.
struct Written {
    name: &'static str,
    type_name: &'static str,
    definition: Option<String>,
    messages: Vec<Fields>,
}

/// One message a topic and 10 ms, recorded from [`START_NS`] on.
fn write(path: &Path, topics: &[Written]) {
    let database = Connection::open(path).unwrap();
    let tables = "CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT);
         CREATE TABLE messages(topic_id INTEGER, timestamp INTEGER, data BLOB);
         CREATE TABLE message_definitions(topic_type TEXT, encoding TEXT, encoded_message_definition TEXT);";
    database.execute_batch(tables).unwrap();
    for (id, topic) in topics.iter().enumerate() {
        let insert = "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr')";
        database
            .execute(insert, (id as i64, topic.name, topic.type_name))
            .unwrap();
        if let Some(text) = &topic.definition {
            let insert = "INSERT INTO message_definitions VALUES (?1, 'ros2msg', ?2)";
            database.execute(insert, (topic.type_name, text)).unwrap();
        }
        for (step, message) in topic.messages.iter().enumerate() {
            let row = (
                id as i64,
                START_NS + step as i64 * STEP_NS,
                Encoder::message(message),
            );
            let insert = "INSERT INTO messages VALUES (?1, ?2, ?3)";
            database.execute(insert, row).unwrap();
        }
    }
}

const START_NS: i64 = 1_700_000_000_000_000_000;
const STEP_NS: i64 = 10_000_000;

/// Seven joints of which the robot has two.
const SEVEN: [&str; 7] = ["a1", "elbow", "a3", "shoulder", "a5", "a6", "a7"];

fn seven(elbow: f64, shoulder: f64) -> [f64; 7] {
    [0.1, elbow, 0.3, shoulder, 0.5, 0.6, 0.7]
}

fn texts(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn choice() -> TopicChoice {
    TopicChoice {
        joint_names: texts(&SEVEN),
        ..TopicChoice::default()
    }
}

fn read_by(path: &Path, choice: &TopicChoice) -> Result<Recording, BagError> {
    read_samples(&Bag::open(path)?, &arm(), choice, TOLERANCE_NS)
}

/// Fields of `LBRState`; `commanded` stands in FRI 1 only.
fn lbr_definition(commanded: bool) -> String {
    let eight = [
        "session_state",
        "connection_quality",
        "safety_state",
        "operation_mode",
        "drive_state",
        "client_command_mode",
        "overlay_type",
        "control_mode",
    ];
    let mut text = "float64 sample_time\n".to_owned();
    text.extend(eight.map(|name| format!("int8 {name}\n")));
    text +=
        "uint32 time_stamp_sec\nuint32 time_stamp_nano_sec\nfloat64[7] measured_joint_position\n";
    if commanded {
        text += "float64[7] commanded_joint_position\n";
    }
    text + "float64[7] measured_torque\nfloat64[7] commanded_torque\nfloat64[7] external_torque\n\
           float64[7] ipo_joint_position\nfloat64 tracking_performance\n"
}

fn lbr_message(commanded: bool, position: [f64; 7], torque: [f64; 7]) -> Fields {
    let mut message = fields![0.01, [1u8; 8], 5u32, 6u32, position];
    if commanded {
        message.0.push(Box::new([9.0; 7]));
    }
    let rest = fields![[8.0; 7], [7.0; 7], torque, [6.0; 7], 1.0];
    message.0.extend(rest.0);
    message
}

fn lbr_topic(commanded: bool, definition: bool) -> Written {
    let message = |torque| lbr_message(commanded, seven(2.0, 1.0), seven(torque, 3.0));
    Written {
        name: "/lbr/state",
        type_name: "lbr_fri_idl/msg/LBRState",
        definition: definition.then(|| lbr_definition(commanded)),
        messages: vec![message(f64::NAN), message(4.0), message(4.5)],
    }
}

#[test]
fn both_layouts_of_lbr_state_are_read_with_and_without_their_definition() {
    for (commanded, length) in [(true, 368), (false, 312)] {
        for definition in [true, false] {
            let (_folder, path) = place("bag.db3");
            let topic = lbr_topic(commanded, definition);
            let message = Encoder::message(&topic.messages[0]);
            assert_eq!(message.len(), 4 + length);
            write(&path, &[topic]);
            let recording = read_by(&path, &choice()).unwrap();
            assert_eq!(recording.positions, recording.torques);
            // NaN at the start, as of a driver that has no torques yet.
            assert_eq!(recording.torques.unusable.not_finite, 1);
            let expected = [4.0, 4.5].map(|torque| JointSample {
                stamp_ns: START_NS + if torque == 4.0 { STEP_NS } else { 2 * STEP_NS },
                position: vec![1.0, 2.0],
                external_torque: vec![3.0, torque],
            });
            assert_eq!(recording.samples, expected);
        }
    }
}

#[test]
fn a_layout_of_unknown_length_is_not_guessed() {
    let (_folder, path) = place("bag.db3");
    let mut topic = lbr_topic(true, false);
    topic.messages.iter_mut().for_each(|message| {
        message.0.push(Box::new(0.5));
    });
    write(&path, &[topic]);
    let chosen = TopicChoice {
        torques: Some("/lbr/state".to_owned()),
        ..choice()
    };
    let error = read_by(&path, &chosen).unwrap_err().to_string();
    assert!(
        error.contains("one of the 2 versions of its type that are known, found 376 bytes"),
        "{error}"
    );
}

fn interface_value(interfaces: &[(&str, f64)]) -> Fields {
    let (names, values): (Vec<_>, Vec<_>) = interfaces.iter().copied().unzip();
    fields![texts(&names), values]
}

fn dynamic_message(with_torque: bool) -> Fields {
    let joint = |position, torque| {
        let interfaces = [
            ("effort", 50.0),
            ("external_torque", torque),
            ("position", position),
        ];
        interface_value(if with_torque {
            &interfaces
        } else {
            &interfaces[2..]
        })
    };
    let sensor = interface_value(&[("force.x", 5.0)]);
    fields![
        Header::new(START_NS + 5, ""),
        texts(&["elbow", "sensor", "shoulder"]),
        vec![joint(2.0, 4.0), sensor, joint(1.0, 3.0)],
    ]
}

fn dynamic_topic(with_torque: bool, definition: bool) -> Written {
    let text = "std_msgs/Header header\nstring[] joint_names\nInterfaceValue[] interface_values\n===\n\
        MSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n";
    Written {
        name: "/lbr/dynamic_joint_states",
        type_name: "control_msgs/msg/DynamicJointState",
        definition: definition.then(|| text.to_owned()),
        messages: vec![dynamic_message(with_torque)],
    }
}

#[test]
fn dynamic_joint_states_are_read_by_interface_among_sensors() {
    let expected = JointSample {
        stamp_ns: START_NS + 5,
        position: vec![1.0, 2.0],
        external_torque: vec![3.0, 4.0],
    };
    for definition in [true, false] {
        let (_folder, path) = place("bag.db3");
        write(&path, &[dynamic_topic(true, definition)]);
        let recording = read_by(&path, &TopicChoice::default()).unwrap();
        assert_eq!(recording.samples, vec![expected.clone()]);
    }
}

#[test]
fn dynamic_joint_states_without_external_torque_are_none() {
    let (_folder, path) = place("bag.db3");
    write(&path, &[dynamic_topic(false, true)]);
    let error = read_by(&path, &TopicChoice::default()).unwrap_err();
    assert!(error.to_string().contains("no topic fits"), "{error}");
}

fn franka_topic(definition: bool) -> Written {
    let state = |position: &[f64], effort: &[f64]| {
        state(START_NS + 7, &["elbow", "shoulder"], position, effort)
    };
    // Of the many fields those that matter, and one between them.
    let text = "std_msgs/Header header\nsensor_msgs/JointState measured_joint_state\nfloat64[7] dtau_j\n\
        sensor_msgs/JointState tau_ext_hat_filtered\n";
    Written {
        name: "/franka_robot_state_broadcaster/robot_state",
        type_name: "franka_msgs/msg/FrankaRobotState",
        definition: definition.then(|| text.to_owned()),
        messages: vec![fields![
            Header::new(START_NS + 7, "base"),
            state(&[2.0, 1.0], &[20.0, 10.0]),
            [0.0; 7],
            state(&[], &[4.0, 3.0]),
        ]],
    }
}

#[test]
fn franka_states_are_read_by_the_definition_in_the_bag() {
    let (_folder, path) = place("bag.db3");
    write(&path, &[franka_topic(true)]);
    let recording = read_by(&path, &TopicChoice::default()).unwrap();
    let expected = JointSample {
        stamp_ns: START_NS + 7,
        position: vec![1.0, 2.0],
        external_torque: vec![3.0, 4.0],
    };
    assert_eq!(recording.samples, [expected]);
}

#[test]
fn a_type_that_the_bag_does_not_define_is_named_with_the_way_out() {
    let (_folder, path) = place("bag.db3");
    write(&path, &[franka_topic(false)]);
    let error = read_by(&path, &TopicChoice::default()).unwrap_err();
    let error = error.to_string();
    for part in [
        "no topic fits",
        "definition of franka_msgs/msg/FrankaRobotState",
        "none (bags before ROS 2 Iron carry none)",
        "ros2 bag convert",
    ] {
        assert!(error.contains(part), "{error}");
    }
}

/// Positions with a header, and torques in a bare array.
fn array_topics(torques: &'static str) -> [Written; 2] {
    let joint_state = |step: i64| {
        let state = state(
            START_NS + step * STEP_NS,
            &SEVEN,
            &seven(2.0, 1.0),
            &[30.0; 7],
        );
        fields![state]
    };
    let array = |torque| {
        let layout = fields![Vec::<f64>::new(), 0u32];
        fields![layout, seven(torque, 3.0).to_vec()]
    };
    [
        Written {
            name: "/joint_states",
            type_name: "sensor_msgs/msg/JointState",
            definition: None,
            messages: vec![joint_state(0), joint_state(1)],
        },
        Written {
            name: torques,
            type_name: "std_msgs/msg/Float64MultiArray",
            definition: None,
            messages: vec![array(4.0), array(4.5)],
        },
    ]
}

#[test]
fn bare_arrays_are_torques_where_the_topic_says_so_or_is_named() {
    let (_folder, path) = place("bag.db3");
    write(
        &path,
        &array_topics("/ets_state_broadcaster/external_torques"),
    );
    let found = read_by(&path, &choice()).unwrap();
    assert_eq!(found.samples.len(), 2);
    assert_eq!(found.samples[1].position, [1.0, 2.0]);
    assert_eq!(found.samples[1].external_torque, [3.0, 4.5]);
    assert_eq!(found.samples[1].stamp_ns, START_NS + STEP_NS);

    let (_folder, path) = place("bag.db3");
    write(&path, &array_topics("/position_controller/commands"));
    let error = read_by(&path, &choice()).unwrap_err().to_string();
    assert!(
        error.contains("external joint torques: no topic fits"),
        "{error}"
    );
    let named = TopicChoice {
        torques: Some("/position_controller/commands".to_owned()),
        ..choice()
    };
    assert_eq!(read_by(&path, &named).unwrap().samples, found.samples);
}

#[test]
fn of_several_that_fit_the_source_decides_or_the_user() {
    let (_folder, path) = place("bag.db3");
    write(&path, &[lbr_topic(true, true), dynamic_topic(true, true)]);
    let error = read_by(&path, &choice()).unwrap_err().to_string();
    assert!(
        error.contains("2 topics fit (/lbr/state, /lbr/dynamic_joint_states)"),
        "{error}"
    );
    let by_source = TopicChoice {
        source: Some(Source::DynamicJointState),
        ..choice()
    };
    let recording = read_by(&path, &by_source).unwrap();
    assert_eq!(recording.torques.topic, "/lbr/dynamic_joint_states");
    let by_name = TopicChoice {
        torques: Some("/lbr/state".to_owned()),
        ..choice()
    };
    let recording = read_by(&path, &by_name).unwrap();
    assert_eq!(recording.positions.topic, "/lbr/state");
}
