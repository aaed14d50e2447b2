//! One simulated trial: scenario, samples, filter, score.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::Result;
use palpate_filter::Filter;
use palpate_model::{JointSample, Robot};
use palpate_sim::{SimError, Trial, Truth, simulate};

use super::condition::{self, Condition};
use super::estimator::Estimator;
use super::score::{Known, Score, score};
use super::seed::mixed;

/// What is common to the trials of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cell {
    /// Name of the condition.
    pub condition: &'static str,
    /// What estimates.
    pub estimator: Estimator,
    /// Number of the touched link: how many joints move it.
    pub link: usize,
}

/// How all trials are made.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The robot; but see [`Condition::true_robot`] and [`Condition::known_robot`].
    pub robot: Robot,
    /// Seed of everything.
    pub seed: u64,
    /// Trials a cell.
    pub trials: usize,
    /// Length of a trial, s.
    pub secs: f64,
    /// Number of particles; none for each estimator's own.
    pub particles: Option<usize>,
    /// The robots as they are, by condition and number of the touched link, as far as they were needed.
    pub true_robots: TrueRobots,
}

/// Robots shared by all trials.
pub type TrueRobots = Arc<Mutex<BTreeMap<(&'static str, usize), Arc<Robot>>>>;

/// A trial's score, or why there is none.
pub type Outcome = Result<Score, String>;

impl Setup {
    /// Name of the link of this number: the first one that so many joints move and that can be touched.
    pub fn link_name(&self, number: usize) -> Option<&str> {
        self.link(number)
            .map(|index| self.robot.links[index].name.as_str())
    }

    fn link(&self, number: usize) -> Option<usize> {
        let is_it = |link: &palpate_model::Link| link.path.len() == number && link.mesh.is_some();
        self.robot.links.iter().position(is_it)
    }

    /// Plays a trial and scores it. Its scene and motion follow from seed, link and number alone, so that every condition
    /// and estimator is tried on the same ones (as far as the obstacle allows).
    ///
    /// # Errors
    /// If the simulator or the filter cannot be used so at all; that a contact is not found is an outcome.
    pub fn run(&self, cell: &Cell, number: usize) -> Result<Outcome> {
        let Some(condition) = condition::named(cell.condition) else {
            anyhow::bail!("there is no condition {}", cell.condition);
        };
        match self.play(condition, cell.link, number)? {
            Err(reason) => Ok(Err(reason)),
            Ok(trial) => Ok(self
                .estimate(condition, cell, number, &trial, |_, _| {})?
                .ok_or_else(|| "no contact".to_owned())),
        }
    }

    /// Simulates a trial; or says why the simulator found none.
    pub fn play(
        &self,
        condition: &Condition,
        link: usize,
        number: usize,
    ) -> Result<Result<Trial, String>> {
        let Some(name) = self.link_name(link) else {
            anyhow::bail!("the robot has no link with a mesh behind just {link} movable joints");
        };
        let scenario = condition.scenario(name, self.scene_seed(link, number), self.secs);
        let true_robot = self.true_robot(condition, link)?;
        match simulate(&true_robot, &scenario) {
            Ok(trial) => Ok(Ok(trial)),
            Err(error @ SimError::NoContact { .. }) => Ok(Err(error.to_string())),
            Err(error) => Err(error.into()),
        }
    }

    /// The robot as it is in a condition, for contacts on the link of this number; made once.
    fn true_robot(&self, condition: &Condition, link: usize) -> Result<Arc<Robot>> {
        let mut made = self
            .true_robots
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(robot) = made.get(&(condition.name, link)) {
            return Ok(Arc::clone(robot));
        }
        let index = self.link(link).unwrap_or_default();
        let robot = Arc::new(condition.true_robot(&self.robot, index)?);
        made.insert((condition.name, link), Arc::clone(&robot));
        Ok(robot)
    }

    /// Runs the filter over a trial and scores it; shows it to `see` after each sample.
    pub fn estimate(
        &self,
        condition: &Condition,
        cell: &Cell,
        number: usize,
        trial: &Trial,
        see: impl FnMut(&JointSample, &Filter),
    ) -> Result<Option<Score>> {
        let known_robot = condition.known_robot(&self.robot);
        let parameters = cell.estimator.parameters(self.particles);
        let seed = mixed(&[self.scene_seed(cell.link, number), 1]);
        let mut filter = Filter::new(&known_robot, &parameters, seed)?;
        let truth: Vec<_> = trial.truth.iter().filter_map(known).collect();
        let dof = self.robot.dof();
        Ok(score(&mut filter, dof, &trial.samples, &truth, see))
    }

    fn scene_seed(&self, link: usize, number: usize) -> u64 {
        mixed(&[self.seed, link as u64, number as u64])
    }
}

fn known(truth: &Truth) -> Option<Known> {
    let contact = truth.contact.as_ref()?;
    Some(Known {
        stamp_ns: truth.stamp_ns,
        link: truth.link,
        point_in_root: contact.point_in_root,
        force: contact.force_in_root.norm(),
    })
}
