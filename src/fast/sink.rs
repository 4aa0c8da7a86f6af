//! Where a tile's normals go: to every pixel, or to the places of the pixels that indices list.

use std::ops::Range;

use super::estimates::Estimates;
use super::lanes::{Bits, LANES, all};
use crate::Error;
use crate::cloud::Normals;
use crate::memory::refill;
use crate::output::Output;
use crate::simd::Simd;

/// The output of one computation.
pub(crate) enum Sink<'a> {
    /// Pixel (x, y) of the normals.
    All(&'a Normals<'a>),
    /// The elements that belong to a pixel; several may.
    Listed {
        normals: &'a Normals<'a>,
        /// (pixel, element), in the order of pixels.
        listed: &'a [(u32, u32)],
        width: usize,
    },
}

impl<'a> Sink<'a> {
    /// The sink of an image's normals; `listed` is room for those that are listed.
    pub fn new(
        Output { normals, indices }: Output<'a>,
        width: usize,
        listed: &'a mut Vec<(u32, u32)>,
    ) -> Result<Self, Error> {
        let Some(indices) = indices else { return Ok(Sink::All(normals)) };
        refill(listed, indices.iter().enumerate().map(|(at, index)| (*index as u32, at as u32)))?;
        listed.sort_unstable();
        Ok(Sink::Listed { normals, listed, width })
    }

    /// Writes these `lanes` of some estimates, for the pixels from `(x, y)` on. Row by row, `columns` are written.
    ///
    /// # Safety
    /// The pixels are inside the image, and no other thread writes them; the processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn write<S: Simd>(
        &self,
        (x, y): (usize, usize),
        lanes: u32,
        estimates: &Estimates,
        columns: &Range<usize>,
    ) {
        const { assert!(S::LANES == LANES) };
        let Estimates { normal: [nx, ny, nz], curvature } = estimates;
        let normal = |lane: usize| [nx[lane], ny[lane], nz[lane]];
        match self {
            // SAFETY: as the caller's.
            Sink::All(normals) => unsafe {
                if lanes != 0 {
                    normals.prefetch((x, y), LANES, columns);
                }
                if lanes == all(LANES) {
                    let (nx, ny) = (S::load(nx.as_ptr()), S::load(ny.as_ptr()));
                    let (nz, curvature) = (S::load(nz.as_ptr()), S::load(curvature.as_ptr()));
                    normals.write_lanes::<S>(x, y, [nx, ny, nz, curvature]);
                } else {
                    for lane in Bits(lanes) {
                        normals.write(x + lane, y, normal(lane), curvature[lane]);
                    }
                }
            },
            Sink::Listed { normals, listed, width } => {
                let first = y * width + x;
                let start = listed.partition_point(|(pixel, _)| (*pixel as usize) < first);
                let rest = listed[start..].iter().map(|(pixel, at)| (*pixel as usize - first, at));
                for (lane, element) in rest.take_while(|(lane, _)| *lane < LANES) {
                    if lanes >> lane & 1 == 1 {
                        let normal = normal(lane);
                        // SAFETY: as the caller's; every listed element is one of the normals.
                        unsafe { normals.write(*element as usize, 0, normal, curvature[lane]) };
                    }
                }
            }
        }
    }
}
