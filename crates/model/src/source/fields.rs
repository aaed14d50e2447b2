//! Decoded messages, seen alike whether a bag or ROS 2 decoded them.

/// A value of a decoded message.
pub trait Fields: Copy {
    /// The field of this name, if this is a message that has it.
    fn field(self, name: &str) -> Option<Self>;

    /// The number, if this is an integer that fits.
    fn integer(self) -> Option<i64>;

    /// The numbers, if this is an array of numbers. NaN is one.
    fn numbers(self) -> Option<Vec<f64>>;

    /// The texts, if this is an array of strings.
    fn texts(self) -> Option<Vec<String>>;

    /// The elements, if this is an array of messages.
    fn messages(self) -> Option<Vec<Self>>;

    /// The stamp in ns of a message that begins with a `std_msgs/Header`; none if there is none, or it is zero.
    fn header_stamp_ns(self) -> Option<i64> {
        let stamp = self.field("header")?.field("stamp")?;
        stamp_ns(
            stamp.field("sec")?.integer()?,
            stamp.field("nanosec")?.integer()?,
        )
    }
}

/// Nanoseconds of a stamp; none if it is zero or out of all range.
pub(super) fn stamp_ns(secs: i64, nanos: i64) -> Option<i64> {
    let stamp_ns = secs.checked_mul(1_000_000_000)?.checked_add(nanos)?;
    (stamp_ns != 0).then_some(stamp_ns)
}
