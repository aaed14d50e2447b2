//! The filter along a row of samples, as a live node would see them.

use std::time::{Duration, Instant};

use anyhow::Result;
use palpate_filter::{ContactStatus, Filter, Intake, IntakeCounts, Mode, Refusal};
use palpate_model::JointSample;

/// What the filter said at one sample.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Stamp of the sample, ns.
    pub stamp_ns: i64,
    /// What is known.
    pub status: ContactStatus,
    /// The most probable explanation; none without contact.
    pub best: Option<Mode>,
}

/// What the filter said all along.
pub struct Track {
    /// One entry an admitted sample.
    pub estimates: Vec<Estimated>,
    /// What was admitted and refused.
    pub counts: IntakeCounts,
    /// How often time started anew, and the filter with it.
    pub restarts: u64,
    /// Time that the filter itself took.
    pub filter_time: Duration,
}

impl Track {
    /// Share of the estimates with this status.
    pub fn share(&self, status: ContactStatus) -> f64 {
        let with = self.estimates.iter().filter(|e| e.status == status).count();
        with as f64 / self.estimates.len().max(1) as f64
    }

    /// Time from the first to the last sample, s.
    pub fn span_secs(&self) -> f64 {
        match (self.estimates.first(), self.estimates.last()) {
            (Some(first), Some(last)) => (last.stamp_ns - first.stamp_ns) as f64 * 1e-9,
            _ => 0.0,
        }
    }
}

/// Feeds `samples` of `dof` joints to the filter and shows each admitted one to `see`, after the update. A stamp that lies
/// further back than `time_jump_secs` starts time and filter anew; other stamps that do not advance are refused.
pub fn track(
    filter: &mut Filter,
    dof: usize,
    samples: &[JointSample],
    time_jump_secs: f64,
    mut see: impl FnMut(&JointSample, &Filter) -> Result<()>,
) -> Result<Track> {
    let mut intake = Intake::new(dof);
    let mut track = Track {
        estimates: Vec::with_capacity(samples.len()),
        counts: IntakeCounts::default(),
        restarts: 0,
        filter_time: Duration::ZERO,
    };
    for sample in samples {
        if let Some(last) = track.estimates.last() {
            let back_secs = last.stamp_ns.saturating_sub(sample.stamp_ns) as f64 * 1e-9;
            if back_secs > time_jump_secs {
                tracing::warn!("stamps jump back by {back_secs:.3} s: the filter starts anew");
                intake.restart();
                filter.reset();
                track.restarts += 1;
            }
        }
        match intake.admit(sample) {
            Ok(admitted) => {
                let start = Instant::now();
                let estimate = filter.update(admitted);
                track.filter_time += start.elapsed();
                track.estimates.push(Estimated {
                    stamp_ns: estimate.stamp_ns,
                    status: estimate.status,
                    best: estimate.best().cloned(),
                });
                see(sample, filter)?;
            }
            Err(refusal) => note(&refusal, intake.counts()),
        }
    }
    track.counts = intake.counts();
    Ok(track)
}

/// Tells the first refusal; the others are counted.
fn note(refusal: &Refusal, counts: IntakeCounts) {
    if counts.refused() == 1 {
        tracing::warn!("sample refused: {refusal}; further ones are only counted");
    }
}
