//! Pairing of positions and torques that come on two topics.

use std::collections::VecDeque;

use crate::JointSample;

/// What was not paired, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairingLosses {
    /// Torques for which no position came close enough in time.
    pub torque_without_position: u64,
    /// Positions that no torque asked for.
    pub position_without_torque: u64,
}

/// Pairs each torque with the position nearest in time, within a tolerance. Works live and offline alike.
///
/// The two topics may differ in rate and either may run ahead: a torque waits until a position at or after its stamp
/// has come, so that the nearest one is known.
#[derive(Clone, Debug)]
pub struct Pairing {
    tolerance_ns: i64,
    positions: VecDeque<(i64, Vec<f64>)>,
    torques: VecDeque<(i64, Vec<f64>)>,
    losses: PairingLosses,
}

impl Pairing {
    /// At most so many of each wait for their partner; the oldest goes first.
    const WAITING: usize = 256;

    /// Pairs stamps that differ by at most `tolerance_ns` nanoseconds.
    pub fn new(tolerance_ns: i64) -> Self {
        Self {
            tolerance_ns,
            positions: VecDeque::new(),
            torques: VecDeque::new(),
            losses: PairingLosses::default(),
        }
    }

    /// Takes joint positions (in the robot's order); then call [`Pairing::next_sample`] until it gives none.
    pub fn push_position(&mut self, stamp_ns: i64, position: Vec<f64>) {
        if self.positions.len() == Self::WAITING {
            self.positions.pop_front();
            self.losses.position_without_torque += 1;
        }
        self.positions.push_back((stamp_ns, position));
    }

    /// Takes external torques (in the robot's order); then call [`Pairing::next_sample`] until it gives none.
    pub fn push_torque(&mut self, stamp_ns: i64, torque: Vec<f64>) {
        if self.torques.len() == Self::WAITING {
            self.torques.pop_front();
            self.losses.torque_without_position += 1;
        }
        self.torques.push_back((stamp_ns, torque));
    }

    /// The next pair whose members are known for certain, stamped with the torque's stamp.
    pub fn next_sample(&mut self) -> Option<JointSample> {
        loop {
            let torque_ns = self.torques.front()?.0;
            if self.positions.back()?.0 < torque_ns {
                return None;
            }
            let external_torque = self.torques.pop_front()?.1;
            self.drop_positions_before(torque_ns);
            let (position_ns, position) = self.positions.front()?;
            if (position_ns - torque_ns).abs() <= self.tolerance_ns {
                return Some(JointSample {
                    stamp_ns: torque_ns,
                    position: position.clone(),
                    external_torque,
                });
            }
            self.losses.torque_without_position += 1;
        }
    }

    /// Leaves the position nearest to `torque_ns` at the front.
    fn drop_positions_before(&mut self, torque_ns: i64) {
        while let (Some(first), Some(second)) = (self.positions.front(), self.positions.get(1)) {
            if (second.0 - torque_ns).abs() > (first.0 - torque_ns).abs() {
                break;
            }
            self.positions.pop_front();
        }
    }

    /// What was not paired so far.
    pub fn losses(&self) -> PairingLosses {
        self.losses
    }

    /// Forgets what waits, as after a jump in time; the counts stay.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.torques.clear();
    }
}
