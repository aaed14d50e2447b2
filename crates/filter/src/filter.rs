//! The filter: one `update` a sample.

use palpate_model::Robot;

use crate::{Admitted, ContactEstimate, ContactStatus, ParameterError, Parameters, Particle};

/// A particle filter for contacts on one robot. Deterministic for a seed, at any number of threads.
pub struct Filter {
    estimate: ContactEstimate,
}

impl Filter {
    /// A filter for `robot`.
    ///
    /// # Errors
    /// If a parameter is out of range, or the robot has no link that can be touched.
    pub fn new(
        _robot: &Robot,
        _parameters: &Parameters,
        _seed: u64,
    ) -> Result<Self, ParameterError> {
        let estimate = ContactEstimate {
            stamp_ns: 0,
            status: ContactStatus::NoContact,
            modes: Vec::new(),
        };
        Ok(Self { estimate })
    }

    /// Takes one sample in. Cannot fail, and allocates nothing in steady state.
    pub fn update(&mut self, sample: Admitted<'_>) -> &ContactEstimate {
        self.estimate.stamp_ns = sample.sample().stamp_ns;
        &self.estimate
    }

    /// The estimate after the last update.
    pub fn estimate(&self) -> &ContactEstimate {
        &self.estimate
    }

    /// Writes the particles into `cloud`, replacing what it holds. Empty without contact.
    pub fn particles(&self, cloud: &mut Vec<Particle>) {
        cloud.clear();
    }

    /// Forgets everything learned, as at the start.
    pub fn reset(&mut self) {
        self.estimate.status = ContactStatus::NoContact;
        self.estimate.modes.clear();
    }
}
