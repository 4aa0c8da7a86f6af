//! The paper's own windows and methods, and what its conclusion leaves open: windows that end at depth changes and
//! at creases, both also on top of PCL's windows.
//!
//! The steps, in their plain forms, are `depth_change`, `distance`, `smoothing_area` and `methods`, over a `cloud`. The second pass
//! is `second_pass`, with `noise`, `bends`, `even_windows` (of `blocks`, by the `planes` of their points, from `summed_area`s),
//! `choices` and `surroundings`; `marks` are bits of pixels. What the steps share is that a pixel's window is a rectangle inside
//! the image, and that a method turns the points in a rectangle into a normal.

mod bends;
mod blocks;
mod choices;
mod cloud;
mod depth_change;
mod distance;
mod even_windows;
mod marks;
mod methods;
mod noise;
mod planes;
mod second_pass;
pub(crate) mod smoothing_area;
mod summed_area;
mod surroundings;

pub(crate) use blocks::{BLOCK, Blocks, MIDDLE};
pub(crate) use choices::{
    ALIKE, CREASE_COST, CREASE_NOISE, EvenWindows, MISFIT, NEAR_NOISE, NEXT, NO_WINDOW, REACH,
    inverse_depth_along, places_at,
};
pub(crate) use cloud::{Cleaned, Cloud};
pub(crate) use depth_change::{DepthChanges, between};
pub(crate) use even_windows::{
    Asked, CHANCE, EvenWindow, JAGGED, JAGGED_LINES, JAGGED_POINTS, JAGGED_RADIUS, RELIEF,
    RELIEF_RADIUS, TAKEN, estimate_of, even_window,
};
pub(crate) use marks::{Marks, WORD, columns as columns_of, from as marks_from, mark, word_of};
pub(crate) use methods::estimate as plain_estimate;
pub(crate) use noise::Noise;
pub(crate) use planes::{JITTER, Plane, estimate_in_space, inverse_depth};
pub(crate) use second_pass::{Engine, SecondPass, Windows};
pub(crate) use summed_area::{ROUNDING, SummedArea};

use std::iter::once;

use crate::Error;
use crate::cloud::Points;
use crate::eigenvalues::eigenvalue_map;
use crate::memory::table;
use crate::methods::Estimate;
use crate::options::{Options, Semantics};
use crate::rect::Rect;
use crate::threads::Workers;

/// The maps of [`Semantics::Paper`], row by row.
pub(crate) struct PaperMaps {
    cloud: Cloud,
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
    pub fn new(points: &Points, options: &Options) -> Result<Self, Error> {
        let cloud = Cloud::new(points, options)?;
        let paper = &options.paper;
        let mut depth_changes = DepthChanges::default();
        find_depth_changes(&mut depth_changes, &cloud, options, &Workers::default())?;
        let depth_changes = depth_changes.map((cloud.width, cloud.height))?;
        let distances = distance::distance_map(
            &depth_changes,
            cloud.width,
            cloud.height,
            paper.distance_metric,
        )?;
        let depth_radius = |depth: &f32| smoothing_area::depth_radius(*depth, paper);
        let depth_radii = table(cloud.depths.iter().map(depth_radius))?;
        let radius = |(&radius, &distance): (&f32, &f32)| {
            if radius.is_nan() {
                0.0
            } else {
                smoothing_area::smoothing_radius(radius, distance, paper)
            }
        };
        let smoothing_radii = table(depth_radii.iter().zip(&distances).map(radius))?;
        Ok(PaperMaps { cloud, depth_radii, depth_changes, distances, smoothing_radii })
    }

    /// The eigenvalues of the covariance matrices of all pixels' windows.
    pub fn eigenvalue_map(&self) -> Result<Vec<[f32; 3]>, Error> {
        let Cloud { width, height, .. } = self.cloud;
        let window = |x: usize, y: usize| {
            let radius = self.smoothing_radii[y * width + x] as usize;
            (radius > 0).then(|| once(Rect::around((x, y), radius, (width, height))))
        };
        let reach = self.smoothing_radii.iter().copied().fold(0.0, f32::max);
        eigenvalue_map(&self.cloud.view(), reach as usize, window)
    }
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
    let cleaned = Cleaned::new(points, options);
    methods::estimate(options.method, &cleaned, &rect)
}

/// The changes of a cloud: the plain form.
pub(crate) fn find_depth_changes(
    changes: &mut DepthChanges,
    cloud: &Cloud,
    options: &Options,
    workers: &Workers,
) -> Result<(), Error> {
    changes.find(cloud, options, workers, |depths, marks| between(depths, marks, options, 0))
}

/// Whether depths that differ by `difference` between pixels `gap` apart are a depth change apart; no NaN is.
pub(crate) fn is_depth_change(depth: f32, difference: f32, gap: usize, options: &Options) -> bool {
    match options.semantics {
        Semantics::Paper => smoothing_area::is_depth_change(depth, difference, gap, &options.paper),
        Semantics::Pcl => difference.abs() > least_depth_change(depth, options) * gap as f32,
    }
}

/// The difference in depth between neighbours that is a depth change.
fn least_depth_change(depth: f32, options: &Options) -> f32 {
    match options.semantics {
        Semantics::Paper => smoothing_area::least_depth_change(depth, &options.paper),
        Semantics::Pcl => crate::depth_change::threshold(depth, options.max_depth_change_factor),
    }
}

/// The part inside the image of a window of any size.
fn rect_around(pixel: (usize, usize), size: (usize, usize), image: (usize, usize)) -> Rect {
    let range = |at: usize, size: usize, limit: usize| {
        at.saturating_sub(size / 2)..(at + size).saturating_sub(size / 2).min(limit)
    };
    Rect { x: range(pixel.0, size.0, image.0), y: range(pixel.1, size.1, image.1) }
}
