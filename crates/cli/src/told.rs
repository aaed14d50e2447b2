//! What a run of the demo told: estimate against truth.

use comfy_table::Table;
use palpate_filter::{Filter, Scene};
use palpate_model::Robot;
use palpate_sim::{Trial, Truth};

use crate::last_second::median;
use crate::picture::{Instant, Moment};
use crate::table;
use crate::track::Track;

/// What the run told.
#[derive(Default)]
pub struct Told {
    pub history: Vec<Instant>,
    /// The first moment in contact, one soon after, and the last.
    pub moments: Vec<Moment>,
    pub track: Option<Track>,
}

impl Told {
    /// The instants of the last second.
    fn last_second(&self) -> impl Iterator<Item = &Instant> {
        let end = self.history.last().map_or(0.0, |instant| instant.secs);
        self.history
            .iter()
            .filter(move |instant| instant.secs >= end - 1.0)
    }

    /// Median error over the last second, m; infinite where there is no estimate.
    fn error(&self) -> f64 {
        median(self.last_second().map(|i| i.error.unwrap_or(f64::INFINITY)))
    }

    /// Time after which the error stays below `limit`, m; s.
    fn settled_secs(&self, limit: f64) -> Option<f64> {
        let good = |instant: &&Instant| instant.error.is_some_and(|error| error < limit);
        self.history
            .iter()
            .rev()
            .take_while(good)
            .last()
            .map(|instant| instant.secs)
    }

    /// The result in one sentence.
    pub fn summary(&self) -> String {
        format!("Last second: {} from the truth.", millimetres(self.error()))
    }

    /// The result for the terminal.
    pub fn table(&self, robot: &Robot, trial: &Trial) -> Table {
        let right = self
            .last_second()
            .filter(|instant| instant.right_link)
            .count();
        let right = 100.0 * right as f64 / self.last_second().count().max(1) as f64;
        let settled = match self.settled_secs(0.02) {
            Some(secs) => format!("after {secs:.2} s"),
            None => "not at the end".to_owned(),
        };
        let mut facts = vec![
            ("touched link", robot.links[trial.link].name.clone()),
            ("right link in the last second", format!("{right:.0} %")),
            ("median error in the last second", millimetres(self.error())),
            ("error stays below 20 mm", settled),
        ];
        if let Some(Moment {
            best: Some(best),
            truth: Some(truth),
            ..
        }) = self.moments.last()
        {
            let true_force = truth.force_in_root.norm();
            let forces = format!("{:.1} N estimated, {true_force:.1} N true", best.force);
            facts.push(("force at the end", forces));
        }
        if let Some(track) = &self.track {
            let secs = track.filter_time.as_secs_f64();
            let speed = track.span_secs() / secs.max(1e-9);
            facts.push(("filter", format!("{secs:.2} s, {speed:.1} × real time")));
        }
        table::facts(&facts)
    }
}

fn millimetres(metres: f64) -> String {
    match 1e3 * metres {
        small if small < 1.0 => format!("{small:.2} mm"),
        large if large.is_finite() => format!("{large:.1} mm"),
        _ => "no estimate".to_owned(),
    }
}

/// How well the contact is known after an update.
pub fn instant(filter: &Filter, truth: &Truth) -> Instant {
    let estimate = filter.estimate();
    let best = estimate.best();
    let pair = best.zip(truth.contact.as_ref());
    Instant {
        secs: truth.stamp_ns as f64 * 1e-9,
        status: estimate.status,
        error: pair.map(|(mode, contact)| (mode.point_in_root - contact.point_in_root).norm()),
        std: best.map(|mode| mode.std()),
        right_link: best.is_some_and(|mode| mode.link == truth.link),
    }
}

/// All that is known after an update.
pub fn moment(robot: &Robot, filter: &Filter, truth: &Truth, secs: f64) -> Moment {
    let (kinematics, estimate) = (filter.kinematics(), filter.estimate());
    let scene = Scene::new(robot, kinematics, estimate, filter.particles());
    Moment {
        secs,
        kinematics: kinematics.clone(),
        cloud: scene.cloud,
        best: estimate.best().cloned(),
        truth: truth.contact,
    }
}

/// Names the columns of [`line`].
pub const LINE_HEAD: &str =
    "  time  status     link         prob.    error    std   force estimated / true";

/// One line a sample, for the terminal.
pub fn line(robot: &Robot, filter: &Filter, truth: &Truth, instant: &Instant) -> String {
    let start = format!("{:5.2} s  {:9}", instant.secs, instant.status.word());
    let true_force = truth
        .contact
        .map_or(0.0, |contact| contact.force_in_root.norm());
    let Some(mode) = filter.estimate().best() else {
        return format!("{start}  –                                   – / {true_force:.1} N");
    };
    let error = instant
        .error
        .map_or("–".to_owned(), |error| format!("{:.1} mm", 1e3 * error));
    let std = format!("{:.1} mm", 1e3 * mode.std());
    format!(
        "{start}  {:11} {:4.0} %  {error:>8} {std:>8}  {:6.1} N / {true_force:.1} N",
        robot.links[mode.link].name,
        100.0 * mode.probability,
        mode.force
    )
}
