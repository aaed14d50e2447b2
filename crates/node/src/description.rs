//! The robot's description: from a parameter, a file or a topic.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use futures::{FutureExt, Stream, StreamExt};
use palpate_filter::Settings;
use palpate_model::{IIWA14_MESHES, MeshFiles, MeshSource, ModelError, Robot};
use palpate_node::Throttle;
use r2r::QosProfile;
use r2r::std_msgs::msg::String as Text;

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

/// Descriptions that come on the topic `robot_description`, now and later.
pub struct Descriptions {
    messages: Box<dyn Stream<Item = Text> + Unpin>,
    /// The description that is in use.
    current: Option<String>,
    refusal: Option<String>,
    waiting: Throttle,
    refusals: Throttle,
}

impl Descriptions {
    pub fn new(node: &mut r2r::Node) -> r2r::Result<Self> {
        let latched = QosProfile::default().transient_local().keep_last(1);
        Ok(Self {
            messages: Box::new(node.subscribe("robot_description", latched)?),
            current: None,
            refusal: None,
            waiting: Throttle::new(Duration::from_secs(10)),
            refusals: Throttle::new(Duration::from_secs(10)),
        })
    }

    /// What `begin` makes of the robot that came, if one came that is another than before. One that is wrong is logged,
    /// and all stays as it was.
    pub fn next<T>(
        &mut self,
        settings: &Settings,
        mut begin: impl FnMut(Robot) -> anyhow::Result<T>,
    ) -> Option<T> {
        let mut begun = None;
        while let Some(Some(Text { data })) = self.messages.next().now_or_never() {
            if self.current.as_ref() == Some(&data) {
                continue;
            }
            match load(&data, Path::new(""), settings).and_then(&mut begin) {
                Ok(done) => {
                    begun = Some(done);
                    self.current = Some(data);
                    self.refusal = None;
                }
                Err(error) => self.refuse(&error),
            }
        }
        if self.current.is_none() && self.waiting.pass(Instant::now()).is_some() {
            tracing::warn!(
                "waiting for the topic robot_description, as neither of the parameters robot_description and \
                 robot.description_file is given"
            );
        }
        begun
    }

    fn refuse(&mut self, error: &anyhow::Error) {
        let kept = match self.current {
            Some(_) => "; the robot stays as it was",
            None => "",
        };
        if let Some(more) = self.refusals.pass(Instant::now()) {
            tracing::error!("topic robot_description (and {more} before): {error:#}{kept}");
        }
        self.refusal = Some(format!("{error:#}"));
    }

    /// Why the last description was refused, if it was.
    pub fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }
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
