//! A hypothesis about the obstacle: locally a ball or a bar that rests in the world or drifts through it, pressed
//! against one link.

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use palpate_model::{Robot, SmoothBody, Surface};

use super::evidence::{self, Evidence, MOST_JOINTS};
use super::history::History;
use super::likeness::Likeness;
use super::memory::{Keyframe, LinkView};
use super::noise::Noise;
use super::sums::{Directions, Lever, Sums};
use crate::skin::Skin;

/// Speed at which friction has half its strength, m/s: below it the contact rather sticks.
const STICKING_SPEED: f64 = 2e-4;
/// Half the length of a bar, m.
const BAR_HALF_LENGTH: f64 = 0.3;
/// How far to go at first for how far a projection is off, and the range of what was learned since.
const FIRST_STRIDE: f64 = 2.0;
const STRIDES: [f64; 2] = [1.0, 64.0];
/// Most projections that finding the contact along a bar costs.
const MOST_BAR_LOOKS: usize = 16;
/// Typical radius of a link, m.
pub(super) const LINK_RADIUS: f64 = 0.07;
/// Log of the odds that an obstacle drifts, and the standard deviation of each component of its velocity, m/s. Most
/// rest, and what friction and the mesh get wrong looks like a drift of a millimetre a second; with odds of e⁻³⁰
/// real drifts on link 5 were lost by centimetres.
const LOG_DRIFTING: f64 = -6.0;
pub(super) const DRIFT_STD: f64 = 5e-3;
/// Smallest and largest radius of an obstacle's curvature, m.
pub(super) const RADIUS_RANGE: [f64; 2] = [1e-3, 1.0];

/// The core of the obstacle, in some frame: a point, or a line for poles and edges. Its surface is at an unknown
/// radius r around the core, which the stiffness and force absorb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Core {
    /// Centre c of the curvature: the point of the core nearest to the link, m.
    pub(super) centre: Point3<f64>,
    /// Direction of a bar; none for a ball.
    pub(super) axis: Option<Unit<Vector3<f64>>>,
    /// Velocity of what drifts, m/s; none for what rests.
    pub(super) drift: Option<Vector3<f64>>,
}

impl Core {
    /// The same core in another frame.
    pub(super) fn moved(&self, a_from_b: &Isometry3<f64>) -> Self {
        Self {
            centre: a_from_b * self.centre,
            axis: self.axis.map(|axis| a_from_b.rotation * axis),
            drift: self.drift.map(|drift| a_from_b.rotation * drift),
        }
    }

    /// Where it is so much later, s.
    pub(super) fn after(&self, secs: f64) -> Self {
        Self {
            centre: self.centre + self.velocity() * secs,
            ..*self
        }
    }

    fn velocity(&self) -> Vector3<f64> {
        self.drift.unwrap_or_default()
    }
}

/// An obstacle and the link that it touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Obstacle {
    pub(super) link: u16,
    /// What the link is taken for.
    pub(super) likeness: Likeness,
    /// Triangle that the contact was on when last looked at: where the next projection starts.
    pub(super) triangle: u32,
    /// The core in the root frame, where it is at the newest keyframe.
    pub(super) core: Core,
}

/// A link's shape: its mesh, or the smooth body that the mesh stands for.
#[derive(Clone, Copy)]
pub(super) struct Shape<'a> {
    surface: &'a Surface,
    body: Option<&'a SmoothBody>,
}

/// Where an obstacle touches its link in one configuration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Contact point p in the link's frame, m.
    pub(super) point: Point3<f64>,
    pub(super) triangle: u32,
    /// Outward normal: from p to the core.
    pub(super) normal: Unit<Vector3<f64>>,
    /// Distance d from the core to the link, m; negative inside.
    pub(super) distance: f64,
    /// Where on the core its point nearest to the link is.
    pub(super) spot: Spot,
}

/// Where along a bar the contact is, and what finding the next one begins with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Way from the core's centre along the axis, m.
    pub(super) along: f64,
    /// How far to go for how far the projection is off.
    stride: f64,
}

impl Spot {
    /// The centre.
    pub(super) const CENTRE: Self = Self {
        along: 0.0,
        stride: FIRST_STRIDE,
    };
}

/// The contact: the link's point nearest to the core (the paper's figure 2). For a bar, `guess` is where it may be.
pub(super) fn touch(shape: &Shape, core_in_link: &Core, start: u32, guess: Spot) -> Touch {
    let Some(axis) = core_in_link.axis else {
        return touch_ball(shape, &core_in_link.centre, start);
    };
    let at = |along: f64, start: u32| {
        let centre = core_in_link.centre + axis.into_inner() * along;
        let touch = touch_ball(shape, &centre, start);
        // Zero where the point of the bar is the one nearest to its own projection.
        let miss = axis.dot(&(touch.point - centre));
        (touch, along, miss)
    };
    let (mut best, mut along, mut miss) = at(guess.along, start);
    // On a convex link the miss falls along the bar: steeply where the contact is on an edge or a corner of the mesh,
    // hardly where it is on a triangle. So a step may be far too short, and the next one goes farther, until the sign
    // changes; from then on the contact lies between two places.
    let mut other: Option<(f64, f64)> = None;
    let mut stride = guess.stride;
    let mut learned = guess.stride;
    for _ in 0..MOST_BAR_LOOKS {
        if miss.abs() < bar_tolerance(best.distance) {
            break;
        }
        let next = match other {
            None => along + stride * miss,
            Some((there, its_miss)) => between((along, miss), (there, its_miss)),
        };
        let next = next.clamp(-BAR_HALF_LENGTH, BAR_HALF_LENGTH);
        if next == along {
            break;
        }
        let (touch, next, next_miss) = at(next, best.triangle);
        learned = (next - along) / (miss - next_miss);
        if (next_miss < 0.0) != (miss < 0.0) {
            other = Some((along, miss));
        } else if let Some((_, its_miss)) = &mut other {
            // The far end weighs half, so that it is left behind (the Illinois method: Dowell and Jarratt 1971).
            *its_miss *= 0.5;
        } else {
            stride *= 4.0;
        }
        (best, along, miss) = (touch, next, next_miss);
    }
    let [least, most] = STRIDES;
    let stride = match learned.is_finite() {
        true => learned.clamp(least, most),
        false => FIRST_STRIDE,
    };
    Touch {
        spot: Spot { along, stride },
        ..best
    }
}

/// Where a line through two values of opposite sign is zero.
fn between((a, at_a): (f64, f64), (b, at_b): (f64, f64)) -> f64 {
    a - at_a * (b - a) / (at_b - at_a)
}

/// How exactly the contact along a bar is found, m: so that the normal is right to a ten-thousandth of a radian.
fn bar_tolerance(distance: f64) -> f64 {
    (1e-4 * distance.abs()).clamp(1e-8, 1e-5)
}

/// The contact with a ball around `centre`.
fn touch_ball(shape: &Shape, centre: &Point3<f64>, start: u32) -> Touch {
    let surface = shape.surface;
    if let Some(body) = shape.body {
        let nearest = body.closest_point_from(surface, centre, start);
        return Touch {
            point: nearest.point,
            triangle: nearest.triangle,
            normal: nearest.normal,
            distance: nearest.distance,
            spot: Spot::CENTRE,
        };
    }
    let nearest = surface.closest_point_from(centre, start);
    let face = surface.normal(nearest.triangle);
    let away = centre - nearest.point;
    let distance = away.norm();
    let side = if away.dot(&face) < 0.0 { -1.0 } else { 1.0 };
    let normal = match distance > 1e-7 {
        true => Unit::new_unchecked(away * (side / distance)),
        false => face,
    };
    Touch {
        point: nearest.point,
        triangle: nearest.triangle,
        normal,
        distance: side * distance,
        spot: Spot::CENTRE,
    }
}

impl LinkView {
    /// Directions of the forces on the link at a touch with a core in the root frame.
    fn directions(&self, touch: &Touch, core: &Core) -> Directions {
        let linear: Vector3<f64> = self.velocity.fixed_rows::<3>(0).into_owned();
        let angular: Vector3<f64> = self.velocity.fixed_rows::<3>(3).into_owned();
        let of_link = linear + angular.cross(&touch.point.coords);
        let velocity = of_link - self.link_from_root.rotation * core.velocity();
        let slip = velocity - touch.normal.into_inner() * velocity.dot(&touch.normal);
        Directions {
            push: -touch.normal.into_inner(),
            rub: slip * (-1.0 / (slip.norm() + STICKING_SPEED)),
        }
    }
}

impl Obstacle {
    /// The same, but with this velocity in the root frame, m/s, or at rest.
    pub(super) fn drifting(self, drift: Option<Vector3<f64>>) -> Self {
        let core = Core { drift, ..self.core };
        Self { core, ..self }
    }

    /// The shape of the link that it touches.
    pub(super) fn shape<'a>(&self, skin: &'a Skin) -> Shape<'a> {
        let link = self.link as usize;
        Shape {
            surface: skin.surface(link),
            body: skin.body(link).filter(|_| self.likeness.is_smooth()),
        }
    }

    /// Where it touches, in the configuration that `link_from_root` belongs to.
    pub(super) fn touch(&self, skin: &Skin, link_from_root: &Isometry3<f64>) -> Touch {
        touch(
            &self.shape(skin),
            &self.core.moved(link_from_root),
            self.triangle,
            Spot::CENTRE,
        )
    }

    /// The evidence of the whole history for this obstacle. Puts triangle and centre where the newest keyframe has
    /// the contact.
    pub(super) fn evidence(
        &mut self,
        robot: &Robot,
        skin: &Skin,
        keyframes: &[Keyframe],
        noise: &Noise,
    ) -> Evidence {
        let link = self.link as usize;
        let path = &robot.links[link].path;
        let mut sums = Sums::new(self.likeness);
        let mut levers = [Lever::default(); MOST_JOINTS];
        let mut newest: Option<Touch> = None;
        self.follow(skin, keyframes, |index, keyframe, touch| {
            let e = newest.get_or_insert(touch).distance - touch.distance;
            let view = &keyframe.links[link];
            let felt = levers_of(keyframe, index, link, &touch, path, noise);
            for (lever, felt) in levers.iter_mut().zip(felt) {
                *lever = felt;
            }
            let directions = view.directions(&touch, &self.core);
            sums.add(e, &directions, &levers[..path.len()]);
        });
        let Some(newest) = newest else {
            return Evidence::default();
        };
        self.triangle = newest.triangle;
        if let Some(axis) = self.core.axis {
            self.core.centre += axis.into_inner() * newest.spot.along;
        }
        Evidence {
            reference: newest.distance,
            ..evidence::evidence(&sums, noise, path)
        }
    }

    /// Follows the contact through the keyframes, from the newest to the oldest.
    fn follow<'a>(
        &self,
        skin: &Skin,
        keyframes: &'a [Keyframe],
        mut visit: impl FnMut(usize, &'a Keyframe, Touch),
    ) {
        let link = self.link as usize;
        let shape = self.shape(skin);
        let (mut start, mut spot) = (self.triangle, Spot::CENTRE);
        let newest_secs = keyframes.last().map_or(0.0, |newest| newest.secs);
        for (index, keyframe) in keyframes.iter().enumerate().rev() {
            let core = self.core.after(keyframe.secs - newest_secs);
            let core = core.moved(&keyframe.links[link].link_from_root);
            let touch = touch(&shape, &core, start, spot);
            (start, spot) = (touch.triangle, touch.spot);
            visit(index, keyframe, touch);
        }
    }

    /// The history's torques as the solved hypothesis predicts them, from the newest keyframe to the oldest: calls
    /// `take(predicted, joint, measured)`.
    pub(super) fn predict(
        &self,
        evidence: &Evidence,
        history: &History,
        mut take: impl FnMut(f64, usize, Lever),
    ) {
        let mut newest = None;
        self.follow(history.skin, history.keyframes, |index, _, touch| {
            let e = *newest.get_or_insert(touch.distance) - touch.distance;
            let force = evidence.force + evidence.stiffness * e;
            self.predict_one(evidence, history, index, &touch, force, &mut take);
        });
    }

    /// The newest keyframe's torques as a hypothesis predicts them that was solved without it: calls
    /// `take(predicted, joint, measured)`.
    pub(super) fn predict_newest(
        &self,
        evidence: &Evidence,
        history: &History,
        mut take: impl FnMut(f64, usize, Lever),
    ) {
        let touch = history.newest_touch(self);
        let force = evidence.force_at(touch.distance);
        let newest = history.keyframes.len() - 1;
        self.predict_one(evidence, history, newest, &touch, force, &mut take);
    }

    /// The torques that a force at a touch makes in one keyframe.
    fn predict_one(
        &self,
        evidence: &Evidence,
        history: &History,
        index: usize,
        touch: &Touch,
        force: f64,
        take: &mut impl FnMut(f64, usize, Lever),
    ) {
        let link = self.link as usize;
        let path = &history.robot.links[link].path;
        let keyframe = &history.keyframes[index];
        let Directions { push, rub } = keyframe.links[link].directions(touch, &self.core);
        let unit = push + rub * evidence.friction + evidence.tilt;
        let slack = (self.likeness.slack() * force).powi(2);
        for (lever, &joint) in
            levers_of(keyframe, index, link, touch, path, history.noise).zip(path)
        {
            let weight = 1.0 / (1.0 / lever.weight + slack * lever.row.norm_squared());
            take(
                lever.row.dot(&unit) * force,
                joint,
                Lever { weight, ..lever },
            );
        }
    }
}

/// How the joints of a link's path feel a force at a touch in one keyframe.
fn levers_of<'a>(
    keyframe: &'a Keyframe,
    index: usize,
    link: usize,
    touch: &Touch,
    path: &'a [usize],
    noise: &'a Noise,
) -> impl Iterator<Item = Lever> + 'a {
    let point = touch.point.coords;
    let screws = keyframe.links[link].screws.column_iter();
    screws.zip(path).map(move |(screw, &joint)| Lever {
        row: screw.fixed_rows::<3>(0) + screw.fixed_rows::<3>(3).cross(&point),
        measured: keyframe.torque[joint],
        weight: noise.weight(index, joint),
    })
}

impl Obstacle {
    /// Log of the prior density of an obstacle that touches at `distance` (m), in space: contact points uniform over
    /// a skin of the given area (m²) and radii uniform in log space, on a link that is itself about [`LINK_RADIUS`]
    /// round; balls and bars alike, the bars in any direction along the surface.
    pub(super) fn log_prior(&self, distance: f64, area: f64) -> f64 {
        let radius = distance.max(RADIUS_RANGE[0]);
        let direction = if self.core.axis.is_some() {
            -std::f64::consts::PI.ln()
        } else {
            0.0
        };
        let normalisation = 2.0 * area * (RADIUS_RANGE[1] / RADIUS_RANGE[0]).ln();
        direction - normalisation.ln() - radius.ln() - 2.0 * (1.0 + radius / LINK_RADIUS).ln()
            + log_radius_prior(distance)
            + self.core.log_drift_prior()
    }
}

impl Core {
    /// Log of the prior density of how it moves: most obstacles rest.
    pub(super) fn log_drift_prior(&self) -> f64 {
        match self.drift {
            None => 0.0,
            Some(drift) => {
                let normalisation = 3.0 * (DRIFT_STD * std::f64::consts::TAU.sqrt()).ln();
                LOG_DRIFTING - normalisation - 0.5 * drift.norm_squared() / (DRIFT_STD * DRIFT_STD)
            }
        }
    }
}

/// Log of the prior on the logarithm of the radius: flat within [`RADIUS_RANGE`], and soon nothing outside.
pub(super) fn log_radius_prior(distance: f64) -> f64 {
    let [least, most] = RADIUS_RANGE;
    if distance > most {
        -0.5 * ((distance / most).ln() / 0.2).powi(2)
    } else if distance < least {
        -0.5 * ((least - distance) / (0.5 * least)).powi(2)
    } else {
        0.0
    }
}
