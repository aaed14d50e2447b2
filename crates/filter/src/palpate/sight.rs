//! What the torques can see of a contact at all: how far off it would be put by torques that are a little wrong.

use nalgebra::{Matrix3, SMatrix, SVector};

use super::chart::{COORDINATES, Coordinates};
use super::history::History;
use super::obstacle::{DRIFT_STD, Obstacle};
use super::peaks::{Peak, STEPS};

/// Systematic error of the torques that is always reckoned with: a share of each joint's rms torque, and Nm. With
/// what the best hypothesis leaves unexplained, it stands for all that the model lacks: a mesh that is not the body,
/// stiffness that is not linear, delays, wrong masses.
const ERROR_SHARE: f64 = 0.02;
const ERROR: f64 = 0.01;
/// Precision of each component of a velocity before any torque is seen, s²/m².
const STILL: f64 = 1.0 / (DRIFT_STD * DRIFT_STD);
/// Precisions before any torque is seen: of a place on the link (1/m²), of the radius' logarithm, of a bar's
/// direction, of a velocity (s²/m²), of the force (1/N²) and of the stiffness (m²/N²).
const PRIOR: [f64; UNKNOWNS] = [25.0, 25.0, 0.4, 1.0, STILL, STILL, STILL, 3e-4, 2.5e-9];

/// The obstacle's coordinates, force and stiffness.
const UNKNOWNS: usize = COORDINATES + 2;
type Unknowns = SVector<f64, UNKNOWNS>;
type Information = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Fewest joints that must feel a contact for its place to be seen: one torque a sample cannot tell two coordinates and
/// a force apart, whatever it does over time that a wrong model could not do as well.
const LEAST_JOINTS: usize = 2;
/// Variance of a place that cannot be seen, m²: about the size of a link.
pub(super) const UNSEEN: f64 = 0.01;

/// Covariance (m², link frame) of the contact point that systematic errors of the torques cause.
///
/// With D the derivatives of the predicted torques by place, radius, direction, force and stiffness, an error of
/// variance Σ that lasts as long as the history leaves the information Dᵀ Σ⁻¹ D averaged over the history, not
/// summed: more samples of the same do not help, other configurations do.
pub(super) fn sight(peak: &Peak, history: &History) -> Matrix3<f64> {
    let link = &history.robot.links[peak.obstacle.link as usize];
    if link.path.len() < LEAST_JOINTS {
        return Matrix3::identity() * UNSEEN;
    }
    let columns = derivatives(peak, history);
    let mut information = Information::from_diagonal(&PRIOR.into());
    let samples: f64 = history
        .keyframes
        .iter()
        .map(|keyframe| keyframe.samples)
        .sum();
    for (row, derivatives) in columns.iter().enumerate() {
        let keyframe = &history.keyframes[history.keyframes.len() - 1 - row / link.path.len()];
        let joint = link.path[row % link.path.len()];
        let sigma = ERROR
            + ERROR_SHARE * history.noise.rms(joint)
            + history.noise.unexplained(keyframe, joint);
        information +=
            derivatives * derivatives.transpose() * (keyframe.samples / (samples * sigma * sigma));
    }
    let covariance = information
        .try_inverse()
        .unwrap_or_else(Information::identity);
    let sides = peak.sides();
    sides * covariance.fixed_view::<2, 2>(0, 0) * sides.transpose()
}

/// Derivatives of the predicted torques, one row a keyframe (newest first) and joint of the path.
fn derivatives(peak: &Peak, history: &History) -> Vec<Unknowns> {
    let evidence = &peak.evidence;
    let predict = |obstacle: &Obstacle, force: f64, stiffness: f64| {
        let evidence = super::Evidence {
            force,
            stiffness,
            ..*evidence
        };
        history.torques(obstacle, &evidence)
    };
    let here = predict(&peak.obstacle, evidence.force, evidence.stiffness);
    let mut rows = vec![Unknowns::zeros(); here.len()];
    let mut fill = |column: usize, torques: Vec<f64>, step: f64| {
        for ((row, torque), here) in rows.iter_mut().zip(torques).zip(&here) {
            row[column] = (torque - here) / step;
        }
    };
    for &axis in peak.counting() {
        let mut x = Coordinates::zeros();
        x[axis] = STEPS[axis];
        fill(
            axis,
            predict(&peak.at(&x, history), evidence.force, evidence.stiffness),
            STEPS[axis],
        );
    }
    fill(
        COORDINATES,
        predict(&peak.obstacle, evidence.force + 1.0, evidence.stiffness),
        1.0,
    );
    fill(
        COORDINATES + 1,
        predict(&peak.obstacle, evidence.force, evidence.stiffness + 100.0),
        100.0,
    );
    rows
}
