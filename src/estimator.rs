//! The estimator: options and scratch memory, and the steps in their order.

use crate::Error;
use crate::cloud::{Normals, Points};
use crate::fast::paper::FastEngine;
use crate::fast::{self, Job, SIZES, Scratch};
use crate::isa::Isa;
use crate::options::{Method, Options, Semantics};
use crate::orientation::turn_to_viewpoint;
use crate::output::Output;
use crate::paper::{Cloud, PaperMaps, SecondPass};
use crate::plain::{Plain, PlainEngine, of_window};
use crate::threads::Workers;

/// The maps behind the normals; each is written if it is there and must hold width x height elements, row by row,
/// unless it says otherwise.
///
/// They are those of the smoothing area map's own windows, whatever `one_sided_windows` and `crease_windows` say.
#[derive(Debug, Default)]
pub struct Maps<'a> {
    /// Radius that the depth asks for (the paper's B, Eq. 5), within its limits, in pixels; NaN at missing points.
    /// Only with [`Semantics::Paper`](crate::Semantics::Paper).
    pub depth_radii: Option<&'a mut [f32]>,
    /// Depth change indication map (the paper's C): 1 at a depth change, else 0. With
    /// [`Semantics::Pcl`](crate::Semantics::Pcl) both pixels of a change are marked, and those at and beside a z that is not
    /// finite, but two of the last row or column are never told apart, as in PCL; with
    /// [`Semantics::Paper`](crate::Semantics::Paper) the pixel before the change (Eq. 7): of missing points only the last one
    /// before a change across them.
    pub depth_changes: Option<&'a mut [u8]>,
    /// Distance to the nearest depth change in pixels (the paper's T; PCL's `getDistanceMap`). Without any in the image:
    /// width + height, with [`Semantics::Paper`](crate::Semantics::Paper) infinity.
    pub distances: Option<&'a mut [f32]>,
    /// Smoothing area map: the side of the pixel's window in pixels, or with
    /// [`Semantics::Paper`](crate::Semantics::Paper) its radius R (Eq. 8); 0 where there is no window.
    pub smoothing_areas: Option<&'a mut [f32]>,
    /// Eigenvalues of the covariance matrix (Eq. 16) of the finite points in every pixel's window, ascending, for
    /// edge and corner detection: three for every pixel, one after the other, so that this map holds
    /// 3 x width x height elements. In the cloud's unit squared; NaN where there is no window, or no finite point in it.
    /// Only with [`Method::CovarianceMatrix`](crate::Method::CovarianceMatrix).
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
    /// Normals have unit length and point to the viewpoint's side (to either where the pixel's x or y is not finite); pixels
    /// without one get NaN, also as curvature (which is 0 where all points of a PCL window of [`Method::CovarianceMatrix`]
    /// are one place).
    /// Errors: [`Error::Size`] if the sizes differ, [`Error::Overlap`], [`Error::OutOfMemory`], [`Error::Threads`], and what
    /// [`Options::check`] refuses.
    pub fn compute(&mut self, points: &Points, normals: &mut Normals) -> Result<(), Error> {
        self.options.check()?;
        if (points.width(), points.height()) != (normals.width(), normals.height()) {
            return Err(Error::Size);
        }
        normals.check_disjoint(points)?;
        self.compute_pixels(points, Output { normals, indices: None })
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
        if indices.iter().any(|&index| !usize::try_from(index).is_ok_and(|i| i < pixels)) {
            return Err(Error::Index);
        }
        normals.check_disjoint(points)?;
        self.compute_pixels(points, Output { normals, indices: Some(indices) })
    }

    /// The normals of a request that was checked.
    fn compute_pixels(&mut self, points: &Points, output: Output) -> Result<(), Error> {
        let points = &points.beside(output.normals);
        if !self.is_plain(points) {
            let Estimator { ref options, isa, ref mut scratch, .. } = *self;
            let job = Job { isa, points, options };
            if options.semantics == Semantics::Paper && !options.has_second_pass() {
                return fast::paper::compute(&job, output, scratch);
            }
            if !options.is_beyond_pcl() {
                return fast::compute(&job, output, scratch);
            }
            return self.compute_beyond_pcl(points, output);
        }
        if self.options.is_beyond_pcl() {
            return self.compute_beyond_pcl_plainly(points, output);
        }
        let width = points.width();
        let plain = Plain::new(points, &self.options)?;
        let estimate = |pixel: usize| plain.estimate(pixel % width, pixel / width);
        output.write(&Workers::default(), |_, pixel| Some(estimate(pixel)));
        Ok(())
    }

    /// Computes the normal of pixel `(x, y)` from the window of `width` x `height` pixels around it, whatever the
    /// depth changes, the smoothing size and the ignored border say; writes it to `normal`, which must be 1 x 1.
    ///
    /// The window starts at `(x - width / 2, y - height / 2)`; what lies outside the image is clipped, or folded
    /// back with [`BorderPolicy::Mirror`](crate::BorderPolicy::Mirror), which
    /// [`Semantics::Paper`](crate::Semantics::Paper) does not have. One-sided and crease windows have no effect, nor do they
    /// make points missing here. NaN if it gives no normal. If the pixel's point is not finite, the normal may point to
    /// either side. Takes time proportional to the window, or with `zero_is_missing` in PCL's semantics to the cloud.
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
        // Larger windows are clipped or folded to the same, but where they end would be no number of 32 bits.
        let [width, height] =
            [width, height].map(|side| (side as usize).min(isize::MAX as usize / 2));
        let size = (width, height);
        // The paper's methods leave zeros out themselves.
        let is_asked = self.options.semantics == Semantics::Pcl && self.options.zero_is_missing;
        let cleaned = self.cleaned(points, is_asked)?;
        let cleaned = cleaned.as_ref().map(Cloud::view);
        let found = of_window(cleaned.as_ref().unwrap_or(points), &self.options, (x, y), size);
        let found = turn_to_viewpoint(found, points.at(x, y), self.options.viewpoint);
        Output { normals: normal, indices: None }.write(&Workers::default(), |_, _| Some(found));
        Ok(())
    }

    /// Computes the maps behind the normals.
    ///
    /// Errors: [`Error::Size`] if a map's length is wrong, [`Error::Unsupported`] for a map that the semantics or the
    /// method does not have, [`Error::OutOfMemory`], and what [`Options::check`] refuses.
    pub fn compute_maps(&mut self, points: &Points, maps: &mut Maps) -> Result<(), Error> {
        self.options.check()?;
        let (width, height) = (points.width(), points.height());
        let Maps { depth_radii, depth_changes, distances, smoothing_areas, eigenvalues } = &*maps;
        let floats = [(depth_radii, 1), (distances, 1), (smoothing_areas, 1), (eigenvalues, 3)];
        let lengths = floats.map(|(map, fields)| map.as_ref().map(|map| (map.len(), fields)));
        let length = depth_changes.as_ref().map(|map| (map.len(), 1));
        let is_wrong = |(length, fields)| length != fields * width * height;
        if lengths.into_iter().chain([length]).flatten().any(is_wrong) {
            return Err(Error::Size);
        }
        if maps.eigenvalues.is_some() && self.options.method != Method::CovarianceMatrix
            || maps.depth_radii.is_some() && self.options.semantics != Semantics::Paper
        {
            return Err(Error::Unsupported);
        }
        let depth_changes = match self.options.semantics {
            Semantics::Pcl => self.maps_of_pcl(points, maps)?,
            Semantics::Paper => self.maps_of_paper(points, maps)?,
        };
        if let Some(map) = &mut maps.depth_changes {
            for (to, from) in map.iter_mut().zip(depth_changes) {
                *to = u8::from(from);
            }
        }
        Ok(())
    }

    /// Writes the maps but that of the depth changes, which is returned.
    fn maps_of_pcl(&self, points: &Points, maps: &mut Maps) -> Result<Vec<bool>, Error> {
        let cleaned = self.cleaned(points, self.options.is_beyond_pcl())?;
        let cleaned = cleaned.as_ref().map(Cloud::view);
        let plain = Plain::new(cleaned.as_ref().unwrap_or(points), &self.options)?;
        let eigenvalues = maps.eigenvalues.is_some().then(|| plain.eigenvalue_map());
        copy(&mut maps.eigenvalues, eigenvalues.transpose()?.unwrap_or_default().as_flattened());
        copy(&mut maps.distances, &plain.distances);
        if let Some(map) = &mut maps.smoothing_areas {
            for (at, to) in map.iter_mut().enumerate() {
                *to = plain.window_side(at % points.width(), at / points.width()) as f32;
            }
        }
        Ok(plain.depth_changes)
    }

    /// A copy of the points in which the missing ones are NaN, if it is asked for.
    fn cleaned(&self, points: &Points, is_asked: bool) -> Result<Option<Cloud>, Error> {
        is_asked.then(|| Cloud::new(points, &self.options)).transpose()
    }

    /// As [`Estimator::maps_of_pcl`].
    fn maps_of_paper(&self, points: &Points, maps: &mut Maps) -> Result<Vec<bool>, Error> {
        let of_paper = PaperMaps::new(points, &self.options)?;
        let eigenvalues = maps.eigenvalues.is_some().then(|| of_paper.eigenvalue_map());
        copy(&mut maps.eigenvalues, eigenvalues.transpose()?.unwrap_or_default().as_flattened());
        copy(&mut maps.depth_radii, &of_paper.depth_radii);
        copy(&mut maps.distances, &of_paper.distances);
        copy(&mut maps.smoothing_areas, &of_paper.smoothing_radii);
        Ok(of_paper.depth_changes)
    }

    /// As [`Estimator::compute_pixels`], by the plain form, where PCL's windows and sums alone are not what is asked for.
    fn compute_beyond_pcl_plainly(&mut self, points: &Points, output: Output) -> Result<(), Error> {
        let Estimator { options, scratch, cloud, second_pass, .. } = self;
        scratch.prepare(options.threads)?;
        cloud.read(points, options)?;
        let points = &cloud.view();
        let workers = scratch.workers();
        let mut engine = PlainEngine { points, options, workers, sizes: Vec::new() };
        second_pass.compute(cloud, options, &mut engine)?;
        output.write(workers, |_, at| {
            let chosen = second_pass.chosen(cloud, options, at, engine.sizes[at]);
            Some(chosen.unwrap_or_else(|| engine.own(at)))
        });
        write_around(cloud, options, second_pass, output, workers);
        Ok(())
    }

    /// The same, fast.
    fn compute_beyond_pcl(&mut self, points: &Points, output: Output) -> Result<(), Error> {
        let Estimator { ref options, isa, ref mut scratch, ref mut cloud, ref mut second_pass } =
            *self;
        let job = Job { isa, points, options };
        scratch.prepare(options.threads)?;
        fast::paper::read_cloud(&job, cloud, scratch)?;
        // To all windows, a point that misses a coordinate is missing whole.
        let points = &cloud.view().beside(output.normals);
        let job = Job { points, ..job };
        // But for zeros, which are left out now, this is as PCL.
        if !options.has_second_pass() {
            return fast::compute(&job, output, scratch);
        }
        // CM's sums are those of even windows too.
        let is_along = options.is_cm_of_paper();
        let own = is_along.then_some(output);
        second_pass.compute(cloud, options, &mut FastEngine { job, scratch, own })?;
        if !is_along {
            fast::paper::find_left(&job, second_pass.choices(), scratch)?;
            match options.semantics {
                Semantics::Pcl => fast::compute_left(&job, output, scratch),
                Semantics::Paper => fast::paper::compute_left(&job, output, scratch),
            }?;
        }
        // Of these hardly any is left: they are summed one by one.
        let of_left = is_along.then_some(points);
        let (scratch, workers, width) = (&*scratch, scratch.workers(), cloud.width);
        let Output { normals, indices } = output;
        if indices.is_none() {
            fast::paper::write_chosen(&job, second_pass, cloud, normals, of_left, scratch);
            return Ok(());
        }
        output.write(workers, |_, at| {
            let pixel = (at % width, at / width);
            let size = job.sizes(scratch, pixel.1)[pixel.0];
            let chosen = second_pass.chosen(cloud, options, at, size);
            chosen.or_else(|| second_pass.left(of_left?, options, pixel, size))
        });
        write_around(cloud, options, second_pass, output, workers);
        Ok(())
    }

    /// How much scratch memory is held, in bytes.
    pub fn scratch_size(&self) -> usize {
        self.scratch.size() + self.cloud.size() + self.second_pass.size()
    }

    /// Frees the scratch memory and the worker threads; the next computation makes them anew.
    pub fn release_scratch(&mut self) {
        *self = Self::with_isa(self.options.clone(), self.isa);
    }
}

/// With one-sided windows writes the estimates of the pixels that have no normal, where the points around them give one.
fn write_around(
    cloud: &Cloud,
    options: &Options,
    second_pass: &SecondPass,
    output: Output,
    workers: &Workers,
) {
    if options.one_sided_windows {
        output.write(workers, |(x, y), at| {
            // SAFETY: every normal has been written, and falls to one thread.
            let has_normal = || unsafe { output.normals.has_normal(x, y) };
            second_pass.estimate_around(cloud, options, at, has_normal)
        });
    }
}

/// Fills a map, if it is asked for.
fn copy(map: &mut Option<&mut [f32]>, from: &[f32]) {
    if let Some(map) = map {
        map.copy_from_slice(from);
    }
}
