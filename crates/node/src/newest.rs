//! A bounded buffer between two threads in which the newest data wins.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A queue of limited length: the writer never waits, and where the reader is too slow, the oldest entry is lost and
/// counted.
#[derive(Debug)]
pub struct Newest<T> {
    capacity: usize,
    state: Mutex<State<T>>,
    arrived: Condvar,
}

#[derive(Debug)]
struct State<T> {
    waiting: VecDeque<T>,
    lost: u64,
    closed: bool,
}

impl<T> Newest<T> {
    /// A buffer of at most `capacity` entries (at least one).
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity: capacity.max(1),
            state: Mutex::new(State {
                waiting: VecDeque::new(),
                lost: 0,
                closed: false,
            }),
            arrived: Condvar::new(),
        }
    }

    /// Puts an entry in, in place of the oldest where there is no room.
    pub fn push(&self, entry: T) {
        self.push_over(entry, |_, _| false);
    }

    /// Puts an entry in, in place of the oldest where there is no room, and of all that wait where the oldest is `stale`
    /// beside it: a reader that is late goes on with the newest, and not with what is nearly stale.
    pub fn push_over(&self, entry: T, stale: impl Fn(&T, &T) -> bool) {
        let mut state = self.lock();
        let waiting = state.waiting.len();
        let is_late = (state.waiting.front()).is_some_and(|oldest| stale(oldest, &entry));
        let lost = match is_late {
            true => waiting,
            false => usize::from(waiting == self.capacity),
        };
        state.waiting.drain(..lost);
        state.lost += lost as u64;
        state.waiting.push_back(entry);
        self.arrived.notify_one();
    }

    /// Takes the oldest entry out, waiting for one. None after [`Newest::close`].
    pub fn pop(&self) -> Option<T> {
        let state = self.lock();
        let state = self
            .arrived
            .wait_while(state, |state| state.waiting.is_empty() && !state.closed);
        take(&mut state.unwrap_or_else(PoisonError::into_inner))
    }

    /// As [`Newest::pop`], but waits for `time` at most.
    pub fn pop_within(&self, time: Duration) -> Option<T> {
        let state = self.lock();
        let waited = self.arrived.wait_timeout_while(state, time, |state| {
            state.waiting.is_empty() && !state.closed
        });
        take(&mut waited.unwrap_or_else(PoisonError::into_inner).0)
    }

    /// Takes the oldest entry out, if there is one.
    pub fn try_pop(&self) -> Option<T> {
        self.lock().waiting.pop_front()
    }

    /// Waits for `time`, or until the buffer is closed. Says whether it is still open.
    pub fn wait_open(&self, time: Duration) -> bool {
        let (state, _) = self
            .arrived
            .wait_timeout_while(self.lock(), time, |state| !state.closed)
            .unwrap_or_else(PoisonError::into_inner);
        !state.closed
    }

    /// Whether it was closed.
    pub fn is_closed(&self) -> bool {
        self.lock().closed
    }

    /// Ends the reader's waiting, now and later.
    pub fn close(&self) {
        self.lock().closed = true;
        self.arrived.notify_all();
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.lock().waiting.is_empty()
    }

    /// How many entries wait.
    pub fn len(&self) -> usize {
        self.lock().waiting.len()
    }

    /// How many entries were lost so far.
    pub fn lost(&self) -> u64 {
        self.lock().lost
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        // A panic elsewhere leaves the queue as it was between two calls.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn take<T>(state: &mut State<T>) -> Option<T> {
    match state.closed {
        true => None,
        false => state.waiting.pop_front(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_win_and_the_lost_are_counted() {
        let buffer = Newest::new(3);
        for entry in 0..10 {
            buffer.push(entry);
        }
        assert_eq!(buffer.lost(), 7);
        assert_eq!(
            [buffer.pop(), buffer.pop(), buffer.pop()],
            [Some(7), Some(8), Some(9)]
        );
        assert_eq!(buffer.try_pop(), None);
    }

    #[test]
    fn all_that_wait_give_way_where_the_oldest_is_stale() {
        let buffer = Newest::new(10);
        for entry in [1, 2, 3, 4, 5, 6] {
            buffer.push_over(entry, |oldest, newest| oldest + 2 < *newest);
        }
        assert_eq!(buffer.lost(), 3);
        assert_eq!(
            [buffer.pop(), buffer.pop(), buffer.pop()],
            [Some(4), Some(5), Some(6)]
        );
        assert_eq!(buffer.pop_within(Duration::from_millis(1)), None);
    }

    #[test]
    fn closing_ends_a_waiting_reader() {
        let buffer = Newest::<u8>::new(1);
        std::thread::scope(|scope| {
            let reader = scope.spawn(|| buffer.pop());
            buffer.close();
            assert_eq!(reader.join().unwrap(), None);
        });
        assert!(!buffer.wait_open(Duration::from_secs(3600)));
        assert!(buffer.is_closed());
    }

    #[test]
    fn what_one_thread_puts_in_another_takes_out_in_order() {
        let buffer = Newest::new(1000);
        std::thread::scope(|scope| {
            scope.spawn(|| (0..1000).for_each(|entry| buffer.push(entry)));
            let taken: Vec<_> = (0..1000).filter_map(|_| buffer.pop()).collect();
            assert_eq!(taken, (0..1000).collect::<Vec<_>>());
        });
    }
}
