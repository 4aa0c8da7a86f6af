//! Rectangles of pixels inside the image.

use std::ops::Range;

/// Columns and rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Rect {
    pub x: Range<usize>,
    pub y: Range<usize>,
}

/// Whether all pixels are on one line of the image.
pub(crate) fn are_in_line(mut pixels: impl Iterator<Item = (usize, usize)>) -> bool {
    let Some((x, y)) = pixels.next() else { return true };
    let mut ways = pixels.map(|to| [to.0 as isize - x as isize, to.1 as isize - y as isize]);
    let Some([along, down]) = ways.next() else { return true };
    ways.all(|[dx, dy]| dx * down == dy * along)
}

impl Rect {
    /// The pixels at most `reach` columns and rows away from one, inside an image of this size.
    pub fn around((x, y): (usize, usize), reach: usize, (width, height): (usize, usize)) -> Rect {
        let clip = |at: usize, size: usize| at.saturating_sub(reach)..(at + reach + 1).min(size);
        Rect { x: clip(x, width), y: clip(y, height) }
    }

    pub fn pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let Rect { x: columns, y: rows } = self.clone();
        rows.flat_map(move |y| columns.clone().map(move |x| (x, y)))
    }

    /// Without the outermost rows and columns.
    pub fn inner(&self) -> Rect {
        let inner = |range: &Range<usize>| range.start + 1..(range.end - 1).max(range.start + 1);
        Rect { x: inner(&self.x), y: inner(&self.y) }
    }

    /// The column and the row in the middle, the first of two.
    pub fn middle(&self) -> (usize, usize) {
        let middle = |range: &Range<usize>| (range.start + range.end - 1) / 2;
        (middle(&self.x), middle(&self.y))
    }

    /// The number of pixels.
    pub fn area(&self) -> usize {
        self.x.len() * self.y.len()
    }
}
