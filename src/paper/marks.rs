//! Marks of an image's pixels, a bit each: what few pixels have is found by words, and many are marked at a time.

use std::iter::repeat_n;

use crate::Error;
use crate::memory::{bytes, refill};

/// Pixels of a word.
pub(crate) const WORD: usize = u64::BITS as usize;

/// The marks, row by row: in each, those of the first columns are the lowest bits of the first word. Bits behind the last
/// column mean nothing.
#[derive(Debug, Default)]
pub(crate) struct Marks {
    /// Words of a row.
    stride: usize,
    words: Vec<u64>,
}

impl Marks {
    /// Becomes those of an image of this size in which no pixel is marked.
    pub fn clear(&mut self, (width, height): (usize, usize)) -> Result<(), Error> {
        self.stride = width.div_ceil(WORD);
        refill(&mut self.words, repeat_n(0, self.stride * height))
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        bytes(&self.words)
    }

    /// Row `y`.
    #[inline]
    pub fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.stride..][..self.stride]
    }

    /// Words of a row.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// All rows.
    pub fn rows(&mut self) -> impl Iterator<Item = &mut [u64]> + Send {
        self.bands(1)
    }

    /// All rows, so many or those that are left at a time.
    pub fn bands(&mut self, rows: usize) -> impl Iterator<Item = &mut [u64]> + Send {
        self.words.chunks_mut(rows * self.stride)
    }

    /// How many there are, if bits behind the last column are 0.
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    pub fn has(&self, (x, y): (usize, usize)) -> bool {
        from(self.row(y), x) & 1 != 0
    }
}

/// The marks of a row's pixels from column `x` to the end of the word, from the lowest bit on.
#[inline(always)]
pub(crate) fn from(row: &[u64], x: usize) -> u64 {
    row[x / WORD] >> (x % WORD)
}

/// Marks the pixels of a row from column `x` on whose bits are set; they are in one word.
#[inline(always)]
pub(crate) fn mark(row: &mut [u64], x: usize, bits: u64) {
    row[x / WORD] |= bits << (x % WORD);
}

/// The marks of a word's pixels, or of those that there are.
#[inline(always)]
pub(crate) fn word_of(marks: impl Iterator<Item = bool>) -> u64 {
    // Marked together first, a byte each.
    let mut bytes = [[0; u8::BITS as usize]; WORD / u8::BITS as usize];
    for (to, is_marked) in bytes.as_flattened_mut().iter_mut().zip(marks) {
        *to = is_marked.into();
    }
    // The i-th of eight bytes times 2^(56 - 7 i) is bit i of the highest byte, and no other.
    let bits = |eight: [u8; 8]| u64::from_le_bytes(eight).wrapping_mul(0x0102_0408_1020_4080) >> 56;
    bytes.into_iter().rev().fold(0, |word, eight| word << u8::BITS | bits(eight))
}

/// The columns that are marked in a row.
pub(crate) fn columns(row: &[u64]) -> impl Iterator<Item = usize> {
    let words = row.iter().zip((0..).step_by(WORD));
    words.flat_map(|(word, first)| bits(*word).map(move |x| first + x))
}

/// The bits that are set in a word.
pub(crate) fn bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lowest = word.trailing_zeros() as usize;
        word &= word.wrapping_sub(1);
        (lowest < WORD).then_some(lowest)
    })
}

/// The marks of a word's pixels, of those before them and of those behind them.
#[inline(always)]
pub(crate) fn around(row: &[u64], word: usize) -> [u64; 3] {
    let own = row[word];
    let before = if word > 0 { row[word - 1] } else { 0 };
    let behind = row.get(word + 1).copied().unwrap_or(0);
    [own, own << 1 | before >> (WORD - 1), own >> 1 | behind << (WORD - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_have_a_bit_for_each_mark() {
        for count in [0, 1, 7, 8, 9, 63, 64] {
            for seed in 0..200_u64 {
                let random = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
                let word =
                    random.rotate_left(seed as u32) & u64::MAX.checked_shr(64 - count).unwrap_or(0);
                assert_eq!(word_of((0..count).map(|i| word >> i & 1 != 0)), word);
            }
        }
    }
}
