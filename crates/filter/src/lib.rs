//! Where the contact is: a particle filter over the triangles of each link's mesh.

mod cloud;
mod detection;
mod detector;
mod estimate;
mod filter;
mod intake;
mod modes;
mod palpate;
mod paper;
mod parameter_table;
mod parameters;
mod particle;
mod random;
mod region;
mod resample;
mod scene;
mod settings;
mod skin;
mod step;
mod tare;
mod torque_settings;

pub use detection::{ContactChange, ContactEvent, Detection};
pub use detector::{Detector, DetectorParameters, JointBias};
pub use estimate::{ContactEstimate, ContactStatus, Mode};
pub use filter::Filter;
pub use intake::{Admitted, Intake, IntakeCounts, Refusal};
pub use palpate::PalpateParameters;
#[doc(hidden)]
pub use paper::Stage;
pub use paper::{MotionModel, PaperParameters};
pub use parameter_table::{PARAMETER_TABLE, ParameterRow};
pub use parameters::{Method, ParameterError, Parameters};
pub use particle::Particle;
pub use region::CredibleRegion;
pub use scene::{
    Arrow, CLOUD_FIELDS, CLOUD_POINT_STEP, CloudField, CloudFieldType, CloudPoint, Colour,
    ContactPose, Label, Scene, pack_cloud,
};
pub use settings::{
    InputSettings, RealtimeSettings, RobotSettings, Settings, SettingsError, VizSettings,
};
pub use tare::{TareRefusal, TareState};
pub use torque_settings::{
    FrictionSettings, ObserverSettings, PayloadSettings, SpeedSource, TorqueSettings, TorqueSource,
    VelocitySettings,
};
