//! What the robot is: its joints and links from a URDF, their meshes, how they move, and the surfaces that can be
//! touched.
//!
//! The model never changes after it is built; the results for one configuration are another value ([`Kinematics`]).
//! Transforms are named `a_from_b`, quantities `x_in_a`; units are SI, angles radians, stamps integer nanoseconds.

mod error;
mod joint_map;
mod kinematics;
mod mesh;
mod pairing;
mod robot;
mod sample;
mod surface;

pub use error::ModelError;
pub use joint_map::JointMap;
pub use kinematics::Kinematics;
pub use mesh::TriangleMesh;
pub use pairing::{Pairing, PairingLosses};
pub use robot::{Joint, JointKind, JointLimits, Link, Robot};
pub use sample::JointSample;
pub use surface::{Surface, SurfacePoint};
