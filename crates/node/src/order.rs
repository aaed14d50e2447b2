//! What the estimating thread is told to do between two samples.

use std::sync::mpsc::Sender;

use palpate_filter::Parameters;

/// What is to be done.
pub enum Order {
    /// Forget the present contact.
    Reset,
    /// Take the mean of each joint's torque over this time, s, for its bias.
    Tare(f64),
    /// Take the torques as they are measured.
    ClearTare,
    /// Estimate, or leave it.
    Enable(bool),
    /// Estimate with these parameters.
    Parameters(Box<Parameters>),
}

/// What became of an order.
pub struct Outcome {
    /// Whether it was carried out.
    pub done: bool,
    /// How it went, or why not.
    pub message: String,
}

impl Outcome {
    pub fn done(message: impl ToString) -> Self {
        Self {
            done: true,
            message: message.to_string(),
        }
    }

    pub fn refused(message: impl ToString) -> Self {
        Self {
            done: false,
            message: message.to_string(),
        }
    }
}

/// An order, and where its outcome goes.
pub struct Asked {
    pub order: Order,
    pub reply: Sender<Outcome>,
}

impl Asked {
    /// Tells the outcome; nobody may wait for it any more.
    pub fn tell(reply: &Sender<Outcome>, outcome: Outcome) {
        let _ = reply.send(outcome);
    }
}
