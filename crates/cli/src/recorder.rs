//! Everything of a run into one bag that viewers open.

use std::path::Path;

use palpate_bag::{BagError, BagWriter};
use palpate_filter::{Filter, Scene};
use palpate_model::{JointSample, Kinematics, Robot};
use palpate_sim::Truth;

/// Writes samples with their transforms, estimates, and clouds and markers at a rate that viewers can take.
pub struct Recorder {
    bag: BagWriter,
    scene_period_ns: i64,
    next_scene_ns: Option<i64>,
}

impl Recorder {
    /// Starts a bag with the robot's URDF at `start_ns`; clouds and markers come at most `scene_rate` (Hz) times a
    /// second.
    pub fn create(
        path: &Path,
        urdf: &str,
        start_ns: i64,
        scene_rate: f64,
    ) -> Result<Self, BagError> {
        let mut bag = BagWriter::create(path)?;
        bag.robot_description(start_ns, urdf)?;
        Ok(Self {
            bag,
            scene_period_ns: (1e9 / scene_rate).round() as i64,
            next_scene_ns: None,
        })
    }

    /// Writes a sample, and where the links are.
    pub fn sample(
        &mut self,
        robot: &Robot,
        kinematics: &Kinematics,
        sample: &JointSample,
    ) -> Result<(), BagError> {
        self.bag.sample(robot, sample)?;
        self.bag.transforms(sample.stamp_ns, robot, kinematics)
    }

    /// Writes the filter's estimate and, where it is time again, its particles and markers.
    pub fn estimate(&mut self, robot: &Robot, filter: &Filter) -> Result<(), BagError> {
        let estimate = filter.estimate();
        self.bag.estimate(robot, estimate)?;
        let stamp_ns = estimate.stamp_ns;
        // A stamp far before the next scene means that time has started anew.
        let due = self.next_scene_ns.is_none_or(|next_ns| {
            stamp_ns >= next_ns || stamp_ns < next_ns.saturating_sub(2 * self.scene_period_ns)
        });
        if due {
            self.next_scene_ns = Some(stamp_ns.saturating_add(self.scene_period_ns));
            let scene = Scene::new(robot, filter.kinematics(), estimate, filter.particles());
            self.bag.scene(robot, &scene)?;
        }
        Ok(())
    }

    /// Writes the truth that belongs to a sample's stamp; nothing without contact.
    pub fn truth(&mut self, robot: &Robot, stamp_ns: i64, truth: &Truth) -> Result<(), BagError> {
        match &truth.contact {
            Some(contact) => self.bag.truth(
                stamp_ns,
                robot,
                &truth.link_name,
                &contact.point_in_root,
                &contact.force_in_root,
            ),
            None => Ok(()),
        }
    }

    /// Completes the bag.
    pub fn finish(self) -> Result<(), BagError> {
        self.bag.finish()
    }
}
