//! What the robot is: its joints and links from a URDF, their meshes, how they move, what torque that takes, and the
//! surfaces that can be touched.
//!
//! The model never changes after it is built; the results for one configuration are another value ([`Kinematics`],
//! [`DynamicsWorkspace`]).
//! Transforms are named `a_from_b`, quantities `x_in_a`; units are SI, angles radians, stamps integer nanoseconds.

mod adjacency;
mod bounds;
mod clean;
mod dynamics;
mod error;
mod exposed;
mod external_torque;
mod iiwa14;
mod inertial;
mod joint_map;
mod kinematics;
mod link_mesh;
mod lists;
mod load;
mod mesh;
mod mesh_file;
mod mesh_source;
mod pairing;
mod plate;
mod rivals;
mod robot;
mod sample;
mod shape;
mod smooth;
mod source;
mod split;
mod surface;
mod tree;
mod triangle;
mod urdf;

pub use clean::Cleaning;
pub use dynamics::{Dynamics, DynamicsWorkspace, Momentum};
pub use error::ModelError;
pub use external_torque::{
    BeyondLimit, ExternalTorque, ExternalTorqueOptions, JointFriction, TorqueCounts, TorqueMethod,
    TorqueRefusal, VelocitySource,
};
pub use iiwa14::{IIWA14_MESHES, IIWA14_URDF, iiwa14};
pub use inertial::{Inertial, Payload, inertia_matrix};
pub use joint_map::JointMap;
pub use kinematics::Kinematics;
pub use load::{Geometry, LinkReport, LoadOptions, LoadReport};
pub use mesh::{EdgeCount, TriangleMesh};
pub use mesh_source::{EmbeddedMeshes, MeshFiles, MeshSource};
pub use pairing::{Pairing, PairingLosses};
pub use robot::{Joint, JointKind, JointLimits, Link, Robot};
pub use sample::{JointSample, MeasuredSample};
pub use smooth::{SmoothBody, SmoothPoint};
pub use source::{Fields, JointPicker, JointReading, JointValues, Source};
pub use surface::{Landing, Plates, Surface, SurfacePoint};
