//! The thread that takes messages: from the driver's topics to samples that wait for the filter.

use std::sync::Arc;
use std::time::{Duration, Instant};

use futures::{FutureExt, Stream, StreamExt};
use palpate_filter::InputSettings;
use palpate_model::Robot;
use palpate_node::{
    JointInput, JointMessage, MessageError, Newest, Throttle, TimedSample, nanoseconds,
};
use r2r::QosProfile;
use r2r::sensor_msgs::msg::JointState;

use crate::messages;

/// Messages that the middleware keeps for a reader that is late.
const DEPTH: usize = 100;

/// Takes both topics in. Best effort, as that reads reliable and best-effort publishers alike.
pub struct Reader {
    positions: Box<dyn Stream<Item = JointState> + Unpin>,
    torques: Box<dyn Stream<Item = JointState> + Unpin>,
    pub input: JointInput,
    samples: Arc<Newest<TimedSample>>,
    max_wait_ns: i64,
    complaints: Throttle,
}

impl Reader {
    pub fn new(
        node: &mut r2r::Node,
        robot: Arc<Robot>,
        settings: &InputSettings,
        samples: Arc<Newest<TimedSample>>,
    ) -> r2r::Result<Self> {
        let qos = QosProfile::sensor_data().keep_last(DEPTH);
        Ok(Self {
            positions: Box::new(node.subscribe("joint_states", qos.clone())?),
            torques: Box::new(node.subscribe("external_torque", qos)?),
            input: JointInput::new(robot, settings),
            samples,
            max_wait_ns: nanoseconds(settings.max_wait_secs),
            complaints: Throttle::new(Duration::from_secs(5)),
        })
    }

    /// Takes over the times of `settings`.
    pub fn set_times(&mut self, settings: &InputSettings) {
        self.input.set_times(settings);
        self.max_wait_ns = nanoseconds(settings.max_wait_secs);
    }

    /// Takes all that has come: r2r itself would drop the newest.
    pub fn drain(&mut self) {
        while let Some(Some(message)) = self.positions.next().now_or_never() {
            let taken = self
                .input
                .position(joint_message(&message, &message.position));
            self.hand_on(taken);
        }
        while let Some(Some(message)) = self.torques.next().now_or_never() {
            let taken = self.input.torque(joint_message(&message, &message.effort));
            self.hand_on(taken);
        }
    }

    fn hand_on(&mut self, taken: Result<(), MessageError>) {
        if let Err(refusal) = taken
            && let Some(more) = self.complaints.pass(Instant::now())
        {
            tracing::warn!("message refused (and {more} before): {refusal}");
        }
        while let Some(sample) = self.input.next_sample() {
            let max_wait_ns = self.max_wait_ns;
            let stale =
                |oldest: &TimedSample, newest: &TimedSample| oldest.is_older(newest, max_wait_ns);
            self.samples.push_over(sample, stale);
        }
    }
}

fn joint_message<'a>(message: &'a JointState, values: &'a [f64]) -> JointMessage<'a> {
    JointMessage {
        stamp_ns: messages::nanoseconds(&message.header.stamp),
        names: &message.name,
        values,
    }
}
