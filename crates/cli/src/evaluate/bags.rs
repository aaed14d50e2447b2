//! Recorded trials: a folder of bags with the truth beside each.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use nalgebra::Point3;
use palpate_bag::{Bag, TopicChoice, read_samples};
use palpate_filter::{Filter, InputSettings};
use palpate_model::{JointSample, Robot};

use super::campaign::{in_parallel, threads};
use super::estimator::Estimator;
use super::report::{Report, parameters, wall_time};
use super::score::{Known, Score, score};
use super::summary::Summary;
use super::table::{heads, markdown, millimetres, percent, seconds};
use super::trial::Outcome;
use super::{Evaluate, csv, machine, targets};
use crate::simulate::START_NS;
use crate::{Unreadable, Usage, progress, read_text, table as terminal};

/// A recorded trial.
pub struct Recorded {
    /// Folder of truth.csv and bag/, below the folder of all trials.
    pub name: String,
    folder: PathBuf,
    /// Name of the folder around: what kind of trials these are.
    set: String,
    /// Number of the touched link.
    pub link: usize,
}

/// Scores every method asked for (palpate and the paper's curvature model by default) on the trials below `--bags`.
pub fn run(evaluate: &Evaluate) -> Result<()> {
    let Some(root) = &evaluate.bags else {
        return Err(Usage("bags: --bags DIR is missing".to_owned()).into());
    };
    if evaluate.experiments.len() > 1 {
        return Err(Usage("bags: give no other experiment beside it".to_owned()).into());
    }
    let start = Instant::now();
    let robot = evaluate.load_robot()?;
    let trials: Vec<_> = (find(root)?.into_iter())
        .filter(|trial| evaluate.links.is_empty() || evaluate.links.contains(&trial.link))
        .collect();
    let estimators: Vec<_> = match evaluate.methods.is_empty() {
        true => vec![Estimator::Curvature, Estimator::Palpate],
        false => evaluate.asked_estimators()?,
    };
    let mut report = Report::new(evaluate.out.clone())?;
    let bar = progress::bar(trials.len() * estimators.len(), "evaluate", evaluate.quiet);
    let threads = threads(evaluate.threads);
    let mut rows = format!("trial,set,link,method,{}\n", csv::SCORE_HEADER);
    for estimator in estimators.iter().copied() {
        let scores = in_parallel(threads, trials.len(), |index| {
            let trial = &trials[index];
            let score = score_one(&robot, trial, estimator, evaluate.particles, evaluate.seed)
                .with_context(|| format!("trial {}", trial.name))?;
            bar.inc(1);
            Ok(score)
        })?;
        for (trial, score) in trials.iter().zip(&scores) {
            let columns = csv::score_columns(score);
            let (name, set, link) = (csv::quoted(&trial.name), &trial.set, trial.link);
            rows += &format!("{name},{set},{link},{},{columns}\n", estimator.name());
        }
        let text = told(estimator, &trials, scores);
        bar.suspend(|| terminal::print(&text))?;
        report.add(text);
    }
    bar.finish_and_clear();
    report.file("bags.csv", &rows)?;
    let mut facts = machine::facts();
    facts.push(("trials", trials.len().to_string()));
    facts.push(("seed", evaluate.seed.to_string()));
    facts.push(("wall time", wall_time(start.elapsed(), threads)));
    report.write_text(&facts, &[parameters(&estimators, evaluate.particles)?])?;
    report.tell()
}

/// Every trial below a folder, by name.
pub fn find(root: &Path) -> Result<Vec<Recorded>> {
    let mut found = Vec::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        let unreadable = |source| Unreadable {
            path: folder.display().to_string(),
            source,
        };
        for entry in std::fs::read_dir(&folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            if path.is_dir() {
                folders.push(path);
            }
        }
        if folder.join("truth.csv").is_file() {
            found.push(recorded(root, folder)?);
        }
    }
    if found.is_empty() {
        let told = format!("--bags {}: no truth.csv below it", root.display());
        return Err(Usage(told).into());
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(found)
}

fn recorded(root: &Path, folder: PathBuf) -> Result<Recorded> {
    let truth = read_text(&folder.join("truth.csv"))?;
    let rows = TruthRow::read_all(&truth).with_context(|| folder.display().to_string())?;
    let whole = folder.canonicalize().unwrap_or_else(|_| folder.clone());
    let set = whole.parent().and_then(Path::file_name);
    let name = folder.strip_prefix(root).unwrap_or(&folder);
    Ok(Recorded {
        name: name.display().to_string(),
        set: set.map_or(String::new(), |set| set.to_string_lossy().into_owned()),
        link: rows.last().map_or(0, |row| row.number),
        folder,
    })
}

/// A trial's samples, and the truth while it is in contact.
pub fn load(robot: &Robot, trial: &Recorded) -> Result<(Vec<JointSample>, Vec<Known>)> {
    let bag = Bag::open(&trial.folder.join("bag"))?;
    let tolerance_ns = (InputSettings::default().pairing_tolerance_secs * 1e9).round() as i64;
    let samples = read_samples(&bag, robot, &TopicChoice::default(), tolerance_ns)?.samples;
    let rows = TruthRow::read_all(&read_text(&trial.folder.join("truth.csv"))?)?;
    let truth = known(robot, &rows, &samples)?;
    Ok((samples, truth))
}

fn score_one(
    robot: &Robot,
    trial: &Recorded,
    estimator: Estimator,
    particles: Option<usize>,
    seed: u64,
) -> Result<Score> {
    let (samples, truth) = load(robot, trial)?;
    // The seed itself, so that `palpate replay` gives the same estimates.
    let mut filter = Filter::new(robot, &estimator.parameters(particles), seed)?;
    score(&mut filter, robot.dof(), &samples, &truth, |_, _| {})
        .ok_or_else(|| wrong_truth("no row with contact").into())
}

/// A row of truth.csv.
struct TruthRow {
    secs: f64,
    number: usize,
    link: String,
    point_in_root: Point3<f64>,
    force: f64,
}

impl TruthRow {
    fn read_all(text: &str) -> Result<Vec<Self>, Unreadable> {
        let mut lines = text.lines();
        let heads: Vec<_> = lines.next().unwrap_or_default().split(',').collect();
        let column = |name: &str| {
            let found = heads.iter().position(|head| head.trim() == name);
            found.ok_or_else(|| wrong_truth(&format!("no column {name}")))
        };
        let link = column("link_name")?;
        let mut numbers = [0; 6];
        for (place, name) in
            numbers
                .iter_mut()
                .zip(["t", "link_index", "px", "py", "pz", "force_N"])
        {
            *place = column(name)?;
        }
        let row = |(index, line): (usize, &str)| {
            let cells: Vec<_> = line.split(',').map(str::trim).collect();
            let cell = |column: usize| cells.get(column).copied().unwrap_or_default();
            let mut values = [0.0; 6];
            for (value, &column) in values.iter_mut().zip(&numbers) {
                *value = cell(column).parse().map_err(|_| {
                    let (line, found) = (index + 2, cell(column));
                    wrong_truth(&format!("line {line}: expected a number, found {found:?}"))
                })?;
            }
            let [secs, number, x, y, z, force] = values;
            Ok(Self {
                secs,
                number: number as usize,
                link: cell(link).to_owned(),
                point_in_root: Point3::new(x, y, z),
                force,
            })
        };
        lines
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty())
            .map(row)
            .collect()
    }
}

/// A truth.csv that says nothing usable.
fn wrong_truth(what: &str) -> Unreadable {
    Unreadable {
        path: "truth.csv".to_owned(),
        source: io::Error::new(io::ErrorKind::InvalidData, what),
    }
}

/// The truth with contact, with stamps as in the bag: those of truth.csv count from the stamp that recorded trials start
/// at by convention, else from the bag's first sample.
fn known(robot: &Robot, rows: &[TruthRow], samples: &[JointSample]) -> Result<Vec<Known>> {
    const LONGEST_NS: i64 = 1_000_000_000_000;
    let first_ns = samples.first().map_or(START_NS, |sample| sample.stamp_ns);
    let is_conventional = (0..LONGEST_NS).contains(&first_ns.saturating_sub(START_NS));
    let start_ns = if is_conventional { START_NS } else { first_ns };
    let in_contact = rows.iter().filter(|row| row.force > 0.0);
    let one = |row: &TruthRow| {
        let link = robot.link_index(&row.link);
        let link = link.ok_or_else(|| {
            let links: Vec<_> = robot.links.iter().map(|link| link.name.as_str()).collect();
            let (found, known) = (&row.link, links.join(", "));
            wrong_truth(&format!("it names link {found}, the robot has {known}"))
        })?;
        Ok(Known {
            stamp_ns: start_ns + (row.secs * 1e9).round() as i64,
            link,
            point_in_root: row.point_in_root,
            force: row.force,
        })
    };
    in_contact.map(one).collect()
}

/// A method's tables: each trial, by link, and beside what is to be reached.
fn told(estimator: Estimator, trials: &[Recorded], scores: Vec<Score>) -> String {
    let outcomes: Vec<Outcome> = scores.into_iter().map(Ok).collect();
    let mut by_link: BTreeMap<(&str, usize), Vec<&Outcome>> = BTreeMap::new();
    for (trial, outcome) in trials.iter().zip(&outcomes) {
        by_link
            .entry((&trial.set, trial.link))
            .or_default()
            .push(outcome);
    }
    let each = (trials.iter().zip(&outcomes)).map(|(trial, outcome)| {
        row(
            vec![trial.name.clone(), trial.link.to_string()],
            &Summary::of([outcome]),
        )
    });
    let sets: BTreeSet<_> = trials.iter().map(|trial| trial.set.as_str()).collect();
    let mut links = Vec::new();
    for set in sets {
        let of_set = || by_link.iter().filter(|((s, _), _)| *s == set);
        for ((_, link), outcomes) in of_set() {
            links.push(row(
                vec![set.to_owned(), link.to_string()],
                &Summary::of(outcomes.iter().copied()),
            ));
        }
        let all = of_set().flat_map(|(_, outcomes)| outcomes.iter().copied());
        links.push(row(
            vec![set.to_owned(), "all".to_owned()],
            &Summary::of(all),
        ));
    }
    let columns = |first: &str| {
        heads(&[
            first,
            "link",
            "trials",
            "median mm",
            "mean mm",
            "most mm",
            "< 2 cm %",
            "right link %",
            "force N",
            "settled s",
            "in 50 %",
            "in 90 %",
            "ambiguous %",
            "std mm",
        ])
    };
    let reached = targets::table(&targets::BAGS, |set, link| {
        by_link.get(&(set, link)).cloned().unwrap_or_default()
    });
    let mut text = format!(
        "## {}\n\n{}\n{}",
        estimator.title(),
        markdown(&columns("trial"), &each.collect::<Vec<_>>(), 1),
        markdown(&columns("set"), &links, 1),
    );
    if reached.lines().count() > 2 {
        text += &format!("\n{reached}");
    }
    text
}

fn row(mut start: Vec<String>, s: &Summary) -> Vec<String> {
    let [half, most] = s.held.map(percent);
    let force = if s.force_error.is_finite() {
        format!("{:.2}", s.force_error)
    } else {
        "–".to_owned()
    };
    start.extend([
        s.count.to_string(),
        millimetres(s.error_median),
        millimetres(s.error_mean),
        millimetres(s.error_max),
        percent(s.found),
        percent(s.right_link),
        force,
        seconds(s.settled_secs),
        half,
        most,
        percent(s.ambiguous),
        millimetres(s.std),
    ]);
    start
}
