//! Work on all cores.

use std::sync::Mutex;
use std::thread;

/// The results of `work` on every item, in the items' order.
pub fn map<T: Send, R: Send>(items: Vec<T>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
    let results = Mutex::new(items.iter().map(|_| None).collect::<Vec<Option<R>>>());
    let queue = Mutex::new(items.into_iter().enumerate());
    let next = || queue.lock().expect("no panic while it is locked").next();
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some((at, item)) = next() {
                    let result = work(item);
                    results.lock().expect("no panic while it is locked")[at] = Some(result);
                }
            });
        }
    });
    let results = results.into_inner().expect("no panic while it was locked");
    results.into_iter().map(|result| result.expect("every item was worked on")).collect()
}
