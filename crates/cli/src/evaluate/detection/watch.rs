//! Plays a simulated drive to detectors and notes what they say.

use anyhow::{Context, Result};
use palpate_filter::{ContactChange, DetectorParameters, Filter, Intake, Method, Parameters};
use palpate_model::{ExternalTorque, Robot};
use palpate_sim::{Drive, DriveScenario};

use super::situation::{Situation, Source};

/// Length of the tare that every run begins with, s, and when it is over for sure.
const TARE_SECS: f64 = 0.5;
const BEGIN_SECS: f64 = 0.6;

/// A detector to be tried: where its torques come from, and its parameters.
#[derive(Clone, Debug)]
pub struct Lane {
    pub source: Source,
    pub detector: DetectorParameters,
}

/// A contact's start as a detector told it.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Time from the run's begin to the sample that it was noticed with, s.
    pub noticed_secs: f64,
    /// Number of the first link that was told to be possible: how many joints move it.
    pub first_link: usize,
}

/// What one detector said.
#[derive(Clone, Debug, Default)]
pub struct Watched {
    pub starts: Vec<Start>,
    /// Time that was watched, and the time in contact therein, s.
    pub secs: f64,
    pub contact_secs: f64,
}

/// Plays a scenario to all lanes at once.
pub fn watch(
    robot: &Robot,
    situation: &Situation,
    scenario: &DriveScenario,
    lanes: &[Lane],
) -> Result<Vec<Watched>> {
    let mut torques = Source::ALL
        .map(|source| ExternalTorque::new(robot, &situation.options(robot, source)))
        .into_iter()
        .collect::<Result<Vec<_>, _>>()
        .context("external torque")?;
    let mut watchers = (lanes.iter())
        .map(|lane| Watcher::new(robot, lane))
        .collect::<Result<Vec<_>>>()?;
    let step_secs = 1.0 / scenario.rate_hz;
    for moment in Drive::new(robot, scenario)? {
        let secs = moment.measured.stamp_ns as f64 * 1e-9;
        for (source, external) in Source::ALL.into_iter().zip(&mut torques) {
            if lanes.iter().all(|lane| lane.source != source) {
                continue;
            }
            let sample = external.update(&moment.measured)?;
            for watcher in watchers.iter_mut().filter(|w| w.source == source) {
                let admitted = watcher.intake.admit(sample)?;
                watcher.filter.update(admitted);
                watcher.note(robot, secs, step_secs);
            }
        }
    }
    Ok(watchers
        .into_iter()
        .map(|watcher| watcher.watched)
        .collect())
}

struct Watcher {
    source: Source,
    intake: Intake,
    filter: Filter,
    watched: Watched,
}

impl Watcher {
    fn new(robot: &Robot, lane: &Lane) -> Result<Self> {
        let parameters = Parameters {
            // No place is asked for: as few particles as may be.
            method: Method::Paper,
            particles: 100,
            detector: lane.detector.clone(),
            ..Parameters::default()
        };
        let mut filter = Filter::new(robot, &parameters, 1)?;
        filter.start_tare(TARE_SECS)?;
        Ok(Self {
            source: lane.source,
            intake: Intake::new(robot.dof()),
            filter,
            watched: Watched::default(),
        })
    }

    /// Notes what the filter said with its last sample.
    fn note(&mut self, robot: &Robot, secs: f64, step_secs: f64) {
        if secs < BEGIN_SECS {
            return;
        }
        let (detection, watched) = (self.filter.detection(), &mut self.watched);
        watched.secs += step_secs;
        if detection
            .event
            .is_some_and(|event| event.change == ContactChange::Start)
        {
            watched.starts.push(Start {
                noticed_secs: secs,
                first_link: 0,
            });
        }
        if detection.in_contact {
            watched.contact_secs += step_secs;
            let first = detection
                .first_link
                .map_or(0, |link| robot.links[link].path.len());
            if let Some(start) = watched.starts.last_mut() {
                start.first_link = start.first_link.max(first);
            }
        }
    }
}
