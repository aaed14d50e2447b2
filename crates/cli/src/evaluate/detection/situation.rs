//! What the arm does, and what its estimator of external torque believes wrongly.

use nalgebra::{Matrix3, Point3};
use palpate_model::{
    Dynamics, ExternalTorqueOptions, Inertial, JointFriction, Payload, Robot, TorqueMethod,
    VelocitySource,
};
use palpate_sim::DriveScenario;

/// Gain of the momentum observer, 1/s.
pub const GAIN: f64 = 50.0;
/// What the arm carries where it carries something: its mass, kg, and how far it is from the last link's origin, m.
const PAYLOAD: f64 = 3.0;
const PAYLOAD_OUT: f64 = 0.1;
/// Friction of every joint where there is some: Coulomb, Nm, and viscous, Nm s/rad.
const FRICTION: f64 = 0.5;
/// Share of payload and friction that the estimator knows of.
const BELIEVED: f64 = 0.9;

/// How external torques are made of measured ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// The generalised-momentum observer.
    Observer,
    /// The static formula.
    Static,
}

impl Source {
    pub const ALL: [Self; 2] = [Self::Observer, Self::Static];

    pub fn name(self) -> &'static str {
        match self {
            Self::Observer => "momentum observer",
            Self::Static => "static formula",
        }
    }

    fn method(self, dof: usize) -> TorqueMethod {
        match self {
            Self::Static => TorqueMethod::Static,
            Self::Observer => TorqueMethod::MomentumObserver {
                gain: vec![GAIN; dof],
            },
        }
    }
}

/// A motion with its errors. Everywhere: 0.1 Nm white noise, 0.05 Nm drift, and masses known to within 1 %.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Situation {
    /// Name in tables and files.
    pub name: &'static str,
    pub speed: Speed,
    /// Whether it carries a payload that is believed lighter.
    pub has_payload: bool,
    /// Whether its joints have friction that is believed smaller.
    pub has_friction: bool,
}

/// How fast the arm moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speed {
    Rest,
    Slow,
    Fast,
}

const fn situation(name: &'static str, speed: Speed, payload: bool, friction: bool) -> Situation {
    Situation {
        name,
        speed,
        has_payload: payload,
        has_friction: friction,
    }
}

/// Every situation.
pub const SITUATIONS: [Situation; 7] = [
    situation("rest", Speed::Rest, false, false),
    situation("slow", Speed::Slow, false, false),
    situation("fast", Speed::Fast, false, false),
    situation("slow, payload 10 % wrong", Speed::Slow, true, false),
    situation("fast, payload 10 % wrong", Speed::Fast, true, false),
    situation("slow, friction 10 % wrong", Speed::Slow, false, true),
    situation("fast, friction 10 % wrong", Speed::Fast, false, true),
];

impl Situation {
    /// What happens, with this seed, rate (Hz) and length (s).
    pub fn scenario(&self, robot: &Robot, seed: u64, rate_hz: f64, secs: f64) -> DriveScenario {
        let dof = robot.dof();
        let friction = || vec![if self.has_friction { FRICTION } else { 0.0 }; dof];
        let scenario = match self.speed {
            Speed::Fast => DriveScenario::fast(seed),
            Speed::Slow => DriveScenario::slow(seed),
            Speed::Rest => DriveScenario {
                peak_speed: 0.0,
                ..DriveScenario::slow(seed)
            },
        };
        DriveScenario {
            rate_hz,
            duration_secs: secs,
            mass_error: 0.01,
            payload: self.has_payload.then(|| payload(robot)).flatten(),
            viscous_friction: friction(),
            coulomb_friction: friction(),
            ..scenario
        }
    }

    /// What the estimator of external torque believes.
    pub fn options(&self, robot: &Robot, source: Source) -> ExternalTorqueOptions {
        let size = if self.has_friction {
            BELIEVED * FRICTION
        } else {
            0.0
        };
        let friction = JointFriction {
            viscous: size,
            coulomb: size,
        };
        let believed = |payload: Payload| payload.scaled(BELIEVED);
        ExternalTorqueOptions {
            method: source.method(robot.dof()),
            gravity_in_root: Dynamics::UPRIGHT,
            payload: self
                .has_payload
                .then(|| payload(robot))
                .flatten()
                .map(believed),
            friction: vec![friction; robot.dof()],
            velocity: VelocitySource::Driver,
        }
    }
}

/// A ball at the link that most joints move.
fn payload(robot: &Robot) -> Option<Payload> {
    let last =
        (robot.links.iter()).max_by_key(|link| (link.path.len(), link.inertial.is_some()))?;
    Some(Payload {
        link: last.name.clone(),
        inertial: Inertial {
            mass: PAYLOAD,
            centre_in_link: Point3::new(0.0, 0.0, PAYLOAD_OUT),
            inertia_in_link: Matrix3::identity() * 0.004,
        },
    })
}

/// The situations in words, for a report.
pub fn told() -> String {
    format!(
        "Everywhere: white noise of 0.1 Nm and a slow drift of 0.05 Nm (σ, forgotten within 60 s) on the torques, 0.001 \
         rad/s on the speeds, links' masses known to within 1 %. Slow: all joints swing with up to 0.25 rad/s; fast: with up \
         to 1.5 rad/s. Payload: {PAYLOAD} kg of which {:.0} % are known. Friction: {FRICTION} Nm Coulomb and {FRICTION} Nm \
         s/rad viscous on every joint, of which {:.0} % are known, so that the external torque jumps by {:.1} Nm where a \
         joint turns back. The momentum observer's gain is {GAIN} 1/s. Each run begins with a tare over half a second.",
        100.0 * BELIEVED,
        100.0 * BELIEVED,
        2.0 * FRICTION * (1.0 - BELIEVED),
    )
}
