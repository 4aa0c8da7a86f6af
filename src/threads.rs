//! Work shared out among threads. Items are fixed by the frame, not by the number of threads, so results are too.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::Error;
use crate::cores::Cores;

/// The calling thread, and a pool of further threads that lives until another number is asked for.
#[derive(Debug, Default)]
pub(crate) struct Workers {
    pool: Option<ThreadPool>,
    /// The pool's threads.
    threads: Vec<JoinHandle<()>>,
    /// Where these run.
    cores: Option<Arc<Cores>>,
    /// The process that has them: a fork of it has none.
    process: u32,
}

impl Workers {
    /// Makes `threads` workers ready; 0 takes one per processor.
    pub fn prepare(&mut self, threads: usize) -> Result<(), Error> {
        let threads = match threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            threads => threads,
        };
        if self.process != std::process::id() || self.count() != threads {
            self.end();
        }
        if threads > 1 && self.pool.is_none() {
            self.process = std::process::id();
            let cores = Arc::new(Cores::of(threads - 1)?);
            let handles = &mut self.threads;
            let pool = ThreadPoolBuilder::new().num_threads(threads - 1).spawn_handler(|thread| {
                let cores = Arc::clone(&cores);
                let work = move || {
                    cores.join();
                    thread.run();
                };
                handles.push(std::thread::Builder::new().spawn(work)?);
                Ok(())
            });
            match pool.build() {
                Ok(pool) => (self.pool, self.cores) = (Some(pool), Some(cores)),
                Err(_) => {
                    self.end();
                    return Err(Error::Threads);
                }
            }
        }
        if let Some(cores) = &self.cores {
            cores.keep_off_this_one(threads);
        }
        Ok(())
    }

    /// Ends the threads, and waits for that: their code may be unloaded next.
    fn end(&mut self) {
        self.cores = None;
        if self.process != std::process::id() {
            // In a fork the pool is not dropped: that takes locks which one of the parent's threads may have held.
            std::mem::forget(self.pool.take());
            std::mem::forget(std::mem::take(&mut self.threads));
            return;
        }
        self.pool = None;
        for thread in self.threads.drain(..) {
            // One that panicked has ended too.
            let _ = thread.join();
        }
    }

    pub fn count(&self) -> usize {
        1 + self.pool.as_ref().map_or(0, ThreadPool::current_num_threads)
    }

    /// Calls `work(worker, parts)` as often as there are threads, mostly once on each; each call gets the parts that fall to
    /// it, as it asks for them.
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
        let run_all = || {
            pool.in_place_scope(|scope| {
                let run = &run;
                for worker in 1..self.count() {
                    scope.spawn(move |_| run(worker));
                }
                run(0);
            });
        };
        if rayon::current_thread_index().is_none() {
            return run_all();
        }
        // The calling thread is one of a pool of the caller's. Waiting itself, it would meanwhile do other work of that pool,
        // which may want what is held for this one, or compute normals with the same estimator.
        std::thread::scope(|scope| {
            match std::thread::Builder::new().spawn_scoped(scope, run_all) {
                Ok(waiting) => waiting.join().unwrap_or_else(|panic| resume_unwind(panic)),
                Err(_) => (0..items).for_each(|item| work(0, item)),
            }
        });
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.end();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    #[test]
    fn as_many_work_at_once_as_were_asked_for() {
        let mut workers = Workers::default();
        let all = std::thread::available_parallelism().unwrap().get();
        for (asked, count) in [(1, 1), (3, 3), (0, all), (2, 2), (1, 1), (5, 5)] {
            workers.prepare(asked).unwrap();
            assert_eq!(workers.count(), count);
            // None passes before all are there.
            let barrier = Barrier::new(count);
            workers.for_each(count, |worker, _| {
                assert!(worker < count);
                barrier.wait();
            });
        }
    }

    /// If there are enough; and others may put them elsewhere.
    #[cfg(target_os = "linux")]
    #[test]
    fn workers_keep_off_the_core_of_the_calling_thread() {
        use rustix::thread::{CpuSet, sched_getaffinity, sched_getcpu, sched_setaffinity};
        let all = sched_getaffinity(None).unwrap();
        let on_each = |workers: &Workers, work: &(dyn Fn() + Sync)| {
            let barrier = Barrier::new(workers.count());
            workers.for_each(workers.count(), |worker, _| {
                barrier.wait();
                if worker > 0 {
                    work();
                }
            });
        };
        let cores_of = |workers: &Workers| {
            let found = Mutex::new(CpuSet::new());
            on_each(workers, &|| *found.lock().unwrap() = sched_getaffinity(None).unwrap());
            found.into_inner().unwrap()
        };
        for asked in [2, 3, all.count() as usize + 1] {
            let mut workers = Workers::default();
            workers.prepare(asked).unwrap();
            // All have joined.
            on_each(&workers, &|| ());
            // The calling thread may be moved to another core meanwhile, but not always.
            let found = (0..1000).any(|_| {
                let here = sched_getcpu();
                workers.prepare(asked).unwrap();
                let has_stayed = sched_getcpu() == here;
                let mut expected = all;
                if asked <= all.count() as usize {
                    expected.unset(here);
                }
                has_stayed && cores_of(&workers) == expected
            });
            assert!(found, "{asked} of {all:?}");
            // As where the whole process is given just those cores.
            let left = cores_of(&workers);
            sched_setaffinity(None, &left).unwrap();
            for _ in 0..2 {
                workers.prepare(asked).unwrap();
                let found = cores_of(&workers);
                let is_left = |core: usize| left.is_set(core) || !found.is_set(core);
                assert!((0..CpuSet::MAX_CPU).all(is_left), "{asked}: {found:?} of {left:?}");
            }
            sched_setaffinity(None, &all).unwrap();
            let mut one = CpuSet::new();
            one.set((0..CpuSet::MAX_CPU).find(|core| all.is_set(*core)).unwrap());
            on_each(&workers, &|| sched_setaffinity(None, &one).unwrap());
            workers.prepare(asked).unwrap();
            assert_eq!(cores_of(&workers), one, "{asked} where others put them");
        }
    }
}
