//! Work shared out among threads. Items are fixed by the frame, not by the number of threads, so results are too.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::Error;

/// The calling thread, and a pool of further threads that lives until another number is asked for.
#[derive(Debug, Default)]
pub(crate) struct Workers {
    pool: Option<ThreadPool>,
    /// The process that has the pool's threads: a fork of it has none of them.
    process: u32,
}

impl Workers {
    /// Makes `threads` workers ready; 0 takes one per core.
    pub fn prepare(&mut self, threads: usize) -> Result<(), Error> {
        let threads = match threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            threads => threads,
        };
        self.forget_parents();
        self.process = std::process::id();
        if threads == 1 {
            self.pool = None;
        } else if self.count() != threads {
            let pool = ThreadPoolBuilder::new().num_threads(threads - 1).build();
            self.pool = Some(pool.map_err(|_| Error::Threads)?);
        }
        Ok(())
    }

    /// In a fork, what dropping its parent's threads locks one of them may have held.
    fn forget_parents(&mut self) {
        if self.process != std::process::id() {
            std::mem::forget(self.pool.take());
        }
    }

    pub fn count(&self) -> usize {
        1 + self.pool.as_ref().map_or(0, ThreadPool::current_num_threads)
    }

    /// Calls `work(worker, parts)` once on every thread, with the parts that fall to it, as it asks for them.
    pub fn share<T: Send>(
        &self,
        parts: impl Iterator<Item = T> + Send,
        work: impl Fn(usize, &mut dyn Iterator<Item = T>) + Sync,
    ) {
        let parts = Mutex::new(parts);
        let next = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
        self.for_each(self.count(), |worker, _| work(worker, &mut std::iter::from_fn(next)));
    }

    /// As [`Workers::share`], of work that can fail: tells whether some did.
    pub fn try_share<T: Send>(
        &self,
        parts: impl Iterator<Item = T> + Send,
        work: impl Fn(usize, &mut dyn Iterator<Item = T>) -> Result<(), Error> + Sync,
    ) -> Result<(), Error> {
        let failed = Mutex::new(Ok(()));
        self.share(parts, |worker, parts| {
            let done = work(worker, parts);
            if done.is_err() {
                *failed.lock().unwrap_or_else(PoisonError::into_inner) = done;
            }
        });
        failed.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls `work` with every part.
    pub fn each<T: Send>(&self, parts: impl Iterator<Item = T> + Send, work: impl Fn(T) + Sync) {
        self.share(parts, |_, parts| parts.for_each(&work));
    }

    /// Calls `work(worker, item)` for every item; no two calls run at once with the same worker.
    pub fn for_each(&self, items: usize, work: impl Fn(usize, usize) + Sync) {
        let Some(pool) = &self.pool else { return (0..items).for_each(|item| work(0, item)) };
        let next = AtomicUsize::new(0);
        let run = |worker: usize| {
            loop {
                let item = next.fetch_add(1, Ordering::Relaxed);
                if item >= items {
                    break;
                }
                work(worker, item);
            }
        };
        // The calling thread works too: schedulers tend to wake others on the core of one that goes to sleep.
        pool.in_place_scope(|scope| {
            let run = &run;
            for worker in 1..self.count() {
                scope.spawn(move |_| run(worker));
            }
            run(0);
        });
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.forget_parents();
    }
}
