//! Work shared out among threads. Items are fixed by the frame, not by the number of threads, so results are too.

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::Error;

/// The calling thread alone, or a pool of threads of its own that lives until another number is asked for.
#[derive(Debug, Default)]
pub(crate) struct Workers {
    pool: Option<ThreadPool>,
}

impl Workers {
    /// Makes `threads` workers ready; 0 takes one per core.
    pub fn prepare(&mut self, threads: usize) -> Result<(), Error> {
        let threads = match threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            threads => threads,
        };
        if threads == 1 {
            self.pool = None;
        } else if self.count() != threads {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            self.pool = Some(pool.map_err(|_| Error::Threads)?);
        }
        Ok(())
    }

    pub fn count(&self) -> usize {
        self.pool.as_ref().map_or(1, ThreadPool::current_num_threads)
    }

    /// Calls `work(worker, item)` for every item; no two calls run at once with the same worker.
    pub fn for_each(&self, items: usize, work: impl Fn(usize, usize) + Sync) {
        match &self.pool {
            None => (0..items).for_each(|item| work(0, item)),
            Some(pool) => pool.install(|| {
                (0..items).into_par_iter().with_max_len(1).for_each(|item| {
                    work(rayon::current_thread_index().unwrap_or(0), item);
                });
            }),
        }
    }
}
