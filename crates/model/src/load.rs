//! What to load of a robot, and what was found on the way.

use serde::{Deserialize, Serialize};

use crate::{Cleaning, ModelError};

/// Which of a link's geometries can be touched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// The `<collision>` elements.
    #[default]
    Collision,
    /// The `<visual>` elements.
    Visual,
}

/// How a robot is loaded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LoadOptions {
    /// Which of a link's geometries can be touched.
    pub geometry: Geometry,
    /// Longest edge that a triangle may have, m; longer ones are split. Infinity keeps the triangles as they are.
    pub max_edge: f64,
    /// Joints that are held at zero, whatever their type: those that no message tells of, as a gripper's fingers. Names
    /// that the robot has not are no error, as grippers are options.
    pub fixed_joints: Vec<String>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            geometry: Geometry::default(),
            max_edge: 0.02,
            fixed_joints: Vec::new(),
        }
    }
}

impl LoadOptions {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        if self.max_edge > 0.0 {
            return Ok(());
        }
        Err(ModelError::Number {
            name: "max_edge".to_owned(),
            expected: "a length above zero",
            found: self.max_edge.to_string(),
        })
    }
}

/// What loading found and changed, link by link.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadReport {
    /// One entry a link, in the order of [`Robot::links`](crate::Robot::links).
    pub links: Vec<LinkReport>,
}

/// What loading found in the geometry of one link, and changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinkReport {
    /// The link.
    pub name: String,
    /// Elements (`<collision>` or `<visual>`) that make up the mesh; zero for a link that cannot be touched.
    pub elements: usize,
    /// Triangles in the files and shapes.
    pub triangles_read: usize,
    /// Triangles of the finished mesh.
    pub triangles: usize,
    /// Vertices of the finished mesh.
    pub vertices: usize,
    /// What cleaning merged and dropped.
    pub cleaning: Cleaning,
    /// Edges with one triangle only, the rims of holes, before splitting.
    pub open_edges: usize,
    /// Edges whose triangles disagree on which side is outside, before splitting.
    pub inconsistent_edges: usize,
    /// Edges halved because they were too long.
    pub split_edges: usize,
    /// Triangles dropped after splitting because other ones enclose them: nothing can touch them.
    pub enclosed_triangles: usize,
    /// What a person should look at, in sentences.
    pub warnings: Vec<String>,
}
