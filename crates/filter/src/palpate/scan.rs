//! Where on the robot the newest torques could come from: every triangle is asked, and the best are climbed from.

use nalgebra::{Matrix6, Vector3, Vector6};
use rand::{Rng, RngExt};

use super::history::{History, Place};
use super::likeness::Likeness;
use super::obstacle::Obstacle;
use super::peaks::Peak;
use crate::random::{Purpose, stream};

/// Keyframes since the contact began after which a scan is due; later every so many, and more often while the best
/// that was found leaves so much more unexplained than the noise, as a factor on the variance.
const FIRST: [usize; 8] = [1, 2, 3, 5, 7, 10, 14, 19];
const EVERY: usize = 10;
const EVERY_IF_POOR: usize = 3;
const POOR: f64 = 4.0;
/// Candidates of each link for each question: the best minima of the misfit, and triangles drawn as likely as they are.
const MINIMA: usize = 3;
const DRAWN: usize = 4;
/// Radii that a climb may start with, m.
const RADII: [f64; 3] = [0.006, 0.04, 0.25];
/// Directions that a bar may start with.
const DIRECTIONS: usize = 4;
/// Evaluations that it takes to see whether a candidate is worth a climb, in the mean over balls and bars.
pub(super) const SCREENING: usize = RADII.len() * (1 + DIRECTIONS) / 2;
/// How many of the best climbs, of balls and of bars, go on after each round of a scan: successive halving (Jamieson and
/// Talwalkar 2016).
pub(super) const MOST_LEFT: [usize; 8] = [20, 20, 12, 12, 8, 8, 8, 8];
/// Rounds of the bars' climbs.
pub(super) const BAR_ROUNDS: usize = 8;
/// Ball peaks that bars are tried in the place of.
pub(super) const BARS: usize = 8;
/// What it costs to begin a climb as a bar, in evaluations.
pub(super) const BAR_COST: usize = DIRECTIONS + 17;
/// Peaks at rest that drifting ones are tried in the place of, and the rounds of their climbs.
pub(super) const DRIFTS: usize = 8;
pub(super) const DRIFT_ROUNDS: usize = 6;
/// What it costs to begin one of them.
pub(super) const DRIFT_COST: usize = 32;

/// Extra standard deviation, Nm, and as a share of the torque, for what one keyframe alone cannot tell: bias and
/// friction. How large a bias is, nobody knows.
const SLACKS: [f64; 2] = [0.05, 0.3];
const SLACK_SHARE: f64 = 0.05;

/// Torques for which a push is looked for on each triangle.
struct Question {
    /// By joint, Nm.
    torque: Vec<f64>,
    /// Inverse variances.
    weight: Vec<f64>,
    /// Whether a push may be negative, as the change of one may.
    may_pull: bool,
}

/// Number of [questions](Question::new).
pub(super) const QUESTIONS: usize = SLACKS.len() + 1;

impl Question {
    /// The newest torques, with either slack; or what they changed by since the keyframe that they differ most from, as a
    /// bias is not in that.
    fn new(history: &History, number: usize) -> Self {
        let torque = &history.newest().torque;
        let slack = SLACKS.get(number);
        let weight = |(joint, torque): (usize, &f64)| {
            let slack = slack.unwrap_or(&SLACKS[0]).powi(2) + (SLACK_SHARE * torque).powi(2);
            1.0 / (1.0 / history.noise.weight(history.keyframes.len() - 1, joint) + slack)
        };
        Self {
            weight: torque.iter().enumerate().map(weight).collect(),
            may_pull: slack.is_none(),
            torque: match slack {
                Some(_) => torque.clone(),
                None => largest_change(history),
            },
        }
    }

    /// Squared normalised error that the best push along some force and moment leaves.
    fn misfit(&self, terms: &Terms, push: &Vector6<f64>) -> f64 {
        let along = terms.g.dot(push);
        let along = if self.may_pull { along } else { along.max(0.0) };
        terms.measured - along * along / push.dot(&(terms.a * push)).max(1e-12)
    }
}

/// What the newest torques changed by since the keyframe that they differ most from, Nm.
fn largest_change(history: &History) -> Vec<f64> {
    let newest = &history.newest().torque;
    let changes = history.keyframes.iter().map(|keyframe| {
        let pairs = newest.iter().zip(&keyframe.torque);
        pairs.map(|(now, before)| now - before).collect::<Vec<_>>()
    });
    let size = |change: &Vec<f64>| change.iter().map(|x| x * x).sum::<f64>();
    let largest = changes.max_by(|a, b| size(a).total_cmp(&size(b)));
    largest.unwrap_or_default()
}

/// What a question comes to for the links of one path: A = S W Sᵀ, g = S W τ and τᵀ W τ.
struct Terms {
    a: Matrix6<f64>,
    g: Vector6<f64>,
    measured: f64,
}

impl Terms {
    fn new(question: &Question, history: &History, link: usize) -> Self {
        let Question { torque, weight, .. } = question;
        let (mut a, mut g) = (Matrix6::zeros(), Vector6::zeros());
        let screws = &history.newest().links[link].screws;
        for (column, &joint) in screws.column_iter().zip(&history.robot.links[link].path) {
            a += column * column.transpose() * weight[joint];
            g += column * (weight[joint] * torque[joint]);
        }
        let squares = torque
            .iter()
            .zip(weight)
            .map(|(torque, weight)| weight * torque * torque);
        Self {
            a,
            g,
            measured: squares.sum(),
        }
    }
}

/// A triangle that explains a keyframe's torques better than its neighbours do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    link: usize,
    likeness: Likeness,
    is_bar: bool,
    triangle: u32,
}

/// Whether a scan is due after so many keyframes, by the best hypothesis' inflation of the noise.
pub(super) fn is_due(keyframes: usize, inflation: f64) -> bool {
    let every = if inflation > POOR {
        EVERY_IF_POOR
    } else {
        EVERY
    };
    FIRST.contains(&keyframes) || keyframes.is_multiple_of(every)
}

/// Triangles of a link that a push on answers a question, whatever link and obstacle are taken for.
pub(super) fn candidates(
    history: &History,
    link: usize,
    question: usize,
    (seed, key): (u64, u64),
) -> Vec<Candidate> {
    let mut random = stream(seed, key, link * QUESTIONS + question, Purpose::Fresh);
    let question = Question::new(history, question);
    let flat = of_link(history, link, &question, &mut random);
    let kinds = Likeness::ALL.map(|likeness| [false, true].map(|is_bar| (likeness, is_bar)));
    let taken_for = |(likeness, is_bar)| {
        let candidate = move |&candidate: &Candidate| Candidate {
            likeness,
            is_bar,
            ..candidate
        };
        flat.iter().map(candidate)
    };
    kinds.into_iter().flatten().flat_map(taken_for).collect()
}

/// Where a climb from a candidate begins.
pub(super) fn start(history: &History, candidate: &Candidate) -> Peak {
    let &Candidate { link, likeness, .. } = candidate;
    let triangle = candidate.triangle;
    let surface = history.skin.surface(link);
    let place = Place {
        link,
        likeness,
        triangle,
        point: surface.centroid(triangle),
        normal: surface.normal(triangle),
    };
    let turns = if candidate.is_bar {
        &TURNS[1..]
    } else {
        &TURNS[..1]
    };
    let of_radius = |radius| {
        let start = move |&turn: &Option<f64>| history.obstacle_at(&place, radius, turn);
        turns.iter().map(start)
    };
    best(RADII.into_iter().flat_map(of_radius), history)
}

/// Where a climb as a bar from a peak begins.
pub(super) fn bar(history: &History, ball: &Peak) -> Peak {
    let start = |&turn: &Option<f64>| history.reshaped(&ball.obstacle, turn);
    best(TURNS[1..].iter().map(start), history)
}

/// How a ball, and then how bars are turned about the normal, rad.
const TURNS: [Option<f64>; 1 + DIRECTIONS] = {
    let step = std::f64::consts::PI / DIRECTIONS as f64;
    [
        None,
        Some(0.0),
        Some(step),
        Some(2.0 * step),
        Some(3.0 * step),
    ]
};

/// Where a climb as a drifting obstacle begins from one at rest.
pub(super) fn drifting(history: &History, resting: &Obstacle) -> Peak {
    Peak::new(resting.drifting(Some(Vector3::zeros())), history)
}

/// The start with the largest evidence.
fn best(starts: impl Iterator<Item = Obstacle>, history: &History) -> Peak {
    let weighed = starts.map(|mut obstacle| {
        let evidence = history.evidence(&mut obstacle);
        (obstacle, evidence)
    });
    let (obstacle, evidence) = weighed
        .reduce(|a, b| if b.1.log > a.1.log { b } else { a })
        .expect("a climb has at least one start");
    Peak::of(obstacle, evidence, history)
}

/// Triangles of one link that a push on answers a question: the best minima, and some drawn.
fn of_link(
    history: &History,
    link: usize,
    question: &Question,
    random: &mut impl Rng,
) -> Vec<Candidate> {
    let surface = history.skin.surface(link);
    let terms = Terms::new(question, history, link);
    let misfit = |triangle: u32| {
        let centre = surface.centroid(triangle);
        let push = -surface.normal(triangle).into_inner();
        let moment = centre.coords.cross(&push);
        let push = Vector6::new(push.x, push.y, push.z, moment.x, moment.y, moment.z);
        question.misfit(&terms, &push)
    };
    let misfits: Vec<f64> = (0..surface.triangle_count() as u32).map(misfit).collect();
    let candidate = |triangle: u32| Candidate {
        link,
        likeness: Likeness::Mesh,
        is_bar: false,
        triangle,
    };
    let is_minimum = |&triangle: &u32| {
        let own = misfits[triangle as usize];
        surface
            .neighbours(triangle)
            .all(|other| own <= misfits[other as usize])
    };
    let all = 0..misfits.len() as u32;
    let mut minima: Vec<u32> = all.clone().filter(is_minimum).collect();
    minima.sort_by(|&a, &b| misfits[a as usize].total_cmp(&misfits[b as usize]));
    minima.truncate(MINIMA);
    // Where many triangles fit alike, any of them may be meant: some are drawn as likely as they are, by the
    // largest sums of log weight and Gumbel noise (Yellott 1977).
    let mut drawn: Vec<(f64, u32)> = all
        .map(|triangle| {
            let uniform = random.random::<f64>().max(f64::MIN_POSITIVE);
            let gumbel = -(-uniform.ln()).ln();
            (
                gumbel - 0.5 * misfits[triangle as usize] + surface.triangle_area(triangle).ln(),
                triangle,
            )
        })
        .collect();
    let largest_first = |a: &(f64, u32), b: &(f64, u32)| b.0.total_cmp(&a.0);
    if drawn.len() > DRAWN {
        drawn.select_nth_unstable_by(DRAWN - 1, largest_first);
    }
    minima.extend(drawn.iter().take(DRAWN).map(|&(_, triangle)| triangle));
    minima.into_iter().map(candidate).collect()
}
