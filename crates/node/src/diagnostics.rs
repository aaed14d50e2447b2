//! What the node tells about itself on `/diagnostics`, once a second.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use palpate_filter::Settings;
use palpate_model::Robot;
use palpate_node::{Health, JointInput, Level, Losses, Rates, judge};
use r2r::builtin_interfaces::msg::Time;
use r2r::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use r2r::{Publisher, QosProfile};

use crate::estimation::Progress;
use palpate_node::messages;

const PERIOD: Duration = Duration::from_secs(1);

/// What there is to tell of, once the robot is known.
pub struct Observed<'a> {
    pub robot: &'a Robot,
    pub input: &'a JointInput,
    /// Samples that were lost because the filter is too slow.
    pub lost: u64,
    pub progress: &'a Mutex<Progress>,
}

/// Tells how many messages came, what became of them, how long the steps took and what the filter knows.
pub struct Diagnostics {
    publisher: Publisher<DiagnosticArray>,
    name: String,
    last: Instant,
    before: Losses,
}

impl Diagnostics {
    pub fn new(node: &mut r2r::Node) -> r2r::Result<Self> {
        let name = node.fully_qualified_name()?;
        Ok(Self {
            publisher: node.create_publisher("/diagnostics", QosProfile::default())?,
            name: format!("{}: contact", name.trim_start_matches('/')),
            last: Instant::now(),
            before: Losses::default(),
        })
    }

    /// Publishes if a second has passed. `now` is the node's time; `refusal` is why the last description was refused.
    pub fn tell(
        &mut self,
        now: &Time,
        settings: &Settings,
        observed: Option<Observed<'_>>,
        refusal: Option<&str>,
    ) -> r2r::Result<()> {
        let elapsed = self.last.elapsed();
        if elapsed < PERIOD {
            return Ok(());
        }
        self.last = Instant::now();
        let mut status = match observed {
            Some(observed) => self.status(now, settings, &observed, elapsed),
            None => DiagnosticStatus {
                level: DiagnosticStatus::ERROR as u8,
                message: "waiting for the robot's description".to_owned(),
                ..DiagnosticStatus::default()
            },
        };
        status.name.clone_from(&self.name);
        if let Some(refusal) = refusal {
            status.values.push(pair("description refused", refusal));
        }
        let mut message = DiagnosticArray {
            status: vec![status],
            ..DiagnosticArray::default()
        };
        message.header.stamp = now.clone();
        self.publisher.publish(&message)
    }

    fn status(
        &mut self,
        now: &Time,
        settings: &Settings,
        observed: &Observed<'_>,
        elapsed: Duration,
    ) -> DiagnosticStatus {
        let progress = look(observed.progress);
        let losses = losses(observed, &progress);
        // Another robot begins at zero.
        let before = match losses.is_after(&self.before) {
            true => self.before,
            false => Losses::default(),
        };
        self.before = losses;
        let now_ns = messages::nanoseconds(now);
        let age_secs = (progress.last_stamp_ns).map(|last_ns| (now_ns - last_ns) as f64 * 1e-9);
        let rates = Rates::between(&before, &losses, elapsed);
        let (level, message) = judge(&Health {
            before,
            now: losses,
            age_secs,
            is_disabled: progress.is_disabled,
            is_together: settings.input.source.has_both(),
        });
        let mut values = counts(observed, &progress, &losses);
        values.extend([
            pair("positions, Hz", format!("{:.1}", rates.positions)),
            pair("torques, Hz", format!("{:.1}", rates.torques)),
            pair("samples used, Hz", format!("{:.1}", rates.used)),
            pair("age of the newest sample, s", seconds(age_secs)),
        ]);
        values.extend(delays(observed.input));
        values.extend(figures(settings, &progress));
        DiagnosticStatus {
            level: match level {
                Level::Ok => DiagnosticStatus::OK as u8,
                Level::Warn => DiagnosticStatus::WARN as u8,
                Level::Error => DiagnosticStatus::ERROR as u8,
            },
            message: message.to_owned(),
            hardware_id: observed.robot.name.clone(),
            values,
            ..DiagnosticStatus::default()
        }
    }
}

/// Takes the steps' times out, sorted.
fn look(progress: &Mutex<Progress>) -> Progress {
    let mut looked = {
        // Estimation waits for this.
        let mut shared = progress.lock().unwrap_or_else(PoisonError::into_inner);
        let steps = std::mem::take(&mut shared.steps);
        Progress {
            steps,
            ..shared.clone()
        }
    };
    looked.steps.sort_unstable();
    looked
}

fn losses(observed: &Observed<'_>, progress: &Progress) -> Losses {
    let (messages, intake) = (observed.input.counts(), progress.intake);
    let refused = messages.joints_missing
        + messages.wrong_length
        + messages.stamp_not_after
        + messages.unreadable
        + messages.unmeasured;
    Losses {
        positions: messages.positions,
        torques: messages.torques,
        used: intake.admitted,
        refused: refused + intake.refused(),
        unpaired: observed.input.pairing_losses().torque_without_position,
        lost: observed.lost,
    }
}

fn counts(observed: &Observed<'_>, progress: &Progress, losses: &Losses) -> Vec<KeyValue> {
    let (messages, intake) = (observed.input.counts(), progress.intake);
    let pairing = observed.input.pairing_losses();
    let wrong_length = messages.wrong_length + intake.wrong_length;
    let stamp_not_after = messages.stamp_not_after + intake.stamp_not_after;
    [
        ("position messages", messages.positions),
        ("torque messages", messages.torques),
        ("samples used", intake.admitted),
        ("samples lost, filter too slow", losses.lost),
        ("torques without position", pairing.torque_without_position),
        ("positions without torque", pairing.position_without_torque),
        ("refused, joint missing", messages.joints_missing),
        ("refused, wrong length", wrong_length),
        ("refused, unreadable", messages.unreadable),
        ("refused, not measured", messages.unmeasured),
        (
            "torques beyond their limit",
            observed.input.beyond_limit().0,
        ),
        ("refused, not finite", intake.not_finite),
        ("refused, too large", intake.too_large),
        ("refused, stamp not after", stamp_not_after),
        ("time started anew", messages.time_jumps),
    ]
    .map(|(key, count)| pair(key, count))
    .to_vec()
}

/// How the clocks differ, as far as the messages tell.
fn delays(input: &JointInput) -> [KeyValue; 4] {
    let delays = input.delays();
    let secs = |ns: Option<i64>| seconds(ns.map(|ns| ns as f64 * 1e-9));
    let between = (delays.torque_ns.zip(delays.position_ns))
        .map(|(torque_ns, position_ns)| torque_ns.saturating_sub(position_ns));
    [
        pair("position stamps behind now, s", secs(delays.position_ns)),
        pair("torque stamps behind now, s", secs(delays.torque_ns)),
        pair("torque stamps behind positions', s", secs(between)),
        pair(
            "controller's clock behind now, s",
            secs(delays.controller_ns),
        ),
    ]
}

fn figures(settings: &Settings, progress: &Progress) -> [KeyValue; 10] {
    let bias_age = (progress.last_stamp_ns.zip(progress.tared_ns))
        .map(|(last_ns, tared_ns)| (last_ns - tared_ns) as f64 * 1e-9);
    [
        pair("status", progress.status),
        pair("last stamp, ns", progress.last_stamp_ns.unwrap_or_default()),
        pair("step p50, ms", quantile_ms(&progress.steps, 0.50)),
        pair("step p99, ms", quantile_ms(&progress.steps, 0.99)),
        pair("step max, ms", quantile_ms(&progress.steps, 1.0)),
        pair("particles", progress.particles),
        pair(
            "effective sample size",
            format!("{:.1}", progress.effective_sample_size),
        ),
        pair(
            "spread of the particles, m",
            format!("{:.4}", progress.spread),
        ),
        pair("seed", settings.seed),
        pair("age of the tare, s", seconds(bias_age)),
    ]
}

fn pair(key: &str, value: impl ToString) -> KeyValue {
    KeyValue {
        key: key.to_owned(),
        value: value.to_string(),
    }
}

fn seconds(secs: Option<f64>) -> String {
    secs.map_or("none".to_owned(), |secs| format!("{secs:.3}"))
}

/// Of durations in ascending order.
fn quantile_ms(sorted: &[Duration], share: f64) -> String {
    let index = (sorted.len().saturating_sub(1) as f64 * share).round() as usize;
    match sorted.get(index) {
        Some(step) => format!("{:.3}", 1e3 * step.as_secs_f64()),
        None => "none".to_owned(),
    }
}
