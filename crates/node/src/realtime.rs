//! Real-time priority and cores for the threads that must not be late.
//!
//! What a thread is granted, the threads that it starts later inherit.

use std::io;

use palpate_filter::RealtimeSettings;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use thread_priority::unix::{set_thread_priority_and_policy, thread_native_id};
use thread_priority::{
    Error, NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority,
    ThreadPriorityValue, ThreadSchedulePolicy,
};

/// What the system did not grant.
#[derive(Debug, thiserror::Error)]
pub enum RealtimeRefusal {
    /// The process may not have real-time priority, or not so high a one.
    #[error(
        "realtime.priority: the system refuses the real-time priority {priority}: {source}. Going on without; `ulimit -r` \
         tells how high a user may go"
    )]
    Priority {
        /// The priority asked for.
        priority: u8,
        /// The system's reason.
        source: io::Error,
    },
    /// None of the cores is there, or the process may use none of them.
    #[error("realtime.cores: the system refuses the cores {cores:?}: {source}. Going on on any")]
    Cores {
        /// The cores asked for.
        cores: Vec<usize>,
        /// The system's reason.
        source: io::Error,
    },
    /// Some of the cores are not there, or the process may not use them.
    #[error("realtime.cores: of the cores {cores:?} the system grants only {granted:?}")]
    SomeCores {
        /// The cores asked for.
        cores: Vec<usize>,
        /// Those that it runs on.
        granted: Vec<usize>,
    },
}

/// Asks for priority and cores for the current thread and those that it starts from now on. Gives what was refused; all
/// is as before in that.
pub fn claim(settings: &RealtimeSettings) -> Vec<RealtimeRefusal> {
    let cores = settings.chosen_cores();
    let pinned = match cores.is_empty() {
        true => Ok(()),
        false => pin(cores),
    };
    let raised = match settings.priority {
        0 => Ok(()),
        priority => raise(priority),
    };
    [pinned.err(), raised.err()].into_iter().flatten().collect()
}

/// Takes real-time priority from the current thread, which inherited it, and lets all others go before it.
///
/// # Errors
/// If the system refuses, which it does to nobody who steps down.
pub fn step_down() -> io::Result<()> {
    let usual = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);
    schedule(ThreadPriority::Min, usual)
}

fn raise(priority: u8) -> Result<(), RealtimeRefusal> {
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let raised = match ThreadPriorityValue::try_from(priority) {
        Ok(value) => schedule(ThreadPriority::Crossplatform(value), fifo),
        Err(reason) => Err(io::Error::other(reason)),
    };
    raised.map_err(|source| RealtimeRefusal::Priority { priority, source })
}

fn schedule(priority: ThreadPriority, policy: ThreadSchedulePolicy) -> io::Result<()> {
    set_thread_priority_and_policy(thread_native_id(), priority, policy).map_err(
        |error| match error {
            Error::OS(code) => io::Error::from_raw_os_error(code),
            other => io::Error::other(other),
        },
    )
}

fn pin(cores: Vec<usize>) -> Result<(), RealtimeRefusal> {
    let mut wanted = CpuSet::new();
    for &core in cores.iter().filter(|&&core| core < CpuSet::MAX_CPU) {
        wanted.set(core);
    }
    let pinned = sched_setaffinity(None, &wanted).and_then(|()| sched_getaffinity(None));
    match pinned {
        Ok(granted) if granted == wanted => Ok(()),
        Ok(granted) => Err(RealtimeRefusal::SomeCores {
            granted: (cores.iter().copied())
                .filter(|&core| granted.is_set(core))
                .collect(),
            cores,
        }),
        Err(reason) => Err(RealtimeRefusal::Cores {
            cores,
            source: reason.into(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use thread_priority::unix::thread_schedule_policy;

    use super::*;

    fn cores(cores: &[i64]) -> RealtimeSettings {
        RealtimeSettings {
            cores: cores.to_vec(),
            ..RealtimeSettings::default()
        }
    }

    /// Runs in a thread of its own, so that other tests keep their cores.
    fn apart(test: impl FnOnce() + Send) {
        thread::scope(|scope| scope.spawn(test).join().unwrap());
    }

    fn first_core() -> usize {
        let usable = sched_getaffinity(None).unwrap();
        (0..CpuSet::MAX_CPU)
            .find(|&core| usable.is_set(core))
            .unwrap()
    }

    #[test]
    fn nothing_is_asked_for_by_default() {
        apart(|| {
            let before = sched_getaffinity(None).unwrap();
            assert!(claim(&RealtimeSettings::default()).is_empty());
            assert_eq!(sched_getaffinity(None).unwrap(), before);
        });
    }

    #[test]
    fn cores_are_granted_and_inherited() {
        apart(|| {
            let core = first_core();
            assert!(claim(&cores(&[core as i64, -1])).is_empty());
            apart(|| {
                let granted = sched_getaffinity(None).unwrap();
                assert!(granted.is_set(core) && granted.count() == 1);
            });
        });
    }

    #[test]
    fn cores_that_are_not_there_are_refused_by_name() {
        apart(|| {
            let before = sched_getaffinity(None).unwrap();
            let refused = claim(&cores(&[1000, 1001]));
            let said = refused[0].to_string();
            assert_eq!(refused.len(), 1);
            assert!(
                said.contains("realtime.cores: the system refuses the cores [1000, 1001]"),
                "{said}"
            );
            assert_eq!(sched_getaffinity(None).unwrap(), before);
            let core = first_core();
            let said = claim(&cores(&[core as i64, 1000]))[0].to_string();
            assert!(said.contains(&format!("grants only [{core}]")), "{said}");
        });
    }

    /// Whether this process may have it depends on who runs it: see the tests against ROS 2 for one that may not.
    #[test]
    fn priority_is_granted_or_refused_by_name() {
        apart(|| {
            let settings = RealtimeSettings {
                priority: 1,
                ..RealtimeSettings::default()
            };
            let policy = || thread_schedule_policy().unwrap();
            let usual = policy();
            match claim(&settings).as_slice() {
                [] => {
                    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
                    assert_eq!(policy(), fifo);
                    step_down().unwrap();
                }
                [refusal] => {
                    let said = refusal.to_string();
                    assert!(said.contains("refuses the real-time priority 1"), "{said}");
                }
                more => panic!("{more:?}"),
            }
            assert_eq!(policy(), usual);
        });
    }
}
