//! Where normals go: to the pixels of an image, or to the elements of a list.

use crate::cloud::Normals;
use crate::methods::Estimate;
use crate::threads::Workers;

/// The normals of all pixels, or of those that `indices` list, element by element.
#[derive(Clone, Copy)]
pub(crate) struct Output<'a> {
    pub normals: &'a Normals<'a>,
    pub indices: Option<&'a [i32]>,
}

impl Output<'_> {
    /// Writes the estimates of the pixels for which there is one: `estimate` gives those of normals, by column and row, and of
    /// the pixels that they belong to.
    pub fn write(
        &self,
        workers: &Workers,
        estimate: impl Fn((usize, usize), usize) -> Option<Estimate> + Sync,
    ) {
        let &Output { normals, indices } = self;
        let put = |x: usize, y: usize, pixel: usize| {
            if let Some(Estimate { normal, curvature }) = estimate((x, y), pixel) {
                // SAFETY: there is an element for every index, or for every pixel, which falls to one thread.
                unsafe { normals.write(x, y, normal, curvature) };
            }
        };
        match indices {
            None => workers.for_each(normals.height(), |_, y| {
                (0..normals.width()).for_each(|x| put(x, y, y * normals.width() + x));
            }),
            Some(indices) => {
                indices.iter().enumerate().for_each(|(k, index)| put(k, 0, *index as usize));
            }
        }
    }

    /// Writes NaN everywhere: no output is partial.
    pub fn write_none(&self) {
        self.write(&Workers::default(), |_, _| Some(Estimate::NONE));
    }
}
