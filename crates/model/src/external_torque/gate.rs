//! What is wrong with a measured sample.

use crate::{MeasuredSample, Robot};

/// Largest value that is believed: larger ones would overflow when squared twice.
const MOST: f64 = 1e9;

/// Why a measured sample was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TorqueRefusal {
    /// An array has the wrong number of entries.
    #[error("{what} has {found} values, expected {expected}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Number of joints of the robot.
        expected: usize,
        /// Number of values found.
        found: usize,
    },
    /// A value is NaN, infinite, or beyond all that a robot can report.
    #[error("{what} of joint {joint} is {value}, expected a number of at most 1e9 in size")]
    Value {
        /// Which array.
        what: &'static str,
        /// Name of the joint.
        joint: String,
        /// The value found.
        value: f64,
    },
    /// The sample has no speeds, or one of them is not finite.
    #[error(
        "velocity of joint {joint} is {found}, expected a number in rad/s: where the driver gives none, set \
         torque.velocity.source to differentiated"
    )]
    Velocity {
        /// Name of the joint.
        joint: String,
        /// The value found, or `absent`.
        found: String,
    },
    /// The stamp is not after the last one.
    #[error("stamp {found_ns} ns is not after the last one, {last_ns} ns")]
    StampNotAfter {
        /// The last stamp.
        last_ns: i64,
        /// The refused stamp.
        found_ns: i64,
    },
}

/// A measured torque beyond its joint's limit in the URDF.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "measured torque of joint {joint} is {found}, beyond its limit of {limit} in the URDF: is it saturated, or in another \
     unit?"
)]
pub struct BeyondLimit {
    /// Name of the joint.
    pub joint: String,
    /// The limit's effort, Nm or N.
    pub limit: f64,
    /// The torque found, Nm or N.
    pub found: f64,
}

/// What became of measured samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TorqueCounts {
    /// Samples that gave an external torque.
    pub used: u64,
    /// Of these, those with a torque beyond its joint's limit: a hard collision, a saturated sensor, or a wrong unit. They
    /// are used, as the first must not be lost.
    pub beyond_limit: u64,
    /// Refused for an array's length.
    pub wrong_length: u64,
    /// Refused for a position or a torque that is no number, or absurd.
    pub wrong_value: u64,
    /// Refused for a missing speed.
    pub velocity_missing: u64,
    /// Refused for a stamp that does not advance.
    pub stamp_not_after: u64,
}

impl TorqueCounts {
    /// All that were refused.
    pub fn refused(&self) -> u64 {
        self.wrong_length + self.wrong_value + self.velocity_missing + self.stamp_not_after
    }
}

/// Admits measured samples or refuses them, and counts both.
#[derive(Clone, Debug)]
pub(super) struct Gate {
    joints: Vec<String>,
    /// The effort's limits; infinite where the URDF has none.
    limits: Vec<f64>,
    needs_velocity: bool,
    last_ns: Option<i64>,
    counts: TorqueCounts,
    beyond_limit: Option<BeyondLimit>,
}

impl Gate {
    pub fn new(robot: &Robot, needs_velocity: bool) -> Self {
        let limit = |joint: &crate::Joint| {
            let effort = joint.limits.map(|limits| limits.effort);
            effort
                .filter(|effort| *effort > 0.0)
                .unwrap_or(f64::INFINITY)
        };
        Self {
            joints: robot
                .joints
                .iter()
                .map(|joint| joint.name.clone())
                .collect(),
            limits: robot.joints.iter().map(limit).collect(),
            needs_velocity,
            last_ns: None,
            counts: TorqueCounts::default(),
            beyond_limit: None,
        }
    }

    /// The time since the last sample, s; none for the first.
    pub fn pass(&mut self, sample: &MeasuredSample) -> Result<Option<f64>, TorqueRefusal> {
        let checked = self.check(sample);
        match &checked {
            Ok(()) => self.counts.used += 1,
            Err(TorqueRefusal::Length { .. }) => self.counts.wrong_length += 1,
            Err(TorqueRefusal::Value { .. }) => self.counts.wrong_value += 1,
            Err(TorqueRefusal::Velocity { .. }) => self.counts.velocity_missing += 1,
            Err(TorqueRefusal::StampNotAfter { .. }) => self.counts.stamp_not_after += 1,
        }
        checked?;
        self.watch_limits(sample);
        let last_ns = self.last_ns.replace(sample.stamp_ns);
        Ok(last_ns.map(|last_ns| sample.stamp_ns.saturating_sub(last_ns) as f64 * 1e-9))
    }

    fn check(&self, sample: &MeasuredSample) -> Result<(), TorqueRefusal> {
        self.check_values("position", &sample.position)?;
        self.check_values("measured torque", &sample.torque)?;
        if self.needs_velocity {
            self.check_velocity(&sample.velocity)?;
        }
        match self.last_ns {
            Some(last_ns) if sample.stamp_ns <= last_ns => Err(TorqueRefusal::StampNotAfter {
                last_ns,
                found_ns: sample.stamp_ns,
            }),
            _ => Ok(()),
        }
    }

    fn check_values(&self, what: &'static str, values: &[f64]) -> Result<(), TorqueRefusal> {
        let (expected, found) = (self.joints.len(), values.len());
        if found != expected {
            return Err(TorqueRefusal::Length {
                what,
                expected,
                found,
            });
        }
        match (self.joints.iter().zip(values)).find(|(_, value)| !is_sound(**value)) {
            None => Ok(()),
            Some((joint, &value)) => Err(TorqueRefusal::Value {
                what,
                joint: joint.clone(),
                value,
            }),
        }
    }

    fn check_velocity(&self, velocity: &[f64]) -> Result<(), TorqueRefusal> {
        for (index, joint) in self.joints.iter().enumerate() {
            let found = velocity.get(index);
            if !found.is_some_and(|speed| is_sound(*speed)) {
                return Err(TorqueRefusal::Velocity {
                    joint: joint.clone(),
                    found: found.map_or("absent".to_owned(), f64::to_string),
                });
            }
        }
        Ok(())
    }

    fn watch_limits(&mut self, sample: &MeasuredSample) {
        let beyond = |(torque, limit): (&f64, &f64)| torque.abs() > *limit;
        let Some(index) = sample.torque.iter().zip(&self.limits).position(beyond) else {
            return;
        };
        self.counts.beyond_limit += 1;
        if self.beyond_limit.is_none() {
            self.beyond_limit = Some(BeyondLimit {
                joint: self.joints[index].clone(),
                limit: self.limits[index],
                found: sample.torque[index],
            });
        }
    }

    pub fn counts(&self) -> TorqueCounts {
        self.counts
    }

    pub fn beyond_limit(&self) -> Option<&BeyondLimit> {
        self.beyond_limit.as_ref()
    }

    pub fn restart(&mut self) {
        self.last_ns = None;
    }
}

fn is_sound(value: f64) -> bool {
    value.abs() <= MOST
}
