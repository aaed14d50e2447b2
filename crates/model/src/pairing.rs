//! Pairing of positions and torques that come on two topics.

use std::collections::VecDeque;

use crate::JointSample;

/// What was not paired, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairingLosses {
    /// Torques for which no position came close enough in time.
    pub torque_without_position: u64,
    /// Positions that fell out while they waited for torques, which stopped or lag far behind. Positions between two
    /// torques are no loss: they may come at a higher rate.
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

    /// From now on, pairs stamps that differ by at most `tolerance_ns` nanoseconds.
    pub fn set_tolerance(&mut self, tolerance_ns: i64) {
        self.tolerance_ns = tolerance_ns;
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

#[cfg(test)]
mod tests {
    use super::*;

    fn drain(pairing: &mut Pairing) -> Vec<(i64, f64, f64)> {
        std::iter::from_fn(|| pairing.next_sample())
            .map(|sample| {
                (
                    sample.stamp_ns,
                    sample.position[0],
                    sample.external_torque[0],
                )
            })
            .collect()
    }

    #[test]
    fn a_torque_takes_the_nearest_position_and_keeps_its_own_stamp() {
        let mut pairing = Pairing::new(5);
        for stamp in [0, 10, 20, 30] {
            pairing.push_position(stamp, vec![stamp as f64]);
        }
        for stamp in [4, 16, 20] {
            pairing.push_torque(stamp, vec![-stamp as f64]);
        }
        let expected = [(4, 0.0, -4.0), (16, 20.0, -16.0), (20, 20.0, -20.0)];
        assert_eq!(drain(&mut pairing), expected);
        assert_eq!(pairing.losses().torque_without_position, 0);
    }

    #[test]
    fn the_order_in_which_topics_arrive_does_not_matter() {
        let positions = [0, 10, 20, 30, 40];
        let torques = [1, 12, 18, 39];
        let mut together = Pairing::new(5);
        for stamp in positions {
            together.push_position(stamp, vec![stamp as f64]);
        }
        for stamp in torques {
            together.push_torque(stamp, vec![0.0]);
        }
        let expected = drain(&mut together);
        assert_eq!(expected.len(), 4);

        let mut torques_first = Pairing::new(5);
        for stamp in torques {
            torques_first.push_torque(stamp, vec![0.0]);
        }
        let mut found = Vec::new();
        for stamp in positions {
            torques_first.push_position(stamp, vec![stamp as f64]);
            found.extend(drain(&mut torques_first));
        }
        assert_eq!(found, expected);
    }

    #[test]
    fn a_torque_waits_until_a_position_at_or_after_it_is_known() {
        let mut pairing = Pairing::new(5);
        pairing.push_position(0, vec![1.0]);
        pairing.push_torque(3, vec![2.0]);
        assert_eq!(pairing.next_sample(), None);
        pairing.push_position(4, vec![3.0]);
        assert_eq!(drain(&mut pairing), [(3, 3.0, 2.0)]);
    }

    #[test]
    fn a_torque_too_far_from_any_position_is_counted_and_skipped() {
        let mut pairing = Pairing::new(5);
        pairing.push_position(0, vec![1.0]);
        pairing.push_position(100, vec![2.0]);
        pairing.push_torque(50, vec![3.0]);
        pairing.push_torque(97, vec![4.0]);
        assert_eq!(drain(&mut pairing), [(97, 2.0, 4.0)]);
        assert_eq!(pairing.losses().torque_without_position, 1);
    }

    #[test]
    fn positions_between_torques_are_no_loss_but_positions_without_any_are() {
        let mut pairing = Pairing::new(5);
        for stamp in 0..2000 {
            pairing.push_position(stamp, vec![0.0]);
            if stamp % 10 == 0 {
                pairing.push_torque(stamp, vec![0.0]);
                assert_eq!(drain(&mut pairing).len(), 1);
            }
        }
        assert_eq!(pairing.losses(), PairingLosses::default());
        for stamp in 2000..2500 {
            pairing.push_position(stamp, vec![0.0]);
        }
        // The position of the last torque, 1990, is the oldest that waits.
        let expected = PairingLosses {
            position_without_torque: 510 - 256,
            ..PairingLosses::default()
        };
        assert_eq!(pairing.losses(), expected);
    }

    #[test]
    fn what_waits_is_bounded_and_what_falls_out_is_counted() {
        let mut pairing = Pairing::new(5);
        for stamp in 0..300 {
            pairing.push_torque(stamp, vec![0.0]);
        }
        assert_eq!(pairing.losses().torque_without_position, 300 - 256);
        let mut pairing = Pairing::new(5);
        for stamp in 0..300 {
            pairing.push_position(stamp, vec![0.0]);
        }
        assert_eq!(pairing.losses().position_without_torque, 300 - 256);
    }

    #[test]
    fn clearing_forgets_what_waits_but_not_the_counts() {
        let mut pairing = Pairing::new(5);
        pairing.push_position(0, vec![1.0]);
        pairing.push_position(100, vec![2.0]);
        pairing.push_torque(50, vec![3.0]);
        assert_eq!(pairing.next_sample(), None);
        pairing.push_torque(100, vec![3.0]);
        pairing.clear();
        assert_eq!(pairing.next_sample(), None);
        assert_eq!(pairing.losses().torque_without_position, 1);
    }
}
