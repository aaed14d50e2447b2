use nalgebra::{Matrix3, Point3, Unit};
use palpate_filter::{CLOUD_POINT_STEP, ContactEstimate, ContactStatus, Mode, Particle, Scene};
use palpate_model::Kinematics;

use super::*;
use crate::{Value, decode, topics};

#[test]
fn samples_come_back_bit_for_bit_from_file_and_folder() {
    for name in ["lone.mcap", "folder"] {
        let (_folder, path) = place(name);
        write_samples(&path);
        let recording = read(&path).unwrap();
        let bits = |samples: &[JointSample]| -> Vec<(i64, Vec<u64>)> {
            let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect();
            let both = |sample: &JointSample| {
                let values = [&sample.position[..], &sample.external_torque].concat();
                (sample.stamp_ns, bits(&values))
            };
            samples.iter().map(both).collect()
        };
        assert_eq!(bits(&recording.samples), bits(&samples()), "{name}");
        assert_eq!(recording.positions.topic, topics::JOINT_STATES);
        assert_eq!(recording.torques.topic, topics::EXTERNAL_TORQUES);
        assert_eq!(recording.torques.messages, 10);
        assert_eq!(recording.torques.unusable.total(), 0);
    }
}

#[test]
fn the_same_messages_give_the_same_bytes() {
    let (_folder, path) = place("lone.mcap");
    write_samples(&path);
    let first = std::fs::read(&path).unwrap();
    write_samples(&path);
    assert!(first == std::fs::read(&path).unwrap());
}

fn estimate(stamp_ns: i64) -> ContactEstimate {
    ContactEstimate {
        stamp_ns,
        status: ContactStatus::Located,
        modes: vec![Mode {
            link: 2,
            probability: 0.5,
            point_in_root: Point3::new(0.1, 0.2, 0.3),
            point_in_link: Point3::origin(),
            normal_in_root: Unit::new_normalize(Vector3::new(0.0, 3.0, 4.0)),
            force_in_root: Vector3::new(1.0, -2.0, 3.0),
            force: 14_f64.sqrt(),
            stiffness: 1e3,
            covariance_in_root: Matrix3::identity() * 1e-4,
        }],
    }
}

fn particle(index: usize) -> Particle {
    Particle {
        triangle: 0,
        link: 1 + index % 2,
        point_in_link: Point3::new(0.0, 0.0, index as f64 * 0.01),
        normal_in_link: Vector3::x_axis(),
        force: 3.0,
        stiffness: 1e3,
        weight: index as f64,
    }
}

/// Everything that can be written, with one particle that must not be drawn.
fn write_everything(path: &Path, stamp_ns: i64) {
    let robot = arm();
    let kinematics = Kinematics::new(&robot);
    let estimate = estimate(stamp_ns);
    let mut particles: Vec<_> = (0..5).map(particle).collect();
    particles[3].point_in_link.x = f64::NAN;
    let scene = Scene::new(&robot, &kinematics, &estimate, &particles);
    let mut bag = BagWriter::create(path).unwrap();
    bag.robot_description(stamp_ns, "<robot name=\"ä\"/>")
        .unwrap();
    bag.transforms(stamp_ns, &robot, &kinematics).unwrap();
    bag.estimate(&robot, &estimate).unwrap();
    bag.scene(&robot, &scene).unwrap();
    let (point, force) = (Point3::new(1.0, 2.0, 3.0), Vector3::x());
    bag.truth(stamp_ns, &robot, "lower", &point, &force)
        .unwrap();
    bag.finish().unwrap();
}

/// Decodes the only message of `topic` by the definition that the bag carries, and hands it to `look`.
fn with_message(bag: &Bag, topic: &str, look: impl FnOnce(&Value<'_>)) {
    let index = bag.topic(topic).unwrap();
    let definitions = bag.topics()[index].definitions().unwrap();
    let messages = bag.messages(&[index]).unwrap();
    assert_eq!(messages.len(), 1, "{topic}");
    look(&decode(&definitions[0], &messages[0].data).unwrap());
}

fn number(message: &Value<'_>, path: &str) -> f64 {
    message.get(path).and_then(Value::as_f64).unwrap()
}

#[test]
fn every_message_decodes_by_the_definition_beside_it() {
    let (_folder, path) = place("all.mcap");
    let stamp_ns = 12_000_000_034;
    write_everything(&path, stamp_ns);
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.topics().len(), 9);
    with_message(&bag, topics::ROBOT_DESCRIPTION, |message| {
        let text = message.get("data").and_then(Value::as_str);
        assert_eq!(text, Some("<robot name=\"ä\"/>"));
    });
    with_message(&bag, topics::CONTACT_POSE, |message| {
        assert_eq!(number(message, "header.stamp.sec"), 12.0);
        assert_eq!(number(message, "header.stamp.nanosec"), 34.0);
        let frame = message.get("header.frame_id").and_then(Value::as_str);
        assert_eq!(frame, Some("base"));
        assert_eq!(number(message, "pose.pose.position.z"), 0.3);
        let covariance = message.get("pose.covariance").and_then(Value::numbers);
        assert_eq!(covariance.unwrap()[7], 1e-4);
    });
    with_message(&bag, topics::CONTACT_WRENCH, |message| {
        assert_eq!(number(message, "wrench.force.y"), -2.0);
        assert_eq!(number(message, "wrench.torque.y"), 0.0);
    });
    with_message(&bag, topics::TRUE_POINT, |message| {
        assert_eq!(number(message, "point.z"), 3.0);
    });
    with_message(&bag, topics::TRUE_LINK, |message| {
        assert_eq!(message.get("data").and_then(Value::as_str), Some("lower"));
    });
    with_message(&bag, topics::PARTICLES, |message| {
        assert_eq!(number(message, "width"), 4.0);
        let data = message.get("data").and_then(Value::numbers).unwrap();
        assert_eq!(data.len(), 4 * CLOUD_POINT_STEP);
    });
}

#[test]
fn markers_delete_the_old_and_draw_only_what_is_finite() {
    let (_folder, path) = place("all.mcap");
    write_everything(&path, 1);
    let bag = Bag::open(&path).unwrap();
    with_message(&bag, topics::MARKERS, |message| {
        let Some(Value::List(markers)) = message.get("markers") else {
            panic!("{message:?}");
        };
        let numbers =
            |name| -> Vec<f64> { markers.iter().map(|marker| number(marker, name)).collect() };
        assert_eq!(numbers("type"), [0.0, 0.0, 9.0, 7.0]);
        assert_eq!(numbers("action"), [3.0, 0.0, 0.0, 0.0]);
        assert!(numbers("pose.orientation.w").iter().all(|&w| w == 1.0));
        for list in ["points", "colors"] {
            let Some(Value::List(list)) = markers[3].get(list) else {
                panic!("{message:?}");
            };
            assert_eq!(list.len(), 4);
        }
    });
}

#[test]
fn transforms_place_every_link_in_its_parent() {
    let (_folder, path) = place("all.mcap");
    write_everything(&path, 1);
    with_message(&Bag::open(&path).unwrap(), topics::TF, |message| {
        let Some(Value::List(transforms)) = message.get("transforms") else {
            panic!("{message:?}");
        };
        let frames: Vec<_> = transforms
            .iter()
            .map(|transform| {
                let text = |path| transform.get(path).and_then(Value::as_str).unwrap();
                (text("header.frame_id"), text("child_frame_id"))
            })
            .collect();
        assert_eq!(frames, [("base", "upper"), ("upper", "lower")]);
        assert!((number(&transforms[1], "transform.translation.z") - 0.3).abs() < 1e-12);
    });
}

#[test]
fn without_contact_only_the_scene_is_written() {
    let (_folder, path) = place("none.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    let none = ContactEstimate {
        stamp_ns: 5,
        status: ContactStatus::NoContact,
        modes: Vec::new(),
    };
    bag.estimate(&arm(), &none).unwrap();
    bag.scene(&arm(), &Scene::default()).unwrap();
    bag.finish().unwrap();
    let bag = Bag::open(&path).unwrap();
    let names: Vec<_> = bag.topics().iter().map(|topic| &topic.name).collect();
    assert_eq!(names, [topics::PARTICLES, topics::MARKERS]);
}
