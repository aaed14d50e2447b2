//! What is fed to the filters: simulated contacts of the iiwa that ships with the project.

use palpate_model::{JointSample, Robot};
use palpate_sim::{Scenario, simulate};

/// What the particles are like while steps are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cloud {
    /// Gathered around the contact, after motion.
    Converged,
    /// Over the whole robot, just after the touch.
    Ambiguous,
}

/// Samples that are fed first, and samples whose steps are measured.
pub struct Stream {
    pub lead: Vec<JointSample>,
    pub measured: Vec<JointSample>,
}

impl Stream {
    /// At most so many steps of 1 kHz, after what brings the cloud about.
    pub fn new(robot: &Robot, cloud: Cloud, most: usize) -> Self {
        let samples = samples(robot, 1000.0, 2.0);
        let (lead, measured) = match cloud {
            // At first every tenth sample, to be there sooner.
            Cloud::Converged => (
                samples[..1500].iter().step_by(10).cloned().collect(),
                1500..2000,
            ),
            Cloud::Ambiguous => (samples[..5].to_vec(), 5..65),
        };
        let last = measured.end.min(measured.start + most);
        Self {
            lead,
            measured: samples[measured.start..last].to_vec(),
        }
    }

    /// Every sample of a contact, the first tenth of it not measured.
    pub fn steady(robot: &Robot, rate_hz: f64, secs: f64) -> Self {
        let mut lead = samples(robot, rate_hz, secs);
        let measured = lead.split_off(lead.len() / 10);
        Self { lead, measured }
    }
}

/// A ball at link 5, 5 % noise.
fn samples(robot: &Robot, rate_hz: f64, duration_secs: f64) -> Vec<JointSample> {
    let scenario = Scenario {
        rate_hz,
        duration_secs,
        noise_fraction: 0.05,
        joint_speed: 0.2,
        travel: 0.03,
        ..Scenario::new("lbr_link_5")
    };
    simulate(robot, &scenario).unwrap().samples
}
