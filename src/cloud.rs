//! Borrowed views over organized buffers: points in, normals out. Nothing is copied.
//!
//! A view is a base address per field, a stride from pixel to pixel and a stride from row to row. That covers
//! interleaved points of any size, rows with padding, and separate planes; and because a view is not a slice,
//! points and normals may be disjoint fields of one array.

use std::marker::PhantomData;
use std::ops::Range;

use crate::Error;
use crate::cache::Level;
use crate::simd::{Along, GROUP, Simd};

/// The geometry that all fields of a view share. Strides are in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    pub width: usize,
    pub height: usize,
    pub point_stride: usize,
    pub row_stride: usize,
}

const FIELD: usize = size_of::<f32>();

impl Grid {
    /// Checks the sizes and strides; a `row_stride` of 0 means packed rows.
    pub fn new(
        width: usize,
        height: usize,
        point_stride: usize,
        row_stride: usize,
    ) -> Result<Self, Error> {
        if width == 0 || height == 0 {
            return Err(Error::Size);
        }
        if !point_stride.is_multiple_of(FIELD) || !row_stride.is_multiple_of(FIELD) {
            return Err(Error::Stride);
        }
        if point_stride < FIELD {
            return Err(Error::Stride);
        }
        let packed = width.checked_mul(point_stride).ok_or(Error::Size)?;
        let row_stride = if row_stride == 0 { packed } else { row_stride };
        if row_stride < packed {
            return Err(Error::Stride);
        }
        let bytes = row_stride.checked_mul(height).ok_or(Error::Size)?;
        // Pixel numbers are 32-bit in indices and in PCL; byte offsets must fit a pointer difference.
        let pixels = width.checked_mul(height).ok_or(Error::Size)?;
        if bytes > isize::MAX as usize || pixels > i32::MAX as usize {
            return Err(Error::Size);
        }
        Ok(Grid { width, height, point_stride, row_stride })
    }

    /// Bytes from the first pixel's field to the end of the last one's.
    fn extent(&self) -> usize {
        (self.height - 1) * self.row_stride + (self.width - 1) * self.point_stride + FIELD
    }

    /// Byte offset of pixel `(x, y)`.
    #[inline(always)]
    pub fn offset(&self, x: usize, y: usize) -> usize {
        y * self.row_stride + x * self.point_stride
    }

    /// The fields of any two pixels are a multiple of so many bytes apart.
    fn step(&self) -> usize {
        match self.height {
            1 => self.point_stride,
            _ => greatest_common_divisor(self.point_stride, self.row_stride),
        }
    }

    /// Whether a field of this grid at address `a` shares a byte with a field of `other` at address `b`.
    fn collides(&self, a: usize, other: &Grid, b: usize) -> bool {
        if a + self.extent() <= b || b + other.extent() <= a {
            return false;
        }
        if self.row_stride != other.row_stride {
            // Fields at different places of points of one size never meet, however the points are arranged.
            let step = greatest_common_divisor(self.step(), other.step());
            return a.abs_diff(b).is_multiple_of(step);
        }
        // Addresses are multiples of 4, so fields share a byte only where they are equal, which is where
        // b - a = i * point_stride - k * other.point_stride + j * row_stride; rows are at most as long as row_stride.
        let difference = b as i128 - a as i128;
        let step = greatest_common_divisor(self.point_stride, other.point_stride) as i128;
        let [rows, rows_of_other] = [self, other].map(|grid| grid.height as i128);
        let [row, row_of_other] =
            [self, other].map(|grid| ((grid.width - 1) * grid.point_stride) as i128);
        let row_stride = self.row_stride as i128;
        let j = difference.div_euclid(row_stride);
        [j, j + 1].into_iter().any(|j| {
            let rest = difference - j * row_stride;
            let in_both = (-row_of_other..=row).contains(&rest);
            (1 - rows_of_other..rows).contains(&j) && in_both && rest % step == 0
        })
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// One field's base address, checked for NULL and alignment.
fn check_field(field: *const f32, grid: &Grid) -> Result<usize, Error> {
    if field.is_null() {
        return Err(Error::NullPointer);
    }
    let address = field.addr();
    if !address.is_multiple_of(FIELD) {
        return Err(Error::Misaligned);
    }
    address.checked_add(grid.extent()).ok_or(Error::Size)?;
    Ok(address)
}

/// The points of an organized cloud: `width` x `height` pixels of x, y, z in any unit of length, z being depth.
///
/// To mark a point missing, make its z NaN, or all three. With [`Semantics::Pcl`](crate::Semantics::Pcl) z alone decides,
/// as in PCL: a pixel whose x or y is not finite but whose z is still gets a normal, which may point to either side. With
/// [`Semantics::Paper`](crate::Semantics::Paper), one-sided or crease windows, or missing zeros, a point is missing if any of
/// its coordinates is not finite.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    x: *const f32,
    y: *const f32,
    z: *const f32,
    grid: Grid,
    /// As [`Points::beside`] says.
    are_whole: bool,
    /// The level of the cache that lines are asked for to.
    level: Level,
    lifetime: PhantomData<&'a [f32]>,
}

// SAFETY: a view only reads, and the memory is borrowed for 'a (or promised by the caller of `from_raw`).
unsafe impl Send for Points<'_> {}
// SAFETY: as above.
unsafe impl Sync for Points<'_> {}

impl<'a> Points<'a> {
    /// Interleaved points: x, y, z are the first three floats of every pixel.
    ///
    /// `point_stride` (at least 3) and `row_stride` (0 for packed rows, else at least `width * point_stride`)
    /// count floats. Errors: [`Error::Size`] if a size is zero or `data` is too short, [`Error::Stride`].
    pub fn interleaved(
        data: &'a [f32],
        width: usize,
        height: usize,
        point_stride: usize,
        row_stride: usize,
    ) -> Result<Self, Error> {
        if point_stride < 3 {
            return Err(Error::Stride);
        }
        let grid = float_grid(width, height, point_stride, row_stride)?;
        check_length(data.len(), &grid, 3)?;
        let x = data.as_ptr();
        // SAFETY: `data` is borrowed for 'a, and `check_length` saw that it holds three floats at every pixel.
        unsafe { Self::from_grid([x, x.wrapping_add(1), x.wrapping_add(2)], grid) }
    }

    /// Three separate planes; `row_stride` (0 for packed rows, else at least `width`) counts floats.
    ///
    /// Errors: [`Error::Size`] if a size is zero or a plane is too short, [`Error::Stride`].
    pub fn planes(
        [x, y, z]: [&'a [f32]; 3],
        width: usize,
        height: usize,
        row_stride: usize,
    ) -> Result<Self, Error> {
        let grid = float_grid(width, height, 1, row_stride)?;
        for plane in [x, y, z] {
            check_length(plane.len(), &grid, 1)?;
        }
        // SAFETY: the planes are borrowed for 'a, and `check_length` saw that each holds a float at every pixel.
        unsafe { Self::from_grid([x.as_ptr(), y.as_ptr(), z.as_ptr()], grid) }
    }

    /// A view from the addresses of the first pixel's x, y and z. Strides, from a point and from a row to the next, are in
    /// bytes, multiples of 4; a `row_stride` of 0 means packed rows.
    ///
    /// Errors: [`Error::NullPointer`], [`Error::Misaligned`], [`Error::Size`], [`Error::Stride`].
    ///
    /// # Safety
    /// Every pixel's three floats must be readable, and not written by anyone else, for `'a`; and where y and z follow x,
    /// so must be, for all points but the last of a row, or of all where rows follow each other, the four bytes behind z.
    pub unsafe fn from_raw(
        [x, y, z]: [*const f32; 3],
        width: usize,
        height: usize,
        [point_stride, row_stride]: [usize; 2],
    ) -> Result<Self, Error> {
        let grid = Grid::new(width, height, point_stride, row_stride)?;
        // SAFETY: promised by the caller.
        unsafe { Self::from_grid([x, y, z], grid) }
    }

    /// # Safety
    /// As [`Points::from_raw`].
    unsafe fn from_grid([x, y, z]: [*const f32; 3], grid: Grid) -> Result<Self, Error> {
        for field in [x, y, z] {
            check_field(field, &grid)?;
        }
        let (are_whole, level) = (false, Level::best());
        Ok(Points { x, y, z, grid, are_whole, level, lifetime: PhantomData })
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.grid.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.grid.height
    }

    /// The point at column `x`, row `y`.
    ///
    /// # Panics
    /// If the pixel is outside the cloud.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> [f32; 3] {
        assert!(x < self.grid.width && y < self.grid.height);
        let offset = self.grid.offset(x, y);
        // SAFETY: the pixel is inside the grid that the constructor vouched for, and alignment was checked there.
        unsafe {
            [
                self.x.byte_add(offset).read(),
                self.y.byte_add(offset).read(),
                self.z.byte_add(offset).read(),
            ]
        }
    }

    /// The depth at column `x`, row `y`.
    ///
    /// # Panics
    /// If the pixel is outside the cloud.
    #[inline(always)]
    pub fn z(&self, x: usize, y: usize) -> f32 {
        self.at(x, y)[2]
    }

    /// Whether the bytes `start..end` meet those from a coordinate's first pixel to its last.
    pub(crate) fn reach_into(&self, start: usize, end: usize) -> bool {
        let extent = self.grid.extent();
        self.fields().into_iter().any(|field| start < field + extent && field < end)
    }

    fn fields(&self) -> [usize; 3] {
        [self.x.addr(), self.y.addr(), self.z.addr()]
    }

    /// Row `y`'s depths: the address of the first, and the bytes from one to the next.
    #[inline(always)]
    pub(crate) fn z_row(&self, y: usize) -> (*const f32, usize) {
        assert!(y < self.grid.height);
        // SAFETY: row y is inside the grid that the constructor vouched for.
        (unsafe { self.z.byte_add(y * self.grid.row_stride) }, self.grid.point_stride)
    }

    /// Asks for the cache lines of so many points of row `y`, from column `x` on, if there is such a row.
    #[inline(always)]
    pub(crate) fn prefetch(&self, y: usize, x: usize, count: usize) {
        if y < self.grid.height {
            let first = self.z.wrapping_byte_add(self.grid.offset(x, y));
            self.level.read(first, count, self.grid.point_stride);
        }
    }

    /// The same for the points below row `y`, as rows are read downwards: two rows below, or three where more lines can be
    /// on their way.
    #[inline(always)]
    pub(crate) fn prefetch_below(&self, y: usize, x: usize, count: usize) {
        let rows = match self.level {
            Level::First => 2,
            Level::Second => 3,
        };
        self.prefetch(y + rows, x, count);
    }

    /// These points, to be read while `normals` are written. Whole if the 16 bytes from a point's x are part of the same cloud,
    /// and of nothing that `normals` writes, for every point but a row's last, or where rows follow each other the cloud's.
    pub(crate) fn beside(&self, normals: &Normals) -> Self {
        let interleaved = self.y == self.x.wrapping_add(1) && self.z == self.x.wrapping_add(2);
        let apart = |(field, grid): &(*const f32, Grid)| {
            let (start, end) = (self.x.addr(), self.x.addr() + self.grid.extent() + 3 * FIELD);
            end <= field.addr() || field.addr() + grid.extent() <= start
        };
        let are_whole = interleaved
            && self.grid.point_stride >= 3 * FIELD
            && normals.fields().iter().flatten().all(apart);
        Points { are_whole, ..*self }
    }

    /// The points of row `y` in `columns`.
    #[inline(always)]
    pub(crate) fn row(&self, y: usize, columns: Range<usize>) -> PointRow<'_> {
        assert!(y < self.grid.height && columns.end <= self.grid.width);
        let offset = self.grid.offset(columns.start, y);
        let step = self.grid.point_stride;
        // Behind all these points is another.
        let goes_on = y + 1 < self.grid.height && self.grid.row_stride == self.grid.width * step;
        let end = if goes_on { self.grid.width } else { self.grid.width - 1 };
        let inside = columns.end.min(end).saturating_sub(columns.start);
        let whole = if self.are_whole { inside } else { 0 };
        let below = if y + 2 < self.grid.height { 2 * self.grid.row_stride } else { 0 };
        let first = self.x.wrapping_byte_add(offset);
        PointRow { points: self, y, columns, first, step, below, whole }
    }
}

/// Points of a row, to be read as many at a time as there are lanes.
pub(crate) struct PointRow<'a> {
    points: &'a Points<'a>,
    y: usize,
    columns: Range<usize>,
    /// The first point's x, and the bytes to the next one's and to that two rows below.
    first: *const f32,
    step: usize,
    below: usize,
    /// How many of them can be read whole.
    whole: usize,
}

impl PointRow<'_> {
    /// How many of the first points can be read whole: 16 bytes from x on.
    #[inline(always)]
    pub fn whole(&self) -> usize {
        self.whole
    }

    /// Where lanes start that together are all points: the last ones start before the end of those before them where fewer
    /// are left, so that none lies behind the row's last point.
    #[inline(always)]
    pub fn starts<S: Along>(&self) -> impl Iterator<Item = usize> + use<S> {
        let count = self.columns.len();
        (0..count).step_by(S::LANES).map(move |at| at.min(count.saturating_sub(S::LANES)))
    }

    /// x, y and z of as many points as there are lanes, from the `at`-th on; NaN for those behind the last. Asks for
    /// those two rows below, as rows are read downwards.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn lanes<S: Along>(&self, at: usize) -> [S::F; 3] {
        let below = self.first.wrapping_byte_add(self.below + at * self.step);
        self.points.level.read(below, S::LANES, self.step);
        // SAFETY: as the caller's; the points are inside the row, and of those that are read whole none is the last.
        unsafe {
            if at + S::LANES <= self.whole {
                return S::load_points(self.first.byte_add(at * self.step), self.step);
            }
            if self.step == FIELD && at + S::LANES <= self.columns.len() {
                let place = self.points.grid.offset(self.columns.start + at, self.y);
                let Points { x, y, z, .. } = *self.points;
                let [x, y, z] = [x, y, z].map(|field| field.byte_add(place));
                return [S::load(x), S::load(y), S::load(z)];
            }
            let [x, y, z] = self.gather(at, S::LANES);
            [S::load(x.as_ptr()), S::load(y.as_ptr()), S::load(z.as_ptr())]
        }
    }

    /// [`PointRow::lanes`], coordinate by coordinate.
    fn gather(&self, at: usize, lanes: usize) -> [[f32; 2 * GROUP]; 3] {
        let mut planes = [[f32::NAN; 2 * GROUP]; 3];
        for (lane, x) in self.columns.clone().skip(at).take(lanes).enumerate() {
            let point = self.points.at(x, self.y);
            for c in 0..3 {
                planes[c][lane] = point[c];
            }
        }
        planes
    }
}

/// Where normals go: nx, ny, nz and, if wanted, the curvature of every pixel. Other bytes stay untouched.
#[derive(Debug)]
pub struct Normals<'a> {
    normal: [*mut f32; 3],
    grid: Grid,
    curvature: Option<(*mut f32, Grid)>,
    /// If nx, ny and nz lie side by side: how many floats after nx the curvature is, 3 to 7, or 0 if it is elsewhere or not
    /// wanted.
    side_by_side: Option<usize>,
    /// The level of the cache that lines are asked for to.
    level: Level,
    lifetime: PhantomData<&'a mut [f32]>,
}

// SAFETY: the memory is borrowed mutably for 'a (or promised by the caller of `from_raw`).
unsafe impl Send for Normals<'_> {}
// SAFETY: writes go through methods whose callers give every pixel to one thread only.
unsafe impl Sync for Normals<'_> {}

impl<'a> Normals<'a> {
    /// Interleaved output: nx, ny, nz are the first three floats of every pixel, the curvature, if wanted, is at
    /// `curvature_offset` (at least 3). Strides count floats, as in [`Points::interleaved`]; so `pcl::Normal` is
    /// stride 8, curvature 4.
    ///
    /// Errors: [`Error::Size`] if a size is zero or `data` is too short, [`Error::Stride`], [`Error::Overlap`].
    pub fn interleaved(
        data: &'a mut [f32],
        width: usize,
        height: usize,
        point_stride: usize,
        row_stride: usize,
        curvature_offset: Option<usize>,
    ) -> Result<Self, Error> {
        let fields = curvature_offset.map_or(3, |offset| offset.saturating_add(1)).max(3);
        if point_stride < fields {
            return Err(Error::Stride);
        }
        let grid = float_grid(width, height, point_stride, row_stride)?;
        check_length(data.len(), &grid, fields)?;
        let nx = data.as_mut_ptr();
        let curvature = curvature_offset.map(|offset| (nx.wrapping_add(offset), grid));
        // SAFETY: `data` is borrowed mutably for 'a, and `check_length` saw that it holds every field.
        unsafe { Self::from_grid([nx, nx.wrapping_add(1), nx.wrapping_add(2)], grid, curvature) }
    }

    /// Three separate planes, and if wanted one of curvatures; `row_stride` as in [`Points::planes`].
    ///
    /// Errors: [`Error::Size`] if a size is zero or a plane is too short, [`Error::Stride`].
    pub fn planes(
        normal: [&'a mut [f32]; 3],
        curvature: Option<&'a mut [f32]>,
        width: usize,
        height: usize,
        row_stride: usize,
    ) -> Result<Self, Error> {
        let grid = float_grid(width, height, 1, row_stride)?;
        for plane in normal.iter().chain(&curvature) {
            check_length(plane.len(), &grid, 1)?;
        }
        let normal = normal.map(|plane| plane.as_mut_ptr());
        let curvature = curvature.map(|plane| (plane.as_mut_ptr(), grid));
        // SAFETY: the planes are borrowed mutably for 'a, and `check_length` saw that each holds a float at every pixel.
        unsafe { Self::from_grid(normal, grid, curvature) }
    }

    /// A view from the addresses of the first pixel's nx, ny, nz and, if wanted, curvature, which has strides of
    /// its own. Strides are in bytes, multiples of 4; a row stride of 0 means packed rows.
    ///
    /// Errors: [`Error::NullPointer`], [`Error::Misaligned`], [`Error::Size`], [`Error::Stride`],
    /// [`Error::Overlap`] if two of the fields share a byte.
    ///
    /// # Safety
    /// Every pixel's fields must be writable, and not touched by anyone else, for `'a`.
    pub unsafe fn from_raw(
        normal: [*mut f32; 3],
        width: usize,
        height: usize,
        [point_stride, row_stride]: [usize; 2],
        curvature: Option<(*mut f32, [usize; 2])>,
    ) -> Result<Self, Error> {
        let grid = Grid::new(width, height, point_stride, row_stride)?;
        let curvature = match curvature {
            Some((field, [point, row])) => Some((field, Grid::new(width, height, point, row)?)),
            None => None,
        };
        // SAFETY: promised by the caller.
        unsafe { Self::from_grid(normal, grid, curvature) }
    }

    /// # Safety
    /// As [`Normals::from_raw`].
    unsafe fn from_grid(
        normal: [*mut f32; 3],
        grid: Grid,
        curvature: Option<(*mut f32, Grid)>,
    ) -> Result<Self, Error> {
        let [nx, ny, nz] = normal;
        let place = curvature.and_then(|(field, other)| {
            (3..GROUP).find(|place| field == nx.wrapping_add(*place) && other == grid)
        });
        let are_side_by_side = ny == nx.wrapping_add(1) && nz == nx.wrapping_add(2);
        let side_by_side = are_side_by_side.then_some(place.unwrap_or(0));
        let (level, lifetime) = (Level::best(), PhantomData);
        let normals = Normals { normal, grid, curvature, side_by_side, level, lifetime };
        let fields = normals.fields();
        for (field, grid) in fields.iter().flatten() {
            check_field(*field, grid)?;
        }
        for (i, (a, grid_a)) in fields.iter().flatten().enumerate() {
            for (b, grid_b) in fields.iter().flatten().skip(i + 1) {
                if grid_a.collides(a.addr(), grid_b, b.addr()) {
                    return Err(Error::Overlap);
                }
            }
        }
        Ok(normals)
    }

    fn fields(&self) -> [Option<(*const f32, Grid)>; 4] {
        let [nx, ny, nz] = self.normal.map(|field| Some((field.cast_const(), self.grid)));
        let curvature = self.curvature.map(|(field, grid)| (field.cast_const(), grid));
        [nx, ny, nz, curvature]
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.grid.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.grid.height
    }

    /// Refuses output that shares a byte with `points`' coordinates.
    pub(crate) fn check_disjoint(&self, points: &Points) -> Result<(), Error> {
        points.fields().into_iter().try_for_each(|field| self.check_apart(&points.grid, field))
    }

    /// Refuses output that shares a byte with so many indices.
    pub(crate) fn check_disjoint_from_indices(
        &self,
        indices: *const i32,
        count: usize,
    ) -> Result<(), Error> {
        self.check_apart(&Grid::new(count, 1, size_of::<i32>(), 0)?, indices.addr())
    }

    /// Refuses output that shares a byte with an input of such a grid at an address.
    fn check_apart(&self, input: &Grid, at: usize) -> Result<(), Error> {
        let collides = |(field, grid): &(*const f32, Grid)| grid.collides(field.addr(), input, at);
        if self.fields().iter().flatten().any(collides) { Err(Error::Overlap) } else { Ok(()) }
    }

    /// Whether what was written to a pixel is a normal.
    ///
    /// # Safety
    /// As [`Normals::write`], which was called for the pixel.
    #[inline(always)]
    pub(crate) unsafe fn has_normal(&self, x: usize, y: usize) -> bool {
        // SAFETY: as the caller's.
        !unsafe { self.normal[0].byte_add(self.grid.offset(x, y)).read() }.is_nan()
    }

    /// Writes one pixel.
    ///
    /// # Safety
    /// `x < width`, `y < height`, and no other thread accesses this pixel's normal at the same time.
    #[inline(always)]
    pub(crate) unsafe fn write(&self, x: usize, y: usize, normal: [f32; 3], curvature: f32) {
        let offset = self.grid.offset(x, y);
        // SAFETY: the pixel is inside the grid that the constructor vouched for, and ours alone.
        unsafe {
            self.normal[0].byte_add(offset).write(normal[0]);
            self.normal[1].byte_add(offset).write(normal[1]);
            self.normal[2].byte_add(offset).write(normal[2]);
            if let Some((field, grid)) = self.curvature {
                field.byte_add(grid.offset(x, y)).write(curvature);
            }
        }
    }
}

/// How far ahead lines are asked for; found by trying 64 to 256.
const PIXELS_AHEAD: usize = 192;

impl Normals<'_> {
    /// Asks for the cache lines of those that are written some pixels after the `count` from `(x, y)` on, if it is these
    /// `columns` of one row after the other.
    #[inline(always)]
    pub(crate) fn prefetch(&self, (x, y): (usize, usize), count: usize, columns: &Range<usize>) {
        let (mut x, mut y) = (x + PIXELS_AHEAD, y);
        while x >= columns.end {
            (x, y) = (x - columns.len(), y + 1);
        }
        let Grid { point_stride, row_stride, .. } = self.grid;
        // There may be no such row, nor an address for it.
        let offset = y.wrapping_mul(row_stride).wrapping_add(x * point_stride);
        self.level.write(self.normal[0].wrapping_byte_add(offset), count, point_stride);
    }

    /// Writes as many pixels of a row as there are lanes: nx, ny, nz and the curvature.
    ///
    /// # Safety
    /// As [`Normals::write`], for the pixels from `x` on; the processor has the instruction set of `S`.
    #[inline(always)]
    pub(crate) unsafe fn write_lanes<S: Simd>(&self, x: usize, y: usize, fields: [S::F; 4]) {
        // SAFETY: as the caller's.
        unsafe {
            if let Some(place) = self.side_by_side {
                let nx = self.normal[0].byte_add(self.grid.offset(x, y));
                S::store_points(fields, place, nx, self.grid.point_stride);
                if place > 0 {
                    return;
                }
            } else {
                for (to, field) in self.normal.into_iter().zip(fields) {
                    write_field::<S>(to, &self.grid, (x, y), field);
                }
            }
            if let Some((to, grid)) = &self.curvature {
                write_field::<S>(*to, grid, (x, y), fields[3]);
            }
        }
    }
}

/// Writes one field of as many pixels of a row as there are lanes.
///
/// # Safety
/// As [`Normals::write_lanes`]; the field is on this grid.
#[inline(always)]
unsafe fn write_field<S: Simd>(to: *mut f32, grid: &Grid, (x, y): (usize, usize), field: S::F) {
    // SAFETY: as the caller's.
    unsafe {
        let first = to.byte_add(grid.offset(x, y));
        if grid.point_stride == FIELD {
            return S::store(first, field);
        }
        let mut lanes = [0.0; 2 * GROUP];
        S::store(lanes.as_mut_ptr(), field);
        for (lane, value) in lanes[..S::LANES].iter().enumerate() {
            first.byte_add(lane * grid.point_stride).write(*value);
        }
    }
}

/// A grid whose strides are given in floats.
fn float_grid(
    width: usize,
    height: usize,
    point_stride: usize,
    row_stride: usize,
) -> Result<Grid, Error> {
    let bytes = |floats: usize| floats.checked_mul(FIELD).ok_or(Error::Size);
    Grid::new(width, height, bytes(point_stride)?, bytes(row_stride)?)
}

/// Refuses a slice too short to hold `fields` floats at every pixel.
fn check_length(length: usize, grid: &Grid, fields: usize) -> Result<(), Error> {
    let needed = grid.extent() / FIELD + fields - 1;
    if length < needed { Err(Error::Size) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_that_share_a_byte_collide() {
        let grids: Vec<_> = (0..108)
            .flat_map(|i| {
                let (width, height, floats) = (1 + i % 3, 1 + i / 3 % 3, [1, 2, 3][i / 9 % 3]);
                // Packed rows, and others; those of the last kind are alike for many grids.
                let row_stride = [0, 5 * FIELD, 6 * FIELD, 9 * FIELD][i / 27];
                Grid::new(width, height, floats * FIELD, row_stride)
            })
            .collect();
        let addresses = |grid: &Grid, from: usize| {
            let rows = (0..grid.height).map(|y| grid.offset(0, y));
            let fields = rows.flat_map(|row| (0..grid.width).map(move |x| (row, x)));
            fields.map(|(row, x)| from + row + x * grid.point_stride).collect::<Vec<_>>()
        };
        let from = 400;
        for a in &grids {
            let of_a = addresses(a, from);
            for b in &grids {
                for at in (from - 120..from + 120).step_by(FIELD) {
                    let found = a.collides(from, b, at);
                    let of_b = addresses(b, at);
                    let truth = of_a.iter().any(|address| of_b.contains(address));
                    // Two grids of the same strides are told exactly.
                    let is_exact = (a.point_stride, a.row_stride) == (b.point_stride, b.row_stride);
                    assert!(found >= truth && (!is_exact || found == truth), "{a:?} {b:?} {at}");
                }
            }
        }
        // In each row six normals, and behind them their curvatures.
        let normals = Grid::new(6, 4, 3 * FIELD, 24 * FIELD).unwrap();
        let curvatures = Grid::new(6, 4, FIELD, 24 * FIELD).unwrap();
        for field in 0..3 {
            assert!(!normals.collides(from + field * FIELD, &curvatures, from + 18 * FIELD));
        }
    }
}
