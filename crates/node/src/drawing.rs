//! The thread that draws: estimation hands it the latest state when asked, and never waits for it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use palpate_filter::{ContactEstimate, Particle, Scene};
use palpate_model::{Kinematics, Robot};
use palpate_node::Newest;
use r2r::Publisher;
use r2r::sensor_msgs::msg::PointCloud2;
use r2r::visualization_msgs::msg::MarkerArray;

use palpate_node::messages;

/// Everything that a picture needs.
pub struct Drawing {
    pub estimate: ContactEstimate,
    pub particles: Vec<Particle>,
    pub kinematics: Kinematics,
}

/// Where estimation puts a drawing when one is waited for.
pub struct Easel {
    waiting: AtomicBool,
    period_ns: AtomicU64,
    drawings: Newest<Drawing>,
}

impl Easel {
    /// For `rate` drawings a second at most.
    pub fn new(rate: f64) -> Self {
        let easel = Self {
            waiting: AtomicBool::new(false),
            period_ns: AtomicU64::new(0),
            drawings: Newest::new(1),
        };
        easel.set_rate(rate);
        easel
    }

    /// From the next drawing on, `rate` a second at most.
    pub fn set_rate(&self, rate: f64) {
        self.period_ns.store((1e9 / rate) as u64, Ordering::Relaxed);
    }

    /// Whether a drawing is waited for.
    pub fn is_waiting(&self) -> bool {
        self.waiting.load(Ordering::Acquire)
    }

    /// Hands a drawing over.
    pub fn put(&self, drawing: Drawing) {
        self.waiting.store(false, Ordering::Release);
        self.drawings.push(drawing);
    }

    /// Ends all waiting.
    pub fn close(&self) {
        self.drawings.close();
    }

    fn period(&self) -> Duration {
        Duration::from_nanos(self.period_ns.load(Ordering::Relaxed))
    }

    fn ask(&self) -> Option<Drawing> {
        self.waiting.store(true, Ordering::Release);
        self.drawings.pop()
    }
}

/// Where drawings go.
#[derive(Clone)]
pub struct Pictures {
    pub cloud: Publisher<PointCloud2>,
    pub markers: Publisher<MarkerArray>,
}

impl Pictures {
    /// Draws as often as `easel` says, for as long as it is open and whenever somebody looks.
    ///
    /// # Errors
    /// If ROS 2 refuses to publish.
    pub fn run(&self, robot: &Robot, easel: &Easel) -> r2r::Result<()> {
        while easel.drawings.wait_open(easel.period()) {
            let cloud_wanted = self.cloud.get_inter_process_subscription_count()? > 0;
            let markers_wanted = self.markers.get_inter_process_subscription_count()? > 0;
            if !(cloud_wanted || markers_wanted) {
                continue;
            }
            let Some(drawing) = easel.ask() else {
                break;
            };
            let Drawing {
                estimate,
                particles,
                kinematics,
            } = &drawing;
            let scene = Scene::new(robot, kinematics, estimate, particles);
            let header = messages::header(scene.stamp_ns, robot.root());
            if cloud_wanted {
                self.cloud
                    .publish(&messages::cloud(&scene, header.clone()))?;
            }
            if markers_wanted {
                self.markers.publish(&messages::markers(&scene, &header))?;
            }
        }
        Ok(())
    }
}
