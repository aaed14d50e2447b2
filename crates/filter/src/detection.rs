//! What the detector says: whether something touches, since when, how sure that is, and which joints saw it.

/// What is known of a contact without knowing where it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Detection {
    /// Whether something touches.
    pub in_contact: bool,
    /// Stamp at which the present contact began, ns; earlier than the sample that gave it away.
    pub since_ns: Option<i64>,
    /// Probability that the present contact is none of the false alarms that the stated rate allows; 0 without contact.
    pub confidence: f64,
    /// Which joints feel it now, one entry a joint.
    pub joints: Vec<bool>,
    /// Index in [`Robot::links`](palpate_model::Robot::links) of the first link that can be touched: the one that the
    /// last joint that saw the present contact moves. Links before it cannot be the touched one.
    pub first_link: Option<usize>,
    /// The contact that began or ended with the last sample.
    pub event: Option<ContactEvent>,
}

/// A contact's start or end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEvent {
    /// Which of both.
    pub change: ContactChange,
    /// When it happened, as far as the torques tell, ns.
    pub stamp_ns: i64,
    /// Stamp of the sample that gave it away, ns.
    pub noticed_ns: i64,
    /// Probability that it is no false alarm, or that nothing touches any more.
    pub confidence: f64,
}

/// Whether a contact starts or ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactChange {
    /// Something begins to touch.
    Start,
    /// Nothing touches any more.
    End,
}
