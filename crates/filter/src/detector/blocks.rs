//! The last fraction of a second: what it would teach is held back until no contact followed, and taken back otherwise.

use super::bias::BiasFilter;
use super::joint::{JointDetector, SCALES};
use super::noise::Exposure;

/// Length of a block, s, and how many are held back.
const BLOCK_SECS: f64 = 0.05;
const HELD: usize = 8;

/// A short time without contact.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    begin_ns: i64,
    secs: f64,
    /// Squared quickness of the motion, times time.
    motion: f64,
}

/// One joint's part in it.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// The bias when it began.
    bias: BiasFilter,
    /// Squares of the smoothed residuals, times time.
    squares: [f64; SCALES.len()],
}

/// The blocks held back, the newest last in `order`.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    blocks: [Block; HELD],
    /// Parts by joint.
    parts: Vec<[Option<Part>; HELD]>,
    oldest: usize,
    count: usize,
    exposure: Exposure,
}

impl Blocks {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            blocks: [Block::default(); HELD],
            parts: vec![[None; HELD]; dof],
            oldest: 0,
            count: 0,
            exposure: Exposure::default(),
        }
    }

    /// Drops what is held back.
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Forgets also what was learned.
    pub(super) fn forget(&mut self) {
        self.exposure = Exposure::default();
    }

    /// Takes a sample without contact in, and teaches the joints what is old enough.
    pub(super) fn take(
        &mut self,
        stamp_ns: i64,
        step_secs: f64,
        x2: f64,
        joints: &mut [JointDetector],
        motion_std: f64,
    ) {
        let newest = (self.oldest + self.count + HELD - 1) % HELD;
        let is_open = self.count > 0 && self.blocks[newest].secs < BLOCK_SECS;
        let place = match is_open {
            true => newest,
            false => self.open(stamp_ns, joints, motion_std),
        };
        let block = &mut self.blocks[place];
        block.secs += step_secs;
        block.motion += step_secs * x2;
        for (parts, joint) in self.parts.iter_mut().zip(joints) {
            if let Some(part) = &mut parts[place] {
                for (sum, smoothed) in part.squares.iter_mut().zip(joint.smoothed) {
                    *sum += step_secs * smoothed * smoothed;
                }
            }
        }
    }

    fn open(&mut self, stamp_ns: i64, joints: &mut [JointDetector], motion_std: f64) -> usize {
        if self.count == HELD {
            self.teach(joints, motion_std);
        }
        let place = (self.oldest + self.count) % HELD;
        self.count += 1;
        self.blocks[place] = Block {
            begin_ns: stamp_ns,
            ..Block::default()
        };
        for (parts, joint) in self.parts.iter_mut().zip(joints) {
            parts[place] = Some(Part {
                bias: joint.bias,
                squares: [0.0; SCALES.len()],
            });
        }
        place
    }

    /// Teaches the oldest block to the joints.
    fn teach(&mut self, joints: &mut [JointDetector], motion_std: f64) {
        let Block { secs, motion, .. } = self.blocks[self.oldest];
        let x2 = motion / secs;
        self.exposure.take(secs, x2);
        for (parts, joint) in self.parts.iter().zip(joints) {
            let Some(part) = parts[self.oldest] else {
                continue;
            };
            for (spread, squares) in joint.spread.iter_mut().zip(part.squares) {
                spread.take(squares / secs, secs, x2, &self.exposure, motion_std);
            }
        }
        self.oldest = (self.oldest + 1) % HELD;
        self.count -= 1;
    }

    /// Puts the biases back to what they were before a contact that began at `since_ns`.
    pub(super) fn restore(&mut self, since_ns: i64, joints: &mut [JointDetector]) {
        let mut newest_first = (0..self.count)
            .rev()
            .map(|index| (self.oldest + index) % HELD);
        let before = newest_first.find(|&place| self.blocks[place].begin_ns <= since_ns);
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
