//! Blocks of pixels, as the second pass looks at them: what is best for one pixel is next to best for its neighbours.

/// Columns and rows of a block.
pub(crate) const BLOCK: usize = 2;

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

    /// Column and row of a block's first pixel.
    pub fn first(&self, block: usize) -> (usize, usize) {
        (block % self.across * BLOCK, block / self.across * BLOCK)
    }

    /// The numbers of a block's pixels.
    pub fn pixels(&self, block: usize) -> impl Iterator<Item = usize> + use<> {
        let Blocks { width, height, .. } = *self;
        let (x, y) = self.first(block);
        let rows = y..(y + BLOCK).min(height);
        rows.flat_map(move |y| y * width + x..y * width + (x + BLOCK).min(width))
    }

    /// The block that a pixel is in.
    pub fn block(&self, pixel: usize) -> usize {
        pixel / self.width / BLOCK * self.across + pixel % self.width / BLOCK
    }
}
