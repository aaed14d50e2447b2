//! The thread that takes messages: from the driver's topics to samples that wait for the filter.

use std::sync::Arc;
use std::time::{Duration, Instant};

use futures::{FutureExt, Stream, StreamExt};
use palpate_filter::{InputSettings, ParameterError};
use palpate_model::{ExternalTorque, JointReading, Robot, Source};
use palpate_node::{JointInput, MessageError, Newest, Throttle, TimedSample, Untyped, nanoseconds};
use r2r::{QosProfile, WrappedNativeMsgUntyped};
use serde_json::Value;

/// Messages that the middleware keeps for a reader that is late.
const DEPTH: usize = 100;

/// Takes the driver's topics in. Best effort, as that reads reliable and best-effort publishers alike.
pub struct Reader {
    source: Source,
    /// None where the torques' messages hold positions too.
    positions: Option<Messages>,
    /// None where torques are told from those measured beside the positions.
    torques: Option<Messages>,
    pub input: JointInput,
    samples: Arc<Newest<TimedSample>>,
    max_wait_ns: i64,
    complaints: Throttle,
    has_told_limit: bool,
}

type Messages = Box<dyn Stream<Item = r2r::Result<Value>> + Unpin>;

/// Refuses a source whose messages were not there when this was built.
pub fn check_source(settings: &InputSettings) -> Result<(), ParameterError> {
    let type_name = settings.source.type_name();
    let known = WrappedNativeMsgUntyped::new_from(type_name).is_ok();
    known.then_some(()).ok_or_else(|| ParameterError::Range {
        name: "input.source",
        expected: "one whose messages were on the prefix path when this node was built",
        found: format!("{}, whose message is {type_name}", settings.source.word()),
    })
}

impl Reader {
    pub fn new(
        node: &mut r2r::Node,
        robot: Arc<Robot>,
        settings: &InputSettings,
        external: Option<ExternalTorque>,
        samples: Arc<Newest<TimedSample>>,
    ) -> r2r::Result<Self> {
        let source = settings.source;
        let mut joint_states = || subscribe(node, "joint_states", Source::JointState);
        let positions = match source.has_both() && external.is_none() {
            true => None,
            false => Some(joint_states()?),
        };
        let input = JointInput::new(robot, settings);
        let (torques, input) = match external {
            None => (Some(subscribe(node, "external_torque", source)?), input),
            Some(external) => (None, input.with_measured_torques(external)),
        };
        Ok(Self {
            source,
            positions,
            torques,
            input,
            samples,
            max_wait_ns: nanoseconds(settings.max_wait_secs),
            complaints: Throttle::new(Duration::from_secs(5)),
            has_told_limit: false,
        })
    }

    /// Takes over the times of `settings`.
    pub fn set_times(&mut self, settings: &InputSettings) {
        self.input.set_times(settings);
        self.max_wait_ns = nanoseconds(settings.max_wait_secs);
    }

    /// Takes all that has come by the node's time `now_ns`: r2r itself would drop the newest.
    pub fn drain(&mut self, now_ns: Option<i64>) {
        while let Some(message) = self.positions.as_mut().and_then(next) {
            let reading = read(Source::JointState, message);
            let taken = self.input.position(reading.as_ref(), now_ns);
            self.hand_on(taken);
        }
        while let Some(message) = self.torques.as_mut().and_then(next) {
            let reading = read(self.source, message);
            let taken = self.input.torque(reading.as_ref(), now_ns);
            self.hand_on(taken);
        }
    }

    fn hand_on(&mut self, taken: Result<(), MessageError>) {
        if let Err(refusal) = taken
            && let Some(more) = self.complaints.pass(Instant::now())
        {
            tracing::warn!("message refused (and {more} before): {refusal}");
        }
        if let (_, Some(beyond)) = self.input.beyond_limit()
            && !self.has_told_limit
        {
            tracing::warn!("{beyond} Further ones are only counted.");
            self.has_told_limit = true;
        }
        while let Some(sample) = self.input.next_sample() {
            let max_wait_ns = self.max_wait_ns;
            let stale =
                |oldest: &TimedSample, newest: &TimedSample| oldest.is_older(newest, max_wait_ns);
            self.samples.push_over(sample, stale);
        }
    }
}

fn subscribe(node: &mut r2r::Node, topic: &str, source: Source) -> r2r::Result<Messages> {
    let qos = QosProfile::sensor_data().keep_last(DEPTH);
    Ok(Box::new(node.subscribe_untyped(
        topic,
        source.type_name(),
        qos,
    )?))
}

fn next(messages: &mut Messages) -> Option<r2r::Result<Value>> {
    messages.next().now_or_never().flatten()
}

fn read(source: Source, message: r2r::Result<Value>) -> Option<JointReading> {
    message
        .ok()
        .and_then(|message| source.read(Untyped(&message)))
}
