//! What the second pass builds on, fast.

use super::{Job, Own, choices, even_windows, find_depth_changes};
use crate::Error;
use crate::cloud::Normals;
use crate::fast::{Scratch, sides};
use crate::options::{Method, Options, Semantics};
use crate::paper::{Asked, Cloud, DepthChanges, Engine, EvenWindows, Marks, Windows};
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

    fn find_sizes(&mut self) -> Result<(), Error> {
        let FastEngine { job, scratch, .. } = self;
        match job.options.semantics {
            Semantics::Pcl => sides(job.isa, job.points, job.options, scratch),
            Semantics::Paper => job.radii(scratch),
        }
    }

    fn sizes(&self, y: usize) -> &[f32] {
        self.job.sizes(self.scratch, y)
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
        let own = self.own.map(|(indices, normals)| Own { concerned, indices, normals });
        // CM's sums are what even windows are made from.
        let method = Method::CovarianceMatrix;
        let options = &Options { method, ..self.job.options.clone() };
        let job = Job { options, ..self.job };
        even_windows(&job, (cloud, asked), found, own, self.scratch)
    }

    fn choices(&mut self, even: &EvenWindows, found: &mut [u32]) {
        choices(self.job.isa, even, found, self.scratch);
    }
}
