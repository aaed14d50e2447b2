//! What can be wrong with a robot description or with the names and arrays of a message.

/// Why a robot could not be built, or a message not be matched to it.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// A file could not be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The file.
        path: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A message lacks joints that the robot has.
    #[error("joints missing: the robot needs {missing}; the message has {found}")]
    JointsMissing {
        /// Names that the robot has and the message has not.
        missing: String,
        /// Names that the message has.
        found: String,
    },
    /// An array is shorter than the names that go with it.
    #[error("array too short: expected at least {expected} values, found {found}")]
    ArrayLength {
        /// Least number of values.
        expected: usize,
        /// Number of values found.
        found: usize,
    },
    /// A message has not one value a joint name.
    #[error("expected {expected} values, one a name, found {found}")]
    ValueCount {
        /// Number of names.
        expected: usize,
        /// Number of values found.
        found: usize,
    },
    /// The URDF is not one: not well-formed, or not what the format asks for.
    #[error("malformed URDF: {reason}")]
    Urdf {
        /// What is wrong and where.
        reason: String,
    },
    /// Two links, or two joints, share a name.
    #[error("duplicate {kind} name: expected each once, found `{name}` twice")]
    DuplicateName {
        /// `link` or `joint`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A joint names a link that is not in the URDF.
    #[error("joint `{joint}`: expected a link of the robot as its {role}, found `{link}`")]
    UnknownLink {
        /// The joint.
        joint: String,
        /// `parent` or `child`.
        role: &'static str,
        /// The name that no link has.
        link: String,
    },
    /// The links do not form one tree.
    #[error("the links form no tree: expected {expected}, found {found}")]
    Tree {
        /// What a tree has.
        expected: &'static str,
        /// What the URDF has instead, with the names.
        found: String,
    },
    /// A joint moves in a way that is not supported.
    #[error(
        "joint `{joint}`: expected type revolute, continuous, prismatic or fixed, found {found}"
    )]
    JointType {
        /// The joint.
        joint: String,
        /// Its type.
        found: String,
    },
    /// A number is not one that its place allows.
    #[error("{name}: expected {expected}, found {found}")]
    Number {
        /// What the number says.
        name: String,
        /// What is allowed.
        expected: &'static str,
        /// The number or numbers.
        found: String,
    },
    /// There is not one value a joint.
    #[error("{what}: expected {expected} values, one a joint, found {found}")]
    JointCount {
        /// What the values say.
        what: &'static str,
        /// Number of movable joints.
        expected: usize,
        /// Number of values.
        found: usize,
    },
    /// A link moves and has no mass.
    #[error(
        "link `{link}`: expected a mass and an inertia in the URDF, as it moves, found none: without them no external \
         torque can be told from measured ones"
    )]
    NoInertia {
        /// The link.
        link: String,
    },
    /// The payload is carried by a link that is not in the URDF.
    #[error("the payload: expected one of the links {known}, found `{found}`")]
    PayloadLink {
        /// The name that no link has.
        found: String,
        /// Names that the robot has.
        known: String,
    },
    /// The geometry of a link could not be loaded.
    #[error("link `{link}`, {geometry}: {source}")]
    Geometry {
        /// The link.
        link: String,
        /// The mesh's address as the URDF gives it, or the shape.
        geometry: String,
        /// What is wrong with it.
        source: Box<ModelError>,
    },
    /// No mesh is at the address.
    #[error("mesh not found: expected one of {searched}, found none of them")]
    MeshNotFound {
        /// Where it was looked for.
        searched: String,
    },
    /// A mesh's address, or its format, is not one that is understood.
    #[error("unknown {what}: expected {expected}, found `{found}`")]
    MeshKind {
        /// `kind of address` or `mesh format`.
        what: &'static str,
        /// What is understood.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// A mesh file ends too early.
    #[error("{format} file too short: expected {expected} bytes, found {found}")]
    MeshLength {
        /// The format.
        format: &'static str,
        /// Bytes that the file announces or needs.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// A mesh file breaks the rules of its format.
    #[error("malformed {format} file: {reason}")]
    MeshFile {
        /// The format.
        format: &'static str,
        /// What is wrong and where.
        reason: String,
    },
    /// A mesh has no triangle that could be touched.
    #[error("empty mesh: expected at least one triangle with an area, found {found}")]
    MeshEmpty {
        /// What was found.
        found: String,
    },
    /// The mesh is so large against the longest edge allowed that splitting it would not end in reasonable memory.
    #[error(
        "mesh too large: expected at most {limit} triangles with edges up to {max_edge} m, found a mesh {extent} m \
         across that needs more (is its unit the metre? `scale` in the URDF corrects it)"
    )]
    MeshTooLarge {
        /// Largest number of triangles.
        limit: usize,
        /// Longest edge allowed, m.
        max_edge: f64,
        /// Diagonal of the bounding box, m.
        extent: f64,
    },
}
