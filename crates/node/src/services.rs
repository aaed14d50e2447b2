//! The services `~/reset`, `~/tare`, `~/clear_tare` and `~/set_enabled`.

use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};

use futures::{FutureExt, Stream, StreamExt};
use r2r::std_srvs::srv::{SetBool, Trigger};
use r2r::{QosProfile, ServiceRequest};

use crate::order::{Asked, Order, Outcome};

/// Requests of one service that came in.
pub type Requests<T> = Box<dyn Stream<Item = ServiceRequest<T>> + Unpin>;

type Respond = Box<dyn FnOnce(Outcome) -> r2r::Result<()>>;

/// Hands requests over as orders, and answers them when those are carried out.
pub struct Services {
    reset: Requests<Trigger::Service>,
    tare: Requests<Trigger::Service>,
    clear_tare: Requests<Trigger::Service>,
    set_enabled: Requests<SetBool::Service>,
    waiting: Vec<(Respond, Receiver<Outcome>)>,
}

impl Services {
    pub fn new(node: &mut r2r::Node) -> r2r::Result<Self> {
        let qos = QosProfile::services_default;
        Ok(Self {
            reset: Box::new(node.create_service("~/reset", qos())?),
            tare: Box::new(node.create_service("~/tare", qos())?),
            clear_tare: Box::new(node.create_service("~/clear_tare", qos())?),
            set_enabled: Box::new(node.create_service("~/set_enabled", qos())?),
            waiting: Vec::new(),
        })
    }

    /// Takes requests in, for who takes `orders` if there is anybody, and answers those that are done.
    pub fn serve(&mut self, orders: Option<&Sender<Asked>>, tare_secs: f64) {
        for (order, respond) in self.take(tare_secs) {
            let Some(orders) = orders else {
                let refusal = Outcome::refused("the node still waits for the robot's description");
                answer(respond, refusal);
                continue;
            };
            let (reply, outcome) = mpsc::channel();
            // Where nobody takes the order, its reply is dropped, which is seen below.
            let _ = orders.send(Asked { order, reply });
            self.waiting.push((respond, outcome));
        }
        for (respond, outcome) in std::mem::take(&mut self.waiting) {
            match outcome.try_recv() {
                Ok(outcome) => answer(respond, outcome),
                Err(TryRecvError::Empty) => self.waiting.push((respond, outcome)),
                Err(TryRecvError::Disconnected) => {
                    answer(respond, Outcome::refused("the node began anew meanwhile"));
                }
            }
        }
    }

    fn take(&mut self, tare_secs: f64) -> Vec<(Order, Respond)> {
        let mut taken = Vec::new();
        while let Some(Some(request)) = self.reset.next().now_or_never() {
            taken.push((Order::Reset, trigger(request)));
        }
        while let Some(Some(request)) = self.tare.next().now_or_never() {
            taken.push((Order::Tare(tare_secs), trigger(request)));
        }
        while let Some(Some(request)) = self.clear_tare.next().now_or_never() {
            taken.push((Order::ClearTare, trigger(request)));
        }
        while let Some(Some(request)) = self.set_enabled.next().now_or_never() {
            let order = Order::Enable(request.message.data);
            let respond = |Outcome { done, message }| {
                request.respond(SetBool::Response {
                    success: done,
                    message,
                })
            };
            taken.push((order, Box::new(respond)));
        }
        taken
    }
}

fn trigger(request: ServiceRequest<Trigger::Service>) -> Respond {
    Box::new(|Outcome { done, message }| {
        request.respond(Trigger::Response {
            success: done,
            message,
        })
    })
}

fn answer(respond: Respond, outcome: Outcome) {
    tracing::info!("{}", outcome.message);
    // The client may have gone, which is no reason to end.
    if let Err(error) = respond(outcome) {
        tracing::debug!("an answer was not sent: {error}");
    }
}
