//! The paper's own windows and methods, and what its conclusion leaves open: windows that end at depth changes and
//! at creases, both also on top of PCL's windows.
//!
//! One file per step, in its plain form. What the steps share is that a pixel's window is a rectangle inside the
//! image, and that a method turns the points in a rectangle into a normal.

mod cloud;
mod creases;
mod depth_change;
mod distance;
mod even_windows;
mod methods;
mod planes;
mod rect;
pub(crate) mod smoothing_area;
mod summed_area;
mod surroundings;

pub(crate) use cloud::{CleanPoints, Cleaned, Cloud};
pub(crate) use even_windows::{
    Asked, CHANCE, EvenWindow, EvenWindows, JAGGED, JAGGED_POINTS, JAGGED_RADIUS, MISFIT, NEAR,
    NEAR_NOISE, REACH, even_windows,
};
pub(crate) use methods::estimate as plain_estimate;
pub(crate) use planes::{JITTER, Plane, inverse_depth};
pub(crate) use rect::Rect;
pub(crate) use smoothing_area::window;

use creases::SummedNormals;
use depth_change::DepthChanges;

use crate::Error;
use crate::cloud::Points;
use crate::methods::Estimate;
use crate::options::{Method, Options, Semantics};
use crate::orientation::turn_to_viewpoint;

/// The maps of [`Semantics::Paper`], row by row.
pub(crate) struct PaperMaps {
    /// B in pixels; NaN at missing points.
    pub depth_radii: Vec<f32>,
    /// C.
    pub depth_changes: Vec<bool>,
    /// T in pixels.
    pub distances: Vec<f32>,
    /// R in pixels; 0 where there is no window.
    pub smoothing_radii: Vec<f32>,
}

impl PaperMaps {
    pub fn new(points: &Points, options: &Options) -> Self {
        let cloud = Cloud::new(points, options);
        let paper = &options.paper;
        let depth_changes = depth_changes(&cloud, options).map();
        let distances = distance::distance_map(
            &depth_changes,
            cloud.width,
            cloud.height,
            paper.distance_metric,
        );
        let depth_radii: Vec<f32> =
            cloud.depths.iter().map(|depth| smoothing_area::depth_radius(*depth, paper)).collect();
        let radius = |(&radius, &distance): (&f32, &f32)| {
            if radius.is_nan() {
                0.0
            } else {
                smoothing_area::smoothing_radius(radius, distance, paper)
            }
        };
        let smoothing_radii = depth_radii.iter().zip(&distances).map(radius).collect();
        PaperMaps { depth_radii, depth_changes, distances, smoothing_radii }
    }
}

/// The covariance matrices' eigenvalues of all pixels with one of these radii; NaN for the others.
pub(crate) fn eigenvalue_map(points: &Points, options: &Options, radii: &[f32]) -> Vec<[f32; 3]> {
    let cloud = Cleaned { points, zero_is_missing: options.zero_is_missing };
    let (width, height) = (points.width(), points.height());
    let of_pixel = |(at, &radius): (usize, &f32)| {
        if radius == 0.0 {
            return [f32::NAN; 3];
        }
        let pixel = (at % width, at / width);
        let rect = smoothing_area::window(pixel, radius as usize, width, height);
        let values = methods::eigenvalues(&cloud, &rect);
        values.map_or([f32::NAN; 3], |values| values.map(|value| value as f32))
    };
    radii.iter().enumerate().map(of_pixel).collect()
}

/// The points, row by row, with NaN for every missing one.
pub(crate) fn with_missing_as_nan(points: &Points, options: &Options) -> Vec<[f32; 3]> {
    Cloud::new(points, options).points
}

/// The estimate of a pixel from the part of a window of any `size` that lies inside the image, not turned.
pub(crate) fn estimate_window(
    points: &Points,
    options: &Options,
    pixel: (usize, usize),
    size: (usize, usize),
) -> Estimate {
    let rect = rect_around(pixel, size, (points.width(), points.height()));
    if rect.x.is_empty() || rect.y.is_empty() {
        return Estimate::NONE;
    }
    let cleaned = Cleaned { points, zero_is_missing: options.zero_is_missing };
    methods::estimate(options.method, &cleaned, &rect)
}

fn depth_changes(cloud: &Cloud, options: &Options) -> DepthChanges {
    DepthChanges::find(cloud, |depth, difference, gap| {
        is_depth_change(depth, difference, gap, options)
    })
}

/// Whether depths that differ by `difference` between pixels `gap` apart are a depth change apart.
fn is_depth_change(depth: f32, difference: f32, gap: usize, options: &Options) -> bool {
    match options.semantics {
        Semantics::Paper => smoothing_area::is_depth_change(depth, difference, gap, &options.paper),
        Semantics::Pcl => {
            let threshold = crate::depth_change::threshold(depth, options.max_depth_change_factor);
            difference.abs() > threshold * gap as f32
        }
    }
}

/// The difference in depth between neighbours that is a depth change.
fn least_depth_change(depth: f32, options: &Options) -> f32 {
    match options.semantics {
        Semantics::Paper => {
            options.paper.gamma * smoothing_area::smallest_depth_change(depth, &options.paper)
        }
        Semantics::Pcl => crate::depth_change::threshold(depth, options.max_depth_change_factor),
    }
}

/// How windows and their estimates are computed: by the plain forms, or fast. Estimates are turned to the viewpoint.
pub(crate) trait Engine {
    /// Every pixel's window, 0 for none, as a radius, or in PCL's semantics as a side; and its estimate.
    fn windows(&mut self) -> Result<(Vec<u32>, Vec<Estimate>), Error>;

    /// The even windows of the needed pixels.
    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        needed: &[bool],
    ) -> Result<Vec<EvenWindow>, Error>;

    /// The pixel whose window each pixel takes, if there is one.
    fn choices(&mut self, even: &EvenWindows) -> Result<Vec<Option<usize>>, Error>;

    /// The estimates of other windows, for the pixels that have one, by their radii.
    fn of_radii(&mut self, radii: &[u32]) -> Result<Vec<Estimate>, Error>;
}

/// The size that the window of a pixel has far from any depth change, as [`Engine::windows`] gives them; 0 at a
/// missing point.
fn wanted_size(cloud: &Cloud, options: &Options, at: usize) -> u32 {
    match options.semantics {
        Semantics::Paper => smoothing_area::depth_radius(cloud.depths[at], &options.paper) as u32,
        Semantics::Pcl => {
            crate::smoothing_area::window_side(f32::INFINITY, cloud.points[at][2], options)
        }
    }
}

/// The radius of a window of a size as [`Engine::windows`] gives them.
fn radius_of_size(size: u32, options: &Options) -> u32 {
    match options.semantics {
        Semantics::Paper => size,
        Semantics::Pcl => size / 2,
    }
}

/// The window of a size as [`Engine::windows`] gives them, without what lies outside the image.
fn window_of_size(cloud: &Cloud, options: &Options, at: usize, size: u32) -> Rect {
    let (width, height) = (cloud.width, cloud.height);
    let (pixel, size) = ((at % width, at / width), size as usize);
    match options.semantics {
        Semantics::Paper => window(pixel, size, width, height),
        Semantics::Pcl => rect_around(pixel, (size, size), (width, height)),
    }
}

/// The part inside the image of a window of any size.
fn rect_around(pixel: (usize, usize), size: (usize, usize), image: (usize, usize)) -> Rect {
    let range = |at: usize, size: usize, limit: usize| {
        at.saturating_sub(size / 2)..(at + size).saturating_sub(size / 2).min(limit)
    };
    Rect { x: range(pixel.0, size.0, image.0), y: range(pixel.1, size.1, image.1) }
}

/// The plain form's estimate of a pixel from the window of a radius.
pub(crate) fn of_radius(
    points: &Points,
    options: &Options,
    pixel: (usize, usize),
    radius: usize,
) -> Estimate {
    let cleaned = Cleaned { points, zero_is_missing: options.zero_is_missing };
    let rect = window(pixel, radius, points.width(), points.height());
    methods::estimate(options.method, &cleaned, &rect)
}

/// The estimates of all pixels, row by row, turned to the viewpoint: near depth changes and near creases from the
/// even windows of a second pass, as the options ask.
pub(crate) fn estimates(
    points: &Points,
    options: &Options,
    engine: &mut impl Engine,
) -> Result<Vec<Estimate>, Error> {
    let (sizes, mut estimates) = engine.windows()?;
    if !(options.one_sided_windows || options.crease_windows) {
        return Ok(estimates);
    }
    let cloud = Cloud::new(points, options);
    let (width, height) = (cloud.width, cloud.height);
    let pixels = || (0..width * height).map(|at| (at, (at % width, at / width)));
    let wanted: Vec<u32> = (0..width * height).map(|at| wanted_size(&cloud, options, at)).collect();
    let clean = depth_changes(&cloud, options).not_explained(&cloud).clean_radii();
    let limit = options.paper.largest_radius;
    let radius = |size: &u32| radius_of_size(*size, options).min(limit);
    let wanted_radii: Vec<u32> = wanted.iter().map(radius).collect();
    let normals = options.crease_windows.then(|| SummedNormals::new(&estimates, width, height));
    // None unless another pixel's window may serve better than its own.
    let levels = |at: usize| {
        let is_near_crease = || {
            sizes[at] > 0
                && normals.as_ref().is_some_and(|normals| {
                    normals.vary_in(&window_of_size(&cloud, options, at, sizes[at]))
                })
        };
        if options.one_sided_windows && sizes[at] < wanted[at] {
            EVERY_LEVEL
        } else if !cloud.is_missing(at) && is_near_crease() {
            CREASE_LEVELS
        } else {
            0
        }
    };
    let levels: Vec<u8> = (0..width * height).map(levels).collect();
    let asked = Asked {
        wanted: &wanted_radii,
        levels: &levels,
        clean: &clean,
        limit,
        least_noise: Asked::least_noise(options.paper.alpha),
    };
    let windows = engine.even_windows(&cloud, &asked, &asked.needed(width, height))?;
    let even = EvenWindows { cloud: &cloud, asked: &asked, options, windows };
    let choices = engine.choices(&even)?;
    let mut taken = vec![0; width * height];
    for other in choices.iter().flatten() {
        taken[*other] = even.radius(*other);
    }
    let second = engine.of_radii(&taken)?;
    for (at, pixel) in pixels().filter(|(at, _)| levels[*at] > 0) {
        let found =
            choices[at].map(|other| second[other]).filter(|found| !found.normal[0].is_nan());
        let around = || {
            let same = |depth: f32, difference: f32, distance: usize| {
                !is_depth_change(depth, difference, distance.max(1), options)
            };
            let has_none = options.one_sided_windows && estimates[at].normal[0].is_nan();
            has_none.then(|| surroundings::plane_around(&cloud, pixel, same)).flatten()
        };
        if let Some(found) = found.or_else(around) {
            let normal = turn_to_viewpoint(found.normal, cloud.points[at], options.viewpoint);
            estimates[at] = Estimate { normal, ..found };
        }
    }
    if options.method != Method::CovarianceMatrix {
        estimates.iter_mut().for_each(|estimate| estimate.curvature = f32::NAN);
    }
    Ok(estimates)
}

/// As often as a radius can be halved.
const EVERY_LEVEL: u8 = u32::BITS as u8;

/// A crease does not bound the windows next to it as a depth change does: of the sizes that are tried, these many.
const CREASE_LEVELS: u8 = 2;
