//! The bodies that move: links merged over fixed joints.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::spatial::{Placement, SpatialInertia, Twist};
use crate::{Inertial, JointKind, ModelError, Payload, Robot};

/// All that one joint moves before the next joints. Its frame is the joint's.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// Index of the body that carries it; always smaller than its own; none where that is the root.
    pub parent: Option<usize>,
    /// Motion of the body for a unit of joint speed, in its own frame.
    pub screw: Twist,
    pub inertia: SpatialInertia,
    rest: Placement,
    /// Parts of the turn that go with the angle's sine and its cosine's lack (Rodrigues), or, of a slide, nothing.
    with_sine: Matrix3<f64>,
    with_versine: Matrix3<f64>,
    /// Shift in the parent's frame for a unit of joint position.
    slide: Vector3<f64>,
}

impl Body {
    fn new(
        parent: Option<usize>,
        parent_from_rest: Isometry3<f64>,
        kind: JointKind,
        axis: Vector3<f64>,
    ) -> Self {
        let rest = Placement::from(parent_from_rest);
        let zero = Vector3::zeros();
        let (angular, linear) = match kind {
            JointKind::Prismatic => (zero, axis),
            JointKind::Revolute | JointKind::Continuous => (axis, zero),
        };
        let cross = angular.cross_matrix();
        Self {
            parent,
            screw: Twist { angular, linear },
            inertia: SpatialInertia::default(),
            with_sine: rest.turn * cross,
            with_versine: rest.turn * cross * cross,
            slide: rest.turn * linear,
            rest,
        }
    }

    /// Where the body is in its parent's frame, for joint position `q`.
    pub fn placement(&self, q: f64) -> Placement {
        let (sine, cosine) = q.sin_cos();
        Placement {
            turn: self.rest.turn + self.with_sine * sine + self.with_versine * (1.0 - cosine),
            shift: self.rest.shift + self.slide * q,
        }
    }
}

/// The bodies of a robot, one a movable joint in the joints' order.
pub(super) fn bodies(robot: &Robot, payload: Option<&Payload>) -> Result<Vec<Body>, ModelError> {
    let carrier = payload.map(|payload| carrier(robot, payload)).transpose()?;
    let mut bodies: Vec<Body> = Vec::with_capacity(robot.dof());
    // For each link the body that it belongs to, if it moves, and where it is in that body.
    let mut belongs: Vec<(Option<usize>, Isometry3<f64>)> = Vec::with_capacity(robot.links.len());
    for (index, link) in robot.links.iter().enumerate() {
        let (parent, body_from_parent) =
            (link.parent).map_or((None, Isometry3::identity()), |parent| belongs[parent]);
        let body_from_rest = body_from_parent * link.parent_from_rest;
        let (body, body_from_link) = match link.joint {
            Some(joint) => {
                let axis = robot.joints[joint].axis_in_joint.into_inner();
                let kind = robot.joints[joint].kind;
                bodies.push(Body::new(parent, body_from_rest, kind, axis));
                (Some(joint), Isometry3::identity())
            }
            None => (parent, body_from_rest),
        };
        belongs.push((body, body_from_link));
        let Some(body) = body else {
            continue; // It does not move.
        };
        let carried = (payload.filter(|_| carrier == Some(index))).map(|payload| &payload.inertial);
        for inertial in link.inertial.iter().chain(carried) {
            bodies[body].inertia += SpatialInertia::new(inertial, &body_from_link);
        }
        check(robot, index, carried)?;
    }
    check_masses(robot, &bodies)?;
    Ok(bodies)
}

fn carrier(robot: &Robot, payload: &Payload) -> Result<usize, ModelError> {
    payload.inertial.check("the payload")?;
    robot.link_index(&payload.link).ok_or_else(|| {
        let names: Vec<_> = robot.links.iter().map(|link| link.name.as_str()).collect();
        ModelError::PayloadLink {
            found: payload.link.clone(),
            known: names.join(", "),
        }
    })
}

/// Refuses a moving link with a wrong mass, or with a shape and no mass. A frame needs none.
fn check(robot: &Robot, index: usize, carried: Option<&Inertial>) -> Result<(), ModelError> {
    let link = &robot.links[index];
    match &link.inertial {
        Some(inertial) => inertial.check(&format!("link `{}`", link.name)),
        None if link.mesh.is_some() && carried.is_none() => Err(ModelError::NoInertia {
            link: link.name.clone(),
        }),
        None => Ok(()),
    }
}

/// Refuses a joint that moves no mass of its own: its mass matrix would be singular, or the URDF is not complete.
fn check_masses(robot: &Robot, bodies: &[Body]) -> Result<(), ModelError> {
    let massless = |joint: usize| {
        bodies
            .get(joint)
            .is_some_and(|body| body.inertia.mass == 0.0)
    };
    match (robot.links.iter()).find(|link| link.joint.is_some_and(massless)) {
        None => Ok(()),
        Some(link) => Err(ModelError::NoInertia {
            link: link.name.clone(),
        }),
    }
}
