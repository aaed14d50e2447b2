//! Samples put together in cells of a short time, and means over some of them.

/// Samples are put together in cells that are at least this long, s.
const CELL_SECS: f64 = 0.001;
/// Cells that are remembered.
const CELLS: usize = 256;

/// Mean torques of short times, and how their sum ran.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    dof: usize,
    /// Running sum of the cells' means, by cell (in a ring) and joint.
    sums: Vec<f64>,
    /// Sum of the torques in the cell that is being filled, how many they are, and how long it is, s.
    filling: Vec<f64>,
    samples: f64,
    secs: f64,
    /// Mean length of a cell, s.
    pub(super) cell_secs: f64,
    /// Cells since the begin.
    pub(super) count: usize,
}

impl Cells {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            dof,
            sums: vec![0.0; CELLS * dof],
            filling: vec![0.0; dof],
            samples: 0.0,
            secs: 0.0,
            cell_secs: CELL_SECS,
            count: 0,
        }
    }

    pub(super) fn begin(&mut self) {
        self.empty();
        self.count = 0;
    }

    fn empty(&mut self) {
        self.filling.fill(0.0);
        self.samples = 0.0;
        self.secs = 0.0;
    }

    /// Takes a sample's torques in, and tells whether a cell became full.
    pub(super) fn take(&mut self, torques: impl Iterator<Item = f64>, step_secs: f64) -> bool {
        for (sum, torque) in self.filling.iter_mut().zip(torques) {
            *sum += torque;
        }
        self.samples += 1.0;
        self.secs += step_secs;
        if self.secs + 0.5 * step_secs < CELL_SECS {
            return false;
        }
        let share = (1.0 / (self.count as f64 + 1.0)).max(0.02);
        self.cell_secs += share * (self.secs - self.cell_secs);
        let (last, next) = (self.place(0), self.place(CELLS - 1));
        for joint in 0..self.dof {
            let mean = self.filling[joint] / self.samples;
            self.sums[next + joint] = self.sums[last + joint] + mean;
        }
        self.count += 1;
        self.empty();
        true
    }

    /// Where the running sums are that end so many cells ago.
    fn place(&self, ago: usize) -> usize {
        (self.count + CELLS - ago) % CELLS * self.dof
    }

    /// How many cells a time is.
    pub(super) fn length(&self, secs: f64) -> usize {
        ((secs / self.cell_secs).round() as usize).clamp(1, CELLS / 2 - 1)
    }

    /// For each joint the second difference of the last three cells; none if there are not as many.
    pub(super) fn seconds(&self) -> Option<impl Iterator<Item = f64>> {
        let places = [0, 1, 2, 3].map(|ago| self.place(ago));
        (self.count > 3).then(move || {
            (0..self.dof).map(move |joint| {
                let [now, last, before, first] = places.map(|place| self.sums[place + joint]);
                now - 3.0 * last + 3.0 * before - first
            })
        })
    }

    /// For each joint the last cell less the last but two; there must be as many.
    pub(super) fn about_last_but_one(&self) -> impl Iterator<Item = f64> {
        let places = [0, 1, 2, 3].map(|ago| self.place(ago));
        (0..self.dof).map(move |joint| {
            let [now, last, before, first] = places.map(|place| self.sums[place + joint]);
            (now - last) - (before - first)
        })
    }

    /// Puts the mean of its neighbours in place of the last cell but one.
    pub(super) fn mend(&mut self) {
        let places = [0, 1, 2, 3].map(|ago| self.place(ago));
        for joint in 0..self.dof {
            let [now, last, before, first] = places.map(|place| self.sums[place + joint]);
            let change = 0.5 * (now - last + before - first) - (last - before);
            self.sums[places[0] + joint] += change;
            self.sums[places[1] + joint] += change;
        }
    }

    /// For each joint the mean of the last cells, weighted by how many came before, less the mean of those before; none if
    /// there are not as many.
    pub(super) fn rises(&self, recent: usize, before: usize) -> Option<impl Iterator<Item = f64>> {
        let [end, middle, begin] = [0, recent, recent + before].map(|ago| self.place(ago));
        let weights = (recent * (recent + 1) / 2) as f64;
        (self.count > recent + before).then(move || {
            (0..self.dof).map(move |joint| {
                let end = self.sums[end + joint];
                let since = |ago| end - self.sums[self.place(ago) + joint];
                let lately = (1..=recent).map(since).sum::<f64>() / weights;
                lately - (self.sums[middle + joint] - self.sums[begin + joint]) / before as f64
            })
        })
    }
}

/// Variance of such a mean of so many cells, for those of variance 1.
pub(super) fn ramp_variance(cells: usize) -> f64 {
    let cells = cells as f64;
    (4.0 * cells + 2.0) / (3.0 * cells * (cells + 1.0))
}
