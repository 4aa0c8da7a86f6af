//! The paper's own windows and methods, and what its conclusion leaves open: one-sided windows near depth changes
//! and a second pass near creases, both also on top of PCL's windows.
//!
//! One file per step, in its plain form. What the steps share is that a pixel's window is a rectangle inside the
//! image, and that a method turns the points in a rectangle into a normal.

mod candidates;
mod cloud;
mod creases;
mod depth_change;
mod distance;
mod methods;
mod one_sided;
mod planes;
mod rect;
pub(crate) mod smoothing_area;
mod summed_area;

pub(crate) use cloud::{CleanPoints, Cleaned};
pub(crate) use methods::estimate as plain_estimate;
pub(crate) use rect::Rect;
pub(crate) use smoothing_area::window;

use candidates::{Candidates, Choice};
use cloud::Cloud;
use creases::SummedNormals;
use depth_change::DepthChanges;
use one_sided::OneSided;
use planes::InverseDepths;

use crate::Error;
use crate::cloud::Points;
use crate::methods::{self as pcl, Estimate};
use crate::options::{BorderPolicy, Method, Options, Semantics};
use crate::orientation::turn_to_viewpoint;
use crate::window::Image;

/// A pixel's window, and the side it would have far from any depth change.
struct Window {
    rect: Option<Rect>,
    wanted_side: usize,
}

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
    (x, y): (usize, usize),
    size: (usize, usize),
) -> Estimate {
    let range = |at: usize, size: usize, limit: usize| {
        at.saturating_sub(size / 2)..(at + size).saturating_sub(size / 2).min(limit)
    };
    let rect = Rect { x: range(x, size.0, points.width()), y: range(y, size.1, points.height()) };
    if rect.x.is_empty() || rect.y.is_empty() {
        return Estimate::NONE;
    }
    of_rect(points, options, &rect)
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

/// How windows and their estimates are computed: by the plain forms, or fast. Estimates are turned to the viewpoint.
pub(crate) trait Engine {
    /// Every pixel's window, 0 for none, as a radius, or in PCL's semantics as a side; and its estimate.
    fn windows(&mut self) -> Result<(Vec<u32>, Vec<Estimate>), Error>;

    /// The estimates of other windows, for the pixels that have one.
    fn of_rects(&mut self, rects: &[Option<Rect>]) -> Result<Vec<Estimate>, Error>;
}

/// Every pixel's window around it, and the side it would have far from any depth change.
fn windows_around(cloud: &Cloud, options: &Options, sizes: &[u32]) -> Vec<Window> {
    let (width, height) = (cloud.width, cloud.height);
    let of_pixel = |(at, &size): (usize, &u32)| {
        let (x, y) = (at % width, at / width);
        let size = size as usize;
        match options.semantics {
            Semantics::Paper => {
                let wanted = smoothing_area::depth_radius(cloud.depths[at], &options.paper);
                Window {
                    rect: (size > 0).then(|| window((x, y), size, width, height)),
                    wanted_side: if wanted.is_nan() { 0 } else { 2 * wanted as usize + 1 },
                }
            }
            Semantics::Pcl => {
                let range = |at: usize, limit: usize| {
                    let start = at.saturating_sub(size / 2);
                    start..(start + size).min(limit)
                };
                let z = cloud.points[at][2];
                let wanted = crate::smoothing_area::window_side(f32::INFINITY, z, options);
                Window {
                    rect: (size > 0).then(|| Rect { x: range(x, width), y: range(y, height) }),
                    wanted_side: wanted as usize,
                }
            }
        }
    };
    sizes.iter().enumerate().map(of_pixel).collect()
}

/// The plain form's estimate of a pixel from any window.
pub(crate) fn of_rect(points: &Points, options: &Options, rect: &Rect) -> Estimate {
    match options.semantics {
        Semantics::Paper => {
            let cleaned = Cleaned { points, zero_is_missing: options.zero_is_missing };
            methods::estimate(options.method, &cleaned, rect)
        }
        Semantics::Pcl => {
            let (width, height) = (points.width(), points.height());
            let side = rect.side();
            let center = (rect.x.start + side / 2, rect.y.start + side / 2);
            let image = Image { width, height, border_policy: BorderPolicy::Ignore };
            let center = (center.0.min(width - 1), center.1.min(height - 1));
            pcl::estimate(options.method, points, &image, center, side)
        }
    }
}

/// The estimates of all pixels, row by row, turned to the viewpoint: near depth changes from one-sided windows, near
/// creases from the windows of a second pass, as the options ask.
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
    let changes = depth_changes(&cloud, options);
    let windows = windows_around(&cloud, options, &sizes);
    let planes = InverseDepths::new(&cloud);
    let candidates = Candidates {
        planes: &planes,
        changes: &changes.not_explained(&cloud, &planes).summed(),
        size: (width, height),
        alpha: f64::from(options.paper.alpha),
    };
    let one_sided = options.one_sided_windows.then(|| OneSided::new(&cloud, &candidates, &windows));
    if let Some(stage) = &one_sided {
        let moved = |(choice, moved): (&Option<Choice>, &bool)| {
            choice.as_ref().filter(|_| *moved).map(|choice| choice.rect.clone())
        };
        let rects: Vec<_> = stage.choices.iter().zip(&stage.moved).map(moved).collect();
        let second = engine.of_rects(&rects)?;
        for at in (0..rects.len()).filter(|at| stage.moved[*at]) {
            estimates[at] = second[at];
        }
    }
    if options.crease_windows {
        let normals = SummedNormals::new(&estimates, width, height);
        let largest = 2 * options.paper.largest_radius as usize + 1;
        let mut found = Vec::new();
        let mut crease_window = |(at, pixel): (usize, (usize, usize))| {
            let Window { rect, wanted_side } = &windows[at];
            // Those of the stage before are the best of their sizes already.
            if one_sided.as_ref().is_some_and(|stage| stage.moved[at])
                || !normals.vary_in(rect.as_ref()?)
            {
                return None;
            }
            let choice = creases::window(&candidates, pixel, *wanted_side, largest, &mut found);
            choice.map(|choice| choice.rect)
        };
        let rects: Vec<_> = pixels().map(&mut crease_window).collect();
        for (estimate, second) in estimates.iter_mut().zip(engine.of_rects(&rects)?) {
            if !second.normal[0].is_nan() {
                *estimate = second;
            }
        }
    }
    if let Some(stage) = &one_sided {
        let first = estimates.clone();
        for (at, pixel) in pixels().filter(|(at, _)| !cloud.is_missing(*at)) {
            let has_none = first[at].normal[0].is_nan();
            if !has_none && !stage.is_poor(at, windows[at].wanted_side) {
                continue;
            }
            let tolerance = tolerance(cloud.depths[at], options);
            let same = |depth: f32, difference: f32, distance: usize| {
                !is_depth_change(depth, difference, distance.max(1), options)
            };
            let found = stage
                .adopted(&cloud, &candidates, &first, pixel, tolerance)
                .or((!has_none).then_some(first[at]))
                .or_else(|| one_sided::plane_around(&cloud, pixel, same));
            if let Some(found) = found {
                let normal = turn_to_viewpoint(found.normal, cloud.points[at], options.viewpoint);
                estimates[at] = Estimate { normal, ..found };
            }
        }
    }
    let curvature = options.method == Method::CovarianceMatrix;
    if !curvature {
        estimates.iter_mut().for_each(|estimate| estimate.curvature = f32::NAN);
    }
    Ok(estimates)
}

/// How far from a plane a point at a depth may lie to be on that surface, in inverse depth: half a depth change.
fn tolerance(depth: f32, options: &Options) -> f64 {
    let change = match options.semantics {
        Semantics::Paper => {
            options.paper.gamma * smoothing_area::smallest_depth_change(depth, &options.paper)
        }
        Semantics::Pcl => crate::depth_change::threshold(depth, options.max_depth_change_factor),
    };
    f64::from(change / (depth * depth)) / 2.0
}
