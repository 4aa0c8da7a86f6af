//! Which points of a tile's rings are there, bit by bit along rows and down columns, so that the outermost ones of a
//! window's line are found without going over the missing ones.

use crate::Error;
use crate::fast::buffer::Buffer;
use crate::fast::lanes::LANES;
use crate::simd::Simd;

/// Bits of a word.
const WORD: usize = u32::BITS as usize;

/// The bits of the rows of a ring of points.
#[derive(Debug, Default)]
pub(crate) struct Presence {
    /// Row by row of a ring, of its columns.
    rows: Buffer<u32>,
    /// Of as many rows as a word has bits, column by column; these in a ring as well.
    columns: Buffer<u32>,
    size: Size,
}

/// Columns, margins included, and rows that a ring has room for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Size {
    columns: usize,
    /// A power of two, as it is what is left of row numbers' bits that counts.
    rows: usize,
}

impl Size {
    /// That of a ring of so many columns and rows.
    pub fn new(columns: usize, rows: usize) -> Self {
        Size { columns, rows: rows.next_power_of_two() }
    }

    /// Words of a row.
    #[inline(always)]
    fn words(&self) -> usize {
        self.columns.div_ceil(WORD)
    }

    /// Words of a column: those that the rows lie in, wherever they start; a power of two as well.
    #[inline(always)]
    fn blocks(&self) -> usize {
        (self.rows / WORD).max(1) * 2
    }

    /// Words of all rows or columns, of which there are more.
    pub fn room(&self) -> usize {
        (self.rows * self.words()).max(self.blocks() * self.columns)
    }
}

impl Presence {
    /// Bytes held.
    pub fn size(&self) -> usize {
        self.rows.size() + self.columns.size()
    }

    /// Makes room for so many words of rows, and of columns.
    pub fn reserve(&mut self, words: usize) -> Result<(), Error> {
        self.rows.grow(words)?;
        self.columns.grow(words)
    }

    /// Starts over with rings of this size; there is room.
    pub fn start(&mut self, size: Size) {
        self.size = size;
        self.columns[..size.blocks() * size.columns].fill(0);
    }

    /// Notes row `y`, where the points are whose weights are above 0; rows come in order.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`, and columns are a multiple of its lanes.
    #[inline(always)]
    pub unsafe fn push<S: Simd>(&mut self, weights: &[f32], y: usize) {
        let Size { columns, rows } = self.size;
        let (words, blocks) = (self.size.words(), self.size.blocks());
        let weights = &weights[..columns];
        let row = &mut self.rows[(y & (rows - 1)) * words..][..words];
        let block = ((y / WORD) & (blocks - 1)) * columns;
        let column = &mut self.columns[block..][..columns];
        let bit = [1_u32 << (y % WORD); LANES];
        let kept = [if y.is_multiple_of(WORD) { 0 } else { u32::MAX }; LANES];
        // SAFETY: as the caller's; lanes of floats are taken for words of bits.
        unsafe {
            let (bit, kept) = (S::load(bit.as_ptr().cast()), S::load(kept.as_ptr().cast()));
            let weights = weights.chunks(WORD).zip(column.chunks_mut(WORD));
            for (word, (weights, column)) in row.iter_mut().zip(weights) {
                *word = 0;
                for at in (0..weights.len()).step_by(S::LANES) {
                    let there = S::lt(S::splat(0.0), S::load(weights[at..].as_ptr()));
                    *word |= S::bits(there) << at;
                    let bits = column[at..].as_mut_ptr().cast();
                    S::store(bits, S::or(S::and(kept, S::load(bits)), S::and(there, bit)));
                }
            }
        }
    }

    /// The first and the last column, between two, of row `y` whose points are there.
    #[inline(always)]
    pub fn of_row(&self, y: usize, ends: [usize; 2]) -> Option<[usize; 2]> {
        let row = (y & (self.size.rows - 1)) * self.size.words();
        outermost(|word| self.rows[row + word], ends)
    }

    /// The first and the last row, between two, of a column whose points are there.
    #[inline(always)]
    pub fn of_column(&self, x: usize, ends: [usize; 2]) -> Option<[usize; 2]> {
        let Size { columns, .. } = self.size;
        let blocks = self.size.blocks();
        outermost(|word| self.columns[(word & (blocks - 1)) * columns + x], ends)
    }
}

/// The first and the last bit that is set between two.
#[inline(always)]
fn outermost(word: impl Fn(usize) -> u32, [first, last]: [usize; 2]) -> Option<[usize; 2]> {
    let mut start = first;
    let mut bits = word(start / WORD) >> (start % WORD);
    while bits == 0 {
        start = (start / WORD + 1) * WORD;
        if start > last {
            return None;
        }
        bits = word(start / WORD);
    }
    start += bits.trailing_zeros() as usize;
    if start > last {
        return None;
    }
    let mut end = last;
    let mut bits = word(end / WORD) << (WORD - 1 - end % WORD);
    while bits == 0 {
        end = end / WORD * WORD - 1;
        bits = word(end / WORD);
    }
    Some([start, end - bits.leading_zeros() as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::portable::Portable;

    /// Every line of every window of a ring, against the points one by one.
    #[test]
    fn finds_the_outermost_points() {
        let (columns, height, radius) = (80, 300, 40);
        let is_there =
            |x: usize, y: usize| (x * 7 + y * 13 + x * y).is_multiple_of(11) && x % 29 > 8;
        let size = Size::new(columns, 2 * radius + 3);
        let mut presence = Presence::default();
        presence.reserve(size.room()).unwrap();
        presence.start(size);
        for y in 0..height {
            let weights: Vec<f32> =
                (0..columns).map(|x| if is_there(x, y) { 1e-4 } else { 0.0 }).collect();
            // SAFETY: every processor has the portable form's instructions.
            unsafe { presence.push::<Portable>(&weights, y) };
            let top = y.saturating_sub(2 * radius);
            for (x, first) in (0..columns).map(|x| (x, x / 2)) {
                let mut row = (first..=x).filter(|x| is_there(*x, top));
                let expected = row.next().map(|first| [first, row.next_back().unwrap_or(first)]);
                assert_eq!(presence.of_row(top, [first, x]), expected);
                let mut column = (top..=y).filter(|y| is_there(x, *y));
                let expected =
                    column.next().map(|first| [first, column.next_back().unwrap_or(first)]);
                assert_eq!(presence.of_column(x, [top, y]), expected);
            }
        }
    }
}
