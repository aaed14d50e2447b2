//! What the node tells about itself on `/diagnostics`, once a second.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use palpate_filter::Settings;
use palpate_model::Robot;
use palpate_node::{JointInput, MessageCounts, Newest, TimedSample};
use r2r::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use r2r::{Publisher, QosProfile};

use crate::clock::Clock;
use crate::estimation::Progress;

const PERIOD: Duration = Duration::from_secs(1);

/// Tells how many messages came, what became of them, and how long the steps took.
pub struct Diagnostics {
    publisher: Publisher<DiagnosticArray>,
    name: String,
    robot: String,
    particles: usize,
    seed: u64,
    progress: Arc<Mutex<Progress>>,
    clock: Clock,
    next: Instant,
    before: Before,
}

/// The counts of the last time, to see what happened since.
#[derive(Clone, Copy, Default, PartialEq)]
struct Before {
    messages: MessageCounts,
    admitted: u64,
    refused: u64,
    lost: u64,
}

impl Diagnostics {
    pub fn new(
        node: &mut r2r::Node,
        robot: &Robot,
        settings: &Settings,
        progress: Arc<Mutex<Progress>>,
    ) -> r2r::Result<Self> {
        Ok(Self {
            publisher: node.create_publisher("/diagnostics", QosProfile::default())?,
            name: format!(
                "{}: contact",
                node.fully_qualified_name()?.trim_start_matches('/')
            ),
            robot: robot.name.clone(),
            particles: settings.filter.particle_count(),
            seed: settings.seed,
            progress,
            clock: Clock::new(node, settings)?,
            next: Instant::now() + PERIOD,
            before: Before::default(),
        })
    }

    /// Publishes if a second has passed.
    pub fn tell(&mut self, input: &JointInput, samples: &Newest<TimedSample>) -> r2r::Result<()> {
        let stamp = self.clock.now();
        let now = Instant::now();
        if now < self.next {
            return Ok(());
        }
        self.next = now + PERIOD;
        let mut progress = {
            let mut shared = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
            let steps = std::mem::take(&mut shared.steps);
            Progress {
                steps,
                ..shared.clone()
            }
        };
        progress.steps.sort_unstable();
        let status = self.status(&progress, input, samples.lost());
        let mut message = DiagnosticArray {
            status: vec![status],
            ..DiagnosticArray::default()
        };
        message.header.stamp = stamp;
        self.publisher.publish(&message)
    }

    fn status(&mut self, progress: &Progress, input: &JointInput, lost: u64) -> DiagnosticStatus {
        let (messages, intake, pairing) = (input.counts(), progress.intake, input.pairing_losses());
        let refused_messages =
            messages.joints_missing + messages.wrong_length + messages.stamp_not_after;
        let now = Before {
            messages,
            admitted: intake.admitted,
            refused: refused_messages + intake.refused(),
            lost,
        };
        let (level, message) = judge(&self.before, &now);
        self.before = now;
        let values = [
            ("status", progress.status.to_owned()),
            ("last stamp, ns", progress.last_stamp_ns.to_string()),
            ("position messages", messages.positions.to_string()),
            ("torque messages", messages.torques.to_string()),
            ("samples used", intake.admitted.to_string()),
            ("samples lost, filter too slow", lost.to_string()),
            (
                "torques without position",
                pairing.torque_without_position.to_string(),
            ),
            (
                "positions without torque",
                pairing.position_without_torque.to_string(),
            ),
            (
                "refused, joint missing",
                messages.joints_missing.to_string(),
            ),
            (
                "refused, wrong length",
                (messages.wrong_length + intake.wrong_length).to_string(),
            ),
            ("refused, not finite", intake.not_finite.to_string()),
            ("refused, too large", intake.too_large.to_string()),
            (
                "refused, stamp not after",
                (messages.stamp_not_after + intake.stamp_not_after).to_string(),
            ),
            ("time started anew", messages.time_jumps.to_string()),
            ("step p50, ms", quantile_ms(&progress.steps, 0.50)),
            ("step p99, ms", quantile_ms(&progress.steps, 0.99)),
            ("particles", self.particles.to_string()),
            ("seed", self.seed.to_string()),
        ];
        DiagnosticStatus {
            level,
            name: self.name.clone(),
            message: message.to_owned(),
            hardware_id: self.robot.clone(),
            values: values
                .map(|(key, value)| KeyValue {
                    key: key.to_owned(),
                    value,
                })
                .to_vec(),
        }
    }
}

/// Level and reason, from what happened in the last second.
fn judge(before: &Before, now: &Before) -> (u8, &'static str) {
    const WARN: u8 = DiagnosticStatus::WARN as u8;
    const ERROR: u8 = DiagnosticStatus::ERROR as u8;
    if now.messages.positions == before.messages.positions {
        (ERROR, "no messages on joint_states")
    } else if now.messages.torques == before.messages.torques {
        (ERROR, "no messages on external_torque")
    } else if now.admitted == before.admitted && now.refused > before.refused {
        (ERROR, "all messages are refused")
    } else if now.admitted == before.admitted {
        (ERROR, "no torque finds a position of its time")
    } else if now.refused > before.refused {
        (WARN, "some messages are refused")
    } else if now.lost > before.lost {
        (
            WARN,
            "the filter is slower than the messages: samples are lost",
        )
    } else {
        (DiagnosticStatus::OK as u8, "working")
    }
}

/// Of durations in ascending order.
fn quantile_ms(sorted: &[Duration], share: f64) -> String {
    let index = (sorted.len().saturating_sub(1) as f64 * share).round() as usize;
    match sorted.get(index) {
        Some(step) => format!("{:.3}", 1e3 * step.as_secs_f64()),
        None => "none".to_owned(),
    }
}
