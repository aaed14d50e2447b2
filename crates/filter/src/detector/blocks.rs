//! The last fraction of a second: what it would teach is held back until no contact followed, and taken back otherwise.

use super::bias::BiasFilter;
use super::joint::{JointDetector, Seen};
use super::motion::Motion;

/// Length of a block, s, and how many are held back.
const BLOCK_SECS: f64 = 0.05;
const HELD: usize = 8;

/// One joint's part in a short time without contact.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// The bias when it began.
    bias: BiasFilter,
    seen: Seen,
}

/// The blocks held back, from the oldest on.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Stamp with which each begins, ns.
    begin_ns: [i64; HELD],
    /// Parts by joint.
    parts: Vec<[Option<Part>; HELD]>,
    oldest: usize,
    count: usize,
    /// Length of the newest so far, s.
    secs: f64,
}

impl Blocks {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            begin_ns: [0; HELD],
            parts: vec![[None; HELD]; dof],
            oldest: 0,
            count: 0,
            secs: 0.0,
        }
    }

    /// Drops what is held back.
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes a sample without contact in, and teaches the joints what is old enough.
    pub(super) fn take(
        &mut self,
        stamp_ns: i64,
        step_secs: f64,
        motion: &Motion,
        joints: &mut [JointDetector],
        motion_std: f64,
    ) {
        if self.count == 0 || self.secs >= BLOCK_SECS {
            self.open(stamp_ns, joints, motion_std);
        }
        self.secs += step_secs;
        let newest = (self.oldest + self.count - 1) % HELD;
        let x2 = motion.quickness().powi(2);
        for ((parts, joint), turning) in self.parts.iter_mut().zip(joints).zip(motion.turning()) {
            if let Some(part) = &mut parts[newest] {
                joint.see(&mut part.seen, step_secs, x2, *turning);
            }
        }
    }

    fn open(&mut self, stamp_ns: i64, joints: &mut [JointDetector], motion_std: f64) {
        if self.count == HELD {
            for (parts, joint) in self.parts.iter().zip(&mut *joints) {
                if let Some(part) = &parts[self.oldest] {
                    joint.learn_noise(&part.seen, motion_std);
                }
            }
            self.oldest = (self.oldest + 1) % HELD;
            self.count -= 1;
        }
        let place = (self.oldest + self.count) % HELD;
        self.count += 1;
        self.secs = 0.0;
        self.begin_ns[place] = stamp_ns;
        for (parts, joint) in self.parts.iter_mut().zip(joints) {
            parts[place] = Some(Part {
                bias: joint.bias,
                seen: Seen::default(),
            });
        }
    }

    /// Puts the biases back to what they were before a contact that began at `since_ns`.
    pub(super) fn restore(&mut self, since_ns: i64, joints: &mut [JointDetector]) {
        let mut newest_first = (0..self.count)
            .rev()
            .map(|index| (self.oldest + index) % HELD);
        let before = newest_first.find(|&place| self.begin_ns[place] <= since_ns);
        let place = before.unwrap_or(self.oldest);
        if self.count > 0 {
            for (parts, joint) in self.parts.iter().zip(joints) {
                if let Some(part) = parts[place] {
                    joint.bias = part.bias;
                }
            }
        }
        self.clear();
    }
}
