//! Everything that a parameter file can say, in the shape that ROS 2 gives such files.

use std::path::{Path, PathBuf};

use palpate_model::{Geometry, LoadOptions, Source};
use serde::{Deserialize, Serialize};
use serde_yaml_ng::{Mapping, Value};

use crate::tare::TARE_SECS;
use crate::{PARAMETER_TABLE, ParameterError, Parameters, TorqueSettings};

/// All parameters of the node and of `palpate replay`; the one place of their defaults, with [`Parameters`]. Unknown
/// keys are refused.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// The robot's URDF as text, as launch files hand it over. Empty: see [`RobotSettings::description_file`].
    pub robot_description: String,
    /// Whether the node takes time from `/clock`. The estimate does not depend on it: samples carry their stamps.
    pub use_sim_time: bool,
    /// Seed of the random streams: the same seed, samples and parameters give the same estimate. Default 1.
    pub seed: u64,
    /// The robot and its geometry.
    pub robot: RobotSettings,
    /// How samples come in.
    pub input: InputSettings,
    /// Where the external torque comes from.
    pub torque: TorqueSettings,
    /// The filter.
    pub filter: Parameters,
    /// What is drawn, and how often.
    pub viz: VizSettings,
    /// What the node asks of the system's scheduler.
    pub realtime: RealtimeSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            robot_description: String::new(),
            use_sim_time: false,
            seed: 1,
            robot: RobotSettings::default(),
            input: InputSettings::default(),
            torque: TorqueSettings::default(),
            filter: Parameters::default(),
            viz: VizSettings::default(),
            realtime: RealtimeSettings::default(),
        }
    }
}

/// The robot and its geometry.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct RobotSettings {
    /// URDF file. Empty (the default): the node waits for the topic `robot_description`.
    pub description_file: String,
    /// Folders in which `package://NAME/…` is looked for, before those of the ament prefix path. Empty names are
    /// skipped. Default none.
    pub package_dirs: Vec<String>,
    /// Which geometry can be touched. Default `collision`.
    pub geometry: Geometry,
    /// Coarse triangles are split until no edge is longer, m. Default 0.02.
    pub max_edge: f64,
    /// Joints that are held at zero because no message tells of them, as a gripper's fingers. Empty names are skipped,
    /// and so are those that the robot has not. Default none.
    pub fixed_joints: Vec<String>,
}

impl Default for RobotSettings {
    fn default() -> Self {
        let LoadOptions {
            geometry,
            max_edge,
            fixed_joints,
        } = LoadOptions::default();
        Self {
            description_file: String::new(),
            package_dirs: Vec::new(),
            geometry,
            max_edge,
            fixed_joints,
        }
    }
}

impl RobotSettings {
    /// How the robot is to be loaded.
    pub fn load_options(&self) -> LoadOptions {
        LoadOptions {
            geometry: self.geometry,
            max_edge: self.max_edge,
            fixed_joints: self.fixed_joints.clone(),
        }
    }

    /// The folders in which `package://NAME/…` is looked for.
    pub fn package_folders(&self) -> Vec<PathBuf> {
        let named = self.package_dirs.iter().filter(|dir| !dir.is_empty());
        named.map(PathBuf::from).collect()
    }
}

/// How samples come in.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct InputSettings {
    /// Type of the messages that external torques come in, and positions too where it holds both. Default
    /// `joint_state`.
    pub source: Source,
    /// Joints of messages that do not name them, in the order of the values. Empty names are skipped. Default none: all
    /// of the robot's joints, in its order.
    pub joint_names: Vec<String>,
    /// Stamps of a position and a torque that belong together differ by at most this, s. Default 0.02.
    pub pairing_tolerance_secs: f64,
    /// Where a step is so late that a sample has waited for more than this, s, by the samples' stamps, the newest is used;
    /// those before are lost, and counted. So no estimate tells of what is older. Default 0.1.
    pub max_wait_secs: f64,
    /// A stamp that lies further back than this, s, means that time has started anew, as when a bag is played again:
    /// everything learned is forgotten. Smaller steps back are refused. Default 1.
    pub time_jump_secs: f64,
    /// Whether time that starts anew is followed. If not, stamps that lie back are refused however far. Default true.
    pub reset_on_time_jump: bool,
    /// A tare averages the torques over this, s. Default 2.
    pub tare_secs: f64,
}

impl Default for InputSettings {
    fn default() -> Self {
        Self {
            source: Source::default(),
            joint_names: Vec::new(),
            pairing_tolerance_secs: 0.02,
            max_wait_secs: 0.1,
            time_jump_secs: 1.0,
            reset_on_time_jump: true,
            tare_secs: 2.0,
        }
    }
}

impl InputSettings {
    /// The names that are given for messages without; none: the robot's.
    pub fn unnamed_joints(&self) -> Vec<String> {
        let given = self.joint_names.iter().filter(|name| !name.is_empty());
        given.cloned().collect()
    }
}

/// What is drawn, and how often.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct VizSettings {
    /// Clouds and markers a second, at most, Hz. Default 10.
    pub rate: f64,
}

impl Default for VizSettings {
    fn default() -> Self {
        Self { rate: 10.0 }
    }
}

/// What the node asks of the system's scheduler, for the threads that take messages and estimate. Where the system
/// refuses, the node warns and goes on. The estimate does not depend on it.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct RealtimeSettings {
    /// Priority of the policy SCHED_FIFO, 1 to 99; 0, the default, leaves the usual policy.
    pub priority: u8,
    /// Cores to run on, counted from 0; negative ones are skipped. None, as by default: any.
    pub cores: Vec<i64>,
}

impl Default for RealtimeSettings {
    fn default() -> Self {
        Self {
            priority: 0,
            // ROS 2 has no empty list without a type.
            cores: vec![-1],
        }
    }
}

impl RealtimeSettings {
    /// Most that a core may be numbered.
    const MOST_CORE: i64 = 1023;

    /// The cores to run on; none: any.
    pub fn chosen_cores(&self) -> Vec<usize> {
        let chosen = self.cores.iter();
        chosen.filter_map(|&core| core.try_into().ok()).collect()
    }

    fn check(&self) -> Result<(), ParameterError> {
        let fits = self.priority <= 99;
        in_range("realtime.priority", "0 to 99", self.priority, fits)?;
        for &core in &self.cores {
            let fits = (-1..=Self::MOST_CORE).contains(&core);
            in_range("realtime.cores", "-1 to 1023", core, fits)?;
        }
        Ok(())
    }
}

/// Why settings were refused.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The file could not be read.
    #[error("cannot read the parameter file {path}: {source}")]
    Read {
        /// The file.
        path: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The text is not YAML.
    #[error("the parameter file is not YAML: {0}")]
    Syntax(#[from] serde_yaml_ng::Error),
    /// The text is YAML of another shape.
    #[error("the parameter file has {found}, expected {expected}")]
    Shape {
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// A key is unknown, or its value of the wrong type.
    #[error("parameter {name}: {reason}")]
    Value {
        /// Full name of the parameter.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A value lies outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

impl Settings {
    /// Reads a parameter file, for a node named `palpate`.
    ///
    /// # Errors
    /// As [`Settings::from_ros_yaml`], and if the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, SettingsError> {
        let text = std::fs::read_to_string(path).map_err(|source| SettingsError::Read {
            path: path.display().to_string(),
            source,
        })?;
        Self::from_ros_yaml(&text)
    }

    /// Settings from the text of a ROS 2 parameter file: the sections `/**` and those of a node named `palpate`, in
    /// whatever namespace. Keys may be nested or dotted.
    ///
    /// # Errors
    /// If the text is not such a file, has no such section, or a key is unknown or has a wrong or forbidden value; the
    /// key is named.
    pub fn from_ros_yaml(text: &str) -> Result<Self, SettingsError> {
        let sections = match serde_yaml_ng::from_str(text)? {
            Value::Mapping(sections) => sections,
            Value::Null => Mapping::new(),
            other => return Err(shape("node names at the top", &other)),
        };
        let mut flat = Vec::new();
        let mut names = Vec::new();
        for (name, section) in &sections {
            let name = name.as_str().unwrap_or("a key that is not text");
            names.push(name);
            if !(name == "/**" || name == "**" || name.rsplit('/').next() == Some("palpate")) {
                continue;
            }
            match section.get("ros__parameters") {
                Some(Value::Mapping(parameters)) => flatten("", parameters, &mut flat)?,
                Some(Value::Null) => {}
                Some(other) => return Err(shape("keys below ros__parameters", other)),
                None => return Err(shape("ros__parameters below the node's name", section)),
            }
        }
        if !names.is_empty()
            && !names
                .iter()
                .any(|name| name.ends_with("**") || name.ends_with("palpate"))
        {
            return Err(SettingsError::Shape {
                expected: "a section /** or palpate",
                found: format!("sections {}", names.join(", ")),
            });
        }
        Self::from_flat(flat)
    }

    /// Settings from dotted names and their values, as ROS 2 hands them to a node; a later one wins. What every ROS 2
    /// node is given besides (`qos_overrides`, `start_type_description_service`) is skipped.
    ///
    /// # Errors
    /// If a key is unknown, or has a wrong or forbidden value; the key is named.
    pub fn from_flat(
        values: impl IntoIterator<Item = (String, Value)>,
    ) -> Result<Self, SettingsError> {
        let mut nested = Mapping::new();
        for (name, value) in values {
            if !(name.starts_with("qos_overrides.") || name == "start_type_description_service") {
                insert(&mut nested, &name, &name, value)?;
            }
        }
        let settings: Self =
            serde_path_to_error::deserialize(Value::Mapping(nested)).map_err(|error| {
                SettingsError::Value {
                    name: error.path().to_string(),
                    reason: error.inner().to_string(),
                }
            })?;
        settings.check()?;
        Ok(settings)
    }

    /// These settings with some parameters changed, as a running node is asked for.
    ///
    /// # Errors
    /// If a name is unknown or its parameter read at start only, or a value is wrong or forbidden; it is named.
    pub fn changed(
        &self,
        changes: impl IntoIterator<Item = (String, Value)>,
    ) -> Result<Self, SettingsError> {
        let mut flat = self.to_flat();
        for (name, value) in changes {
            let Some(entry) = flat.iter_mut().find(|entry| entry.0 == name) else {
                let reason = "unknown".to_owned();
                return Err(SettingsError::Value { name, reason });
            };
            entry.1 = value;
        }
        let changed = Self::from_flat(flat)?;
        let before_and_after = self.to_flat().into_iter().zip(changed.to_flat());
        for ((name, before), (_, after)) in before_and_after {
            let live = PARAMETER_TABLE
                .iter()
                .any(|row| row.name == name && row.live);
            if before != after && !live {
                let reason = "read at start only: restart the node to change it".to_owned();
                return Err(SettingsError::Value { name, reason });
            }
        }
        Ok(changed)
    }

    /// Every parameter that a file can set, by its dotted name, with its value.
    pub fn to_flat(&self) -> Vec<(String, Value)> {
        let mut flat = Vec::new();
        if let Ok(Value::Mapping(nested)) = serde_yaml_ng::to_value(self) {
            // Names come from fields, so they are text.
            let _ = flatten("", &nested, &mut flat);
        }
        flat
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.filter.check()?;
        self.torque.check()?;
        self.realtime.check()?;
        let tolerance = self.input.pairing_tolerance_secs;
        in_range(
            "input.pairing_tolerance_secs",
            "0 to 10",
            tolerance,
            (0.0..=10.0).contains(&tolerance),
        )?;
        let wait = self.input.max_wait_secs;
        in_range(
            "input.max_wait_secs",
            "0 to 3600",
            wait,
            (0.0..=3600.0).contains(&wait),
        )?;
        let jump = self.input.time_jump_secs;
        in_range("input.time_jump_secs", "0 or more", jump, jump >= 0.0)?;
        let tare = self.input.tare_secs;
        let fits = TARE_SECS.contains(&tare);
        in_range("input.tare_secs", "0.1 to 60", tare, fits)?;
        let max_edge = self.robot.max_edge;
        in_range(
            "robot.max_edge",
            "0.001 or more",
            max_edge,
            max_edge >= 0.001,
        )?;
        let rate = self.viz.rate;
        in_range(
            "viz.rate",
            "0.1 to 1000",
            rate,
            (0.1..=1000.0).contains(&rate),
        )
    }
}

fn in_range<T: ToString>(
    name: &'static str,
    expected: &'static str,
    found: T,
    fits: bool,
) -> Result<(), ParameterError> {
    if fits {
        return Ok(());
    }
    Err(ParameterError::Range {
        name,
        expected,
        found: found.to_string(),
    })
}

fn shape(expected: &'static str, found: &Value) -> SettingsError {
    let found = match found {
        Value::Mapping(keys) => keys
            .keys()
            .filter_map(Value::as_str)
            .collect::<Vec<_>>()
            .join(", "),
        Value::Sequence(_) => "a list".to_owned(),
        Value::Null => "nothing".to_owned(),
        other => serde_yaml_ng::to_string(other)
            .unwrap_or_default()
            .trim()
            .to_owned(),
    };
    SettingsError::Shape { expected, found }
}

/// Appends the leaves of `nested` under dotted names.
fn flatten(
    prefix: &str,
    nested: &Mapping,
    flat: &mut Vec<(String, Value)>,
) -> Result<(), SettingsError> {
    for (key, value) in nested {
        let Some(key) = key.as_str() else {
            return Err(shape("keys that are text", key));
        };
        let name = if prefix.is_empty() {
            key.to_owned()
        } else {
            format!("{prefix}.{key}")
        };
        match value {
            Value::Mapping(below) => flatten(&name, below, flat)?,
            leaf => flat.push((name, leaf.clone())),
        }
    }
    Ok(())
}

/// Puts `value` where the dotted `rest` of its `name` says.
fn insert(nested: &mut Mapping, name: &str, rest: &str, value: Value) -> Result<(), SettingsError> {
    let Some((section, rest)) = rest.split_once('.') else {
        nested.insert(rest.into(), value);
        return Ok(());
    };
    let below = nested
        .entry(section.into())
        .or_insert_with(|| Mapping::new().into());
    match below {
        Value::Mapping(below) => insert(below, name, rest, value),
        _ => Err(SettingsError::Value {
            name: name.to_owned(),
            reason: format!("{section} already has a value"),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        Settings::from_ros_yaml(text).unwrap_err().to_string()
    }

    #[test]
    fn defaults_survive_the_way_through_flat_names() {
        let settings = Settings::default();
        assert_eq!(Settings::from_flat(settings.to_flat()).unwrap(), settings);
        assert_eq!(Settings::from_ros_yaml("").unwrap(), settings);
    }

    #[test]
    fn nested_and_dotted_keys_of_the_right_sections_count() {
        let text = "
/**:
  ros__parameters:
    seed: 7
    filter: {particles: 123}
    viz.rate: 5
/arm/palpate:
  ros__parameters: {seed: 8}
/other:
  ros__parameters: {whatever: 1}
";
        let settings = Settings::from_ros_yaml(text).unwrap();
        assert_eq!(settings.seed, 8);
        assert_eq!(settings.filter.particles, 123);
        assert_eq!(settings.viz.rate, 5.0);
    }

    #[test]
    fn an_unknown_key_is_named_with_its_section() {
        let said = refusal("/**: {ros__parameters: {input: {max_wait: 3}}}");
        assert!(said.contains("input.max_wait:"), "{said}");
        assert!(said.contains("max_wait_secs"), "{said}");
        let said = refusal("/**: {ros__parameters: {bogus: 3}}");
        assert!(said.contains("bogus"), "{said}");
    }

    #[test]
    fn a_wrong_type_and_a_wrong_range_are_named_with_what_was_found() {
        let said = refusal("/**: {ros__parameters: {seed: many}}");
        assert!(said.contains("seed") && said.contains("many"), "{said}");
        let said = refusal("/**: {ros__parameters: {viz.rate: -1.0}}");
        assert!(said.contains("viz.rate is -1, expected 0.1"), "{said}");
        let said = refusal("/**: {ros__parameters: {viz.rate: .nan}}");
        assert!(said.contains("viz.rate is NaN"), "{said}");
    }

    #[test]
    fn a_file_of_another_shape_is_refused() {
        assert!(refusal("- 1").contains("a list"));
        assert!(refusal("other: {ros__parameters: {}}").contains("sections other"));
        assert!(refusal("/**: {seed: 3}").contains("seed"));
        assert!(refusal("/**: [").contains("not YAML"));
        assert!(refusal("/**: {ros__parameters: {viz: 1, viz.rate: 2}}").contains("viz.rate"));
    }

    #[test]
    fn a_running_node_takes_live_changes_only() {
        let settings = Settings::default();
        let change = |name: &str, value: Value| settings.changed([(name.to_owned(), value)]);
        assert_eq!(change("viz.rate", 5.into()).unwrap().viz.rate, 5.0);
        assert_eq!(change("seed", 1.into()).unwrap(), settings);
        for (name, value, said) in [
            ("seed", 2.into(), "seed: read at start only"),
            ("viz.rat", 5.into(), "viz.rat: unknown"),
            ("qos_overrides.x", 5.into(), "qos_overrides.x: unknown"),
            ("viz.rate", 0.into(), "viz.rate is 0, expected 0.1"),
            ("viz.rate", "fast".into(), "viz.rate: invalid type"),
            ("viz.rate", Value::Null, "viz.rate: invalid type"),
            (
                "filter.detector.release_share",
                2.into(),
                "release_share is 2",
            ),
        ] {
            let refusal = change(name, value).unwrap_err().to_string();
            assert!(refusal.contains(said), "{refusal}");
        }
        let both = [("paper.force_max", 5.0), ("paper.rate_hz", 7.0)]
            .map(|(which, value)| (format!("filter.{which}"), value.into()));
        let paper = settings.changed(both).unwrap().filter.paper;
        assert_eq!((paper.force_max, paper.rate_hz), (5.0, 7.0));
    }

    #[test]
    fn the_shipped_file_says_the_defaults() {
        let mut shipped =
            Settings::from_ros_yaml(include_str!("../../../config/palpate.yaml")).unwrap();
        // ROS 2 has no empty list without a type.
        assert_eq!(shipped.robot.package_folders(), [] as [PathBuf; 0]);
        shipped.robot.package_dirs.clear();
        assert_eq!(shipped.input.unnamed_joints(), [] as [String; 0]);
        assert_eq!(shipped.robot.fixed_joints, [""]);
        shipped.robot.fixed_joints.clear();
        shipped.input.joint_names.clear();
        assert_eq!(shipped, Settings::default());
    }

    #[test]
    fn a_drivers_file_differs_in_what_its_messages_tell() {
        let config = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../config"));
        let mut drivers = 0;
        for entry in std::fs::read_dir(config).unwrap() {
            let path = entry.unwrap().path();
            // What is simulated is no parameter of the node.
            let is_scenario = path.ends_with("demo.yaml");
            if is_scenario || path.extension().is_none_or(|extension| extension != "yaml") {
                continue;
            }
            let mut settings = Settings::read(&path).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            if path.ends_with("palpate.yaml") {
                continue;
            }
            drivers += 1;
            assert!(
                text.contains("config/palpate.yaml has every parameter"),
                "{path:?}"
            );
            assert!(text.contains("# Topics: external_torque:=/"), "{path:?}");
            assert!(text.contains("      source: "), "{path:?}");
            // What differs from the defaults is what messages tell, and how.
            settings.robot.fixed_joints.clear();
            settings.input.source = Source::default();
            settings.input.joint_names.clear();
            assert_eq!(settings, Settings::default(), "{path:?}");
        }
        assert_eq!(drivers, 4);
    }

    #[test]
    fn the_shipped_file_has_every_parameter() {
        let file: Value =
            serde_yaml_ng::from_str(include_str!("../../../config/palpate.yaml")).unwrap();
        for (name, _) in Settings::default().to_flat() {
            let parameters = &file["/**"]["ros__parameters"];
            let found = name
                .split('.')
                .try_fold(parameters, |section, key| section.get(key));
            assert!(
                found.is_some() || name == "robot_description",
                "{name} is missing"
            );
        }
    }

    #[test]
    fn what_every_ros_node_is_given_is_skipped() {
        let given = [("qos_overrides./clock.depth".to_owned(), Value::from(1))];
        assert_eq!(Settings::from_flat(given).unwrap(), Settings::default());
    }
}
