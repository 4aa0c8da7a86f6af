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
    pub(crate) struct Cores(Mutex<Vec<Worker>>);

    #[derive(Debug)]
    struct Worker {
        id: Pid,
        /// Those that it was started with, or has been given by others since.
        own: CpuSet,
        /// Those of them that it was last left.
        left: CpuSet,
    }

    impl Cores {
        /// Of so many workers, none of which has joined.
        pub fn of(workers: usize) -> Result<Self, Error> {
            let mut joined = Vec::new();
            joined.try_reserve_exact(workers)?;
            Ok(Cores(Mutex::new(joined)))
        }

        /// Joins the calling thread to the workers.
        pub fn join(&self) {
            // Where this is forbidden, workers run where they do.
            let Ok(own) = sched_getaffinity(None) else { return };
            let mut workers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            workers.push(Worker { id: gettid(), own, left: own });
        }

        /// Keeps the workers off the core that the calling thread is on, if they may run on as many cores as there are
        /// `threads`, of which it is one.
        pub fn keep_off_this_one(&self, threads: usize) {
            let (here, mine) = (sched_getcpu(), sched_getaffinity(None).ok());
            let mut workers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            for worker in workers.iter_mut() {
                let Ok(now) = sched_getaffinity(Some(worker.id)) else { continue };
                // What the calling thread has too may have been given to the whole process.
                if now != worker.left || Some(now) == mine {
                    worker.own = now;
                }
                let mut left = worker.own;
                if here < CpuSet::MAX_CPU && threads <= left.count() as usize {
                    left.unset(here);
                }
                if left == now || sched_setaffinity(Some(worker.id), &left).is_ok() {
                    worker.left = left;
                }
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

        pub fn keep_off_this_one(&self, _threads: usize) {}
    }
}

#[cfg(not(target_os = "linux"))]
pub(crate) use elsewhere::Cores;
#[cfg(target_os = "linux")]
pub(crate) use linux::Cores;
