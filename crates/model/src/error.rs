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
}
