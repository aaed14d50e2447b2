//! Options that tell the robot, and how it is loaded.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use palpate_filter::RobotSettings;
use palpate_model::{LoadOptions, LoadReport, Robot};

use crate::Usage;

#[derive(Args)]
pub struct RobotArgs {
    /// The robot's URDF, xacro already run [default: replay takes `robot.description_file` of its --config, simulate the
    /// iiwa 14 that ships]
    #[arg(long, value_name = "FILE")]
    pub urdf: Option<PathBuf>,
    /// A folder in which `package://NAME/…` of the URDF is looked for, beside AMENT_PREFIX_PATH; may be given often
    /// [default: none]
    #[arg(long = "package-dir", value_name = "DIR")]
    pub package_dirs: Vec<PathBuf>,
}

impl RobotArgs {
    /// The URDF that is named here, else in the settings.
    pub fn urdf(&self, settings: &RobotSettings) -> Result<PathBuf> {
        let named = (!settings.description_file.is_empty())
            .then(|| PathBuf::from(&settings.description_file));
        self.urdf.clone().or(named).ok_or_else(|| {
            let missing = "--urdf FILE is missing, and no --config names robot.description_file";
            Usage(missing.to_owned()).into()
        })
    }

    /// Loads the robot that is named here, else in the settings.
    pub fn load(
        &self,
        settings: &RobotSettings,
        options: &LoadOptions,
    ) -> Result<(Robot, LoadReport)> {
        let urdf = self.urdf(settings)?;
        let mut package_dirs = self.package_dirs.clone();
        package_dirs.extend(settings.package_folders());
        let ament = std::env::var_os("AMENT_PREFIX_PATH").unwrap_or_default();
        let ament: Vec<_> = std::env::split_paths(&ament).collect();
        let (robot, report) = Robot::from_urdf_file(&urdf, &package_dirs, &ament, options)
            .with_context(|| format!("robot {}", urdf.display()))?;
        tracing::info!(
            "robot {}: {} movable joints, {} links, {} triangles",
            robot.name,
            robot.dof(),
            robot.links.len(),
            report
                .links
                .iter()
                .map(|link| link.triangles)
                .sum::<usize>()
        );
        Ok((robot, report))
    }
}
