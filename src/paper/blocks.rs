//! Blocks of pixels, as the second pass looks at them: what is best for one pixel is next to best for its neighbours.

/// Columns and rows of a block.
pub(crate) const BLOCK: usize = 4;

/// Columns and rows before a block's middle pixel.
pub(crate) const MIDDLE: usize = BLOCK / 2;

/// The columns or rows of blocks, of so many, at a distance before `at`, its own, and behind it.
pub(crate) fn lines_around(at: usize, distance: usize, count: usize) -> [usize; 3] {
    [at.saturating_sub(distance), at, (at + distance).min(count - 1)]
}

/// An image's blocks, row by row; those at its right and lower edges may be cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blocks {
    width: usize,
    height: usize,
    /// Blocks in a row, and in a column.
    pub across: usize,
    pub down: usize,
}

impl Blocks {
    pub fn of(width: usize, height: usize) -> Self {
        Blocks { width, height, across: width.div_ceil(BLOCK), down: height.div_ceil(BLOCK) }
    }

    pub fn count(&self) -> usize {
        self.across * self.down
    }

    /// A block's column and row, of blocks.
    pub fn place(&self, block: usize) -> (usize, usize) {
        (block % self.across, block / self.across)
    }

    /// Column and row of a block's middle pixel; where that is cut off, the last ones inside the image.
    pub fn middle(&self, block: usize) -> (usize, usize) {
        self.middle_of(self.place(block))
    }

    /// That of the block in a column and row of blocks.
    pub fn middle_of(&self, (column, row): (usize, usize)) -> (usize, usize) {
        let middle = |line: usize, count: usize| (line * BLOCK + MIDDLE).min(count - 1);
        (middle(column, self.width), middle(row, self.height))
    }

    /// The block that a pixel is in.
    pub fn block(&self, pixel: usize) -> usize {
        pixel / self.width / BLOCK * self.across + pixel % self.width / BLOCK
    }
}
