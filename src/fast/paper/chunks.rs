//! The rows of the image in chunks, each for one sweep.

use std::ops::Range;

use crate::Error;
use crate::fast::tiling::reached;
use crate::memory::refill;

/// Image rows that are swept together, with the rows around them whose depth changes reach them.
#[derive(Clone, Debug)]
pub(super) struct Chunk {
    pub own: Range<usize>,
    pub swept: Range<usize>,
    /// Where the swept rows start among the rows of the map.
    pub start: usize,
}

/// The rows shared out to `count` sweeps. A depth change more than `reach` away decides no window, so each sweep can
/// start and end that far around its own rows.
pub(super) fn share_out(
    height: usize,
    count: usize,
    reach: usize,
    chunks: &mut Vec<Chunk>,
) -> Result<(), Error> {
    let per_chunk = height.div_ceil(count);
    let per_chunk = if per_chunk < 2 * reach { height } else { per_chunk };
    let mut start = 0;
    let first_rows = (0..height).step_by(per_chunk);
    let chunk = |first: usize| {
        let own = first..(first + per_chunk).min(height);
        let swept = reached(&own, reach, height);
        start += swept.len();
        Chunk { own, start: start - swept.len(), swept }
    };
    refill(chunks, first_rows.map(chunk))
}

/// Which of the map's rows the image's row `y` is.
pub(super) fn place(chunks: &[Chunk], y: usize) -> usize {
    // All chunks but the last have as many own rows.
    let chunk = &chunks[y / chunks[0].own.len()];
    chunk.start + y - chunk.swept.start
}
