//! Where on the robot the newest torques could come from: every triangle is asked, and the best are climbed from.

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use super::history::History;
use super::peaks::Peak;

/// Keyframes since the contact began after which a scan is due; later every so many.
const FIRST: [usize; 8] = [1, 2, 3, 5, 7, 10, 14, 19];
const EVERY: usize = 10;
/// Most candidates of each link.
const CANDIDATES: usize = 6;
/// Radii that a climb may start with, m.
const RADII: [f64; 3] = [0.006, 0.04, 0.25];
/// Directions that a bar may start with.
const DIRECTIONS: usize = 4;
/// Newton steps of a climb.
const CLIMB: usize = 8;
/// Ball peaks that bars are tried in the place of.
const BARS: usize = 8;

/// Extra standard deviation, Nm, and as a share of the torque, for what one keyframe alone cannot tell: bias and
/// friction.
const SLACK: f64 = 0.05;
const SLACK_SHARE: f64 = 0.05;

/// A triangle that explains a keyframe's torques better than its neighbours do.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    link: usize,
    triangle: u32,
    /// Squared normalised error that a push on the triangle's centre leaves.
    misfit: f64,
}

/// Whether a scan is due after so many keyframes.
pub(super) fn is_due(keyframes: usize) -> bool {
    FIRST.contains(&keyframes) || keyframes.is_multiple_of(EVERY)
}

/// Peaks that the newest keyframe leads to: balls first, then bars where the best balls are.
pub(super) fn peaks(history: &History) -> Vec<Peak> {
    let links = history.skin.links();
    let candidates: Vec<Candidate> = links
        .par_iter()
        .flat_map_iter(|&link| candidates(history, link))
        .collect();
    let mut balls: Vec<Peak> = candidates
        .par_iter()
        .map(|candidate| climb_ball(history, candidate))
        .collect();
    super::peaks::keep_best(&mut balls);
    let bars: Vec<Peak> = (balls.par_iter().take(BARS))
        .map(|ball| climb_bar(history, ball))
        .collect();
    balls.extend(bars);
    balls
}

fn climb_ball(history: &History, candidate: &Candidate) -> Peak {
    let surface = history.skin.surface(candidate.link);
    let (foot, normal) = (
        surface.centroid(candidate.triangle),
        surface.normal(candidate.triangle),
    );
    let start = |radius: f64| {
        let triangle = candidate.triangle;
        Peak::new(
            history.obstacle_on(candidate.link, triangle, &foot, &normal, radius, None),
            history,
        )
    };
    climb_best(history, RADII.map(start).into_iter())
}

fn climb_bar(history: &History, ball: &Peak) -> Peak {
    let link = ball.obstacle.link as usize;
    let (touch, radius) = (&ball.touch, ball.touch.distance);
    let start = |direction: usize| {
        let turn = Some(std::f64::consts::PI * direction as f64 / DIRECTIONS as f64);
        let bar = history.obstacle_on(
            link,
            touch.triangle,
            &touch.point,
            &touch.normal,
            radius,
            turn,
        );
        Peak::new(bar, history)
    };
    climb_best(history, (0..DIRECTIONS).map(start))
}

fn climb_best(history: &History, starts: impl Iterator<Item = Peak>) -> Peak {
    let better = |a: Peak, b: Peak| {
        if b.evidence.log > a.evidence.log {
            b
        } else {
            a
        }
    };
    let mut peak = starts
        .reduce(better)
        .expect("a climb has at least one start");
    peak.climb(history, CLIMB);
    peak
}

/// The best triangles of one link: minima of the misfit among their neighbours.
fn candidates(history: &History, link: usize) -> Vec<Candidate> {
    let (surface, keyframe) = (history.skin.surface(link), history.newest());
    let view = &keyframe.links[link];
    let mut a = Matrix6::zeros();
    let mut g = Vector6::zeros();
    let mut measured = 0.0;
    let weight = |joint: usize| {
        let torque = keyframe.torque[joint];
        let slack = SLACK * SLACK + (SLACK_SHARE * torque).powi(2);
        1.0 / (1.0 / history.noise.weight(keyframe, joint) + slack)
    };
    for (column, &joint) in view
        .screws
        .column_iter()
        .zip(&history.robot.links[link].path)
    {
        a += column * column.transpose() * weight(joint);
        g += column * (weight(joint) * keyframe.torque[joint]);
    }
    for (joint, torque) in keyframe.torque.iter().enumerate() {
        measured += weight(joint) * torque * torque;
    }
    let misfit = |triangle: u32| {
        let centre = surface.centroid(triangle);
        let push = -surface.normal(triangle).into_inner();
        let moment = centre.coords.cross(&push);
        let w = Vector6::new(push.x, push.y, push.z, moment.x, moment.y, moment.z);
        // The best force, which cannot pull.
        let along = g.dot(&w).max(0.0);
        measured - along * along / w.dot(&(a * w)).max(1e-12)
    };
    let misfits: Vec<f64> = (0..surface.triangle_count() as u32).map(misfit).collect();
    let is_minimum = |&triangle: &u32| {
        let own = misfits[triangle as usize];
        surface
            .neighbours(triangle)
            .all(|other| own <= misfits[other as usize])
    };
    let mut candidates: Vec<Candidate> = (0..misfits.len() as u32)
        .filter(is_minimum)
        .map(|triangle| Candidate {
            link,
            triangle,
            misfit: misfits[triangle as usize],
        })
        .collect();
    candidates.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    candidates.truncate(CANDIDATES);
    candidates
}
