//! All that hypotheses are held against: the robot, the keyframes and the noise.

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use palpate_model::Robot;

use super::chart::tangential;
use super::evidence::Evidence;
use super::memory::Keyframe;
use super::noise::Noise;
use super::obstacle::{Core, Obstacle, Touch};
use crate::skin::Skin;

/// The history of the present contact, as one step sees it.
#[derive(Clone, Copy)]
pub(super) struct History<'a> {
    pub(super) robot: &'a Robot,
    pub(super) skin: &'a Skin,
    /// Keyframes, oldest first; never empty.
    pub(super) keyframes: &'a [Keyframe],
    pub(super) noise: &'a Noise,
}

impl History<'_> {
    /// The newest keyframe.
    pub(super) fn newest(&self) -> &Keyframe {
        &self.keyframes[self.keyframes.len() - 1]
    }

    /// The root frame in a link's frame at the newest keyframe.
    pub(super) fn newest_link_from_root(&self, link: u16) -> &Isometry3<f64> {
        &self.newest().links[link as usize].link_from_root
    }

    /// The evidence for an obstacle; puts its triangle and centre where the newest contact is.
    pub(super) fn evidence(&self, obstacle: &mut Obstacle) -> Evidence {
        obstacle.evidence(self.robot, self.skin, self.keyframes, self.noise)
    }

    /// The torques that a solved hypothesis predicts: one a keyframe (newest first) and joint of the link's path, Nm.
    pub(super) fn torques(&self, obstacle: &Obstacle, evidence: &Evidence) -> Vec<f64> {
        let mut torques = Vec::with_capacity(self.keyframes.len() * 8);
        obstacle.predict(evidence, self, |torque, _, _| torques.push(torque));
        torques
    }

    /// Log of the prior density, in space, of an obstacle that touches at `distance`, m.
    pub(super) fn log_prior(&self, obstacle: &Obstacle, distance: f64) -> f64 {
        obstacle.log_prior(distance, self.skin.area())
    }

    /// Where an obstacle touches at the newest keyframe.
    pub(super) fn newest_touch(&self, obstacle: &Obstacle) -> Touch {
        obstacle.touch(self.skin, self.newest_link_from_root(obstacle.link))
    }

    /// An obstacle of the given radius (m) that touches a link at a point with an outward normal, both in the link's
    /// frame, at the newest keyframe; a ball, or a bar at an angle `turn` (rad) about the normal.
    pub(super) fn obstacle_on(
        &self,
        link: usize,
        triangle: u32,
        point: &Point3<f64>,
        normal: &Unit<Vector3<f64>>,
        radius: f64,
        turn: Option<f64>,
    ) -> Obstacle {
        let side = if normal.x.abs() < 0.7 {
            Vector3::x_axis()
        } else {
            Vector3::y_axis()
        };
        let core = Core {
            centre: point + normal.into_inner() * radius,
            axis: turn.map(|turn| tangential(&side, normal, turn)),
        };
        let root_from_link = self.newest_link_from_root(link as u16).inverse();
        Obstacle {
            link: link as u16,
            triangle,
            core: core.moved(&root_from_link),
        }
    }

    /// The same contact with the same radius, but as a ball, or as a bar at an angle `turn` about the normal.
    pub(super) fn reshaped(&self, obstacle: &Obstacle, turn: Option<f64>) -> Obstacle {
        let touch = self.newest_touch(obstacle);
        let (link, radius) = (obstacle.link as usize, touch.distance);
        self.obstacle_on(
            link,
            touch.triangle,
            &touch.point,
            &touch.normal,
            radius,
            turn,
        )
    }
}
