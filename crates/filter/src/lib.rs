//! Where the contact is: a particle filter over the triangles of each link's mesh.

mod estimate;
mod filter;
mod intake;
mod parameters;
mod particle;

pub use estimate::{ContactEstimate, ContactStatus, Mode};
pub use filter::Filter;
pub use intake::{Admitted, Intake, IntakeCounts, Refusal};
pub use parameters::{ParameterError, Parameters};
pub use particle::Particle;
