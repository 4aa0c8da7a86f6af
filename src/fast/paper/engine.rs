//! What the second pass builds on, fast.

use super::{Job, Own, choices, compute_of_blocks, even_windows, find_depth_changes, radii};
use crate::Error;
use crate::cloud::Normals;
use crate::fast::{Scratch, sides};
use crate::memory::resize;
use crate::methods::Estimate;
use crate::options::{Method, Options, Semantics};
use crate::paper::{Asked, Blocks, Cloud, DepthChanges, Engine, EvenWindows, Marks, Windows};
use crate::threads::Workers;

/// The engine of one computation.
pub(crate) struct FastEngine<'a> {
    pub job: Job<'a>,
    pub scratch: &'a mut Scratch,
    /// Where the estimates of the pixels that are not concerned are written along with even windows, of all or of those that
    /// indices list.
    pub own: Option<(Option<&'a [i32]>, &'a Normals<'a>)>,
}

impl Engine for FastEngine<'_> {
    fn workers(&self) -> &Workers {
        self.scratch.workers()
    }

    fn sizes(&mut self, sizes: &mut Vec<f32>) -> Result<(), Error> {
        let FastEngine { job, scratch, .. } = self;
        match job.options.semantics {
            Semantics::Pcl => {
                job.depths(scratch)?;
                sides(job.isa, job.points, job.options, sizes, scratch)
            }
            Semantics::Paper => radii(job, sizes, scratch),
        }
    }

    fn find_depth_changes(&self, changes: &mut DepthChanges, cloud: &Cloud) -> Result<(), Error> {
        find_depth_changes(&self.job, changes, cloud, self.scratch.workers())
    }

    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        concerned: &Marks,
        found: &mut Windows,
    ) -> Result<(), Error> {
        let method = Method::CovarianceMatrix;
        let Windows { even, of_even, .. } = found;
        let of_even = normals_of(of_even, &asked.blocks)?;
        let own = self.own.map(|(indices, normals)| Own { concerned, indices, normals });
        let of_even = (self.job.options.method == method).then_some(&of_even);
        // CM's sums are what even windows are made from.
        let options = &Options { method, ..self.job.options.clone() };
        let job = Job { options, ..self.job };
        even_windows(&job, (cloud, asked), even, (of_even, own), self.scratch)
    }

    fn choices(&mut self, even: &EvenWindows, found: &mut [u32]) {
        choices(self.job.isa, even, found, self.scratch);
    }

    fn of_blocks(
        &mut self,
        blocks: &Blocks,
        radii: &[u32],
        estimates: &mut Vec<[f32; 4]>,
    ) -> Result<(), Error> {
        let normals = normals_of(estimates, blocks)?;
        compute_of_blocks(&self.job, radii, &normals, self.scratch)
    }
}

/// A view of the blocks' estimates.
fn normals_of<'a>(estimates: &'a mut Vec<[f32; 4]>, blocks: &Blocks) -> Result<Normals<'a>, Error> {
    resize(estimates, blocks.count(), Estimate::NONE.into())?;
    let data = estimates.as_flattened_mut();
    Normals::interleaved(data, blocks.across, blocks.down, 4, 0, Some(3))
}
