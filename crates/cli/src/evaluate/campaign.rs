//! Many trials at once, none of them twice.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Context, Result};
use indicatif::ProgressBar;

use super::trial::{Cell, Outcome, Setup};

/// Trials and their outcomes.
pub struct Campaign {
    /// How they are made.
    pub setup: Setup,
    /// How many run at the same time.
    threads: usize,
    outcomes: BTreeMap<Cell, Vec<Outcome>>,
    /// Time that all trials took together, s, and their number, for each estimator's name.
    pub taken: BTreeMap<&'static str, (f64, usize)>,
}

impl Campaign {
    /// Without trials yet, to be run on so many threads; 0 is one a core.
    pub fn new(setup: Setup, asked_threads: usize) -> Self {
        Self {
            setup,
            threads: threads(asked_threads),
            outcomes: BTreeMap::new(),
            taken: BTreeMap::new(),
        }
    }

    /// How many trials run at the same time.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Outcomes of a cell, in the order of trials.
    pub fn outcomes(&self, cell: &Cell) -> &[Outcome] {
        self.outcomes.get(cell).map_or(&[], Vec::as_slice)
    }

    /// Every cell that was run, with its outcomes.
    pub fn all(&self) -> impl Iterator<Item = (&Cell, &Vec<Outcome>)> {
        self.outcomes.iter()
    }

    /// Trials of these cells that have not yet been run.
    pub fn missing(&self, cells: &[Cell]) -> Vec<(Cell, usize)> {
        let new: BTreeSet<_> = (cells.iter())
            .filter(|cell| !self.outcomes.contains_key(cell))
            .collect();
        new.into_iter()
            .flat_map(|cell| (0..self.setup.trials).map(|number| (*cell, number)))
            .collect()
    }

    /// Runs the trials of these cells that have not yet been run. The outcomes do not depend on the number of threads.
    pub fn run(&mut self, cells: &[Cell], bar: &ProgressBar) -> Result<()> {
        let trials = self.missing(cells);
        let results = in_parallel(self.threads, trials.len(), |index| {
            let (cell, number) = &trials[index];
            let start = Instant::now();
            let outcome = self.setup.run(cell, *number).with_context(|| {
                format!("trial {number} of {} on link {}", cell.condition, cell.link)
            })?;
            bar.inc(1);
            Ok((outcome, start.elapsed().as_secs_f64()))
        })?;
        for ((cell, _), (outcome, secs)) in trials.into_iter().zip(results) {
            self.outcomes.entry(cell).or_default().push(outcome);
            let taken = self.taken.entry(cell.estimator.name()).or_default();
            *taken = (taken.0 + secs, taken.1 + 1);
        }
        Ok(())
    }
}

/// The number of threads for the one asked for, of which 0 is one a core.
pub fn threads(asked: usize) -> usize {
    match asked {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        asked => asked,
    }
}

/// Calls `work` for 0 to `count` on several threads, each with a pool of one for what the filter does in parallel; gives
/// the results in order, or the first error.
pub fn in_parallel<T: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new((0..count).map(|_| None).collect::<Vec<Option<Result<T>>>>());
    let failed = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, count.max(1)) {
            scope.spawn(|| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= count || failed.load(Ordering::Relaxed) {
                        break;
                    }
                    let result = match &pool {
                        Ok(pool) => pool.install(|| work(index)),
                        Err(error) => Err(anyhow::anyhow!("cannot start a thread: {error}")),
                    };
                    failed.fetch_or(result.is_err(), Ordering::Relaxed);
                    if let Ok(mut results) = results.lock() {
                        results[index] = Some(result);
                    }
                }
            });
        }
    });
    let results = results
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    // After a failure the later ones are missing; the failure itself comes first.
    let (done, missing): (Vec<_>, Vec<_>) = results.into_iter().partition(Option::is_some);
    let done: Result<Vec<T>> = done.into_iter().flatten().collect();
    let done = done?;
    anyhow::ensure!(missing.is_empty(), "{} trials were not run", missing.len());
    Ok(done)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_whatever_the_threads() {
        for threads in [1, 3] {
            let squares = in_parallel(threads, 50, |index| Ok(index * index)).unwrap();
            assert_eq!(squares, (0..50).map(|i| i * i).collect::<Vec<_>>());
        }
        assert!(in_parallel(2, 0, |_| Ok(())).unwrap().is_empty());
    }

    #[test]
    fn an_error_ends_it() {
        let told = in_parallel(2, 50, |index| match index {
            7 => anyhow::bail!("seven"),
            _ => Ok(index),
        });
        assert_eq!(told.unwrap_err().to_string(), "seven");
    }
}
