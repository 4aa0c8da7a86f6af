//! The cores that worker threads may run on.
//!
//! A scheduler may wake a worker on the core of the thread that wakes it though another one is idle. There it waits, and the
//! frame takes as long as with one thread: on machines of two cores Linux does so in most frames, if there is a pause
//! between them, as there is with a camera.

#[cfg(target_os = "linux")]
mod linux {
    use std::sync::{Mutex, PoisonError};

    use rustix::thread::{CpuSet, Pid, gettid, sched_getaffinity, sched_getcpu, sched_setaffinity};

    use crate::Error;

    /// Some workers' cores.
    #[derive(Debug)]
    pub(crate) struct Cores(Mutex<Given>);

    #[derive(Debug, Default)]
    struct Given {
        workers: Vec<Pid>,
        /// Those that all of them were last given.
        cores: Option<CpuSet>,
    }

    impl Cores {
        /// Of so many workers, none of which has joined.
        pub fn of(workers: usize) -> Result<Self, Error> {
            let mut given = Given::default();
            given.workers.try_reserve_exact(workers)?;
            Ok(Cores(Mutex::new(given)))
        }

        /// Joins the calling thread to the workers.
        pub fn join(&self) {
            let mut given = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            given.workers.push(gettid());
            given.cores = None;
        }

        /// Lets the workers run where the calling thread may, but not on the core that it is on, unless there are fewer
        /// cores than `threads`, of which it is one.
        pub fn give(&self, threads: usize) {
            // Where any of this is forbidden, workers run where they do.
            let Ok(mut cores) = sched_getaffinity(None) else { return };
            let here = sched_getcpu();
            if here < CpuSet::MAX_CPU && threads <= cores.count() as usize {
                cores.unset(here);
            }
            let mut given = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if given.cores != Some(cores) {
                for worker in &given.workers {
                    let _ = sched_setaffinity(Some(*worker), &cores);
                }
                given.cores = Some(cores);
            }
        }
    }
}

/// Elsewhere it is left to the scheduler.
#[cfg(not(target_os = "linux"))]
mod elsewhere {
    use crate::Error;

    #[derive(Debug)]
    pub(crate) struct Cores;

    impl Cores {
        pub fn of(_workers: usize) -> Result<Self, Error> {
            Ok(Cores)
        }

        pub fn join(&self) {}

        pub fn give(&self, _threads: usize) {}
    }
}

#[cfg(not(target_os = "linux"))]
pub(crate) use elsewhere::Cores;
#[cfg(target_os = "linux")]
pub(crate) use linux::Cores;
