//! The gate before the filter: wrong samples are refused here, so that `update` cannot fail.

use palpate_model::JointSample;

/// Largest position (rad, m) and torque (Nm, N) that is believed: larger ones would overflow when squared twice.
const MOST: f64 = 1e9;

/// Why a sample was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
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
    /// A value is NaN or infinite.
    #[error("{what} of joint {joint} is {value}, expected a finite number")]
    NotFinite {
        /// Which array.
        what: &'static str,
        /// Index of the joint.
        joint: usize,
        /// The value found.
        value: f64,
    },
    /// A value is beyond all that a robot can report.
    #[error("{what} of joint {joint} is {value}, expected at most {most} in size")]
    TooLarge {
        /// Which array.
        what: &'static str,
        /// Index of the joint.
        joint: usize,
        /// Largest size allowed.
        most: f64,
        /// The value found.
        value: f64,
    },
    /// The stamp is not after the last one.
    #[error("stamp {found_ns} ns is not after the last one, {last_ns} ns")]
    StampNotAfter {
        /// The last admitted stamp.
        last_ns: i64,
        /// The refused stamp.
        found_ns: i64,
    },
}

/// How many samples were admitted and refused, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IntakeCounts {
    /// Samples that went on to the filter.
    pub admitted: u64,
    /// Refused for an array's length.
    pub wrong_length: u64,
    /// Refused for NaN or infinity.
    pub not_finite: u64,
    /// Refused for a value of absurd size.
    pub too_large: u64,
    /// Refused for a stamp that does not advance.
    pub stamp_not_after: u64,
}

impl IntakeCounts {
    /// All that were refused.
    pub fn refused(&self) -> u64 {
        self.wrong_length + self.not_finite + self.too_large + self.stamp_not_after
    }
}

/// A sample that the filter can rely on: right lengths, finite values, a stamp after the last one.
#[derive(Clone, Copy, Debug)]
pub struct Admitted<'a>(&'a JointSample);

impl<'a> Admitted<'a> {
    /// The sample.
    pub fn sample(&self) -> &'a JointSample {
        self.0
    }
}

/// Admits or refuses samples for a robot with a given number of joints, and counts both.
#[derive(Clone, Debug)]
pub struct Intake {
    dof: usize,
    last_ns: Option<i64>,
    counts: IntakeCounts,
}

impl Intake {
    /// A gate for samples of `dof` joints.
    pub fn new(dof: usize) -> Self {
        Self {
            dof,
            last_ns: None,
            counts: IntakeCounts::default(),
        }
    }

    /// Admits a sample.
    ///
    /// # Errors
    /// Says which value is wrong, what was expected and what was found.
    pub fn admit<'a>(&mut self, sample: &'a JointSample) -> Result<Admitted<'a>, Refusal> {
        let checked = self.check(sample);
        match checked {
            Ok(()) => self.counts.admitted += 1,
            Err(Refusal::Length { .. }) => self.counts.wrong_length += 1,
            Err(Refusal::NotFinite { .. }) => self.counts.not_finite += 1,
            Err(Refusal::TooLarge { .. }) => self.counts.too_large += 1,
            Err(Refusal::StampNotAfter { .. }) => self.counts.stamp_not_after += 1,
        }
        checked?;
        self.last_ns = Some(sample.stamp_ns);
        Ok(Admitted(sample))
    }

    fn check(&self, sample: &JointSample) -> Result<(), Refusal> {
        check_values("position", &sample.position, self.dof)?;
        check_values("external torque", &sample.external_torque, self.dof)?;
        match self.last_ns {
            Some(last_ns) if sample.stamp_ns <= last_ns => Err(Refusal::StampNotAfter {
                last_ns,
                found_ns: sample.stamp_ns,
            }),
            _ => Ok(()),
        }
    }

    /// Forgets the last stamp, as after a jump back in time, so that time may start anew. The counts stay.
    pub fn restart(&mut self) {
        self.last_ns = None;
    }

    /// What was admitted and refused so far.
    pub fn counts(&self) -> IntakeCounts {
        self.counts
    }
}

fn check_values(what: &'static str, values: &[f64], expected: usize) -> Result<(), Refusal> {
    if values.len() != expected {
        return Err(Refusal::Length {
            what,
            expected,
            found: values.len(),
        });
    }
    for (joint, &value) in values.iter().enumerate() {
        if !value.is_finite() {
            return Err(Refusal::NotFinite { what, joint, value });
        }
        if value.abs() > MOST {
            return Err(Refusal::TooLarge {
                what,
                joint,
                most: MOST,
                value,
            });
        }
    }
    Ok(())
}
