//! Writes what both passes found for a row of pixels, fast: the plain form is `SecondPass::estimate`.

use crate::cloud::Normals;
use crate::fast::arithmetic::Floats;
use crate::fast::lanes::LANES;
use crate::fast::tile::{Bits, turned};
use crate::options::Options;
use crate::paper::{Cloud, SecondPass};
use crate::simd::{Along, load_by_fours};

/// A row of pixels that is written.
pub(super) struct FoundRow<'a> {
    pub cloud: &'a Cloud,
    pub options: &'a Options,
    pub second_pass: &'a SecondPass,
    pub normals: &'a Normals<'a>,
    pub y: usize,
}

impl FoundRow<'_> {
    /// Writes the row.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`; the row is inside the normals, and no other thread writes it.
    #[inline(always)]
    pub unsafe fn write<S: Along>(&self) {
        let &FoundRow { cloud, options, second_pass, normals, y } = self;
        let first = y * cloud.width;
        let whole = cloud.width / S::LANES * S::LANES;
        for x in (0..whole).step_by(S::LANES) {
            let at = first + x;
            let mut found = [[0.0; 4].as_ptr(); LANES];
            for (lane, found) in found[..S::LANES].iter_mut().enumerate() {
                *found = second_pass.found(at + lane).as_ptr();
            }
            // SAFETY: as the caller's; an estimate is four floats, and so many points are there.
            unsafe {
                let [nx, ny, nz, curvature] = load_by_fours::<S>(|lane| found[lane]);
                // Read by fours of floats.
                let points = cloud.points[at..][..=S::LANES].as_ptr().cast();
                let [px, py, pz] = S::load_points(points, size_of::<[f32; 3]>());
                let normal = [Floats(nx), Floats(ny), Floats(nz)];
                let [nx, ny, nz] =
                    turned::<S>(normal, [Floats(px), Floats(py), Floats(pz)], options.viewpoint);
                normals.write_lanes::<S>(x, y, [nx.0, ny.0, nz.0, curvature]);
                // A window may have no normal.
                let there = S::and_not(S::eq(nx.0, nx.0), S::eq(px, px));
                for lane in Bits(S::bits(there)) {
                    self.write_one(x + lane);
                }
            }
        }
        for x in whole..cloud.width {
            // SAFETY: as the caller's.
            unsafe { self.write_one(x) };
        }
    }

    /// # Safety
    /// As [`FoundRow::write`].
    #[inline(always)]
    unsafe fn write_one(&self, x: usize) {
        let &FoundRow { cloud, options, second_pass, normals, y } = self;
        let found = second_pass.estimate(cloud, options, cloud.index(x, y));
        // SAFETY: as the caller's.
        unsafe { normals.write(x, y, found.normal, found.curvature) };
    }
}
