//! What the second pass builds on, fast.

use super::even_windows::Even;
use super::{choices, depth_changes};
use crate::Error;
use crate::fast::paths::{self, Task};
use crate::fast::{Job, Parts, Scratch, lock, sides};
use crate::memory::resize;
use crate::methods::Estimate;
use crate::options::{Method, Options, Semantics};
use crate::output::Output;
use crate::paper::{
    Asked, BLOCK, Cloud, DepthChanges, Engine, EvenWindow, EvenWindows, Marks, Windows,
};
use crate::simd::Groups;
use crate::threads::Workers;

/// The engine of one computation.
pub(crate) struct FastEngine<'a> {
    pub job: Job<'a>,
    pub scratch: &'a mut Scratch,
    /// Where the estimates of the pixels that are not concerned are written along with even windows.
    pub own: Option<Output<'a>>,
}

impl Engine for FastEngine<'_> {
    fn workers(&self) -> &Workers {
        self.scratch.workers()
    }

    fn find_sizes(&mut self) -> Result<(), Error> {
        let FastEngine { job, scratch, .. } = self;
        match job.options.semantics {
            Semantics::Pcl => sides(job, scratch),
            Semantics::Paper => job.radii(scratch),
        }
    }

    fn sizes(&self, y: usize) -> &[f32] {
        self.job.sizes(self.scratch, y)
    }

    fn find_depth_changes(&self, changes: &mut DepthChanges, cloud: &Cloud) -> Result<(), Error> {
        let Job { isa, options, .. } = self.job;
        changes.find(cloud, options, self.workers(), |depths, marks| {
            // SAFETY: the processor has the instruction set.
            unsafe { paths::run(isa, ChangesTask { depths, options, marks }) }
        })
    }

    /// Afterwards there is room for the choices.
    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        concerned: &Marks,
        found: &mut Windows,
    ) -> Result<(), Error> {
        let &mut FastEngine { job, ref mut scratch, own } = self;
        for scratch in &scratch.each[..scratch.workers.count()] {
            lock(scratch).paper.choices.reserve(cloud.width, asked.limit)?;
        }
        let blocks = asked.blocks.count();
        resize(&mut found.even, blocks, EvenWindow::default())?;
        resize(&mut found.of_even, blocks, Estimate::NONE.into())?;
        let largest = (0..blocks).map(|block| asked.largest(block)).max().unwrap_or(0) as usize;
        let windows = Parts(found.even.as_mut_ptr());
        let estimates = Parts(found.of_even.as_mut_ptr());
        let even = Even { cloud, asked, windows, estimates };
        let own = own.map(|output| (output, concerned));
        // CM's sums are what even windows are made from.
        let method = Method::CovarianceMatrix;
        let options = &Options { method, ..job.options.clone() };
        Job { options, ..job }.even_tiles(scratch, &even, own, largest)
    }

    fn choices(&mut self, even: &EvenWindows, found: &mut [u32]) {
        let Scratch { workers, each, .. } = &*self.scratch;
        let isa = self.job.isa;
        let rows = found.chunks_mut(BLOCK * even.cloud.width).enumerate();
        workers.share(rows, |worker, rows| {
            let scratch = &mut lock(&each[worker]).paper.choices;
            // SAFETY: the processor has the instruction set.
            unsafe { paths::run(isa, ChoicesTask { even, rows, scratch }) }
        });
    }
}

/// The depth changes of a row.
struct ChangesTask<'a> {
    depths: [&'a [f32]; 2],
    options: &'a Options,
    marks: [&'a mut [u64]; 2],
}

impl Task for ChangesTask<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Groups>(self) {
        let ChangesTask { depths, options, marks } = self;
        // SAFETY: as the caller's.
        unsafe { depth_changes::between::<S::Widest>(depths, options, marks) }
    }
}

/// The choices of the pixels of some rows of blocks.
struct ChoicesTask<'a, 'c> {
    even: &'a EvenWindows<'a>,
    rows: &'a mut dyn Iterator<Item = (usize, &'c mut [u32])>,
    scratch: &'a mut choices::Scratch,
}

impl Task for ChoicesTask<'_, '_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Groups>(self) {
        // SAFETY: as the caller's.
        unsafe { choices::rows::<S>(self.even, self.rows, self.scratch) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Points;
    use crate::isa::Isa;

    #[test]
    fn depth_changes_are_those_of_the_plain_form() {
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            for (width, height) in [(1, 1), (1, 5), (16, 3), (17, 4), (64, 9), (65, 9), (128, 20)] {
                // Steps, and gaps of all lengths in rows and columns.
                let value = |i: usize| match (i * 7919 + i / 31) % 23 {
                    0..6 => f32::NAN,
                    value => 1.0 + (value / 9) as f32 * 0.2 + (i % 7) as f32 * 0.001,
                };
                let z: Vec<_> = (0..width * height).map(value).collect();
                let points = Points::planes([&z, &z, &z], width, height, 0).unwrap();
                let mut options = Options::default();
                for semantics in Semantics::ALL {
                    options.semantics = semantics;
                    let cloud = Cloud::new(&points, &options).unwrap();
                    let (points, options, scratch) = (&points, &options, &mut Scratch::default());
                    let engine =
                        FastEngine { job: Job { isa, points, options }, scratch, own: None };
                    let [mut found, mut expected] = [(); 2].map(|()| DepthChanges::default());
                    engine.find_depth_changes(&mut found, &cloud).unwrap();
                    let workers = engine.workers();
                    crate::paper::find_depth_changes(&mut expected, &cloud, options, workers)
                        .unwrap();
                    let [found, expected] = [found, expected].map(|changes| format!("{changes:?}"));
                    assert_eq!(found, expected, "{isa:?} {semantics:?} {width} x {height}");
                }
            }
        }
    }
}
