//! When the detector says that something touches, and when not.

#![allow(clippy::unwrap_used)]

use palpate_filter::{ContactChange, ContactEvent, Detector, DetectorParameters, Intake};
use palpate_model::{JointSample, LoadOptions, Robot, iiwa14};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// A stream of samples at some rate, fed to a detector; it goes on where it stopped.
struct Stream {
    detector: Detector,
    intake: Intake,
    random: Xoshiro256PlusPlus,
    rate_hz: f64,
    /// Of every joint, rad.
    position: f64,
    count: i64,
    events: Vec<ContactEvent>,
}

fn robot() -> Robot {
    iiwa14(&LoadOptions::default()).unwrap()
}

impl Stream {
    fn new(rate_hz: f64) -> Self {
        Self::with(DetectorParameters::default(), rate_hz)
    }

    fn with(parameters: DetectorParameters, rate_hz: f64) -> Self {
        Self {
            detector: Detector::new(&robot(), &parameters).unwrap(),
            intake: Intake::new(7),
            random: Xoshiro256PlusPlus::seed_from_u64(1),
            rate_hz,
            position: 0.3,
            count: 0,
            events: Vec::new(),
        }
    }

    fn secs(&self) -> f64 {
        self.count as f64 / self.rate_hz
    }

    /// Feeds torques for a time, as a function of the time since the stream began and a source of normal numbers.
    fn feed(
        &mut self,
        secs: f64,
        mut torque: impl FnMut(f64, &mut dyn FnMut() -> f64) -> [f64; 7],
    ) {
        for _ in 0..(secs * self.rate_hz).round() as usize {
            let random = &mut self.random;
            let mut normal = || StandardNormal.sample(random);
            let sample = JointSample {
                stamp_ns: (self.count as f64 * 1e9 / self.rate_hz).round() as i64,
                position: vec![self.position; 7],
                external_torque: torque(self.count as f64 / self.rate_hz, &mut normal).to_vec(),
            };
            let detection = self.detector.update(self.intake.admit(&sample).unwrap());
            self.events.extend(detection.event);
            self.count += 1;
        }
    }

    /// White noise of 0.1 Nm on a constant.
    fn feed_noisy(&mut self, secs: f64, constant: [f64; 7]) {
        self.feed(secs, |_, normal| {
            constant.map(|torque| torque + 0.1 * normal())
        });
    }
}

/// What a push on link 4 may do.
const PUSH: [f64; 7] = [0.4, -1.0, 0.2, 0.5, 0.0, 0.0, 0.0];

#[test]
fn noise_and_slow_drift_are_no_contact() {
    for rate_hz in [100.0, 1000.0] {
        let mut stream = Stream::new(rate_hz);
        stream.feed(300.0, |secs, normal| {
            std::array::from_fn(|joint| 0.05 * (0.1 * secs + joint as f64).sin() + 0.1 * normal())
        });
        assert_eq!(stream.events, [], "{rate_hz} Hz");
    }
}

#[test]
fn correlated_and_quantised_noise_is_no_contact() {
    let mut stream = Stream::new(200.0);
    let mut lowpassed = [0.0; 7];
    let mut noise = |_: f64, normal: &mut dyn FnMut() -> f64| {
        // Low-passed at 10 Hz, as one driver does by default, in steps of 0.05 Nm.
        lowpassed = lowpassed.map(|last: f64| last + 0.27 * (0.3 * normal() - last));
        lowpassed.map(|torque: f64| (torque / 0.05).round() * 0.05)
    };
    // It is more than the detector expects: it has to be learned first.
    stream.feed(20.0, &mut noise);
    let early = stream.events.len();
    stream.feed(600.0, noise);
    assert_eq!(stream.events.len(), early, "{:?}", &stream.events[early..]);
    assert!(early <= 10, "{early}");
}

#[test]
fn false_alarms_are_no_more_than_stated() {
    let parameters = DetectorParameters {
        false_alarms_per_hour: 1000.0,
        least_torque: 0.001,
        min_secs: 0.0,
        ..DetectorParameters::default()
    };
    let mut stream = Stream::with(parameters, 100.0);
    stream.feed_noisy(1800.0, [0.0; 7]);
    let alarms = (stream.events.iter()).filter(|event| event.change == ContactChange::Start);
    let count = alarms.count();
    assert!((1..=500).contains(&count), "{count} in half an hour");
}

#[test]
fn a_push_is_found_soon_and_dated_to_its_begin_and_end() {
    for (rate_hz, soon_secs) in [(1000.0, 0.02), (100.0, 0.1)] {
        let mut stream = Stream::new(rate_hz);
        stream.feed_noisy(5.0, [0.0; 7]);
        stream.feed_noisy(1.0, PUSH);
        let [start] = stream.events[..] else {
            panic!("{:?}", stream.events);
        };
        assert_eq!(start.change, ContactChange::Start);
        let secs = |stamp_ns: i64| stamp_ns as f64 * 1e-9;
        assert!(secs(start.noticed_ns) - 5.0 < soon_secs, "{start:?}");
        assert!((secs(start.stamp_ns) - 5.0).abs() < soon_secs, "{start:?}");
        assert!(start.confidence > 0.9, "{start:?}");

        stream.feed_noisy(1.0, [0.0; 7]);
        let end = stream.events[1];
        assert_eq!((end.change, stream.events.len()), (ContactChange::End, 2));
        assert!((secs(end.stamp_ns) - 6.0).abs() < 0.1, "{end:?}");
        assert!(
            end.noticed_ns > end.stamp_ns && end.confidence > 0.5,
            "{end:?}"
        );
    }
}

#[test]
fn a_light_contact_goes_on_while_its_bias_becomes_less_known() {
    let mut stream = Stream::new(100.0);
    let light = |stream: &mut Stream, secs: f64, torque: f64| {
        for _ in 0..(100.0 * secs) as usize {
            stream.position = 0.3 + 0.05 * stream.secs().sin();
            stream.feed(0.01, |_, normal| {
                [0.0, 0.0, 0.0, torque, 0.0, 0.0, 0.0].map(|torque| torque + 0.02 * normal())
            });
        }
    };
    light(&mut stream, 20.0, 0.0);
    light(&mut stream, 15.0, 0.4);
    let changes =
        |stream: &Stream| -> Vec<_> { (stream.events.iter().map(|event| event.change)).collect() };
    assert_eq!(changes(&stream), [ContactChange::Start]);
    light(&mut stream, 1.0, 0.0);
    assert_eq!(changes(&stream), [ContactChange::Start, ContactChange::End]);
}

#[test]
fn joints_that_feel_it_tell_the_first_link_that_can_be_touched() {
    let mut stream = Stream::new(100.0);
    stream.feed_noisy(2.0, [0.0; 7]);
    assert_eq!(stream.detector.detection().first_link, None);
    stream.feed_noisy(1.0, PUSH);
    let detection = stream.detector.detection();
    assert_eq!(detection.first_link, robot().link_index("lbr_link_4"));
    assert!(detection.joints[1] && detection.joints[3], "{detection:?}");
    assert!(!detection.joints[4..].contains(&true), "{detection:?}");
}

#[test]
fn one_wrong_sample_is_no_contact() {
    for rate_hz in [100.0, 1000.0] {
        let mut stream = Stream::new(rate_hz);
        for _ in 0..10 {
            stream.feed_noisy(1.0, [0.0; 7]);
            let wrong = 1.0 / rate_hz;
            stream.feed(wrong, |_, _| [50.0, -50.0, 0.0, 0.0, 0.0, 0.0, 9.0]);
        }
        assert_eq!(stream.events, [], "{rate_hz} Hz");
    }
}

#[test]
fn a_stream_may_begin_in_contact() {
    let mut stream = Stream::new(100.0);
    stream.feed_noisy(0.1, PUSH);
    assert!(stream.detector.detection().in_contact);
    assert!(stream.detector.bias().iter().all(|bias| bias.mean == 0.0));
    stream.feed_noisy(1.0, [0.0; 7]);
    assert!(!stream.detector.detection().in_contact);
}

#[test]
fn the_bias_is_learned_while_nothing_touches_and_frozen_in_contact() {
    let offset = [0.1, -0.1, 0.05, 0.0, 0.08, -0.12, 0.1];
    let mut stream = Stream::new(100.0);
    stream.feed_noisy(20.0, offset);
    let learned = stream.detector.bias().to_vec();
    for (bias, offset) in learned.iter().zip(offset) {
        assert!(
            (bias.mean - offset).abs() < 4.0 * bias.std.max(0.005),
            "{bias:?} {offset}"
        );
        assert!(bias.std < 0.05, "{bias:?}");
    }
    let pushed = std::array::from_fn(|joint| offset[joint] + PUSH[joint]);
    stream.feed_noisy(10.0, pushed);
    assert!(stream.detector.detection().in_contact);
    for (bias, before) in stream.detector.bias().iter().zip(&learned) {
        assert!(
            (bias.mean - before.mean).abs() < 0.02,
            "{bias:?} {before:?}"
        );
        assert!(bias.std >= before.std, "more uncertain with time: {bias:?}");
    }
}

#[test]
fn the_noise_of_each_joint_is_its_own() {
    // One joint is ten times as noisy: it neither alarms, nor keeps the others from feeling.
    let mut stream = Stream::new(100.0);
    let noisy = |push: f64| {
        move |_: f64, normal: &mut dyn FnMut() -> f64| {
            [normal(), push + 0.1 * normal(), 0.0, 0.0, 0.0, 0.0, 0.0]
        }
    };
    stream.feed(60.0, noisy(0.0));
    assert_eq!(stream.events, []);
    stream.feed(0.2, noisy(0.8));
    assert_eq!(stream.detector.detection().joints[..2], [false, true]);
}

#[test]
fn the_joints_beyond_tell_what_of_a_joints_torque_is_noise() {
    // Two joints share a noise in which the push on the first would drown for long.
    let mut stream = Stream::new(1000.0);
    let noisy = |push: f64| {
        move |_: f64, normal: &mut dyn FnMut() -> f64| {
            let shared = 0.3 * normal();
            let mut own = || 0.03 * normal();
            [
                push + shared + own(),
                0.0,
                0.0,
                shared + own(),
                0.0,
                0.0,
                0.0,
            ]
        }
    };
    stream.feed(20.0, noisy(0.0));
    assert_eq!(stream.events, []);
    stream.feed(0.02, noisy(0.3));
    assert!(stream.detector.detection().joints[0]);
    let first = stream.detector.detection().first_link;
    assert_eq!(first, robot().link_index("lbr_link_1"));
}

#[test]
fn a_gap_and_a_jump_back_in_time_begin_anew_with_the_bias_known() {
    let mut stream = Stream::new(100.0);
    stream.feed_noisy(10.0, [0.12; 7]);
    let before = stream.detector.bias()[0].mean;
    stream.count += 500;
    stream.feed_noisy(1.0, [0.12; 7]);
    stream.intake.restart();
    stream.count = 0;
    stream.feed_noisy(1.0, [0.12; 7]);
    assert!(stream.secs() < 2.0 && stream.events.is_empty());
    assert!((stream.detector.bias()[0].mean - before).abs() < 0.03);
}

#[test]
fn a_leap_to_another_position_is_no_motion_that_hides_a_push() {
    let mut stream = Stream::new(50.0);
    stream.feed_noisy(2.0, [0.12; 7]);
    stream.position = 1.5;
    stream.feed_noisy(0.1, PUSH.map(|torque| torque + 0.12));
    assert!(stream.detector.detection().in_contact);
    stream.feed_noisy(1.0, [0.12; 7]);
    let count = stream.events.len();
    stream.position = -0.7;
    stream.feed_noisy(1.0, [0.12; 7]);
    assert_eq!(stream.events.len(), count, "{:?}", stream.events);
}

#[test]
fn random_torques_at_random_times_leave_it_finite() {
    let mut stream = Stream::new(100.0);
    for _ in 0..300 {
        let size = 10.0_f64.powi(stream.random.random_range(-9..9));
        stream.rate_hz = 10.0_f64.powi(stream.random.random_range(-2..5));
        stream.intake.restart();
        stream.feed(3.0 / stream.rate_hz, |_, normal| {
            [(); 7].map(|()| size * normal())
        });
        let detection = stream.detector.detection();
        assert!((0.0..=1.0).contains(&detection.confidence), "{detection:?}");
        for bias in stream.detector.bias() {
            assert!(bias.mean.is_finite() && bias.std.is_finite(), "{bias:?}");
        }
    }
}
