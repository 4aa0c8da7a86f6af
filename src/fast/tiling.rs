//! The image in tiles, and of these the parts around some pixels.

use std::ops::Range;

use crate::paper::{Marks, WORD, columns_of};
use crate::simd::GROUP;

/// Columns and rows of a small tile.
const CELL: (usize, usize) = (WORD, 32);

/// Few are one pixel in so many, at most: to look for the parts that more are in takes too long.
const FEW: usize = 16;

/// The image in tiles of like sizes.
pub(super) struct Tiling {
    width: usize,
    height: usize,
    pub columns: usize,
    pub rows: usize,
    across: usize,
    down: usize,
}

/// Columns, whole groups but for the image's last, and rows.
pub(super) type Place = (Range<usize>, Range<usize>);

impl Tiling {
    /// Tiles of so many columns, whole groups, and rows.
    pub fn new((width, height): (usize, usize), (columns, rows): (usize, usize)) -> Self {
        let (across, down) = (width.div_ceil(columns), height.div_ceil(rows));
        Tiling { width, height, columns, rows, across, down }
    }

    pub fn count(&self) -> usize {
        self.across * self.down
    }

    pub fn tile(&self, item: usize) -> Place {
        let (column, row) = (item % self.across * self.columns, item / self.across * self.rows);
        let columns = column..(column + self.columns).min(self.width);
        (columns, row..(row + self.rows).min(self.height))
    }

    pub fn tiles(&self) -> impl Iterator<Item = Place> {
        (0..self.count()).map(|item| self.tile(item))
    }

    /// Small tiles, if few pixels are marked, near one another: if their parts, and what is around these as far as windows of a
    /// size reach, are less than the image together.
    pub fn cells<'a>(
        (width, height): (usize, usize),
        marks: &Marks,
        sizes: impl Fn(usize) -> &'a [f32],
        reach: impl Fn(f32) -> usize,
    ) -> Option<Self> {
        if FEW * marks.count() > width * height {
            return None;
        }
        let cells = Tiling::new((width, height), CELL);
        let parts = cells.tiles().filter_map(|tile| part(tile, marks, &sizes));
        let covered = parts.map(|((columns, rows), largest)| {
            let around = 2 * reach(largest);
            (columns.len() + around) * (rows.len() + around)
        });
        (covered.sum::<usize>() < width * height).then_some(cells)
    }
}

/// The columns or rows, of so many, that windows of those in `range` reach at a distance from their pixels at most.
pub(crate) fn reached(range: &Range<usize>, reach: usize, count: usize) -> Range<usize> {
    range.start.saturating_sub(reach)..(range.end + reach).min(count)
}

/// The part of a tile with the pixels that are marked, if there are some, and the size of the largest of their windows;
/// `sizes` are those of a row's pixels.
pub(super) fn part<'a>(
    (of_tile, rows_of_tile): Place,
    marks: &Marks,
    sizes: impl Fn(usize) -> &'a [f32],
) -> Option<(Place, f32)> {
    let words = of_tile.start / WORD..of_tile.end.div_ceil(WORD);
    let (mut columns, mut rows) = (of_tile.end..0, rows_of_tile.end..0);
    let mut largest = 0.0_f32;
    for y in rows_of_tile {
        let marked = columns_of(&marks.row(y)[words.clone()]).map(|x| words.start * WORD + x);
        for x in marked.filter(|x| of_tile.contains(x)) {
            let group = x / GROUP * GROUP;
            columns = columns.start.min(group)..columns.end.max(group + GROUP);
            rows = rows.start.min(y)..y + 1;
            largest = largest.max(sizes(y)[x]);
        }
    }
    columns.end = columns.end.min(of_tile.end);
    (!rows.is_empty()).then_some(((columns, rows), largest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::mark;

    const SIZE: (usize, usize) = (200, 100);

    fn marks(is_marked: impl Fn(usize, usize) -> bool) -> Marks {
        let mut marks = Marks::default();
        marks.clear(SIZE).unwrap();
        for (y, row) in marks.rows().enumerate() {
            (0..SIZE.0).filter(|x| is_marked(*x, y)).for_each(|x| mark(row, x, 1));
        }
        marks
    }

    #[test]
    fn tiles_are_the_image() {
        for tile in [(8, 1), (64, 32), (200, 100), (256, 512), (96, 99)] {
            let tiling = Tiling::new(SIZE, tile);
            let mut count = [[0; SIZE.0]; SIZE.1];
            for (columns, rows) in tiling.tiles() {
                for row in &mut count[rows] {
                    row[columns.clone()].iter_mut().for_each(|count| *count += 1);
                }
            }
            assert_eq!(count, [[1; SIZE.0]; SIZE.1], "{tile:?}");
        }
    }

    #[test]
    fn parts_hold_all_that_is_marked_and_little_else() {
        let at = [(3, 0), (70, 40), (90, 41), (199, 99)];
        let marks = marks(|x, y| at.contains(&(x, y)));
        let sizes: Vec<_> = (0..SIZE.0).map(|x| (x % 7) as f32).collect();
        let row = |_| &sizes[..];
        let parts = |tiling: &Tiling| -> Vec<_> {
            tiling.tiles().filter_map(|tile| part(tile, &marks, row)).collect()
        };
        let tiling = Tiling::new(SIZE, (104, 100));
        assert_eq!(parts(&tiling), [((0..96, 0..42), 6.0), ((192..200, 99..100), 3.0)]);
        let cells = Tiling::cells(SIZE, &marks, row, |size| size as usize).unwrap();
        let of_cells = [((0..8, 0..1), 3.0), ((64..96, 40..42), 6.0), ((192..200, 99..100), 3.0)];
        assert_eq!(parts(&cells), of_cells);
    }

    #[test]
    fn there_are_no_small_tiles_where_much_is_covered() {
        let on_grid =
            |step: usize| marks(move |x, y| x.is_multiple_of(step) && y.is_multiple_of(step));
        let in_corner = |side: usize| marks(move |x, y| x < side && y < side);
        for (marks, size, is_much) in [
            (on_grid(50), 1.0, false),
            (on_grid(50), 60.0, true),
            (on_grid(8), 10.0, true),
            (in_corner(32), 1.0, false),
            (in_corner(40), 1.0, true),
        ] {
            let sizes = [size; SIZE.0];
            let cells = Tiling::cells(SIZE, &marks, |_| &sizes, |size| size as usize);
            assert_eq!(cells.is_none(), is_much, "{} of {size}", marks.count());
        }
    }
}
