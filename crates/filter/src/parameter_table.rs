//! What each parameter means, in one table: for the README, and for those who ask a running node.

/// What a user has to know of a parameter, besides the type and the default that [`Settings`](crate::Settings) gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterRow {
    /// Full name.
    pub name: &'static str,
    /// Unit; empty where there is none.
    pub unit: &'static str,
    /// What is allowed, in words; empty where anything is.
    pub range: &'static str,
    /// The same as smallest and largest number. Values between them may still be refused, as 0 is where `range` says
    /// "> 0".
    pub bounds: Option<[f64; 2]>,
    /// Whether it can be changed while the node runs.
    pub live: bool,
    /// What it means.
    pub meaning: &'static str,
}

const fn row(
    name: &'static str,
    unit: &'static str,
    range: &'static str,
    bounds: Option<[f64; 2]>,
    live: bool,
    meaning: &'static str,
) -> ParameterRow {
    ParameterRow {
        name,
        unit,
        range,
        bounds,
        live,
        meaning,
    }
}

/// Every parameter of [`Settings`](crate::Settings), in the README's order.
#[rustfmt::skip]
pub const PARAMETER_TABLE: &[ParameterRow] = &[
    row("robot_description", "", "", None, false, "the URDF as text; empty: see `robot.description_file`"),
    row("use_sim_time", "", "", None, false, "whether the node's own time is `/clock`; samples carry their stamps anyhow"),
    row("seed", "", "≥ 0", Some([0.0, f64::MAX]), false, "the same seed, samples and parameters give the same estimate"),
    row("robot.description_file", "", "", None, false, "URDF file; empty: the node waits for the topic `robot_description`"),
    row("robot.package_dirs", "", "", None, false, "folders for `package://`, before those of the ament prefix path"),
    row("robot.geometry", "", "`collision`, `visual`", None, false, "which geometry can be touched"),
    row("robot.max_edge", "m", "≥ 0.001", Some([0.001, f64::MAX]), false, "coarse triangles are split until no edge is longer"),
    row("robot.fixed_joints", "", "", None, false, "joints held at zero because no message tells of them, as a gripper's fingers"),
    row("input.source", "", "`joint_state`, `multi_array`, `lbr_state`, `franka_state`, `dynamic_joint_state`", None, false, "messages that external torques come in"),
    row("input.joint_names", "", "", None, false, "joints of messages without names; none: the robot's, in its order"),
    row("input.pairing_tolerance_secs", "s", "0 to 10", Some([0.0, 10.0]), true, "most that stamps of position and torque may differ"),
    row("input.max_wait_secs", "s", "0 to 3600", Some([0.0, 3600.0]), true, "after a step later than this the newest sample is used, and those before are lost"),
    row("input.time_jump_secs", "s", "≥ 0", Some([0.0, f64::MAX]), true, "a stamp further back than this starts time anew"),
    row("input.reset_on_time_jump", "", "", None, true, "whether time that starts anew is followed; if not, such stamps are refused"),
    row("input.tare_secs", "s", "0.1 to 60", Some([0.1, 60.0]), true, "a tare averages the torques over this"),
    row("torque.source", "", "`external`, `static`, `momentum_observer`", None, false, "what gives the external torque: the driver, or a formula from the torques measured beside the positions"),
    row("torque.gravity", "m/s²", "-100 to 100", Some([-100.0, 100.0]), false, "gravity in the root frame, for arms on walls and ceilings"),
    row("torque.payload.link", "", "", None, false, "link that carries a payload that the URDF lacks; empty: none"),
    row("torque.payload.mass", "kg", "0 to 1000", Some([0.0, 1000.0]), false, "its mass"),
    row("torque.payload.centre", "m", "-10 to 10", Some([-10.0, 10.0]), false, "its centre of mass in that link's frame"),
    row("torque.payload.inertia", "kg m²", "-1000 to 1000", Some([-1000.0, 1000.0]), false, "its inertia about that centre: xx, xy, xz, yy, yz, zz"),
    row("torque.friction.viscous", "Nm s/rad", "0 to 1000", Some([0.0, 1000.0]), false, "viscous friction in the measured torque, for all joints or for each"),
    row("torque.friction.coulomb", "Nm", "0 to 1000", Some([0.0, 1000.0]), false, "Coulomb friction in the measured torque, for all joints or for each"),
    row("torque.velocity.source", "", "`driver`, `differentiated`", None, false, "what gives the joint speeds: the driver, or the positions"),
    row("torque.velocity.cutoff_hz", "Hz", "0.1 to 1000", Some([0.1, 1000.0]), false, "low-pass on differentiated speeds"),
    row("torque.observer.gain", "1/s", "> 0, at most 1000", Some([0.0, 1000.0]), false, "gain of the momentum observer, for all joints or for each; its bandwidth is gain/2π Hz"),
    row("filter.method", "", "`palpate`, `paper`", None, true, "the method"),
    row("filter.particles", "", "100 to 10⁷", Some([100.0, 1e7]), true, "number of particles of `paper`"),
    row("filter.min_particles", "", "100 to 10⁷", Some([100.0, 1e7]), true, "fewest that the node goes down to where steps take too long; from `filter.particles` on: none fewer"),
    row("filter.located_probability", "", "0 to 1", Some([0.0, 1.0]), true, "least probability of a located contact's first mode"),
    row("filter.located_std", "m", "> 0", Some([0.0, f64::MAX]), true, "largest standard deviation of a located contact's first mode"),
    row("filter.tolerance", "m", "0 to 0.1", Some([0.0, 0.1]), true, "error of meshes and positions, added to every estimate's"),
    row("filter.detector.false_alarms_per_hour", "1/h", "1e-6 to 1000", Some([1e-6, 1000.0]), true, "false alarms that noise may cause, at most"),
    row("filter.detector.least_torque", "Nm", "0.001 to 1000", Some([0.001, 1000.0]), true, "torques below are no contact, however little noise there is"),
    row("filter.detector.min_secs", "s", "0 to 1", Some([0.0, 1.0]), true, "a joint's torque speaks for a contact so long before it begins"),
    row("filter.detector.release_share", "", "0.1 to 1", Some([0.1, 1.0]), true, "it ends when all torques are below this share of what begins one"),
    row("filter.detector.release_secs", "s", "0 to 60", Some([0.0, 60.0]), true, "… for so long"),
    row("filter.detector.bias_std", "Nm", "0.001 to 100", Some([0.001, 100.0]), true, "standard deviation of a joint's bias before anything was learned"),
    row("filter.detector.bias_secs", "s", "0.1 to 3600", Some([0.1, 3600.0]), true, "the bias is learned over this time at rest"),
    row("filter.detector.bias_travel", "rad", "0.001 to 10", Some([0.001, 10.0]), true, "… and over this travel of the joints in motion"),
    row("filter.detector.motion_std", "Nm", "0 to 100", Some([0.0, 100.0]), true, "what torques are wrong by in fast motion before it was learned"),
    row("filter.palpate.hypotheses", "", "50 to 10⁵", Some([50.0, 1e5]), true, "most particles of `palpate`"),
    row("filter.palpate.min_hypotheses", "", "50 to 10⁵", Some([50.0, 1e5]), true, "fewest, where they agree about the place"),
    row("filter.palpate.rounds", "", "1 to 100", Some([1.0, 100.0]), true, "moves that each tries after each keyframe"),
    row("filter.paper.motion_model", "", "`curvature`, `link`, `world`", None, true, "how contacts move"),
    row("filter.paper.rate_hz", "Hz", "0.1 to 10000", Some([0.1, 10000.0]), true, "steps a second, each by the mean of the samples since the last"),
    row("filter.paper.lambda", "1/(Nm)²", "> 0", Some([0.0, f64::MAX]), true, "λ of the likelihood"),
    row("filter.paper.location_noise", "m", "> 0", Some([0.0, f64::MAX]), true, "σ on the location, a step"),
    row("filter.paper.force_noise", "N", "> 0", Some([0.0, f64::MAX]), true, "σ on the force, a step"),
    row("filter.paper.stiffness_noise", "", "> 0", Some([0.0, f64::MAX]), true, "σ on the stiffness' logarithm, a step"),
    row("filter.paper.schedule_travel", "rad", "> 0", Some([0.0, f64::MAX]), true, "joint motion over which pairs go from their first to their second value"),
    row("filter.paper.force_max", "N", "> 0", Some([0.0, f64::MAX]), true, "largest force of a fresh particle"),
    row("filter.paper.stiffness_range", "N/m", "> 0, rising", Some([0.0, f64::MAX]), true, "range of a fresh stiffness"),
    row("filter.paper.resample_below", "", "0 to 1", Some([0.0, 1.0]), true, "effective sample size to resample below, as a share"),
    row("filter.paper.fresh_share", "", "0 to 1", Some([0.0, 1.0]), true, "share of fresh particles at each resampling"),
    row("viz.rate", "Hz", "0.1 to 1000", Some([0.1, 1000.0]), true, "most clouds and markers a second"),
    row("realtime.priority", "", "0 to 99", Some([0.0, 99.0]), false, "SCHED_FIFO priority of the threads that take messages and estimate; 0: the usual scheduling"),
    row("realtime.cores", "", "-1 to 1023", Some([-1.0, 1023.0]), false, "cores that those threads run on; -1: any"),
];
