//! A hypothesis about the obstacle: locally a sphere that rests in the world, pressed against one link.

use nalgebra::{Point3, Unit, Vector3};
use palpate_model::{Robot, Surface};

use super::evidence::{Evidence, JointTorque, Sums};
use super::memory::{Keyframe, LinkView};
use super::noise::Noise;
use crate::skin::Skin;

/// Speed at which friction has half its strength, m/s: below it the contact rather sticks.
const STICKING_SPEED: f64 = 5e-4;

/// Typical radius of a link, m.
pub(super) const LINK_RADIUS: f64 = 0.07;
/// Smallest and largest radius of an obstacle's curvature, m.
pub(super) const RADIUS_RANGE: [f64; 2] = [1e-3, 1.0];

/// The centre of the obstacle's curvature, and the link that it touches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Obstacle {
    pub(super) link: u16,
    /// Triangle that the contact was on when last looked at: where the next projection starts.
    pub(super) triangle: u32,
    /// Centre c in the root frame, m.
    pub(super) centre: Point3<f64>,
}

/// Where an obstacle touches its link in one configuration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Contact point p in the link's frame, m.
    pub(super) point: Point3<f64>,
    pub(super) triangle: u32,
    /// Outward normal: from p to c.
    pub(super) normal: Unit<Vector3<f64>>,
    /// Distance from c to the link, m; negative inside.
    pub(super) distance: f64,
}

/// The contact: the link's point nearest to c (the paper's figure 2).
pub(super) fn touch(surface: &Surface, centre_in_link: &Point3<f64>, start: Option<u32>) -> Touch {
    let nearest = match start {
        Some(triangle) => surface.closest_point_from(centre_in_link, triangle),
        None => surface.closest_point(centre_in_link),
    };
    let face = surface.normal(nearest.triangle);
    let away = centre_in_link - nearest.point;
    let distance = away.norm();
    let side = if away.dot(&face) < 0.0 { -1.0 } else { 1.0 };
    let normal = if distance > 1e-7 { Unit::new_unchecked(away * (side / distance)) } else { face };
    Touch { point: nearest.point, triangle: nearest.triangle, normal, distance: side * distance }
}

impl LinkView {
    /// Direction of the friction on the link at a touch, in the link's frame: against the slip, shorter when slow.
    pub(super) fn friction_direction(&self, touch: &Touch) -> Vector3<f64> {
        let linear: Vector3<f64> = self.velocity.fixed_rows::<3>(0).into_owned();
        let angular: Vector3<f64> = self.velocity.fixed_rows::<3>(3).into_owned();
        let velocity = linear + angular.cross(&touch.point.coords);
        let slip = velocity - touch.normal.into_inner() * velocity.dot(&touch.normal);
        slip * (-1.0 / (slip.norm() + STICKING_SPEED))
    }
}

impl Obstacle {
    /// The evidence of the whole history for this obstacle. Updates the triangle to that of the newest keyframe.
    pub(super) fn evidence(&mut self, robot: &Robot, skin: &Skin, keyframes: &[Keyframe], noise: &Noise) -> Evidence {
        let link = self.link as usize;
        let (surface, path) = (skin.surface(link), &robot.links[link].path);
        let mut sums = Sums::default();
        let mut start = Some(self.triangle);
        let mut reference = None;
        for keyframe in keyframes.iter().rev() {
            let view = &keyframe.links[link];
            let touch = touch(surface, &(view.link_from_root * self.centre), start);
            if start.is_none() || reference.is_none() {
                self.triangle = touch.triangle;
            }
            start = Some(touch.triangle);
            let e = *reference.get_or_insert(touch.distance) - touch.distance;
            sums.add(e, joint_torques(view, keyframe, &touch, path, noise));
        }
        let reference = reference.unwrap_or(0.0);
        Evidence { reference, ..sums.evidence(noise, path) }
    }
}

fn joint_torques<'a>(
    view: &'a LinkView,
    keyframe: &'a Keyframe,
    touch: &Touch,
    path: &'a [usize],
    noise: &'a Noise,
) -> impl Iterator<Item = JointTorque> + 'a {
    let push = -touch.normal.into_inner();
    let push_moment = touch.point.coords.cross(&push);
    let rub = view.friction_direction(touch);
    let rub_moment = touch.point.coords.cross(&rub);
    view.screws.column_iter().zip(path).map(move |(screw, &joint)| {
        let apply = |force: &Vector3<f64>, moment: &Vector3<f64>| {
            screw[0] * force.x + screw[1] * force.y + screw[2] * force.z
                + screw[3] * moment.x + screw[4] * moment.y + screw[5] * moment.z
        };
        JointTorque {
            normal: apply(&push, &push_moment),
            tangential: apply(&rub, &rub_moment),
            measured: keyframe.torque[joint],
            weight: noise.weight(keyframe, joint),
        }
    })
}

/// Residuals of the history's torques for a solved hypothesis: calls `take(joint, squared normalised residual)`.
pub(super) fn residuals(
    obstacle: &Obstacle,
    evidence: &Evidence,
    robot: &Robot,
    skin: &Skin,
    keyframes: &[Keyframe],
    noise: &Noise,
    mut take: impl FnMut(usize, usize, f64, f64),
) {
    let link = obstacle.link as usize;
    let (surface, path) = (skin.surface(link), &robot.links[link].path);
    let mut start = Some(obstacle.triangle);
    let mut reference = None;
    for (index, keyframe) in keyframes.iter().enumerate().rev() {
        let view = &keyframe.links[link];
        let touch = touch(surface, &(view.link_from_root * obstacle.centre), start);
        start = Some(touch.triangle);
        let e = *reference.get_or_insert(touch.distance) - touch.distance;
        let force = evidence.force + evidence.stiffness * e;
        for (joint, &name) in joint_torques(view, keyframe, &touch, path, noise).zip(path) {
            let predicted = (joint.normal + evidence.friction * joint.tangential) * force;
            take(index, name, joint.measured - predicted, joint.weight);
        }
    }
}

/// Log of the prior density of an obstacle whose centre lies at `distance` from the link: contact points uniform over
/// the surface and radii uniform in log space, on a link that is itself about `LINK_RADIUS` round.
pub(super) fn log_prior(distance: f64) -> f64 {
    if distance > RADIUS_RANGE[1] || distance < -0.01 {
        return f64::NEG_INFINITY;
    }
    let distance = distance.max(RADIUS_RANGE[0]);
    -distance.ln() - 2.0 * (distance + LINK_RADIUS).ln()
}
