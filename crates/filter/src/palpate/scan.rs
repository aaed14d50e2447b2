//! Where on the robot one keyframe's torques could come from: every triangle is asked.

use nalgebra::{Matrix6, Vector6};
use palpate_model::{Robot, Surface};

use super::memory::Keyframe;
use super::noise::Noise;

/// Extra standard deviation, Nm, and as a share of the torque, for what one keyframe alone cannot tell: bias and
/// friction.
const SLACK: f64 = 0.05;
const SLACK_SHARE: f64 = 0.05;

/// A triangle that explains a keyframe's torques better than its neighbours do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) link: usize,
    pub(super) triangle: u32,
    /// Squared normalised error that a push on the triangle's centre leaves.
    pub(super) misfit: f64,
}

/// The best triangles of one link, at most `most`: minima of the misfit among their neighbours.
pub(super) fn scan(
    robot: &Robot,
    link: usize,
    surface: &Surface,
    keyframe: &Keyframe,
    noise: &Noise,
    most: usize,
) -> Vec<Candidate> {
    let view = &keyframe.links[link];
    let mut a = Matrix6::zeros();
    let mut g = Vector6::zeros();
    let mut measured = 0.0;
    let weight = |joint: usize| {
        let torque = keyframe.torque[joint];
        let slack = SLACK * SLACK + (SLACK_SHARE * torque).powi(2);
        1.0 / (1.0 / noise.weight(keyframe, joint) + slack)
    };
    for (column, &joint) in view.screws.column_iter().zip(&robot.links[link].path) {
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
        surface.neighbours(triangle).all(|other| own <= misfits[other as usize])
    };
    let mut candidates: Vec<Candidate> = (0..misfits.len() as u32)
        .filter(is_minimum)
        .map(|triangle| Candidate { link, triangle, misfit: misfits[triangle as usize] })
        .collect();
    candidates.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    candidates.truncate(most);
    candidates
}
