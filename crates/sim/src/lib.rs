//! What the robot would report: obstacles, exploratory motion, noise, ground truth.
//!
//! A fixed (or slowly drifting) [`Obstacle`] touches a chosen link, the arm makes small motions that keep the contact,
//! and the force follows from the exact closest points of obstacle and mesh. Nothing here knows the estimator: the
//! distances come from parry, the torques from the sum of cross products on the joint axes, and by default the touched
//! link's mesh is a refined, rounder one than the robot's own ([`refine`]).
//!
//! A [`Drive`] is the other kind of trial: an arm that moves far and fast, with gravity, inertia and friction in its measured
//! torques, and is pushed now and then.
//!
//! Everything follows from the [`Scenario`] or [`DriveScenario`] and its seed.

mod drive;
mod error;
mod motion;
mod noise;
mod obstacle;
mod placement;
mod remesh;
mod scenario;
mod scene;
mod shape;
pub mod solid;
mod torque;
mod trial;
mod truth;

pub use drive::{Drive, DriveMoment, DriveScenario, Push, TruePush};
pub use error::SimError;
pub use obstacle::{Obstacle, ObstacleKind};
pub use remesh::{coarsen, refine};
pub use scenario::Scenario;
pub use trial::{Trial, simulate};
pub use truth::{TrueContact, Truth, write_truth_csv};
