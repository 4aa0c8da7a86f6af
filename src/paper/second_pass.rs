//! The second pass: normals near depth changes and near creases, from even windows.

use super::cloud::Cloud;
use super::creases::SummedNormals;
use super::even_windows::{Asked, EvenWindow, EvenWindows};
use super::rect::Rect;
use super::{
    depth_changes, is_depth_change, rect_around, refill, smoothing_area, surroundings, window,
};
use crate::Error;
use crate::methods::Estimate;
use crate::options::{Method, Options, Semantics};
use crate::orientation::turn_to_viewpoint;

/// How windows and their estimates are computed: by the plain forms, or fast. Estimates are normals, turned to the
/// viewpoint, and curvatures.
pub(crate) trait Engine {
    /// Every pixel's window, 0 for none, as a radius, or in PCL's semantics as a side; and its estimate.
    fn windows(&mut self, sizes: &mut Vec<u32>, estimates: &mut Vec<[f32; 4]>)
    -> Result<(), Error>;

    /// The even windows of the needed pixels.
    fn even_windows(
        &mut self,
        cloud: &Cloud,
        asked: &Asked,
        needed: &[bool],
        windows: &mut Vec<EvenWindow>,
    ) -> Result<(), Error>;

    /// The pixel whose window each pixel takes, if there is one.
    fn choices(
        &mut self,
        even: &EvenWindows,
        choices: &mut Vec<Option<usize>>,
    ) -> Result<(), Error>;

    /// The estimates of other windows, for the pixels that have one, by their radii.
    fn of_radii(&mut self, radii: &[u32], estimates: &mut Vec<[f32; 4]>) -> Result<(), Error>;
}

/// The tables of the image, kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct SecondPass {
    /// Of the first pass; then as they should be.
    estimates: Vec<[f32; 4]>,
    /// The first pass' windows, and those far from any depth change.
    sizes: Vec<u32>,
    wanted: Vec<u32>,
    /// As [`Asked`] has them.
    radii: Vec<u32>,
    levels: Vec<u8>,
    normals: SummedNormals,
    windows: Vec<EvenWindow>,
    choices: Vec<Option<usize>>,
    /// The radii of the windows that some pixel takes, and their estimates.
    taken: Vec<u32>,
    second: Vec<[f32; 4]>,
}

/// As often as a radius can be halved.
const EVERY_LEVEL: u8 = u32::BITS as u8;

/// A crease does not bound the windows next to it as a depth change does: of the sizes that are tried, these many.
const CREASE_LEVELS: u8 = 2;

impl SecondPass {
    /// Bytes held.
    pub fn size(&self) -> usize {
        bytes(&self.estimates)
            + bytes(&self.sizes)
            + bytes(&self.wanted)
            + bytes(&self.radii)
            + bytes(&self.levels)
            + self.normals.size()
            + bytes(&self.windows)
            + bytes(&self.choices)
            + bytes(&self.taken)
            + bytes(&self.second)
    }

    /// The estimates of all pixels, row by row, turned to the viewpoint: near depth changes and near creases from
    /// even windows, as the options ask.
    pub fn estimates(
        &mut self,
        cloud: &Cloud,
        options: &Options,
        engine: &mut impl Engine,
    ) -> Result<&[[f32; 4]], Error> {
        engine.windows(&mut self.sizes, &mut self.estimates)?;
        if !(options.one_sided_windows || options.crease_windows) {
            return Ok(&self.estimates);
        }
        let limit = options.paper.largest_radius;
        self.concern(cloud, options, limit);
        let SecondPass { radii, levels, windows, choices, taken, second, .. } = self;
        let clean = depth_changes(cloud, options).not_explained(cloud).clean_radii();
        let least_noise = Asked::least_noise(options.paper.alpha);
        let asked = Asked { wanted: radii, levels, clean: &clean, limit, least_noise };
        engine.even_windows(cloud, &asked, &asked.needed(cloud.width, cloud.height), windows)?;
        let even = EvenWindows { cloud, asked: &asked, options, windows };
        engine.choices(&even, choices)?;
        refill(taken, choices.iter().map(|_| 0));
        for other in choices.iter().flatten() {
            taken[*other] = even.radius(*other);
        }
        engine.of_radii(taken, second)?;
        self.replace(cloud, options);
        Ok(&self.estimates)
    }

    /// Finds the pixels that another pixel's window may serve better than their own.
    fn concern(&mut self, cloud: &Cloud, options: &Options, limit: u32) {
        let SecondPass { estimates, sizes, wanted, radii, levels, normals, .. } = self;
        let pixels = 0..cloud.width * cloud.height;
        refill(wanted, pixels.clone().map(|at| wanted_size(cloud, options, at)));
        refill(radii, wanted.iter().map(|size| radius_of_size(*size, options).min(limit)));
        if options.crease_windows {
            normals.sum(estimates, cloud.width, cloud.height);
        }
        let levels_of = |at: usize| {
            let is_near_crease = || {
                let window = || window_of_size(cloud, options, at, sizes[at]);
                options.crease_windows && sizes[at] > 0 && normals.vary_in(&window())
            };
            if options.one_sided_windows && sizes[at] < wanted[at] {
                EVERY_LEVEL
            } else if !cloud.is_missing(at) && is_near_crease() {
                CREASE_LEVELS
            } else {
                0
            }
        };
        refill(levels, pixels.map(levels_of));
    }

    /// Gives the pixels concerned the estimates of the windows that they take.
    fn replace(&mut self, cloud: &Cloud, options: &Options) {
        let SecondPass { estimates, levels, choices, second, .. } = self;
        for at in (0..estimates.len()).filter(|at| levels[*at] > 0) {
            let found = choices[at].map(|other| second[other]).filter(|found| !found[0].is_nan());
            let around = || {
                let pixel = (at % cloud.width, at / cloud.width);
                let same = |depth: f32, difference: f32, distance: usize| {
                    !is_depth_change(depth, difference, distance.max(1), options)
                };
                let has_none = options.one_sided_windows && estimates[at][0].is_nan();
                has_none.then(|| surroundings::plane_around(cloud, pixel, same)).flatten()
            };
            if let Some(found) = found.map(Estimate::from).or_else(around) {
                let normal = turn_to_viewpoint(found.normal, cloud.points[at], options.viewpoint);
                estimates[at] = Estimate { normal, ..found }.into();
            }
        }
        if options.method != Method::CovarianceMatrix {
            estimates.iter_mut().for_each(|estimate| estimate[3] = f32::NAN);
        }
    }
}

/// Bytes that a table holds.
fn bytes<T>(table: &Vec<T>) -> usize {
    table.capacity() * size_of::<T>()
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
