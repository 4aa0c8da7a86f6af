//! The estimator: options and scratch memory, and the steps in their order.

use crate::Error;
use crate::cloud::{Normals, Points};
use crate::depth_change::depth_change_map;
use crate::distance::distance_map;
use crate::eigenvalues::eigenvalue_map;
use crate::fast::paper::{Job, Own, WithEven};
use crate::fast::{self, SIZES, Scratch};
use crate::isa::Isa;
use crate::memory::{refill, resize};
use crate::methods::{Estimate, estimate_window, start};
use crate::options::{Method, Options, Semantics};
use crate::orientation::turn_to_viewpoint;
use crate::paper::{
    self, Asked, Blocks, Cloud, DepthChanges, EvenWindows, Marks, PaperMaps, SecondPass, Windows,
};
use crate::smoothing_area::window_side;
use crate::threads::Workers;
use crate::window::Image;

/// The maps behind the normals; each is written if it is there and must hold width x height elements, row by row,
/// unless it says otherwise.
///
/// They are those of the smoothing area map's own windows, whatever `one_sided_windows` and `crease_windows` say.
#[derive(Debug, Default)]
pub struct Maps<'a> {
    /// Radius that the depth asks for (the paper's B, Eq. 5), within its limits, in pixels; NaN at missing points.
    /// Only with [`Semantics::Paper`](crate::Semantics::Paper).
    pub depth_radii: Option<&'a mut [f32]>,
    /// Depth change indication map (the paper's C): 1 at a depth change, else 0.
    pub depth_changes: Option<&'a mut [u8]>,
    /// Distance to the nearest depth change in pixels (the paper's T; PCL's `getDistanceMap`).
    pub distances: Option<&'a mut [f32]>,
    /// Smoothing area map: the side of the pixel's window in pixels, or with
    /// [`Semantics::Paper`](crate::Semantics::Paper) its radius R (Eq. 8); 0 where there is no window.
    pub smoothing_areas: Option<&'a mut [f32]>,
    /// Eigenvalues of the covariance matrix (Eq. 16) of the finite points in every pixel's window, ascending, for
    /// edge and corner detection: three for every pixel, one after the other, so that this map holds
    /// 3 x width x height elements. In the cloud's unit squared; NaN where there is no window. Only with
    /// [`Method::CovarianceMatrix`](crate::Method::CovarianceMatrix).
    pub eigenvalues: Option<&'a mut [f32]>,
}

/// Estimates the normals of organized point clouds. Owns its scratch memory, which is reused from frame to frame.
#[derive(Debug)]
pub struct Estimator {
    options: Options,
    isa: Isa,
    scratch: Scratch,
    cloud: Cloud,
    second_pass: SecondPass,
}

impl Estimator {
    /// An estimator with these options.
    pub fn new(options: Options) -> Self {
        Self::with_isa(options, Isa::active())
    }

    /// An estimator that computes with this instruction set, or with the active one if the processor lacks it.
    pub fn with_isa(options: Options, isa: Isa) -> Self {
        let isa = if isa.is_available() { isa } else { Isa::active() };
        let (scratch, cloud) = (Scratch::default(), Cloud::default());
        Estimator { options, isa, scratch, cloud, second_pass: SecondPass::default() }
    }

    /// The instruction set that computes.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// Whether the plain form computes: because it was asked for, or the image is tiny or too long.
    fn is_plain(&self, points: &Points) -> bool {
        self.isa == Isa::Scalar
            || !(SIZES.contains(&points.width()) && SIZES.contains(&points.height()))
    }

    /// The options.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The options, to change; they are checked when something is computed.
    pub fn options_mut(&mut self) -> &mut Options {
        &mut self.options
    }

    /// Computes the normal of every pixel of `points` into `normals`, which must be of the same size.
    ///
    /// Normals have unit length and point to the viewpoint's side; pixels without one get NaN, also as curvature (which is 0
    /// where all points of a PCL window of [`Method::CovarianceMatrix`] are one place).
    /// Errors: [`Error::Size`] if the sizes differ, [`Error::Overlap`], [`Error::OutOfMemory`], [`Error::Threads`], and what
    /// [`Options::check`] refuses.
    pub fn compute(&mut self, points: &Points, normals: &mut Normals) -> Result<(), Error> {
        self.options.check()?;
        if (points.width(), points.height()) != (normals.width(), normals.height()) {
            return Err(Error::Size);
        }
        normals.check_disjoint(points)?;
        self.compute_pixels(points, None, normals)
    }

    /// Computes the normals of the pixels that `indices` lists (row * width + column, any order, repeats
    /// allowed): element k of `normals`, which must be `indices.len()` x 1, belongs to `indices[k]` and equals what
    /// [`Estimator::compute`] gives for that pixel. An empty list does nothing.
    ///
    /// Errors: as [`Estimator::compute`], and [`Error::Index`].
    pub fn compute_indices(
        &mut self,
        points: &Points,
        indices: &[i32],
        normals: &mut Normals,
    ) -> Result<(), Error> {
        if indices.is_empty() {
            return Ok(());
        }
        self.options.check()?;
        if (normals.width(), normals.height()) != (indices.len(), 1) {
            return Err(Error::Size);
        }
        let pixels = points.width() * points.height();
        if indices.iter().any(|&index| usize::try_from(index).map_or(true, |i| i >= pixels)) {
            return Err(Error::Index);
        }
        normals.check_disjoint(points)?;
        self.compute_pixels(points, Some(indices), normals)
    }

    /// The normals of the pixels that `indices` list, or of all; everything was checked.
    fn compute_pixels(
        &mut self,
        points: &Points,
        indices: Option<&[i32]>,
        normals: &Normals,
    ) -> Result<(), Error> {
        let points = &points.beside(normals);
        if !self.is_plain(points) {
            let Estimator { ref options, isa, ref mut scratch, .. } = *self;
            if options.semantics == Semantics::Paper && !options.has_second_pass() {
                let job = Job { isa, points, options };
                return fast::paper::compute(&job, indices, normals, scratch);
            }
            if !options.is_beyond_pcl() {
                return fast::compute(isa, points, options, indices, normals, scratch);
            }
        }
        if self.options.is_beyond_pcl() {
            return self.compute_beyond_pcl(points, indices, normals);
        }
        let width = points.width();
        let plain = Plain::new(points, &self.options)?;
        let estimate = |pixel: usize| plain.estimate(pixel % width, pixel / width);
        write(normals, indices, width, &Workers::default(), |_, pixel| Some(estimate(pixel)));
        Ok(())
    }

    /// Computes the normal of pixel `(x, y)` from the window of `width` x `height` pixels around it, whatever the
    /// depth changes, the smoothing size and the ignored border say; writes it to `normal`, which must be 1 x 1.
    ///
    /// The window starts at `(x - width / 2, y - height / 2)`; what lies outside the image is clipped, or folded
    /// back with [`BorderPolicy::Mirror`](crate::BorderPolicy::Mirror), which
    /// [`Semantics::Paper`](crate::Semantics::Paper) does not have. NaN if it gives no normal. If the
    /// pixel's point is not finite, the normal may point to either side. Takes time proportional to the window, or with
    /// `zero_is_missing` in PCL's semantics to the cloud.
    /// Errors: as [`Estimator::compute`] but for threads, and [`Error::Index`] if the pixel is outside the cloud.
    pub fn compute_window(
        &mut self,
        points: &Points,
        (x, y): (usize, usize),
        (width, height): (u32, u32),
        normal: &mut Normals,
    ) -> Result<(), Error> {
        self.options.check()?;
        if (normal.width(), normal.height()) != (1, 1) {
            return Err(Error::Size);
        }
        if x >= points.width() || y >= points.height() {
            return Err(Error::Index);
        }
        normal.check_disjoint(points)?;
        let size = (width as usize, height as usize);
        let found = match self.options.semantics {
            Semantics::Pcl => {
                let (width, height) = (points.width(), points.height());
                let cleaned = self.without_zeros(points)?;
                let cleaned = cleaned.as_ref().map(|cleaned| packed(cleaned, width, height));
                let border_policy = self.options.border_policy;
                let image = Image { width, height, border_policy };
                let points = cleaned.as_ref().unwrap_or(points);
                estimate_window(self.options.method, points, &image, (x, y), size)
            }
            Semantics::Paper => paper::estimate_window(points, &self.options, (x, y), size),
        };
        let found = turn_to_viewpoint(found, points.at(x, y), self.options.viewpoint);
        // SAFETY: `normal` has this one element, and no other thread is at work.
        unsafe { normal.write(0, 0, found.normal, found.curvature) };
        Ok(())
    }

    /// Computes the maps behind the normals.
    ///
    /// Errors: [`Error::Size`] if a map's length is wrong, [`Error::Unsupported`] for a map that the semantics or the
    /// method does not have, [`Error::OutOfMemory`], and what [`Options::check`] refuses.
    pub fn compute_maps(&mut self, points: &Points, maps: &mut Maps) -> Result<(), Error> {
        self.options.check()?;
        let (width, height) = (points.width(), points.height());
        let lengths = [
            maps.depth_radii.as_ref().map(|map| map.len()),
            maps.depth_changes.as_ref().map(|map| map.len()),
            maps.distances.as_ref().map(|map| map.len()),
            maps.smoothing_areas.as_ref().map(|map| map.len()),
        ];
        let eigenvalues = maps.eigenvalues.as_ref().map_or(3 * width * height, |map| map.len());
        if lengths.into_iter().flatten().any(|length| length != width * height)
            || eigenvalues != 3 * width * height
        {
            return Err(Error::Size);
        }
        if maps.eigenvalues.is_some() && self.options.method != Method::CovarianceMatrix
            || maps.depth_radii.is_some() && self.options.semantics != Semantics::Paper
        {
            return Err(Error::Unsupported);
        }
        let cleaned = self.without_zeros(points)?;
        let cleaned = cleaned.as_ref().map(|cleaned| packed(cleaned, width, height));
        let points = cleaned.as_ref().unwrap_or(points);
        let write = |map: &mut Option<&mut [f32]>, from: &[f32]| {
            if let Some(map) = map {
                map.copy_from_slice(from);
            }
        };
        let depth_changes = match self.options.semantics {
            Semantics::Pcl => {
                let plain = Plain::new(points, &self.options)?;
                let eigenvalues = maps.eigenvalues.is_some().then(|| plain.eigenvalue_map());
                let eigenvalues = eigenvalues.transpose()?;
                write(&mut maps.distances, &plain.distances);
                if let Some(map) = &mut maps.smoothing_areas {
                    for (at, to) in map.iter_mut().enumerate() {
                        *to = plain.window_side(at % width, at / width) as f32;
                    }
                }
                write(&mut maps.eigenvalues, eigenvalues.unwrap_or_default().as_flattened());
                plain.depth_changes
            }
            Semantics::Paper => {
                let of_paper = PaperMaps::new(points, &self.options)?;
                let eigenvalues =
                    maps.eigenvalues.is_some().then(|| of_paper.eigenvalue_map(points));
                let eigenvalues = eigenvalues.transpose()?;
                write(&mut maps.depth_radii, &of_paper.depth_radii);
                write(&mut maps.distances, &of_paper.distances);
                write(&mut maps.smoothing_areas, &of_paper.smoothing_radii);
                write(&mut maps.eigenvalues, eigenvalues.unwrap_or_default().as_flattened());
                of_paper.depth_changes
            }
        };
        if let Some(map) = &mut maps.depth_changes {
            for (to, from) in map.iter_mut().zip(depth_changes) {
                *to = u8::from(from);
            }
        }
        Ok(())
    }

    /// A copy of the points without zeros, where those are missing.
    fn without_zeros(&self, points: &Points) -> Result<Option<Vec<[f32; 3]>>, Error> {
        let cleaned = || Ok(Cloud::new(points, &self.options)?.points);
        self.options.zero_is_missing.then(cleaned).transpose()
    }

    /// As [`Estimator::compute_pixels`], where PCL's windows and sums alone are not what is asked for.
    fn compute_beyond_pcl(
        &mut self,
        points: &Points,
        indices: Option<&[i32]>,
        normals: &Normals,
    ) -> Result<(), Error> {
        let is_plain = self.is_plain(points);
        let Estimator { options, isa, scratch, cloud, second_pass } = self;
        let isa = *isa;
        let job = Job { isa, points, options };
        scratch.prepare(options.threads)?;
        if is_plain {
            cloud.read(points, options)?;
        } else {
            fast::paper::read_cloud(&job, cloud, scratch)?;
        }
        // To all windows, a point that misses a coordinate is missing whole.
        let points = &packed(&cloud.points, cloud.width, cloud.height).beside(normals);
        // But for zeros, which are left out now, this is as PCL.
        if !is_plain && !options.has_second_pass() {
            return fast::compute(isa, points, options, indices, normals, scratch);
        }
        let job = Job { points, ..job };
        // CM's sums are those of even windows too.
        let is_along = !is_plain && options.is_cm_of_paper();
        let own = is_along.then_some((indices, normals));
        let mut engine = Engine { job, scratch, own, is_plain };
        second_pass.compute(cloud, options, &mut engine)?;
        let width = cloud.width;
        let is_whole = !is_plain && indices.is_none();
        let chosen = |at: usize| second_pass.chosen(cloud, options, at);
        if is_plain {
            let own = engine.own(second_pass.sizes())?;
            let estimate = |at: usize| chosen(at).unwrap_or_else(|| own(at));
            write(normals, indices, width, engine.scratch.workers(), |_, at| Some(estimate(at)));
        } else {
            if options.semantics == Semantics::Pcl {
                fast::compute(isa, points, options, indices, normals, scratch)?;
            } else if !is_along {
                let choices = second_pass.choices();
                fast::paper::compute_own(&job, choices, indices, normals, scratch)?;
            }
            let workers = scratch.workers();
            let of_left = is_along.then_some(points);
            if is_whole {
                fast::paper::write_chosen(&job, second_pass, cloud, normals, of_left, workers);
            } else {
                let left = |at| second_pass.left(of_left?, options, at);
                write(normals, indices, width, workers, |_, at| chosen(at).or_else(|| left(at)));
            }
        }
        if options.one_sided_windows && !is_whole {
            write(normals, indices, width, scratch.workers(), |(x, y), at| {
                // SAFETY: every normal has been written, and falls to one thread.
                let has_normal = || unsafe { normals.has_normal(x, y) };
                second_pass.estimate_around(cloud, options, at, has_normal)
            });
        }
        Ok(())
    }

    /// How much scratch memory is held, in bytes.
    pub fn scratch_size(&self) -> usize {
        self.scratch.size() + self.cloud.size() + self.second_pass.size()
    }

    /// Frees the scratch memory and the worker threads; the next computation makes them anew.
    pub fn release_scratch(&mut self) {
        self.scratch = Scratch::default();
        self.cloud = Cloud::default();
        self.second_pass = SecondPass::default();
    }
}

/// Writes the estimates of the pixels that `indices` list, or of all pixels of an image of this width, for which there is
/// one: `estimate` gives those of normals, by column and row, and of the pixels that they belong to.
fn write(
    normals: &Normals,
    indices: Option<&[i32]>,
    width: usize,
    workers: &Workers,
    estimate: impl Fn((usize, usize), usize) -> Option<Estimate> + Sync,
) {
    let put = |x: usize, y: usize, pixel: usize| {
        if let Some(Estimate { normal, curvature }) = estimate((x, y), pixel) {
            // SAFETY: there is an element for every index, or for every pixel, which falls to one thread.
            unsafe { normals.write(x, y, normal, curvature) };
        }
    };
    match indices {
        None => workers.for_each(normals.height(), |_, y| {
            (0..width).for_each(|x| put(x, y, y * width + x));
        }),
        Some(indices) => {
            indices.iter().enumerate().for_each(|(k, index)| put(k, 0, *index as usize));
        }
    }
}

/// A view of packed points, as many as the size says.
fn packed(points: &[[f32; 3]], width: usize, height: usize) -> Points<'_> {
    Points::interleaved(points.as_flattened(), width, height, 3, 0)
        .expect("a packed copy of a valid cloud")
}

/// A view of `width` x `height` estimates.
fn normals_of(
    estimates: &mut Vec<[f32; 4]>,
    (width, height): (usize, usize),
) -> Result<Normals<'_>, Error> {
    resize(estimates, width * height, Estimate::NONE.into())?;
    Normals::interleaved(estimates.as_flattened_mut(), width, height, 4, 0, Some(3))
}

/// The windows and estimates that the one-sided and crease windows build on.
struct Engine<'a> {
    job: Job<'a>,
    scratch: &'a mut Scratch,
    /// Where the estimates of the pixels that are not concerned are written along with even windows, as [`write`] has it.
    own: Option<(Option<&'a [i32]>, &'a Normals<'a>)>,
    is_plain: bool,
}

impl Engine<'_> {
    /// The plain form's estimates of the windows of these radii, by block, around blocks' middle pixels.
    fn plain_of_blocks(
        &self,
        blocks: &Blocks,
        radius: impl Fn(usize) -> u32,
        estimates: &mut Vec<[f32; 4]>,
    ) -> Result<(), Error> {
        let Job { points, options, .. } = self.job;
        let of_block = |block: usize| {
            paper::of_radius(points, options, blocks.middle(block), radius(block)).into()
        };
        refill(estimates, (0..blocks.count()).map(of_block))
    }

    /// The plain form of the pixels' own estimates, from windows of these sizes.
    fn own(&self, sizes: &[f32]) -> Result<impl Fn(usize) -> Estimate + Sync, Error> {
        let Job { points, options, .. } = self.job;
        let width = points.width();
        let is_pcl = options.semantics == Semantics::Pcl;
        let of_pcl = is_pcl.then(|| Plain::new(points, options)).transpose()?;
        Ok(move |at: usize| {
            let (x, y) = (at % width, at / width);
            let of_paper = || paper::of_radius(points, options, (x, y), sizes[at] as u32);
            of_pcl.as_ref().map_or_else(of_paper, |plain| plain.estimate(x, y))
        })
    }
}

impl paper::Engine for Engine<'_> {
    fn workers(&self) -> &Workers {
        self.scratch.workers()
    }

    fn sizes(&mut self, sizes: &mut Vec<f32>) -> Result<(), Error> {
        let Engine { job, ref mut scratch, is_plain, .. } = *self;
        let Job { isa, points, options, .. } = job;
        let (width, height) = (points.width(), points.height());
        match (options.semantics, is_plain) {
            (Semantics::Pcl, true) => {
                let plain = Plain::new(points, options)?;
                let side = |at: usize| plain.window_side(at % width, at / width) as f32;
                refill(sizes, (0..width * height).map(side))
            }
            (Semantics::Pcl, false) => {
                job.depths(scratch)?;
                fast::sides(isa, points, options, sizes, scratch)
            }
            (_, true) => {
                let maps = PaperMaps::new(points, options)?;
                refill(sizes, maps.smoothing_radii.iter().map(|radius| radius.trunc()))
            }
            (_, false) => fast::paper::radii(&job, sizes, scratch),
        }
    }

    fn find_depth_changes(&self, changes: &mut DepthChanges, cloud: &Cloud) -> Result<(), Error> {
        let Engine { job, scratch, is_plain, .. } = self;
        let workers = scratch.workers();
        if *is_plain {
            paper::find_depth_changes(changes, cloud, job.options, workers)
        } else {
            fast::paper::find_depth_changes(job, changes, cloud, workers)
        }
    }

    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        concerned: &Marks,
        found: &mut Windows,
    ) -> Result<(), Error> {
        let method = Method::CovarianceMatrix;
        let has_normals = self.job.options.method == method;
        let Windows { even, of_even, .. } = found;
        if self.is_plain {
            refill(even, paper::even_windows(cloud, asked))?;
            if has_normals {
                let blocks = &asked.blocks;
                self.plain_of_blocks(blocks, |block| even[block].radius as u32, of_even)?;
            }
            return Ok(());
        }
        let size = (asked.blocks.across, asked.blocks.down);
        let of_even = normals_of(of_even, size)?;
        let own = self.own.map(|(indices, normals)| Own { concerned, indices, normals });
        let along = has_normals.then_some(WithEven { of_even: &of_even, own });
        // CM's sums are what even windows are made from.
        let options = &Options { method, ..self.job.options.clone() };
        let job = Job { options, ..self.job };
        fast::paper::even_windows(&job, (cloud, asked), even, along, self.scratch)
    }

    fn choices(&mut self, even: &EvenWindows, choices: &mut [u32]) {
        if self.is_plain {
            even.choose(choices);
        } else {
            fast::paper::choices(self.job.isa, even, choices, self.scratch);
        }
    }

    fn of_blocks(
        &mut self,
        blocks: &Blocks,
        radii: &[u32],
        estimates: &mut Vec<[f32; 4]>,
    ) -> Result<(), Error> {
        if self.is_plain {
            let radius = |block: usize| radii[block];
            return self.plain_of_blocks(blocks, radius, estimates);
        }
        let normals = normals_of(estimates, (blocks.across, blocks.down))?;
        fast::paper::compute_of_blocks(&self.job, radii, &normals, self.scratch)
    }
}

/// The plain form of the whole method: the specification that every fast path is held to.
struct Plain<'a> {
    points: &'a Points<'a>,
    options: &'a Options,
    image: Image,
    depth_changes: Vec<bool>,
    distances: Vec<f32>,
}

impl<'a> Plain<'a> {
    fn new(points: &'a Points, options: &'a Options) -> Result<Self, Error> {
        let (width, height) = (points.width(), points.height());
        let depth_changes = depth_change_map(points, options.max_depth_change_factor)?;
        let distances = distance_map(&depth_changes, width, height)?;
        let image = Image { width, height, border_policy: options.border_policy };
        Ok(Plain { points, options, image, depth_changes, distances })
    }

    /// The side of a pixel's window; 0 for none.
    fn window_side(&self, x: usize, y: usize) -> u32 {
        let Image { width, height, .. } = self.image;
        let border = self.options.ignored_border();
        let inside = |at: usize, size: usize| at >= border && at < size.saturating_sub(border);
        if !(inside(x, width) && inside(y, height)) {
            return 0;
        }
        window_side(self.distances[y * width + x], self.points.z(x, y), self.options)
    }

    fn estimate(&self, x: usize, y: usize) -> Estimate {
        let side = self.window_side(x, y) as usize;
        if side == 0 {
            return Estimate::NONE;
        }
        let (points, image) = (self.points, &self.image);
        let found = estimate_window(self.options.method, points, image, (x, y), (side, side));
        turn_to_viewpoint(found, self.points.at(x, y), self.options.viewpoint)
    }

    /// The eigenvalues of the covariance matrices of all pixels' windows.
    fn eigenvalue_map(&self) -> Result<Vec<[f32; 3]>, Error> {
        let window = |x: usize, y: usize| {
            let side = self.window_side(x, y) as usize;
            let first = (start(x, side), start(y, side));
            let rects = self.image.rects(first, (side, side));
            (side > 0).then(|| rects.map(|(rect, _)| rect))
        };
        let Image { width, height, .. } = self.image;
        let sides = (0..width * height).map(|at| self.window_side(at % width, at / width));
        eigenvalue_map(self.points, sides.max().unwrap_or(0) as usize, window)
    }
}
