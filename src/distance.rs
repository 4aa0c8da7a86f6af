//! Step 2: the distance transform (the paper's T): how far the nearest depth change is, in pixels.
//!
//! PCL's two chamfer passes (after Borgefors 1986) with weights 1 and 1.4, every value a chain of f32 additions.
//! Their order and their treatment of the image's edges decide windows, so both are kept to the bit.

use crate::Error;
use crate::memory::table;

pub(crate) const STRAIGHT: f32 = 1.0;
pub(crate) const DIAGONAL: f32 = 1.4;

/// The value of a pixel that no depth change reaches.
pub(crate) fn far(width: usize, height: usize) -> f32 {
    (width + height) as f32
}

/// The distance map of a depth change map.
///
/// As PCL, the forward pass leaves row 0 and column 0 as they are, the backward pass the last row and column,
/// and at the row's ends the diagonal neighbour outside the image is the other end of the current row.
pub(crate) fn distance_map(
    depth_changes: &[bool],
    width: usize,
    height: usize,
) -> Result<Vec<f32>, Error> {
    let far = far(width, height);
    let mut map = table(depth_changes.iter().map(|&change| if change { 0.0 } else { far }))?;
    let nearer = |map: &mut [f32], at: usize, neighbours: [usize; 4]| {
        for (i, neighbour) in neighbours.into_iter().enumerate() {
            let step = if i < 2 { STRAIGHT } else { DIAGONAL };
            map[at] = map[at].min(map[neighbour] + step);
        }
    };
    for y in 1..height {
        for x in 1..width {
            let at = y * width + x;
            nearer(&mut map, at, [at - 1, at - width, at - width - 1, at - width + 1]);
        }
    }
    for y in (0..height - 1).rev() {
        for x in (0..width - 1).rev() {
            let at = y * width + x;
            nearer(&mut map, at, [at + 1, at + width, at + width + 1, at + width - 1]);
        }
    }
    Ok(map)
}
