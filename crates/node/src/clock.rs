//! The time now, for messages that have no stamp of their own.
//!
//! r2r follows `/clock` too, but leaves that out where it is built a second time from bindings that it has cached.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use futures::{FutureExt, Stream, StreamExt};
use palpate_filter::Settings;
use r2r::QosProfile;
use r2r::builtin_interfaces::msg::Time;
use r2r::rosgraph_msgs::msg::Clock as ClockMessage;

use palpate_node::messages;

/// The machine's clock, or `/clock` where the parameter `use_sim_time` is set.
pub struct Clock {
    simulated: Option<Simulated>,
}

struct Simulated {
    messages: Box<dyn Stream<Item = ClockMessage> + Unpin>,
    tick: Option<Tick>,
}

/// The newest message on `/clock`.
struct Tick {
    time_ns: i64,
    came: Instant,
    /// How far it lies after the one before, ns.
    step_ns: i64,
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
                tick: None,
            }),
        })
    }

    /// Call often: simulated time comes in messages. Zero before the first.
    pub fn now(&mut self) -> Time {
        messages::time(self.now_ns().unwrap_or(0))
    }

    /// The same in ns; none before the first message.
    pub fn now_ns(&mut self) -> Option<i64> {
        let Some(simulated) = &mut self.simulated else {
            let since = SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .unwrap_or_default();
            return Some(nanoseconds(since));
        };
        while let Some(Some(message)) = simulated.messages.next().now_or_never() {
            let time_ns = messages::nanoseconds(&message.clock);
            let before_ns = simulated.tick.as_ref().map(|tick| tick.time_ns);
            simulated.tick = Some(Tick {
                time_ns,
                came: Instant::now(),
                step_ns: before_ns.map_or(0, |before_ns| (time_ns - before_ns).max(0)),
            });
        }
        simulated.tick.as_ref().map(Tick::now_ns)
    }
}

impl Tick {
    /// Between ticks, which are often rarer than the messages to be stamped, time goes on as the machine's does, but not
    /// further than the next tick is expected.
    fn now_ns(&self) -> i64 {
        let since_ns = nanoseconds(self.came.elapsed());
        self.time_ns.saturating_add(since_ns.min(self.step_ns))
    }
}

/// Saturates.
fn nanoseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}
