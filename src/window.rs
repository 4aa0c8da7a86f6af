//! Windows and what becomes of them at the border of the image.

use std::ops::Range;

use crate::cloud::Points;
use crate::options::{BorderPolicy, Options};
use crate::rect::Rect;

/// The image's size and what windows do at its border.
#[derive(Clone, Debug)]
pub(crate) struct Image {
    pub width: usize,
    pub height: usize,
    pub border_policy: BorderPolicy,
}

impl Image {
    pub fn of(points: &Points, options: &Options) -> Self {
        let (width, height, border_policy) =
            (points.width(), points.height(), options.border_policy);
        Image { width, height, border_policy }
    }

    /// The rectangles that make up a window which may cross the border, none empty, with their signs; a pixel in two of them
    /// counts twice, and one in a rectangle of sign -1 is taken away: mirroring does so to windows that start outside the
    /// image.
    ///
    /// With [`BorderPolicy::Ignore`] the window is clipped (PCL reads out of bounds there).
    pub fn rects(
        &self,
        start: (isize, isize),
        size: (usize, usize),
    ) -> impl Iterator<Item = (Rect, i32)> + Clone + use<> {
        let columns = fold(start.0, size.0, self.width, self.border_policy).map(in_order);
        let rows = fold(start.1, size.1, self.height, self.border_policy).map(in_order);
        // One by one: most are empty.
        (0..4).filter_map(move |k| {
            let ((x, along), (y, down)) = (&columns[k % 2], &rows[k / 2]);
            let is_empty = x.is_empty() || y.is_empty();
            (!is_empty).then(|| (Rect { x: x.clone(), y: y.clone() }, along * down))
        })
    }

    /// The part of a rectangle without the image's outermost rows and columns.
    pub fn inside_frame(&self, rect: &Rect) -> Rect {
        let clip = |range: &Range<usize>, size: usize| {
            range.start.max(1)..range.end.min(size.saturating_sub(1))
        };
        Rect { x: clip(&rect.x, self.width), y: clip(&rect.y, self.height) }
    }

    /// A pixel that may lie outside the image, brought back inside: mirrored as PCL does, or clamped.
    pub fn pixel(&self, x: isize, y: isize) -> (usize, usize) {
        (
            fold_pixel(x, self.width, self.border_policy),
            fold_pixel(y, self.height, self.border_policy),
        )
    }
}

/// An interval with its ends in order, and the sign of its length.
fn in_order(range: Range<usize>) -> (Range<usize>, i32) {
    if range.start > range.end { (range.end..range.start, -1) } else { (range, 1) }
}

/// The one or two intervals of `0..limit` that `start..start + size` becomes; the second may be empty.
///
/// Mirrored as PCL's `sumArea`: about index 0 at the near border, and without the last index at the far one. A
/// window that starts behind the last index (a right or lower half of AVERAGE_DEPTH_CHANGE) gives a first interval
/// whose ends are in reverse order: as in a difference of integral image values, its pixels count negatively.
/// What would still leave the image (a window larger than the image, where PCL reads out of bounds) is clipped.
fn fold(start: isize, size: usize, limit: usize, policy: BorderPolicy) -> [Range<usize>; 2] {
    let end = start + size as isize;
    let last = limit as isize - 1;
    let clip = |start: isize, end: isize| {
        start.clamp(0, limit as isize) as usize..end.clamp(0, limit as isize) as usize
    };
    match policy {
        BorderPolicy::Mirror if start < 0 => [clip(0, end), clip(0, -start)],
        BorderPolicy::Mirror if end > last => [clip(start, last), clip(2 * last + 1 - end, last)],
        _ => [clip(start, end), 0..0],
    }
}

/// One coordinate of a single pixel, mirrored as PCL's AVERAGE_DEPTH_CHANGE does, or clamped.
fn fold_pixel(at: isize, limit: usize, policy: BorderPolicy) -> usize {
    let last = limit as isize - 1;
    let at = match policy {
        BorderPolicy::Mirror if at < 0 => -at,
        BorderPolicy::Mirror if at > last => 2 * last + 1 - at,
        _ => at,
    };
    at.clamp(0, last) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrored_windows_are_folded_as_pcl_folds_them() {
        let fold = |start, size| super::fold(start, size, 10, BorderPolicy::Mirror);
        assert_eq!(fold(2, 5), [2..7, 0..0]);
        assert_eq!(fold(-2, 5), [0..3, 0..2]);
        assert_eq!(fold(4, 5), [4..9, 0..0]);
        assert_eq!(fold(5, 5), [5..9, 9..9]);
        assert_eq!(fold(7, 5), [7..9, 7..9]);
    }

    #[test]
    fn other_windows_are_clipped() {
        let fold = |start, size| super::fold(start, size, 10, BorderPolicy::Ignore);
        assert_eq!(fold(2, 5), [2..7, 0..0]);
        assert_eq!(fold(-2, 5), [0..3, 0..0]);
        assert_eq!(fold(7, 5), [7..10, 0..0]);
        assert_eq!(fold(12, 5), [10..10, 0..0]);
    }

    #[test]
    fn single_pixels_are_folded_or_clamped() {
        let fold = |at, policy| fold_pixel(at, 10, policy);
        let mirrored = [-3, 0, 9, 10, 12, 50].map(|at| fold(at, BorderPolicy::Mirror));
        assert_eq!(mirrored, [3, 0, 9, 9, 7, 0]);
        let clamped = [-3, 0, 9, 10, 12, 50].map(|at| fold(at, BorderPolicy::Ignore));
        assert_eq!(clamped, [0, 0, 9, 9, 9, 9]);
    }

    #[test]
    fn a_window_that_starts_behind_the_image_takes_its_last_column_away() {
        let image = Image { width: 10, height: 6, border_policy: BorderPolicy::Mirror };
        let rects: Vec<_> = image.rects((10, 1), (3, 2)).collect();
        assert_eq!(rects, [(Rect { x: 9..10, y: 1..3 }, -1), (Rect { x: 6..9, y: 1..3 }, 1)]);
    }

    #[test]
    fn windows_larger_than_the_image_stay_inside() {
        for policy in BorderPolicy::ALL {
            for range in fold(-50, 100, 10, policy) {
                assert!(range.end <= 10);
            }
        }
    }
}
