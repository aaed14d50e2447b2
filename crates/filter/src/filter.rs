//! The filter: one `update` a sample.

use std::sync::OnceLock;

use nalgebra::{Matrix3, Vector3};
use palpate_model::{Kinematics, Robot};

use crate::cloud::Cloud;
use crate::detector::Detector;
use crate::modes::ModeFinder;
use crate::palpate::{MOST_JOINTS, PalpateFilter};
use crate::paper::{PaperFilter, Stage};
use crate::skin::Skin;
use crate::step::Step;
use crate::tare::Tare;
use crate::{
    Admitted, ContactEstimate, ContactStatus, Detection, JointBias, Method, Mode, ParameterError,
    Parameters, Particle, TareRefusal, TareState,
};

/// The method chosen, with all that it knows of the present contact.
enum Estimator {
    Paper(Box<PaperFilter>),
    Palpate {
        filter: Box<PalpateFilter>,
        /// Its particles at the last sample, twice: as the outside sees them, and link by link.
        particles: Vec<Particle>,
        cloud: Cloud,
    },
}

impl Estimator {
    fn new(robot: &Robot, parameters: &Parameters, seed: u64) -> Self {
        let count = parameters.particles;
        match parameters.method {
            Method::Paper => {
                let filter = PaperFilter::new(robot, parameters.paper.clone(), count, seed);
                Self::Paper(Box::new(filter))
            }
            Method::Palpate => {
                let parameters = parameters.palpate.clone();
                Self::Palpate {
                    particles: Vec::with_capacity(parameters.hypotheses),
                    cloud: Cloud::with_room(robot.links.len(), parameters.hypotheses),
                    filter: Box::new(PalpateFilter::new(robot, parameters, seed)),
                }
            }
        }
    }

    fn begin(&mut self) {
        match self {
            Self::Paper(filter) => filter.begin(),
            Self::Palpate { filter, .. } => filter.begin(),
        }
    }

    /// Takes a sample in; returns the particles that follow from it, link by link.
    fn step(&mut self, step: &Step, stamp_ns: i64) -> &Cloud {
        match self {
            Self::Paper(filter) => {
                filter.step(step, stamp_ns);
                filter.cloud()
            }
            Self::Palpate {
                filter,
                particles,
                cloud,
            } => {
                filter.step(step, stamp_ns);
                particles.clear();
                filter.show(step, particles);
                cloud.gather(particles);
                cloud
            }
        }
    }

    /// Particles that the last step moved and weighed.
    fn moved(&self) -> usize {
        match self {
            Self::Paper(filter) => filter.moved(),
            Self::Palpate { .. } => 0,
        }
    }

    fn widen(&self, step: &Step, modes: &mut [Mode]) {
        if let Self::Palpate { filter, .. } = self {
            filter.widen(step, modes);
        }
    }

    /// The particles after the last step.
    fn particles(&self) -> Vec<Particle> {
        match self {
            Self::Paper(filter) => filter.particles(),
            Self::Palpate { particles, .. } => particles.clone(),
        }
    }
}

/// A particle filter for contacts on one robot. Deterministic for a seed, at any number of threads.
pub struct Filter {
    robot: Robot,
    skin: Skin,
    parameters: Parameters,
    detector: Detector,
    tare: Tare,
    /// External torques of the last sample without bias, Nm.
    torque: Vec<f64>,
    estimator: Estimator,
    modes: ModeFinder,
    before: Kinematics,
    now: Kinematics,
    position_before: Vec<f64>,
    number: u64,
    seed: u64,
    /// Most particles of the paper's filter, besides its parameter.
    limit: usize,
    /// The particles, once somebody asked for them.
    shown: OnceLock<Vec<Particle>>,
    estimate: ContactEstimate,
}

impl Filter {
    /// A filter for `robot`.
    ///
    /// # Errors
    /// If a parameter is out of range, or the robot has no link that can be touched.
    pub fn new(robot: &Robot, parameters: &Parameters, seed: u64) -> Result<Self, ParameterError> {
        parameters.check()?;
        let nothing = || ParameterError::NothingToTouch {
            robot: robot.name.clone(),
        };
        let mut skin = Skin::new(robot).ok_or_else(nothing)?;
        if parameters.method == Method::Palpate {
            skin = skin.with_bodies(robot);
        }
        check_paths(robot)?;
        Ok(Self {
            detector: Detector::new(robot, &parameters.detector)?,
            tare: Tare::new(robot.dof()),
            torque: vec![0.0; robot.dof()],
            estimator: Estimator::new(robot, parameters, seed),
            modes: ModeFinder::new(robot, &skin),
            before: Kinematics::new(robot),
            now: Kinematics::new(robot),
            position_before: vec![0.0; robot.dof()],
            number: 0,
            seed,
            limit: usize::MAX,
            shown: OnceLock::new(),
            estimate: ContactEstimate {
                stamp_ns: 0,
                status: ContactStatus::NoContact,
                modes: Vec::new(),
            },
            robot: robot.clone(),
            skin,
            parameters: parameters.clone(),
        })
    }

    /// Takes one sample in. Cannot fail, and allocates nothing in steady state.
    pub fn update(&mut self, sample: Admitted<'_>) -> &ContactEstimate {
        self.detector.update(sample);
        let sample = sample.sample();
        std::mem::swap(&mut self.before, &mut self.now);
        self.now.update(&self.robot, &sample.position);
        let was_in_contact = self.estimate.status != ContactStatus::NoContact;
        let measured = &sample.external_torque;
        self.carry_tare_on(sample.stamp_ns, measured);
        self.take_bias_out(measured);
        let in_contact = self.detector.detection().in_contact;
        self.shown.take();
        self.estimate.modes.clear();
        if in_contact {
            if !was_in_contact {
                self.before.update(&self.robot, &sample.position);
                self.position_before.copy_from_slice(&sample.position);
                self.estimator.begin();
            }
            let step = Step {
                robot: &self.robot,
                skin: &self.skin,
                before: &self.before,
                now: &self.now,
                position_before: &self.position_before,
                position: &sample.position,
                torque: &self.torque,
                bias: self.detector.bias(),
                number: self.number,
                limit: self.limit,
            };
            let cloud = self.estimator.step(&step, sample.stamp_ns);
            self.modes
                .find(cloud, &self.skin, &self.now, &mut self.estimate.modes);
            self.estimator.widen(&step, &mut self.estimate.modes);
        }
        self.summarise(sample.stamp_ns, in_contact);
        self.position_before.copy_from_slice(&sample.position);
        self.number += 1;
        &self.estimate
    }

    /// Runs one stage of the paper's method again, on the particles as they are. For benchmarks.
    #[doc(hidden)]
    pub fn run_stage(&mut self, stage: Stage, sample: Admitted<'_>) {
        let step = Step {
            robot: &self.robot,
            skin: &self.skin,
            before: &self.now,
            now: &self.now,
            position_before: &self.position_before,
            position: &sample.sample().position,
            torque: &self.torque,
            bias: self.detector.bias(),
            number: self.number,
            limit: self.limit,
        };
        let Estimator::Paper(filter) = &mut self.estimator else {
            return;
        };
        match stage {
            Stage::Modes => {
                let modes = &mut self.estimate.modes;
                (self.modes).find(filter.cloud(), &self.skin, &self.now, modes);
            }
            _ => filter.run_stage(stage, &step),
        }
        self.number += 1;
    }

    fn summarise(&mut self, stamp_ns: i64, in_contact: bool) {
        self.estimate.stamp_ns = stamp_ns;
        let tolerance = Matrix3::identity() * self.parameters.tolerance.powi(2);
        for mode in &mut self.estimate.modes {
            mode.covariance_in_root += tolerance;
        }
        let located = self.estimate.modes.first().is_some_and(|mode| {
            mode.probability >= self.parameters.located_probability
                && mode.std() <= self.parameters.located_std
        });
        self.estimate.status = match (in_contact, located) {
            (false, _) => ContactStatus::NoContact,
            (true, false) => ContactStatus::Ambiguous,
            (true, true) => ContactStatus::Located,
        };
    }

    /// Lets the paper's filter have at most so many particles (at least one) from the next step on, for a machine that is
    /// too slow for as many as [`Parameters::particles`]. They become fewer with that step, and more again, where this
    /// allows twice as many, or when they are resampled anyhow. Without a call, the number is the parameter's.
    pub fn limit_particles(&mut self, count: usize) {
        self.limit = count.max(1);
    }

    /// Most particles, or hypotheses, that there may be now.
    pub fn most_particles(&self) -> usize {
        let count = self.parameters.particle_count();
        match self.parameters.method {
            Method::Paper => count.min(self.limit),
            Method::Palpate => count,
        }
    }

    /// How many particles of the paper's filter the last update moved and weighed; 0 where it made no step.
    pub fn moved_particles(&self) -> usize {
        match self.estimate.status {
            ContactStatus::NoContact => 0,
            _ => self.estimator.moved(),
        }
    }

    fn take_bias_out(&mut self, external_torque: &[f64]) {
        for ((torque, measured), bias) in
            (self.torque.iter_mut().zip(external_torque)).zip(self.detector.bias())
        {
            *torque = measured - bias.mean;
        }
    }

    /// The tare takes torques in as they are measured, with the bias.
    fn carry_tare_on(&mut self, stamp_ns: i64, external_torque: &[f64]) {
        if self.seen_contact().is_some() {
            self.tare.interrupt();
        } else if self.tare.take(stamp_ns, external_torque) {
            self.detector.set_bias(|joint| self.tare.bias(joint));
        }
    }

    /// Since when something touches, ns, if it was seen to begin: a torque that was there when the stream began may as
    /// well be a bias.
    fn seen_contact(&self) -> Option<i64> {
        let since_ns = self.detector.detection().since_ns;
        since_ns.filter(|_| !self.detector.has_unseen_begin())
    }

    /// Begins to tare: the mean of each joint's torque over the next `secs` (0.1 to 60 s) becomes its bias. The robot
    /// should rest, and nothing touch it; see [`Filter::tare_state`] for how it goes. What seemed to touch since the
    /// stream began or since the last [`Filter::reset`] is tared as well.
    ///
    /// # Errors
    /// If something was seen to touch, or the time is out of range.
    pub fn start_tare(&mut self, secs: f64) -> Result<(), TareRefusal> {
        match self.seen_contact() {
            Some(since_ns) => Err(TareRefusal::InContact { since_ns }),
            None => self.tare.start(secs),
        }
    }

    /// Forgets the bias, tared or learned, and the noise: the torques count as they are measured.
    pub fn clear_tare(&mut self) {
        self.tare.clear();
        self.detector.reset();
    }

    /// Ends a tare that is running; the bias is as it was before.
    pub fn stop_tare(&mut self) {
        self.tare.interrupt();
    }

    /// How far the last commanded tare is.
    pub fn tare_state(&self) -> TareState {
        self.tare.state()
    }

    /// The bias of each joint's external torque, tared or learned.
    pub fn bias(&self) -> &[JointBias] {
        self.detector.bias()
    }

    /// The parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Whether anything touched at the last update, and what the torques tell of it without the estimate.
    pub fn detection(&self) -> &Detection {
        self.detector.detection()
    }

    /// The estimate after the last update.
    pub fn estimate(&self) -> &ContactEstimate {
        &self.estimate
    }

    /// Kinematics at the last sample.
    pub fn kinematics(&self) -> &Kinematics {
        &self.now
    }

    /// The particles after the last update. Empty without contact. Made when they are first asked for.
    pub fn particles(&self) -> &[Particle] {
        match self.estimate.status {
            ContactStatus::NoContact => &[],
            _ => self.shown.get_or_init(|| self.estimator.particles()),
        }
    }

    /// What of each joint's torque, bias removed, the most probable contact's force does not explain, Nm (N for a
    /// prismatic joint); without contact, all of it.
    pub fn residual(&self) -> Vec<f64> {
        let mut residual = self.torque.clone();
        if let Some(mode) = self.estimate.best() {
            let path = &self.robot.links[mode.link].path;
            let jacobian = self.now.jacobian_in_root(mode.link, &mode.point_in_link);
            for (column, &joint) in jacobian.column_iter().zip(path) {
                residual[joint] -= column.dot(&mode.force_in_root);
            }
        }
        residual
    }

    /// Effective sample size of the particles; 0 without contact.
    pub fn effective_sample_size(&self) -> f64 {
        let squares: f64 = self
            .particles()
            .iter()
            .map(|at| at.weight * at.weight)
            .sum();
        if squares > 0.0 { 1.0 / squares } else { 0.0 }
    }

    /// Standard deviation of the particles' points about their mean, m, over all links; 0 without contact.
    pub fn spread(&self) -> f64 {
        let weighted = || {
            self.particles().iter().map(|at| {
                let root_from_link = self.now.root_from_link(at.link);
                (at.weight, (root_from_link * at.point_in_link).coords)
            })
        };
        let mean: Vector3<f64> = weighted().map(|(weight, point)| point * weight).sum();
        let about_mean =
            |(weight, point): (f64, Vector3<f64>)| weight * (point - mean).norm_squared();
        weighted().map(about_mean).sum::<f64>().sqrt()
    }

    /// Takes other parameters over. What is known of the present contact is forgotten; bias and noise stay.
    ///
    /// # Errors
    /// If a parameter is out of range; then all stays as it was.
    pub fn set_parameters(&mut self, parameters: &Parameters) -> Result<(), ParameterError> {
        parameters.check()?;
        if self.parameters == *parameters {
            return Ok(());
        }
        self.parameters = parameters.clone();
        self.detector.set_parameters(&parameters.detector)?;
        self.forget_contact();
        Ok(())
    }

    /// Forgets everything learned, as at the start.
    pub fn reset(&mut self) {
        self.forget_contact();
        self.clear_tare();
        self.number = 0;
    }

    /// Forgets the present contact; bias and noise stay. What touches on begins anew, and may now be tared.
    pub fn forget_contact(&mut self) {
        self.detector.forget_contact();
        self.estimator = Estimator::new(&self.robot, &self.parameters, self.seed);
        self.shown.take();
        self.estimate.status = ContactStatus::NoContact;
        self.estimate.modes.clear();
    }
}

fn check_paths(robot: &Robot) -> Result<(), ParameterError> {
    match robot
        .links
        .iter()
        .find(|link| link.path.len() > MOST_JOINTS)
    {
        None => Ok(()),
        Some(link) => Err(ParameterError::TooManyJoints {
            link: link.name.clone(),
            most: MOST_JOINTS,
            found: link.path.len(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use palpate_model::{LoadOptions, iiwa14};
    use palpate_sim::{Scenario, simulate};
    use pulp::Arch;

    use super::*;
    use crate::{Intake, MotionModel};

    /// The instructions that every processor has, and those of the one at hand.
    #[test]
    fn vector_instructions_change_no_bit() {
        let robot = iiwa14(&LoadOptions::default()).unwrap();
        let scenario = Scenario {
            duration_secs: 0.4,
            noise_fraction: 0.1,
            ..Scenario::new("lbr_link_5")
        };
        let samples = simulate(&robot, &scenario).unwrap().samples;
        let told = |motion_model, processor| {
            let mut parameters = Parameters {
                method: Method::Paper,
                particles: 2100,
                ..Parameters::default()
            };
            parameters.paper.motion_model = motion_model;
            parameters.paper.rate_hz = 100.0;
            let mut filter = Filter::new(&robot, &parameters, 1).unwrap();
            match &mut filter.estimator {
                Estimator::Paper(paper) => paper.run_on(processor),
                Estimator::Palpate { .. } => unreachable!(),
            }
            filter.modes.run_on(processor);
            let mut intake = Intake::new(robot.dof());
            for sample in &samples {
                filter.update(intake.admit(sample).unwrap());
            }
            format!("{:?}\n{:?}", filter.estimate(), filter.particles())
        };
        for model in [
            MotionModel::Curvature,
            MotionModel::Link,
            MotionModel::World,
        ] {
            let plain = told(model, Arch::Scalar);
            assert!(plain.contains("Mode {") && plain.contains("Particle {"));
            assert!(told(model, Arch::new()) == plain, "{model:?}");
        }
    }
}
