//! The plain form: the specification that every fast path is held to.

use crate::Error;
use crate::cloud::Points;
use crate::depth_change::depth_change_map;
use crate::distance::distance_map;
use crate::eigenvalues::eigenvalue_map;
use crate::memory::{refill, table};
use crate::methods::{Estimate, estimate_window, start};
use crate::options::{Options, Semantics};
use crate::orientation::turn_to_viewpoint;
use crate::paper::{
    self, Asked, Cloud, DepthChanges, EvenWindows, Marks, PaperMaps, Windows, even_window,
};
use crate::smoothing_area::window_side;
use crate::threads::Workers;
use crate::window::Image;

/// The whole method with PCL's semantics.
pub(crate) struct Plain<'a> {
    points: &'a Points<'a>,
    options: &'a Options,
    image: Image,
    pub depth_changes: Vec<bool>,
    pub distances: Vec<f32>,
}

impl<'a> Plain<'a> {
    pub fn new(points: &'a Points, options: &'a Options) -> Result<Self, Error> {
        let image = Image::of(points, options);
        let depth_changes = depth_change_map(points, options.max_depth_change_factor)?;
        let distances = distance_map(&depth_changes, image.width, image.height)?;
        Ok(Plain { points, options, image, depth_changes, distances })
    }

    /// The side of a pixel's window; 0 for none.
    pub fn window_side(&self, x: usize, y: usize) -> u32 {
        let Image { width, height, .. } = self.image;
        let border = self.options.ignored_border();
        let inside = |at: usize, size: usize| at >= border && at < size.saturating_sub(border);
        if !(inside(x, width) && inside(y, height)) {
            return 0;
        }
        window_side(self.distances[y * width + x], self.points.z(x, y), self.options)
    }

    pub fn estimate(&self, x: usize, y: usize) -> Estimate {
        of_own_window(self.points, self.options, (x, y), self.window_side(x, y) as f32)
    }

    /// The eigenvalues of the covariance matrices of all pixels' windows.
    pub fn eigenvalue_map(&self) -> Result<Vec<[f32; 3]>, Error> {
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

/// The estimate of a pixel from a window of any `size` around it, not turned.
pub(crate) fn of_window(
    points: &Points,
    options: &Options,
    pixel: (usize, usize),
    size: (usize, usize),
) -> Estimate {
    match options.semantics {
        Semantics::Pcl => {
            let image = Image::of(points, options);
            estimate_window(options.method, points, &image, pixel, size)
        }
        Semantics::Paper => paper::estimate_window(points, options, pixel, size),
    }
}

/// The estimate of a pixel from its own window, of a size as [`Engine::sizes`](paper::Engine::sizes) has it, turned to the
/// viewpoint.
pub(crate) fn of_own_window(
    points: &Points,
    options: &Options,
    pixel: (usize, usize),
    size: f32,
) -> Estimate {
    if size == 0.0 {
        return Estimate::NONE;
    }
    let side = match options.semantics {
        Semantics::Pcl => size as usize,
        Semantics::Paper => 2 * size as usize + 1,
    };
    let found = of_window(points, options, pixel, (side, side));
    turn_to_viewpoint(found, points.at(pixel.0, pixel.1), options.viewpoint)
}

/// What the second pass builds on.
pub(crate) struct PlainEngine<'a> {
    pub points: &'a Points<'a>,
    pub options: &'a Options,
    pub workers: &'a Workers,
    /// Row by row, as [`Engine::sizes`](paper::Engine::sizes).
    pub sizes: Vec<f32>,
}

impl PlainEngine<'_> {
    /// A pixel's own estimate.
    pub fn own(&self, at: usize) -> Estimate {
        let PlainEngine { points, options, sizes, .. } = self;
        let pixel = (at % points.width(), at / points.width());
        of_own_window(points, options, pixel, sizes[at])
    }
}

impl paper::Engine for PlainEngine<'_> {
    fn workers(&self) -> &Workers {
        self.workers
    }

    fn find_sizes(&mut self) -> Result<(), Error> {
        let &mut PlainEngine { points, options, ref mut sizes, .. } = self;
        let (width, height) = (points.width(), points.height());
        match options.semantics {
            Semantics::Pcl => {
                let plain = Plain::new(points, options)?;
                let side = |at: usize| plain.window_side(at % width, at / width) as f32;
                refill(sizes, (0..width * height).map(side))
            }
            Semantics::Paper => {
                let maps = PaperMaps::new(points, options)?;
                refill(sizes, maps.smoothing_radii.iter().map(|radius| radius.trunc()))
            }
        }
    }

    fn sizes(&self, y: usize) -> &[f32] {
        let width = self.points.width();
        &self.sizes[y * width..][..width]
    }

    fn find_depth_changes(&self, changes: &mut DepthChanges, cloud: &Cloud) -> Result<(), Error> {
        paper::find_depth_changes(changes, cloud, self.options, self.workers)
    }

    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        _concerned: &Marks,
        found: &mut Windows,
    ) -> Result<(), Error> {
        let Windows { even, of_even, .. } = found;
        let found = table((0..asked.blocks.count()).map(|block| even_window(cloud, asked, block)))?;
        refill(even, found.iter().map(|(window, _)| *window))?;
        refill(of_even, found.iter().map(|(_, estimate)| *estimate))
    }

    fn choices(&mut self, even: &EvenWindows, choices: &mut [u32]) {
        even.choose(choices);
    }
}
