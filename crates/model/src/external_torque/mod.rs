//! External torque from measured torque: what of it the arm's own dynamics do not explain.
//!
//! The torque that the environment applies on the joints is, from the equation of motion,
//! τ_ext = M q̈ + C q̇ + g + τ_f − τ, with the measured torque τ and the friction τ_f (J. Bimbo et al., IROS 2019, eq. 4, to
//! which friction is added). A push along a joint's axis is positive, as in [`JointSample`].

mod friction;
mod gate;
mod observer;
mod speed;

use nalgebra::Vector3;

pub use self::friction::JointFriction;
use self::gate::Gate;
pub use self::gate::{BeyondLimit, TorqueCounts, TorqueRefusal};
use self::observer::MomentumObserver;
use self::speed::Differentiator;
use crate::{Dynamics, DynamicsWorkspace, JointSample, MeasuredSample, ModelError, Payload, Robot};

/// How the acceleration is done without, which no robot measures.
#[derive(Clone, Debug, PartialEq)]
pub enum TorqueMethod {
    /// Equation 4 with q̈ = 0: right while the arm hardly accelerates, and as noisy as the measured torque.
    Static,
    /// The generalised-momentum observer (A. De Luca, R. Mattone, *Sensorless robot collision detection and hybrid
    /// force/motion control*, ICRA 2005): the external torque through a first-order low-pass.
    MomentumObserver {
        /// Gain of each joint, 1/s: the low-pass has the time constant 1/gain, its bandwidth is gain/2π Hz.
        gain: Vec<f64>,
    },
}

/// Where joint speeds come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VelocitySource {
    /// From the sample; without them it is refused.
    Driver,
    /// From the positions: backward differences through a first-order low-pass.
    Differentiated {
        /// Bandwidth of the low-pass, Hz. The speeds lag by 1/(2π · bandwidth) and half the time between samples.
        cutoff_hz: f64,
    },
}

/// What has to be known of a robot to tell the external from the measured torque.
#[derive(Clone, Debug, PartialEq)]
pub struct ExternalTorqueOptions {
    /// How the acceleration is done without.
    pub method: TorqueMethod,
    /// Gravity in the root frame, m/s²; see [`Dynamics::UPRIGHT`].
    pub gravity_in_root: Vector3<f64>,
    /// What the arm carries beyond what the URDF says.
    pub payload: Option<Payload>,
    /// Friction of each joint that is in the measured torque.
    pub friction: Vec<JointFriction>,
    /// Where joint speeds come from.
    pub velocity: VelocitySource,
}

/// Makes samples with external torques of samples with measured ones. After construction it allocates nothing.
#[derive(Clone, Debug)]
pub struct ExternalTorque {
    dynamics: Dynamics,
    workspace: DynamicsWorkspace,
    friction: Vec<JointFriction>,
    gate: Gate,
    differentiator: Option<Differentiator>,
    observer: Option<MomentumObserver>,
    sample: JointSample,
}

impl ExternalTorque {
    /// Longest time between two samples that observer and differentiator bridge, s: beyond it they start anew.
    pub const LONGEST_GAP_SECS: f64 = 0.5;

    /// For `robot`, as `options` say.
    ///
    /// # Errors
    /// As [`Dynamics::new`]; if there is not one gain or friction a joint; if a gain or the cut-off is not above zero, or a
    /// friction is below it.
    pub fn new(robot: &Robot, options: &ExternalTorqueOptions) -> Result<Self, ModelError> {
        let dof = robot.dof();
        let payload = options.payload.as_ref();
        let dynamics = Dynamics::new(robot, options.gravity_in_root, payload)?;
        check_count("friction", options.friction.len(), dof)?;
        for friction in &options.friction {
            check_number(
                "viscous friction",
                "0 or more",
                friction.viscous,
                friction.viscous >= 0.0,
            )?;
            check_number(
                "Coulomb friction",
                "0 or more",
                friction.coulomb,
                friction.coulomb >= 0.0,
            )?;
        }
        let observer = match &options.method {
            TorqueMethod::Static => None,
            TorqueMethod::MomentumObserver { gain } => {
                check_count("gain of the momentum observer", gain.len(), dof)?;
                for &gain in gain {
                    check_number("gain of the momentum observer", "above 0", gain, gain > 0.0)?;
                }
                Some(MomentumObserver::new(gain.clone()))
            }
        };
        let differentiator = match options.velocity {
            VelocitySource::Driver => None,
            VelocitySource::Differentiated { cutoff_hz } => {
                check_number(
                    "cut-off of the speeds",
                    "above 0 Hz",
                    cutoff_hz,
                    cutoff_hz > 0.0,
                )?;
                Some(Differentiator::new(cutoff_hz, dof))
            }
        };
        Ok(Self {
            workspace: dynamics.workspace(),
            dynamics,
            friction: options.friction.clone(),
            gate: Gate::new(robot, differentiator.is_none()),
            differentiator,
            observer,
            sample: JointSample {
                stamp_ns: 0,
                position: vec![0.0; dof],
                external_torque: vec![0.0; dof],
            },
        })
    }

    /// Takes in a measured sample, and gives the one with the external torque at the same time.
    ///
    /// # Errors
    /// Says which value is wrong, what was expected and what was found. A refused sample changes nothing.
    pub fn update(&mut self, measured: &MeasuredSample) -> Result<&JointSample, TorqueRefusal> {
        let step_secs = self.gate.pass(measured)?;
        let step_secs = step_secs.filter(|secs| *secs <= Self::LONGEST_GAP_SECS);
        let position = &measured.position;
        let velocity = match &mut self.differentiator {
            Some(differentiator) => differentiator.update(step_secs, position),
            None => &measured.velocity,
        };
        let workspace = &mut self.workspace;
        let external = &mut self.sample.external_torque;
        let gravity = self.dynamics.gravity_torque(workspace, position);
        for (joint, external) in external.iter_mut().enumerate() {
            let friction = self.friction[joint].torque(velocity[joint]);
            *external = gravity[joint] + friction - measured.torque[joint];
        }
        match &mut self.observer {
            Some(observer) => {
                let momentum = self.dynamics.momentum(workspace, position, velocity);
                observer.update(step_secs, momentum, external);
            }
            None => {
                let coriolis = self.dynamics.coriolis_torque(workspace, position, velocity);
                for (external, coriolis) in external.iter_mut().zip(coriolis) {
                    *external += coriolis;
                }
            }
        }
        self.sample.stamp_ns = measured.stamp_ns;
        self.sample.position.copy_from_slice(position);
        Ok(&self.sample)
    }

    /// What was used and refused so far.
    pub fn counts(&self) -> TorqueCounts {
        self.gate.counts()
    }

    /// The first torque beyond the limit of its joint, if there was one.
    pub fn beyond_limit(&self) -> Option<&BeyondLimit> {
        self.gate.beyond_limit()
    }

    /// Forgets all samples, as where time starts anew; the counts stay.
    pub fn restart(&mut self) {
        self.gate.restart();
    }
}

fn check_count(what: &'static str, found: usize, expected: usize) -> Result<(), ModelError> {
    if found == expected {
        return Ok(());
    }
    Err(ModelError::JointCount {
        what,
        expected,
        found,
    })
}

fn check_number(
    name: &str,
    expected: &'static str,
    found: f64,
    good: bool,
) -> Result<(), ModelError> {
    if good && found.is_finite() {
        return Ok(());
    }
    Err(ModelError::Number {
        name: name.to_owned(),
        expected,
        found: found.to_string(),
    })
}
