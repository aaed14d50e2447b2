//! What can be wrong with a scenario, or keep it from being played.

/// Why there is no trial.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// The scenario is not YAML, lacks a key, or has one that is not known.
    #[error("the scenario cannot be read: {0}")]
    Yaml(#[from] serde_yaml_ng::Error),
    /// A number is outside of what can be simulated.
    #[error("scenario: {field} must be {expected}, found {found}")]
    OutOfRange {
        /// Key in the scenario.
        field: &'static str,
        /// What is allowed, with its unit.
        expected: String,
        /// What was given.
        found: String,
    },
    /// The robot has no link of this name.
    #[error("the robot has no link {link}; it has {known}")]
    UnknownLink {
        /// Name in the scenario.
        link: String,
        /// Names that the robot has.
        known: String,
    },
    /// The link has nothing to touch.
    #[error("link {link} has no mesh to touch; links with one: {known}")]
    NoMesh {
        /// Name in the scenario.
        link: String,
        /// Names of the links that have a mesh.
        known: String,
    },
    /// No joint feels a contact on the link.
    #[error("link {link} does not move: no joint would feel a contact on it")]
    Immovable {
        /// Name in the scenario.
        link: String,
    },
    /// A mesh is of no use for collision queries.
    #[error("the mesh of link {link} cannot be used: {reason}")]
    Mesh {
        /// The link.
        link: String,
        /// What is wrong.
        reason: String,
    },
    /// The robot's masses are no ground for dynamics.
    #[error(transparent)]
    Model(#[from] palpate_model::ModelError),
    /// Every draw of configuration, obstacle and motion was refused.
    #[error("no contact of a {obstacle} with link {link} in {draws} draws; refused: {reasons}")]
    NoContact {
        /// The link.
        link: String,
        /// Kind of obstacle.
        obstacle: &'static str,
        /// Draws tried.
        draws: usize,
        /// How many were refused for what.
        reasons: String,
    },
}
