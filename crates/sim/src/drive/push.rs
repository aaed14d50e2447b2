//! A finger that pushes on a spot of a moving link.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};
use palpate_model::{Kinematics, Robot};
use rand::{Rng, RngExt};

use super::TruePush;
use crate::SimError;
use crate::scenario::link_to_touch;
use crate::scene::triangle_normal;
use crate::torque::joint_torques;

/// A push against a link's surface, along its inward normal. The spot stays in the link while the arm moves; it is drawn
/// with the scenario's seed, uniform by area.
#[derive(Clone, Debug, PartialEq)]
pub struct Push {
    /// Name of the link.
    pub link: String,
    /// Size of the force, N.
    pub force: f64,
    /// When the force begins to rise, s.
    pub start_secs: f64,
    /// For how long it acts, rise and fall included, s.
    pub duration_secs: f64,
    /// For how long it rises, and falls at the end, s; along a cosine.
    pub rise_secs: f64,
    /// Some joint has at least this lever at the spot while the arm is at zero, m. A push towards a joint's axis, or along
    /// it, is one that the joint cannot feel.
    pub least_lever: f64,
}

impl Push {
    /// A push of half a second that rises within 5 ms, where some joint has a lever of 5 cm or more.
    pub fn new(link: &str, force: f64, start_secs: f64) -> Self {
        Self {
            link: link.to_owned(),
            force,
            start_secs,
            duration_secs: 0.5,
            rise_secs: 0.005,
            least_lever: 0.05,
        }
    }

    /// Share of the force at a time, 0 to 1.
    fn share(&self, secs: f64) -> f64 {
        let since = secs - self.start_secs;
        let edge = since.min(self.duration_secs - since);
        if edge <= 0.0 {
            return 0.0;
        }
        if edge >= self.rise_secs {
            return 1.0;
        }
        0.5 - 0.5 * (PI * edge / self.rise_secs).cos()
    }
}

/// A push on the spot that was drawn for it.
pub(super) struct PlacedPush {
    push: Push,
    link: usize,
    point_in_link: Point3<f64>,
    /// Outward.
    normal_in_link: Vector3<f64>,
}

impl PlacedPush {
    pub fn draw(robot: &Robot, push: &Push, rng: &mut impl Rng) -> Result<Self, SimError> {
        const DRAWS: usize = 1000;
        let link = link_to_touch(robot, &push.link)?;
        let at_zero = Kinematics::new(robot);
        for _ in 0..DRAWS {
            let placed = Self::draw_anywhere(robot, push, link, rng);
            let lever = (placed.torques(1.0, robot, &at_zero).0.iter())
                .fold(0.0_f64, |most, torque| most.max(torque.abs()));
            if lever >= push.least_lever {
                return Ok(placed);
            }
        }
        Err(SimError::OutOfRange {
            field: "least_lever",
            expected: format!("a lever that a push on {} can have", push.link),
            found: format!("{} m", push.least_lever),
        })
    }

    fn draw_anywhere(robot: &Robot, push: &Push, link: usize, rng: &mut impl Rng) -> Self {
        let mesh = robot.links[link].mesh.clone().unwrap_or_default();
        let areas: Vec<_> = (0..mesh.triangles.len())
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle);
                (b - a).cross(&(c - a)).norm()
            })
            .collect();
        let mut left = rng.random::<f64>() * areas.iter().sum::<f64>();
        let drawn = areas.iter().position(|area| {
            left -= area;
            left < 0.0
        });
        let triangle = drawn.unwrap_or(0);
        let [a, b, c] = mesh.corners(triangle);
        let (mut along, mut across) = (rng.random::<f64>(), rng.random::<f64>());
        if along + across > 1.0 {
            (along, across) = (1.0 - along, 1.0 - across);
        }
        Self {
            push: push.clone(),
            link,
            point_in_link: a + (b - a) * along + (c - a) * across,
            normal_in_link: triangle_normal(&mesh, triangle),
        }
    }

    /// Torques and push at a time; none while it does not act.
    pub fn at(
        &self,
        secs: f64,
        index: usize,
        robot: &Robot,
        kinematics: &Kinematics,
    ) -> Option<(Vec<f64>, TruePush)> {
        let force = self.push.force * self.push.share(secs);
        if force == 0.0 {
            return None;
        }
        let (torques, point_in_root, force_in_root) = self.torques(force, robot, kinematics);
        let push = TruePush {
            index,
            link: self.link,
            point_in_root,
            force_in_root,
        };
        Some((torques, push))
    }

    fn torques(
        &self,
        force: f64,
        robot: &Robot,
        kinematics: &Kinematics,
    ) -> (Vec<f64>, Point3<f64>, Vector3<f64>) {
        let root_from_link = kinematics.root_from_link(self.link);
        let point = root_from_link * self.point_in_link;
        let force = root_from_link * self.normal_in_link * -force;
        let torques = joint_torques(robot, kinematics, self.link, &point, &force);
        (torques, point, force)
    }
}
