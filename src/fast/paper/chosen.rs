//! Writes the normals of the pixels of a row that take even windows, fast: the plain forms are `SecondPass::chosen` and
//! `SecondPass::estimate_around`.

use crate::cloud::{Normals, Points};
use crate::fast::arithmetic::Floats;
use crate::fast::estimates::turned;
use crate::fast::lanes::{Bits, LANES, all};
use crate::fast::one_point::of_one_point;
use crate::fast::paths::Task;
use crate::options::Options;
use crate::paper::{Cloud, NO_WINDOW, SecondPass};
use crate::rect::Rect;
use crate::simd::{Along, Groups, load_by_fours};

/// A row of pixels, some of which take even windows.
pub(super) struct ChosenRow<'a> {
    pub cloud: &'a Cloud,
    pub options: &'a Options,
    pub second_pass: &'a SecondPass,
    pub normals: &'a Normals<'a>,
    pub y: usize,
    /// Those of the windows of the row's pixels.
    pub sizes: &'a [f32],
    /// The points, if pixels that are left to their own windows are written too.
    pub of_left: Option<&'a Points<'a>>,
}

/// Writes them, and none for pixels that have no window at all; the others stay as they are, but with one-sided windows those
/// without a normal get one from the points around them. It asks that the row is inside the normals, that the others were
/// written, and that no other thread writes it.
impl Task for ChosenRow<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Groups>(self) {
        // SAFETY: as the caller's.
        unsafe { self.write::<S::Widest>() };
    }
}

impl ChosenRow<'_> {
    /// # Safety
    /// As the task's.
    #[inline(always)]
    unsafe fn write<S: Along>(&self) {
        let &ChosenRow { cloud, options, second_pass, y, sizes, of_left, .. } = self;
        let (first, size) = (y * cloud.width, (cloud.width, cloud.height));
        let choices = &second_pass.choices()[first..][..cloud.width];
        const { assert!(f32::from_bits(NO_WINDOW).is_nan()) };
        let whole = cloud.width / S::LANES * S::LANES;
        for x in (0..whole).step_by(S::LANES) {
            let choices = &choices[x..][..S::LANES];
            // As a float `NO_WINDOW` is NaN, and no place is.
            // SAFETY: as the caller's; there are so many choices.
            let lanes = unsafe {
                let choices = S::load(choices.as_ptr().cast());
                S::bits(S::eq(choices, choices))
            };
            let (mut without, mut left) = (0, 0);
            // Mostly all take a window.
            if lanes != all(S::LANES) {
                let others = second_pass.may_be_chosen(options, (x, y)) as u32;
                let others = others & all(S::LANES) & !lanes;
                let sizes = &sizes[x..][..S::LANES];
                // SAFETY: as the caller's; there are so many sizes.
                without =
                    unsafe { S::bits(S::eq(S::splat(0.0), S::load(sizes.as_ptr()))) } & others;
                left = others & !without;
                // Windows of one point may be those of a whole image.
                if let Some(points) = of_left
                    && left != 0
                {
                    let pixel = |lane: usize| (x + lane, y);
                    let around = |lane: usize| {
                        (pixel(lane), Rect::around(pixel(lane), sizes[lane] as usize, size))
                    };
                    // SAFETY: as the caller's; windows are inside the image.
                    without |= unsafe { of_one_point::<S>(points, left, around) };
                    left &= !without;
                }
            }
            let written = lanes | without;
            if written != 0 {
                // SAFETY: as the caller's.
                unsafe { self.write_chosen::<S>(x, choices, lanes, written) };
            }
            if of_left.is_some() {
                Bits(left).for_each(|lane| self.write_one(x + lane));
            }
            if options.one_sided_windows {
                let depths = &cloud.depths[first + x..][..S::LANES];
                // SAFETY: as the caller's; there are so many depths.
                let there = unsafe {
                    let depths = S::load(depths.as_ptr());
                    S::bits(S::eq(depths, depths))
                };
                Bits(there & !lanes).for_each(|lane| self.write_around(x + lane));
            }
        }
        for x in whole..cloud.width {
            self.write_one(x);
            if options.one_sided_windows {
                self.write_around(x);
            }
        }
    }

    /// Writes the normals of these lanes from column `x` on, which take the windows of these blocks, and none for the others
    /// that are `written`.
    ///
    /// # Safety
    /// As [`ChosenRow::write`]; the lanes are in the row.
    #[inline(always)]
    unsafe fn write_chosen<S: Along>(&self, x: usize, choices: &[u32], lanes: u32, written: u32) {
        let &ChosenRow { cloud, options, second_pass, normals, y, .. } = self;
        let of_even = second_pass.of_even();
        normals.prefetch((x, y), S::LANES, &(0..cloud.width));
        // SAFETY: as the caller's; an estimate is four floats, and so many points are there.
        unsafe {
            // Lanes without a window have any one's.
            let place = |lane: usize| (choices[lane] as usize).min(of_even.len() - 1);
            let [nx, ny, nz, curvature] = load_by_fours::<S>(|lane| of_even[place(lane)].as_ptr());
            // Read by fours of floats.
            let points = cloud.points[y * cloud.width + x..][..=S::LANES].as_ptr().cast();
            let [px, py, pz] = S::load_points(points, size_of::<[f32; 3]>());
            let normal = [Floats(nx), Floats(ny), Floats(nz)];
            let [nx, ny, nz] =
                turned::<S>(normal, [Floats(px), Floats(py), Floats(pz)], options.viewpoint);
            let mut fields = [nx.0, ny.0, nz.0, curvature];
            if written != lanes {
                let (there, none) = (S::mask(lanes), S::splat(f32::NAN));
                for field in &mut fields {
                    *field = S::select(there, *field, none);
                }
            }
            if written == all(S::LANES) {
                return normals.write_lanes::<S>(x, y, fields);
            }
            let mut found = [[0.0; LANES]; 4];
            for (to, field) in found.iter_mut().zip(fields) {
                S::store(to.as_mut_ptr(), field);
            }
            for lane in Bits(written) {
                let [nx, ny, nz, curvature] = found.each_ref().map(|field| field[lane]);
                normals.write(x + lane, y, [nx, ny, nz], curvature);
            }
        }
    }

    /// Writes the normal in a column, if it takes a window, has none or is left.
    #[cold]
    fn write_one(&self, x: usize) {
        let &ChosenRow { cloud, options, second_pass, normals, y, sizes, of_left } = self;
        let (at, size) = (y * cloud.width + x, sizes[x]);
        let left = || second_pass.left(of_left?, options, (x, y), size);
        if let Some(found) = second_pass.chosen(cloud, options, at, size).or_else(left) {
            // SAFETY: as the caller's of `write`.
            unsafe { normals.write(x, y, found.normal, found.curvature) };
        }
    }

    /// Writes the normal in a column where there is none so far, if the points around have one.
    fn write_around(&self, x: usize) {
        let &ChosenRow { cloud, options, second_pass, normals, y, .. } = self;
        // SAFETY: as the caller's of `write`.
        let has_normal = || unsafe { normals.has_normal(x, y) };
        let at = y * cloud.width + x;
        if let Some(found) = second_pass.estimate_around(cloud, options, at, has_normal) {
            // SAFETY: as the caller's of `write`.
            unsafe { normals.write(x, y, found.normal, found.curvature) };
        }
    }
}
