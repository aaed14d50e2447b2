//! The robot from its URDF, by urdf-rs.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Unit, Vector3};

use crate::tree::Tree;
use crate::{Geometry, Inertial, Joint, JointKind, JointLimits, Link, LoadOptions, LoadReport};
use crate::{MeshFiles, MeshSource, ModelError, Robot, link_mesh};

/// Deepest nesting of elements in a URDF. The format itself needs five.
const MOST_NESTING: usize = 64;

impl Robot {
    /// Builds a robot from the text of a URDF and the meshes that it names.
    ///
    /// Revolute, continuous, prismatic and fixed joints are supported, and any that is held fixed. A joint that mimics
    /// another one is refused otherwise, as its torque is not its own.
    ///
    /// # Errors
    /// If the URDF is malformed, its links form no tree, a joint has another type, a number is not finite, or a mesh is
    /// absent, unreadable or empty.
    pub fn from_urdf(
        xml: &str,
        meshes: &dyn MeshSource,
        options: &LoadOptions,
    ) -> Result<(Self, LoadReport), ModelError> {
        options.check()?;
        check_xml(xml)?;
        let urdf = urdf_rs::read_from_string(xml).map_err(|error| ModelError::Urdf {
            reason: error.to_string(),
        })?;
        let tree = Tree::new(&urdf)?;
        let mut robot = Self {
            name: urdf.name.clone(),
            joints: Vec::new(),
            links: Vec::with_capacity(urdf.links.len()),
        };
        let mut report = LoadReport::default();
        for (link, joint_above) in tree.parents_first() {
            let elements = elements(link, options.geometry);
            let (mesh, link_report) = link_mesh::build(&link.name, &elements, meshes, options)?;
            report.links.push(link_report);
            robot.push_link(link, joint_above, options)?;
            if let Some(link) = robot.links.last_mut() {
                link.mesh = mesh;
            }
        }
        Ok((robot, report))
    }

    /// Builds a robot from a URDF file. Meshes are looked for as [`MeshFiles`] says.
    ///
    /// # Errors
    /// If the file cannot be read; and as [`Robot::from_urdf`].
    pub fn from_urdf_file(
        path: impl AsRef<Path>,
        package_dirs: &[PathBuf],
        ament_prefixes: &[PathBuf],
        options: &LoadOptions,
    ) -> Result<(Self, LoadReport), ModelError> {
        let read_error = |source| ModelError::Read {
            path: path.as_ref().display().to_string(),
            source,
        };
        let xml = std::fs::read_to_string(&path).map_err(read_error)?;
        // Absolute, so that the names of all folders above are known.
        let absolute = std::path::absolute(&path).map_err(read_error)?;
        let urdf_dir = absolute.parent().unwrap_or(Path::new("")).to_owned();
        let meshes = MeshFiles::new(urdf_dir, package_dirs.to_vec(), ament_prefixes.to_vec());
        Self::from_urdf(&xml, &meshes, options)
    }

    /// Adds a link without its mesh, and the joint above it if that moves. Its parent is in the robot already.
    fn push_link(
        &mut self,
        link: &urdf_rs::Link,
        joint_above: Option<&urdf_rs::Joint>,
        options: &LoadOptions,
    ) -> Result<(), ModelError> {
        let mut new = Link {
            name: link.name.clone(),
            parent: None,
            parent_from_rest: Isometry3::identity(),
            joint: None,
            path: Vec::new(),
            inertial: inertial(link)?,
            mesh: None,
        };
        if let Some(above) = joint_above {
            new.parent = self.link_index(&above.parent.link);
            new.parent_from_rest = link_mesh::pose(&joint_name(above, "origin"), &above.origin)?;
            if let Some(parent) = new.parent {
                new.path.clone_from(&self.links[parent].path);
            }
            let is_held = options.fixed_joints.contains(&above.name);
            let joint = match is_held {
                true => None,
                false => movable_joint(above)?,
            };
            if let Some(joint) = joint {
                new.joint = Some(self.joints.len());
                new.path.push(self.joints.len());
                self.joints.push(joint);
            }
        }
        self.links.push(new);
        Ok(())
    }
}

fn inertial(link: &urdf_rs::Link) -> Result<Option<Inertial>, ModelError> {
    let name = format!("link `{}` inertial origin", link.name);
    let link_from_inertial = link_mesh::pose(&name, &link.inertial.origin)?;
    Inertial::of_urdf(&link.name, &link.inertial, &link_from_inertial)
}

/// The joint types that the format knows.
const JOINT_TYPES: [&str; 7] = [
    "revolute",
    "continuous",
    "prismatic",
    "fixed",
    "floating",
    "planar",
    "spherical",
];

/// What urdf-rs does not check, or answers with a fault of its own: that the text is XML without absurd nesting, that it
/// is a robot, and that xacro has been run on it.
fn check_xml(xml: &str) -> Result<(), ModelError> {
    let urdf_error = |reason: String| ModelError::Urdf { reason };
    let document =
        roxmltree::Document::parse(xml).map_err(|error| urdf_error(error.to_string()))?;
    let root = document.root_element().tag_name().name();
    if root != "robot" {
        return Err(urdf_error(format!("expected <robot>, found <{root}>")));
    }
    for node in document.root_element().descendants() {
        let depth = node.ancestors().take(MOST_NESTING + 1).count();
        if depth > MOST_NESTING {
            return Err(urdf_error(format!(
                "expected at most {MOST_NESTING} nested elements, found more"
            )));
        }
        if node
            .tag_name()
            .namespace()
            .is_some_and(|space| space.contains("xacro"))
        {
            return Err(urdf_error(format!(
                "expected plain URDF, found <xacro:{}>: run xacro on it first",
                node.tag_name().name()
            )));
        }
    }
    let joints = (document.root_element().children()).filter(|node| node.has_tag_name("joint"));
    for joint in joints {
        let found = joint.attribute("type").unwrap_or("none");
        if !JOINT_TYPES.contains(&found) {
            return Err(ModelError::JointType {
                joint: joint.attribute("name").unwrap_or_default().to_owned(),
                found: found.to_owned(),
            });
        }
    }
    Ok(())
}

fn elements(link: &urdf_rs::Link, geometry: Geometry) -> Vec<(&urdf_rs::Pose, &urdf_rs::Geometry)> {
    match geometry {
        Geometry::Collision => (link.collision.iter())
            .map(|element| (&element.origin, &element.geometry))
            .collect(),
        Geometry::Visual => (link.visual.iter())
            .map(|element| (&element.origin, &element.geometry))
            .collect(),
    }
}

fn joint_name(joint: &urdf_rs::Joint, what: &str) -> String {
    format!("joint `{}` {what}", joint.name)
}

/// The joint, unless it is fixed.
fn movable_joint(joint: &urdf_rs::Joint) -> Result<Option<Joint>, ModelError> {
    use urdf_rs::JointType;
    let unsupported = |found: String| ModelError::JointType {
        joint: joint.name.clone(),
        found,
    };
    let kind = match joint.joint_type {
        JointType::Fixed => return Ok(None),
        JointType::Revolute => JointKind::Revolute,
        JointType::Continuous => JointKind::Continuous,
        JointType::Prismatic => JointKind::Prismatic,
        JointType::Floating => return Err(unsupported("floating".to_owned())),
        JointType::Planar => return Err(unsupported("planar".to_owned())),
        JointType::Spherical => return Err(unsupported("spherical".to_owned())),
    };
    if let Some(mimic) = &joint.mimic {
        return Err(unsupported(format!("a mimic of `{}`", mimic.joint)));
    }
    Ok(Some(Joint {
        name: joint.name.clone(),
        kind,
        axis_in_joint: axis(joint)?,
        limits: limits(joint, kind)?,
    }))
}

fn axis(joint: &urdf_rs::Joint) -> Result<Unit<Vector3<f64>>, ModelError> {
    let xyz = Vector3::from(joint.axis.xyz.0);
    // Scaled first, so that neither very short nor very long axes lose their direction.
    let scaled = xyz / xyz.amax();
    Unit::try_new(scaled, 0.5).ok_or_else(|| ModelError::Number {
        name: joint_name(joint, "axis"),
        expected: "a finite direction other than zero",
        found: format!("{} {} {}", xyz.x, xyz.y, xyz.z),
    })
}

/// Limits as stated; none for a continuous joint, nor for a joint whose URDF has no `<limit>`.
fn limits(joint: &urdf_rs::Joint, kind: JointKind) -> Result<Option<JointLimits>, ModelError> {
    let limit = &joint.limit;
    if kind == JointKind::Continuous || *limit == urdf_rs::JointLimit::default() {
        return Ok(None);
    }
    let values = [limit.lower, limit.upper, limit.velocity, limit.effort];
    if limit.lower > limit.upper || values.iter().any(|value| value.is_nan()) {
        return Err(ModelError::Number {
            name: joint_name(joint, "limit"),
            expected: "lower at most upper, and no NaN",
            found: format!("lower {} and upper {}", limit.lower, limit.upper),
        });
    }
    Ok(Some(JointLimits {
        lower: limit.lower,
        upper: limit.upper,
        velocity: limit.velocity,
        effort: limit.effort,
    }))
}
