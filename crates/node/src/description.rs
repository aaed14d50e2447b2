//! The robot's description: from a parameter, a file or a topic.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use futures::{FutureExt, StreamExt};
use palpate_filter::Settings;
use palpate_model::{IIWA14_MESHES, MeshFiles, MeshSource, ModelError, Robot};
use palpate_node::Throttle;
use r2r::QosProfile;
use r2r::std_msgs::msg::String as Text;

use crate::stopped;

/// The robot of the parameter `robot_description`, else of `robot.description_file`; none where neither is given.
pub fn from_settings(settings: &Settings) -> anyhow::Result<Option<Robot>> {
    let file = &settings.robot.description_file;
    if !settings.robot_description.is_empty() {
        let robot = load(&settings.robot_description, Path::new(""), settings);
        return robot.map(Some).context("parameter robot_description");
    }
    if file.is_empty() {
        return Ok(None);
    }
    let path = std::path::absolute(file).context("parameter robot.description_file")?;
    let read = std::fs::read_to_string(&path).map_err(anyhow::Error::from);
    let folder = path.parent().unwrap_or(Path::new(""));
    let robot = read.and_then(|urdf| load(&urdf, folder, settings));
    robot
        .map(Some)
        .with_context(|| format!("parameter robot.description_file: {}", path.display()))
}

/// Waits for the topic `robot_description`. A description that is wrong is logged, and the next one waited for. None
/// when asked to stop.
pub fn from_topic(
    node: &mut r2r::Node,
    settings: &Settings,
    stop: &AtomicBool,
) -> anyhow::Result<Option<Robot>> {
    let latched = QosProfile::default().transient_local().keep_last(1);
    let mut descriptions = node.subscribe::<Text>("robot_description", latched)?;
    let mut waiting = Throttle::new(Duration::from_secs(10));
    while !stopped(stop) {
        node.spin_once(Duration::from_millis(50));
        while let Some(Some(description)) = descriptions.next().now_or_never() {
            match load(&description.data, Path::new(""), settings) {
                Ok(robot) => return Ok(Some(robot)),
                Err(error) => tracing::error!("topic robot_description: {error:#}"),
            }
        }
        if waiting.pass(Instant::now()).is_some() {
            tracing::warn!(
                "waiting for the topic robot_description, as neither of the parameters robot_description and \
                 robot.description_file is given"
            );
        }
    }
    Ok(None)
}

fn load(urdf: &str, folder: &Path, settings: &Settings) -> anyhow::Result<Robot> {
    let prefixes = std::env::var_os("AMENT_PREFIX_PATH").unwrap_or_default();
    let prefixes: Vec<PathBuf> = std::env::split_paths(&prefixes).collect();
    let meshes = Meshes(MeshFiles::new(
        folder.to_owned(),
        settings.robot.package_folders(),
        prefixes,
    ));
    let (robot, report) = Robot::from_urdf(urdf, &meshes, &settings.robot.load_options())?;
    for link in &report.links {
        for warning in &link.warnings {
            tracing::warn!("link {}: {warning}", link.name);
        }
    }
    let triangles: usize = report.links.iter().map(|link| link.triangles).sum();
    tracing::info!(
        "robot {}: {} joints, {} links, {triangles} triangles, results in {}",
        robot.name,
        robot.dof(),
        robot.links.len(),
        robot.root()
    );
    Ok(robot)
}

/// Files first; the meshes of the arm that ships with the project need none.
struct Meshes(MeshFiles);

impl MeshSource for Meshes {
    fn read(&self, uri: &str) -> Result<Vec<u8>, ModelError> {
        self.0
            .read(uri)
            .or_else(|error| IIWA14_MESHES.read(uri).map_err(|_| error))
    }
}
