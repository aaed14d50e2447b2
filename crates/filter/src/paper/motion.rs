//! How a contact moves while the robot does: the paper's curvature model (its eq. 8 and figure 2) and the two models
//! that its figure 4 compares with.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use palpate_model::Surface;
use serde::{Deserialize, Serialize};

use super::draws::Draws;
use crate::cloud::{BLOCK, Block, Column, set_vector, vector};
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

/// Forces (N) and stiffnesses (N/m) stay below this, whatever the noise.
const MOST: f32 = 1e9;

/// The motion model for one link between two samples.
#[derive(Clone, Debug)]
pub(super) struct LinkMotion {
    model: MotionModel,
    /// What a point fixed in the world moves by in the link's frame: (R − 1) p + t. As a difference, so that single
    /// precision rounds the motion and not the place.
    turn: Matrix3<f32>,
    shift: Vector3<f32>,
    /// Which particle of each block is audited in this step, in turn: projected on the whole surface, as a walk from the
    /// last triangle does not see a place far away that is closer.
    audited: usize,
}

impl Default for LinkMotion {
    fn default() -> Self {
        Self {
            model: MotionModel::default(),
            turn: Matrix3::zeros(),
            shift: Vector3::zeros(),
            audited: 0,
        }
    }
}

impl LinkMotion {
    pub(super) fn new(model: MotionModel, step: &Step, link: usize) -> Self {
        let root_from_before = step.before.root_from_link(link);
        let root_from_now = step.now.root_from_link(link);
        let now_from_before = root_from_now.inv_mul(root_from_before);
        let turn = now_from_before.rotation.to_rotation_matrix();
        Self {
            model,
            turn: (turn.into_inner() - Matrix3::identity()).cast(),
            shift: now_from_before.translation.vector.cast(),
            audited: (step.number % BLOCK as u64) as usize,
        }
    }

    /// Moves the particles of a run: the model, then noise on location, force and stiffness.
    #[inline(always)]
    pub(super) fn propagate(
        &self,
        block: &mut Block,
        range: Range<usize>,
        surface: &Surface,
        draws: &Draws,
        room: &mut Room,
    ) {
        // So that the compiler knows that every index is within a column.
        let range = range.start..range.end.min(BLOCK);
        match self.model {
            MotionModel::Link => {}
            MotionModel::World => {
                for at in range.clone() {
                    set_vector(&mut room.places, at, &self.moved(block.point(at)));
                }
                land(block, range.clone(), surface, room);
            }
            MotionModel::Curvature => self.roll(block, range.clone(), surface, draws, room),
        }
        scatter(block, range.clone(), surface, draws, &mut room.places);
        for at in range {
            block.force[at] = (block.force[at] + draws.force[at]).clamp(0.0, MOST);
            block.stiffness[at] = (block.stiffness[at] * draws.stiffness[at]).min(MOST);
        }
    }

    /// Eq. 8: the contact is the point nearest to the centre of a sphere that rests in the world, and
    /// F_t = F_{t−1} + (r − d_t) K.
    #[inline(always)]
    fn roll(
        &self,
        block: &mut Block,
        range: Range<usize>,
        surface: &Surface,
        draws: &Draws,
        room: &mut Room,
    ) {
        for at in range.clone() {
            let centre = block.point(at) + block.normal(at) * draws.radius[at];
            set_vector(&mut room.places, at, &self.moved(centre));
        }
        land(block, range.clone(), surface, room);
        if range.contains(&self.audited) {
            let at = self.audited;
            let centre = vector(&room.places, at);
            let touch = surface.audit(&centre, block.landing(at, room.distance[at]));
            room.distance[at] = touch.distance;
            block.land(at, &touch);
        }
        for at in range {
            block.force[at] += (draws.radius[at] - room.distance[at]) * block.stiffness[at];
        }
    }

    #[inline(always)]
    fn moved(&self, point: Vector3<f32>) -> Vector3<f32> {
        point + (self.turn * point + self.shift)
    }
}

/// Room for what is needed of one block while it moves.
pub(super) struct Room {
    /// Where the particles would be off the surface, m.
    pub(super) places: [Column; 3],
    /// How high that is over their triangles' planes, m.
    height: Column,
    /// How far that is from where they land, m.
    distance: Column,
}

impl Default for Room {
    fn default() -> Self {
        Self {
            places: [[0.0; BLOCK]; 3],
            height: [0.0; BLOCK],
            distance: [0.0; BLOCK],
        }
    }
}

/// Particles of a block that have left their triangles.
struct Leavers {
    indices: [u8; BLOCK],
    count: usize,
}

impl Leavers {
    /// Those of a run for which `stays` is false, without a branch on it.
    #[inline(always)]
    fn of(range: Range<usize>, mut stays: impl FnMut(usize) -> bool) -> Self {
        let (mut indices, mut count) = ([0; BLOCK], 0);
        for at in range {
            indices[count % BLOCK] = at as u8;
            count += usize::from(!stays(at));
        }
        Self { indices, count }
    }

    #[inline(always)]
    fn each(&self) -> impl Iterator<Item = usize> {
        let left = &self.indices[..self.count.min(BLOCK)];
        left.iter().map(|&at| usize::from(at))
    }
}

/// Projects the places of a run on the surface: first all as if they stayed on their triangles, and so kept their
/// normals, then those that do not.
#[inline(always)]
fn land(block: &mut Block, range: Range<usize>, surface: &Surface, room: &mut Room) {
    let Room {
        places,
        height,
        distance,
    } = room;
    let plates = surface.plates();
    let leavers = Leavers::of(range.clone(), |at| {
        let (over, stays) = plates.height_over(block.triangle[at], &vector(places, at));
        height[at] = over;
        stays
    });
    for at in range {
        let point = vector(places, at) - block.normal(at) * height[at];
        block.set_point(at, &point);
        distance[at] = height[at].abs();
    }
    for at in leavers.each() {
        surface.land_then(&vector(places, at), block.triangle[at], |landing| {
            distance[at] = landing.distance;
            block.land(at, &landing);
        });
    }
}

/// Adds noise along the surface, m: noise along the normal would be undone by the projection, and what stays on its
/// triangle needs none.
#[inline(always)]
fn scatter(
    block: &mut Block,
    range: Range<usize>,
    surface: &Surface,
    draws: &Draws,
    places: &mut [Column; 3],
) {
    for at in range.clone() {
        let [along, across] = tangents(&block.normal(at));
        let noise = along * draws.location[0][at] + across * draws.location[1][at];
        set_vector(places, at, &(block.point(at) + noise));
    }
    let plates = surface.plates();
    let leavers = Leavers::of(range.clone(), |at| {
        plates.holds(block.triangle[at], &vector(places, at))
    });
    for at in range {
        block.set_point(at, &vector(places, at));
    }
    for at in leavers.each() {
        surface.land_then(&vector(places, at), block.triangle[at], |landing| {
            block.land(at, &landing);
        });
    }
}

/// Two unit vectors that are normal to a third and to each other (Duff et al., Building an Orthonormal Basis, Revisited,
/// 2017).
#[inline(always)]
fn tangents(n: &Vector3<f32>) -> [Vector3<f32>; 2] {
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        Vector3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vector3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_and_normal_are_orthonormal() {
        for [x, y, z] in [
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [0.6, 0.0, -0.8],
            [-1.0, 2.0, 0.3],
        ] {
            let normal = Vector3::new(x, y, z).normalize();
            let [along, across] = tangents(&normal);
            let basis = Matrix3::from_columns(&[normal, along, across]);
            let off = basis.transpose() * basis - Matrix3::identity();
            assert!(off.norm() < 1e-6, "{normal}");
        }
    }
}
