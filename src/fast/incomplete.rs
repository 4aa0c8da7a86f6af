//! Where points have a finite z but not a finite x or y. No depth change tells of them, so that windows may hold them: sums
//! go wrong there.

use super::buffer::Buffer;
use super::lanes::Bits;
use super::pair::Pair;
use super::planes::{Frame, window_reach};
use crate::Error;
use crate::cloud::Points;

/// Those of a tile's rows.
#[derive(Debug, Default)]
pub(crate) struct Incomplete {
    /// By column of the frame: the row behind the last one that has such a point; 0 for none.
    behind: Buffer<u32>,
    /// Before each column, and behind the last: how many have one in the rows that windows of the row aimed at reach.
    counts: Buffer<u32>,
    /// The row behind the last one that has some; 0 for none.
    end: usize,
}

impl Incomplete {
    /// Makes room for frames that are no larger.
    pub fn reserve(&mut self, frame: &Frame) -> Result<(), Error> {
        self.behind.grow(frame.columns.len())?;
        self.counts.grow(frame.columns.len() + 1)
    }

    pub fn size(&self) -> usize {
        self.behind.size() + self.counts.size()
    }

    /// There are none so far.
    pub fn start(&mut self) {
        if self.end > 0 {
            self.behind.fill(0);
        }
        self.end = 0;
    }

    /// Notes those of row `y` whose depths' magnitudes are between these.
    #[cold]
    pub fn note(&mut self, points: &Points, frame: &Frame, y: usize, [least, largest]: [f32; 2]) {
        for (x, behind) in frame.columns.clone().zip(self.behind.iter_mut()) {
            let point = points.at(x, y);
            let depth = point[2].abs();
            if least < depth && depth < largest && !(point[0].is_finite() && point[1].is_finite()) {
                *behind = y as u32 + 1;
            }
        }
        self.end = y + 1;
    }

    /// Aims at the windows around the pixels of row `y`, which reach so many rows up; whether some may hold one.
    #[inline(always)]
    pub fn aim(&mut self, frame: &Frame, y: usize, before: usize) -> bool {
        let may_hold_one = reaches(self.end, y, before);
        if may_hold_one {
            self.count(frame, y, before);
        }
        may_hold_one
    }

    #[cold]
    fn count(&mut self, frame: &Frame, y: usize, before: usize) {
        let behind = &self.behind[..frame.columns.len()];
        let mut count = 0;
        self.counts[0] = 0;
        for (behind, to) in behind.iter().zip(&mut self.counts[1..]) {
            count += u32::from(reaches(*behind as usize, y, before));
            *to = count;
        }
    }

    /// The lanes of a pair of the row aimed at whose windows, and the pixels around them, may hold one.
    #[cold]
    pub fn in_windows(&self, frame: &Frame, pair: &Pair) -> u32 {
        let column =
            |x: usize| x.clamp(frame.columns.start, frame.columns.end) - frame.columns.start;
        Bits(pair.windows).which(|lane| {
            let ((x, _), side) = pair.window(lane);
            let (before, after) = window_reach(side);
            self.counts[column(x.saturating_sub(before))] < self.counts[column(x + after + 1)]
        })
    }
}

/// Whether so many rows before row `y` reach the one before `behind`, if there is one.
#[inline(always)]
fn reaches(behind: usize, y: usize, before: usize) -> bool {
    behind > 0 && y < behind + before
}
