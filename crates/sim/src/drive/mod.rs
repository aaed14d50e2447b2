//! An arm that swings through free space and is pushed now and then: what its torque sensors measure, moment by moment.
//!
//! For detectors and for what makes external torques of measured ones. [`simulate`](crate::simulate) has exact
//! external torques of an arm that hardly moves; here the arm moves as fast as asked, with gravity, inertia and friction
//! in its torques, for as long as asked.

mod moment;
mod push;
mod scenario;
mod sensor;
mod swing;

use palpate_model::{Dynamics, DynamicsWorkspace, Kinematics, MeasuredSample, Robot};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use self::moment::friction_torque;
pub use self::moment::{DriveMoment, TruePush};
use self::push::PlacedPush;
pub use self::push::Push;
pub use self::scenario::DriveScenario;
use self::sensor::TorqueSensors;
use self::swing::Swing;
use crate::SimError;

/// The moments of a [`DriveScenario`], one after the other; ends after its duration. The same scenario and robot give
/// the same bits.
///
/// Feed [`DriveMoment::measured`] to a [`palpate_model::ExternalTorque`], and compare what it makes of it with
/// [`DriveMoment::external_torque`]; [`DriveMoment::push`] tells when something touches, and which link. Moments are made
/// one at a time, so that an hour at 1 kHz needs no memory. Noise, drift, friction, and masses that differ from what the
/// estimator believes are fields of the scenario.
///
/// A motion without contact, and one that is pushed with 10 N on link 5 from 1.0 s to 1.5 s:
///
/// ```
/// use palpate_model::{LoadOptions, iiwa14};
/// use palpate_sim::{Drive, DriveScenario, Push};
///
/// let robot = iiwa14(&LoadOptions::default())?;
/// let free = DriveScenario { rate_hz: 100.0, duration_secs: 2.0, ..DriveScenario::slow(7) };
/// assert!(Drive::new(&robot, &free)?.all(|moment| moment.push.is_none()));
///
/// let pushed = DriveScenario { pushes: vec![Push::new("lbr_link_5", 10.0, 1.0)], ..free };
/// for moment in Drive::new(&robot, &pushed)? {
///     let measured = &moment.measured; // Stamp, position, velocity, torque: what the robot reports.
///     let truth = &moment.external_torque; // What an estimator should make of it, Nm.
///     assert_eq!(truth.iter().any(|torque| *torque != 0.0), moment.push.is_some());
///     assert_eq!(measured.torque.len(), 7);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Drive {
    robot: Robot,
    scenario: DriveScenario,
    dynamics: Dynamics,
    workspace: DynamicsWorkspace,
    kinematics: Kinematics,
    swings: Vec<Swing>,
    pushes: Vec<PlacedPush>,
    sensors: TorqueSensors,
    next: u64,
    count: u64,
}

impl Drive {
    /// Draws motion and pushes.
    ///
    /// # Errors
    /// If a number of the scenario is out of range, a push is on a link that has no mesh or does not move, or a link has
    /// no mass.
    pub fn new(robot: &Robot, scenario: &DriveScenario) -> Result<Self, SimError> {
        /// Separate streams, so that a change of the pushes or of the noise leaves the motion as it is.
        const PUSH_STREAM: u64 = 0x7075_7368_0000_0001;
        const MASS_STREAM: u64 = 0x6d61_7373_0000_0001;
        scenario.check(robot)?;
        let stream = |number: u64| Xoshiro256PlusPlus::seed_from_u64(scenario.seed ^ number);
        let truth = scenario.true_masses(robot, &mut stream(MASS_STREAM));
        let gravity = scenario.gravity.into();
        let dynamics = Dynamics::new(&truth, gravity, scenario.payload.as_ref())?;
        let mut motion = stream(0);
        let mut places = stream(PUSH_STREAM);
        Ok(Self {
            workspace: dynamics.workspace(),
            dynamics,
            kinematics: Kinematics::new(robot),
            swings: (robot.joints.iter())
                .map(|joint| Swing::draw(joint, scenario, &mut motion))
                .collect(),
            pushes: (scenario.pushes.iter())
                .map(|push| PlacedPush::draw(robot, push, &mut places))
                .collect::<Result<_, _>>()?,
            sensors: TorqueSensors::new(scenario, robot.dof()),
            next: 0,
            count: (scenario.duration_secs * scenario.rate_hz).round() as u64,
            robot: robot.clone(),
            scenario: scenario.clone(),
        })
    }

    fn moment(&mut self, secs: f64, stamp_ns: i64) -> DriveMoment {
        let position: Vec<_> = self
            .swings
            .iter()
            .map(|swing| swing.position(secs))
            .collect();
        let velocity: Vec<_> = self
            .swings
            .iter()
            .map(|swing| swing.velocity(secs))
            .collect();
        let acceleration: Vec<_> = (self.swings.iter())
            .map(|swing| swing.acceleration(secs))
            .collect();
        self.kinematics.update(&self.robot, &position);
        let pushes = (self.pushes.iter().enumerate())
            .filter_map(|(index, push)| push.at(secs, index, &self.robot, &self.kinematics));
        let mut external_torque = vec![0.0; position.len()];
        let mut last_push = None;
        for (torques, push) in pushes {
            for (sum, torque) in external_torque.iter_mut().zip(torques) {
                *sum += torque;
            }
            last_push = Some(push);
        }
        let needed = self.dynamics.inverse_dynamics(
            &mut self.workspace,
            &position,
            &velocity,
            &acceleration,
        );
        let torque = (needed
            .iter()
            .zip(&velocity)
            .zip(&external_torque)
            .enumerate())
        .map(|(joint, ((needed, speed), external))| {
            needed + friction_torque(&self.scenario, joint, *speed) - external
        })
        .collect();
        DriveMoment {
            measured: self.sensors.measure(MeasuredSample {
                stamp_ns,
                position: position.clone(),
                velocity,
                torque,
            }),
            position,
            external_torque,
            push: last_push,
        }
    }
}

impl Iterator for Drive {
    type Item = DriveMoment;

    fn next(&mut self) -> Option<DriveMoment> {
        if self.next == self.count {
            return None;
        }
        let secs = self.next as f64 / self.scenario.rate_hz;
        self.next += 1;
        Some(self.moment(secs, (secs * 1e9).round() as i64))
    }
}
