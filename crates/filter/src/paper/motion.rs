//! How a contact moves while the robot does: the paper's curvature model (its eq. 8 and figure 2) and the two models
//! that its figure 4 compares with.

use nalgebra::{Isometry3, Vector3};
use palpate_model::Surface;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::State;
use super::schedule::Level;
use crate::step::Step;

/// What the contact does between two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MotionModel {
    /// The obstacle is a sphere of unknown radius at rest in the world; the contact is the point nearest to its centre.
    #[default]
    Curvature,
    /// The contact is at rest in the link's frame (Manuelli and Tedrake 2016).
    Link,
    /// The contact is at rest in the world.
    World,
}

/// Smallest and largest radius of the obstacle's curvature, m (uniform in log space).
const RADIUS_RANGE: [f64; 2] = [1e-3, 1.0];

/// The motion model for one link between two samples.
#[derive(Clone, Debug, Default)]
pub(super) struct LinkMotion {
    model: MotionModel,
    /// Takes a point fixed in the world from the link's frame before to the link's frame now.
    now_from_before: Isometry3<f64>,
}

impl LinkMotion {
    pub(super) fn new(model: MotionModel, step: &Step, link: usize) -> Self {
        let root_from_before = step.before.root_from_link(link);
        let root_from_now = step.now.root_from_link(link);
        Self {
            model,
            now_from_before: root_from_now.inv_mul(root_from_before),
        }
    }

    /// Moves one particle: the model, then noise on location, force and stiffness.
    pub(super) fn propagate(
        &self,
        particle: &mut State,
        surface: &Surface,
        level: &Level,
        random: &mut impl Rng,
    ) {
        let normal = surface.normal(particle.triangle);
        let mut noise = || random.sample::<f64, _>(StandardNormal);
        let location_noise = Vector3::new(noise(), noise(), noise()) * level.location_noise;
        let (force_noise, stiffness_noise) =
            (noise() * level.force_noise, noise() * level.stiffness_noise);
        // Noise along the normal would be undone by the projection.
        let location_noise = location_noise - normal.into_inner() * normal.dot(&location_noise);
        match self.model {
            MotionModel::Link => {
                self.place(particle, surface, particle.point.coords + location_noise)
            }
            MotionModel::World => {
                let moved = self.now_from_before * particle.point;
                self.place(particle, surface, moved.coords + location_noise);
            }
            MotionModel::Curvature => {
                let [least, most] = RADIUS_RANGE;
                let radius = least * (most / least).powf(random.random());
                let centre_before = particle.point + normal.into_inner() * radius;
                let centre = self.now_from_before * centre_before;
                self.place(particle, surface, centre.coords);
                // Eq. 8: F_t = F_{t−1} + (r − d_t) K.
                let distance = (particle.point - centre).norm();
                particle.force += (radius - distance) * particle.stiffness;
                self.place(particle, surface, particle.point.coords + location_noise);
            }
        }
        particle.force = (particle.force + force_noise).max(0.0);
        particle.stiffness *= stiffness_noise.exp();
    }

    fn place(&self, particle: &mut State, surface: &Surface, wanted: Vector3<f64>) {
        let projected = surface.closest_point_from(&wanted.into(), particle.triangle);
        particle.point = projected.point;
        particle.triangle = projected.triangle;
    }
}
