//! The time now, for messages that have no sample's stamp.
//!
//! r2r follows `/clock` too, but leaves that out where it is built a second time from bindings that it has cached.

use std::time::{SystemTime, UNIX_EPOCH};

use futures::{FutureExt, Stream, StreamExt};
use palpate_filter::Settings;
use r2r::QosProfile;
use r2r::builtin_interfaces::msg::Time;
use r2r::rosgraph_msgs::msg::Clock as ClockMessage;

use crate::messages;

/// The machine's clock, or `/clock` where the parameter `use_sim_time` is set.
pub struct Clock {
    simulated: Option<Simulated>,
}

struct Simulated {
    messages: Box<dyn Stream<Item = ClockMessage> + Unpin>,
    now: Time,
}

impl Clock {
    pub fn new(node: &mut r2r::Node, settings: &Settings) -> r2r::Result<Self> {
        if !settings.use_sim_time {
            return Ok(Self { simulated: None });
        }
        let qos = QosProfile::sensor_data().keep_last(1);
        Ok(Self {
            simulated: Some(Simulated {
                messages: Box::new(node.subscribe("/clock", qos)?),
                now: Time::default(),
            }),
        })
    }

    /// Call often: simulated time comes in messages.
    pub fn now(&mut self) -> Time {
        let Some(simulated) = &mut self.simulated else {
            let since = SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .unwrap_or_default();
            return messages::time(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX));
        };
        while let Some(Some(message)) = simulated.messages.next().now_or_never() {
            simulated.now = message.clock;
        }
        simulated.now.clone()
    }
}
