//! Pushes on moving links: how many are noticed, and how soon.

use anyhow::Result;
use indicatif::ProgressBar;
use palpate_filter::DetectorParameters;
use palpate_sim::{DriveScenario, Push};

use super::situation::{SITUATIONS, Situation, Source};
use super::watch::{Lane, Watched, watch};
use super::{Plan, RATES};
use crate::evaluate::campaign::in_parallel;
use crate::evaluate::seed::{mixed, share};
use crate::evaluate::table::{heads, markdown};
use crate::last_second::median;

/// Forces, N.
pub const FORCES: [f64; 5] = [1.0, 3.0, 5.0, 10.0, 20.0];
/// The situations in which is pushed, by their names.
const NAMES: [&str; 5] = [
    "rest",
    "slow",
    "fast",
    "fast, payload 10 % wrong",
    "fast, friction 10 % wrong",
];
/// Time before the first push and from one to the next, s.
const FIRST_SECS: f64 = 4.0;
const EVERY_SECS: f64 = 2.0;

/// The situations in which is pushed.
fn situations() -> impl Iterator<Item = &'static Situation> {
    SITUATIONS
        .iter()
        .filter(|situation| NAMES.contains(&situation.name))
}

/// What became of some pushes that have these in common.
pub struct Cell {
    pub situation: &'static str,
    pub source: Source,
    pub rate_hz: f64,
    pub force: f64,
    pub link: usize,
    /// Delay of each push that was noticed, s, sorted.
    pub delays: Vec<f64>,
    pub pushes: usize,
    /// Those noticed for which a link beyond the pushed one was told as the first that can be touched.
    pub beyond: usize,
}

impl Cell {
    /// Share of the pushes that were noticed.
    pub fn found(&self) -> f64 {
        self.delays.len() as f64 / self.pushes.max(1) as f64
    }

    fn within(&self, secs: f64) -> usize {
        self.delays.iter().filter(|delay| **delay <= secs).count()
    }
}

/// What became of all pushes.
pub struct Pushed {
    pub cells: Vec<Cell>,
}

/// How many runs there are.
pub fn count(plan: &Plan) -> usize {
    RATES.len() * situations().count() * FORCES.len() * plan.links.len()
}

/// Pushes every link with every force.
pub fn run(plan: &Plan, bar: &ProgressBar) -> Result<Pushed> {
    let mut work = Vec::new();
    for rate_hz in RATES {
        for situation in situations() {
            for force in FORCES {
                work.extend(
                    plan.links
                        .iter()
                        .map(|&link| (rate_hz, situation, force, link)),
                );
            }
        }
    }
    let cells = in_parallel(plan.threads, work.len(), |index| {
        let (rate_hz, situation, force, link) = work[index];
        let cells = run_one(plan, rate_hz, situation, force, link)?;
        bar.inc(1);
        Ok(cells)
    })?;
    let cells = cells.into_iter().flatten().collect();
    Ok(Pushed { cells })
}

fn run_one(
    plan: &Plan,
    rate_hz: f64,
    situation: &'static Situation,
    force: f64,
    link: usize,
) -> Result<Vec<Cell>> {
    let Some(scenario) = push_scenario(plan, rate_hz, situation, force, link) else {
        return Ok(Vec::new());
    };
    let lanes = Source::ALL.map(|source| Lane {
        source,
        detector: DetectorParameters::default(),
    });
    let watched = watch(plan.robot, situation, &scenario, &lanes)?;
    let cell = |(source, watched): (Source, Watched)| {
        let found: Vec<_> = (scenario.pushes.iter())
            .filter_map(|push| noticed(&watched, push))
            .collect();
        let mut delays: Vec<_> = found.iter().map(|(delay, _)| *delay).collect();
        delays.sort_by(f64::total_cmp);
        Cell {
            situation: situation.name,
            source,
            rate_hz,
            force,
            link,
            delays,
            pushes: scenario.pushes.len(),
            beyond: found.iter().filter(|(_, first)| *first > link).count(),
        }
    };
    Ok(Source::ALL.into_iter().zip(watched).map(cell).collect())
}

/// A motion in which a link is pushed again and again; none if the robot has no such link.
pub fn push_scenario(
    plan: &Plan,
    rate_hz: f64,
    situation: &Situation,
    force: f64,
    link: usize,
) -> Option<DriveScenario> {
    let robot = plan.robot;
    let is_it = |other: &&palpate_model::Link| other.path.len() == link && other.mesh.is_some();
    let name = robot.links.iter().find(is_it).map(|link| &link.name)?;
    // The same spots and times for every force, rate and situation.
    let seed = mixed(&[plan.seed, 100 + link as u64]);
    let pushes: Vec<_> = (0..plan.pushes)
        .map(|number| {
            let jitter = 0.1 * share(&[seed, number as u64]);
            Push::new(
                name,
                force,
                FIRST_SECS + EVERY_SECS * number as f64 + jitter,
            )
        })
        .collect();
    let secs = FIRST_SECS + EVERY_SECS * pushes.len() as f64;
    let mut scenario = situation.scenario(robot, seed, rate_hz, secs);
    scenario.pushes = pushes;
    Some(scenario)
}

/// Time within which a push is to be noticed, s.
pub fn limit_secs(rate_hz: f64) -> f64 {
    if rate_hz > 500.0 { 0.02 } else { 0.1 }
}

/// Delay with which a push was noticed while it lasted, s, and the number of the first link that was told.
fn noticed(watched: &Watched, push: &Push) -> Option<(f64, usize)> {
    let lasts = push.start_secs..push.start_secs + push.duration_secs;
    let mut starts = watched.starts.iter();
    let start = starts.find(|start| lasts.contains(&start.noticed_secs))?;
    Some((start.noticed_secs - push.start_secs, start.first_link))
}

impl Pushed {
    /// A row for each situation, source, rate and force, a column for each link.
    pub fn table(&self, plan: &Plan) -> String {
        let mut text = String::from(
            "## Pushes\n\nPushes of half a second along the inward normal, risen within 5 ms, on spots drawn by area where some \
             joint has a lever of 5 cm while the arm is at zero. For each link: pushes noticed, % / noticed within 20 ms (at \
             1000 Hz) or 100 ms (at 100 Hz), % / median delay, ms.\n",
        );
        for rate_hz in RATES {
            text += &format!("\n### At {rate_hz:.0} Hz\n\n");
            let mut columns = heads(&["situation", "external torque from", "N"]);
            columns.extend(plan.links.iter().map(|link| format!("link {link}")));
            let mut rows = Vec::new();
            for situation in situations() {
                for source in Source::ALL {
                    for force in FORCES {
                        let mut row = vec![
                            situation.name.to_owned(),
                            source.name().to_owned(),
                            format!("{force}"),
                        ];
                        let cells = self.cells.iter().filter(|cell| {
                            cell.situation == situation.name
                                && (cell.source, cell.rate_hz, cell.force)
                                    == (source, rate_hz, force)
                        });
                        row.extend(cells.map(told));
                        rows.push(row);
                    }
                }
            }
            text += &markdown(&columns, &rows, 2);
        }
        let (beyond, found) = self.cells.iter().fold((0, 0), |(beyond, found), cell| {
            (beyond + cell.beyond, found + cell.delays.len())
        });
        text += &format!(
            "\nOf {found} pushes that were noticed, {beyond} made the detector tell a link beyond the pushed one as the first \
             that can be touched.\n"
        );
        text
    }

    /// Share of the pushes of a cell that were noticed in time.
    pub fn in_time(
        &self,
        situation: &Situation,
        source: Source,
        rate_hz: f64,
        force: f64,
        link: usize,
    ) -> f64 {
        let wanted = (situation.name, source, rate_hz, force, link);
        let mut cells = self.cells.iter();
        let cell = cells.find(|cell| {
            (
                cell.situation,
                cell.source,
                cell.rate_hz,
                cell.force,
                cell.link,
            ) == wanted
        });
        cell.map_or(0.0, |cell| {
            cell.within(limit_secs(rate_hz)) as f64 / cell.pushes.max(1) as f64
        })
    }

    /// A row for each cell.
    pub fn csv(&self) -> String {
        let mut csv = String::from(
            "rate_hz,situation,source,force,link,pushes,noticed,median_delay_secs,most_delay_secs,beyond\n",
        );
        for cell in &self.cells {
            let (situation, source) = (cell.situation.replace(',', ";"), cell.source.name());
            csv += &format!(
                "{},{situation},{source},{},{},{},{},{},{},{}\n",
                cell.rate_hz,
                cell.force,
                cell.link,
                cell.pushes,
                cell.delays.len(),
                median(cell.delays.iter().copied()),
                cell.delays.last().copied().unwrap_or(f64::NAN),
                cell.beyond,
            );
        }
        csv
    }
}

fn told(cell: &Cell) -> String {
    let limit = limit_secs(cell.rate_hz);
    let percent = |count: usize| 100.0 * count as f64 / cell.pushes.max(1) as f64;
    let (found, soon) = (percent(cell.delays.len()), percent(cell.within(limit)));
    match cell.delays.is_empty() {
        true => "0 / 0 / –".to_owned(),
        false => {
            let delay = 1e3 * median(cell.delays.iter().copied());
            format!("{found:.0} / {soon:.0} / {delay:.0}")
        }
    }
}
