//! All that hypotheses are held against: the robot, the keyframes and the noise.

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use palpate_model::Robot;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::chart::tangential;
use super::evidence::Evidence;
use super::likeness::Likeness;
use super::memory::Keyframe;
use super::noise::Noise;
use super::obstacle::{Core, Obstacle, RADIUS_RANGE, Shape, Touch};
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

/// How far beside a contact another one may be looked for, m.
const BESIDE: [f64; 3] = [2e-3, 8e-3, 3e-2];

/// A place on a link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) link: usize,
    pub(super) likeness: Likeness,
    pub(super) triangle: u32,
    /// In the link's frame, m.
    pub(super) point: Point3<f64>,
    /// Outward normal in the link's frame.
    pub(super) normal: Unit<Vector3<f64>>,
}

impl Place {
    /// Where an obstacle touches.
    pub(super) fn of(obstacle: &Obstacle, touch: &Touch) -> Self {
        Self {
            link: obstacle.link as usize,
            likeness: obstacle.likeness,
            triangle: touch.triangle,
            point: touch.point,
            normal: touch.normal,
        }
    }
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

    /// The shape of the link that an obstacle touches.
    pub(super) fn shape(&self, obstacle: &Obstacle) -> Shape<'_> {
        obstacle.shape(self.skin)
    }

    /// Where an obstacle touches at the newest keyframe.
    pub(super) fn newest_touch(&self, obstacle: &Obstacle) -> Touch {
        obstacle.touch(self.skin, self.newest_link_from_root(obstacle.link))
    }

    /// An obstacle of the given radius (m) that touches at the newest keyframe; a ball, or a bar at an angle `turn`
    /// (rad) about the normal.
    pub(super) fn obstacle_at(&self, place: &Place, radius: f64, turn: Option<f64>) -> Obstacle {
        let &Place { link, normal, .. } = place;
        let side = if normal.x.abs() < 0.7 {
            Vector3::x_axis()
        } else {
            Vector3::y_axis()
        };
        let core = Core {
            centre: place.point + normal.into_inner() * radius,
            axis: turn.map(|turn| tangential(&side, &normal, turn)),
            drift: None,
        };
        let root_from_link = self.newest_link_from_root(link as u16).inverse();
        Obstacle {
            link: link as u16,
            likeness: place.likeness,
            triangle: place.triangle,
            core: core.moved(&root_from_link),
        }
    }

    /// Another obstacle about where this one touches, that moves as it does: somewhat beside it, of any kind and radius.
    pub(super) fn elsewhere(&self, obstacle: &Obstacle, random: &mut impl Rng) -> Obstacle {
        let touch = self.newest_touch(obstacle);
        let link = obstacle.link as usize;
        let reach = BESIDE[random.random_range(0..BESIDE.len())];
        let way = Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal) * reach);
        let surface = self.skin.surface(link);
        let beside = surface.closest_point_from(&(touch.point + way), touch.triangle);
        let place = Place {
            link,
            likeness: Likeness::draw(random),
            triangle: beside.triangle,
            point: beside.point,
            normal: surface.normal(beside.triangle),
        };
        let [least, most] = RADIUS_RANGE;
        let radius = match random.random::<bool>() {
            true => touch.distance.clamp(least, most),
            false => least * (most / least).powf(random.random()),
        };
        let turn = std::f64::consts::PI * random.random::<f64>();
        self.obstacle_at(&place, radius, random.random::<bool>().then_some(turn))
            .drifting(obstacle.core.drift)
    }

    /// The same contact with the same radius and motion, but as a ball, or as a bar at an angle `turn` about the normal.
    pub(super) fn reshaped(&self, obstacle: &Obstacle, turn: Option<f64>) -> Obstacle {
        let touch = self.newest_touch(obstacle);
        self.obstacle_at(&Place::of(obstacle, &touch), touch.distance, turn)
            .drifting(obstacle.core.drift)
    }
}
