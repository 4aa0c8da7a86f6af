//! Even windows: around every block's middle pixel the largest window whose points lie in one plane as well as chance
//! allows. The normal is that plane's.
//!
//! A pixel beside a depth change or a crease is in the middle of no large window that lies on one surface, but it is
//! at the edge or in the corner of some, which are the even windows of blocks nearby.

use super::bends::BEND_REACH;
use super::blocks::{BLOCK, Blocks, MIDDLE};
use super::choices::NEXT;
use super::cloud::Cloud;
use super::depth_change::Clean;
use super::noise::Noise;
use super::planes::{Plane, estimate_in_space};
use crate::methods::Estimate;
use crate::rect::Rect;

/// Small samples have, by chance, variances below the noise's. A window is even if its variance is at most this many
/// standard deviations of a sample's variance above that of the window of half its radius; and the noise's variance is
/// taken to be as far above the least one of all windows that a pixel can take.
pub(crate) const CHANCE: f32 = 3.0;
/// A plane takes as much of the noise's variance as three points have, or three areas if neighbours share it. Of the window of half
/// its radius that counts up to this share of the points: with less, small windows, which follow such noise, pass for better ones;
/// with more, creases in it pass for noise.
pub(crate) const TAKEN: f32 = 0.2;
/// Relief finer than windows, as stairs far away, makes one hardly less even than that of half its radius. If its variance is
/// above this many times the least that is told from none (half of alpha squared), and half its radius is this large, it must be
/// as even as the window of a quarter of its radius too.
pub(crate) const RELIEF: f64 = 1250.0;
pub(crate) const RELIEF_RADIUS: u32 = 4;
/// On steep surfaces the sensor's noise along the rows and columns looks like depth changes. A window with some is
/// still on one surface if its points deviate from the plane by less than the plane changes in `JAGGED` pixels, and that is
/// no less than what is told from none. Across a true change, up to a fivefold depth, they deviate by a share of about
/// 1 / `JAGGED_LINES` of the window's side or more, so this is a bound too, the side being as many lines as the points are
/// along the longer one. The window must have at least `JAGGED_RADIUS` and `JAGGED_POINTS` of its points.
pub(crate) const JAGGED: f64 = 1.4;
pub(crate) const JAGGED_LINES: f64 = 7.0;
pub(crate) const JAGGED_RADIUS: u32 = 4;
pub(crate) const JAGGED_POINTS: f64 = 0.8;

/// A block's even window, and what it is worth.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)] // Twelve floats, which the fast form reads as such.
pub(crate) struct EvenWindow {
    /// A whole number; 0 for no window.
    pub radius: f32,
    /// The plane q P = 1, and the ray of the window's mean point.
    pub q: [f32; 3],
    pub ray: [f32; 3],
    /// How much the plane's inverse depth changes from pixel to pixel.
    pub steepness: f32,
    /// The mean square deviation from the plane, and the variance that it may be of.
    pub unevenness: f32,
    pub noise: f32,
    /// What one of noise counts.
    pub per_noise: f32,
    /// How much the slope changes from pixel to pixel, squared: a plane through all points is wrong by that much for each
    /// pixel from the middle.
    pub bend2: f32,
}

const _: () = assert!(size_of::<EvenWindow>() == size_of::<[f32; 12]>());

/// What windows are asked for.
pub(crate) struct Asked<'a> {
    pub blocks: Blocks,
    /// The radius that the depth asks for, block by block, at most `limit`; 0 where all points are missing.
    pub wanted: &'a [u32],
    pub clean: Clean<'a>,
    /// The largest radius of all.
    pub limit: u32,
    pub noise: Noise,
    /// Whether estimates have a curvature.
    pub has_curvature: bool,
}

impl Asked<'_> {
    /// The largest radius that a block's window may have: twice the wanted one, since whether a pixel is on one side
    /// of a crease or on the other is told from less noise then.
    pub fn largest(&self, block: usize) -> u32 {
        (2 * self.wanted[block]).min(self.limit)
    }

    /// A window of whole blocks without a depth change in it, as large as an even window may be but not much larger than a
    /// block: how many are to each side.
    pub fn clean_blocks(&self, block: usize) -> usize {
        let clean = (self.clean.radii[block] as usize).saturating_sub(MIDDLE);
        let most = (self.largest(block) as usize).clamp(BLOCK, BEND_REACH * BLOCK);
        clean.min(most) / BLOCK
    }

    /// What a block's window of this radius covers of the image.
    fn rect(&self, block: usize, radius: u32, cloud: &Cloud) -> Rect {
        let middle = self.blocks.middle(block);
        Rect::around(middle, radius as usize, (cloud.width, cloud.height))
    }

    /// The variance of the mean of a pixel and those next to it, as a share of one point's.
    pub fn noise_share(&self) -> f32 {
        self.noise.area.min(NEXT) / NEXT
    }

    /// The estimate from a window with this plane.
    fn estimate(&self, plane: &Plane, is_jagged: bool) -> [f32; 4] {
        let found = if is_jagged { estimate_in_space(&plane.covariance) } else { plane.estimate() };
        let curvature = if self.has_curvature { found.curvature } else { f32::NAN };
        Estimate { curvature, ..found }.into()
    }
}

/// The even window of a block, and its estimate: the plain form.
pub(crate) fn even_window(cloud: &Cloud, asked: &Asked, block: usize) -> (EvenWindow, [f32; 4]) {
    let found = find_even_window(cloud, asked, block);
    found.unwrap_or((EvenWindow::default(), Estimate::NONE.into()))
}

/// The estimate of a block's even window, which has this radius: the plain form.
pub(crate) fn estimate_of(
    cloud: &Cloud,
    asked: &Asked,
    block: usize,
    radius: u32,
    is_jagged: bool,
) -> [f32; 4] {
    let plane = Plane::of(cloud, &asked.rect(block, radius, cloud));
    plane.map_or(Estimate::NONE.into(), |plane| asked.estimate(&plane, is_jagged))
}

/// A block's even window and its estimate, if there is one.
fn find_even_window(cloud: &Cloud, asked: &Asked, block: usize) -> Option<(EvenWindow, [f32; 4])> {
    let clean = asked.clean.radii[block] as u32;
    let wanted = asked.wanted[block];
    let rect = |radius: u32| asked.rect(block, radius, cloud);
    let plane = |radius: u32| Plane::of(cloud, &rect(radius));
    let jagged = |radius: u32| {
        let (plane, rect) = (plane(radius)?, rect(radius));
        let longer = rect.x.len().max(rect.y.len());
        let jagged = (plane.points / longer as f64 / JAGGED_LINES).min(JAGGED);
        let steep = jagged * jagged * plane.steepness_squared;
        let is_jagged = plane.unevenness <= steep
            && f64::from(asked.noise.least) <= steep
            && plane.points >= JAGGED_POINTS * rect.area() as f64;
        is_jagged.then_some((radius, plane))
    };
    let radii = std::iter::successors(Some(wanted), |radius| Some(radius * 7 / 10));
    let mut radii = radii.take_while(|radius| *radius > clean && *radius >= JAGGED_RADIUS);
    // The variance that a window's unevenness may be of, where its plane takes as much as so many points have.
    let noise = |plane: &Plane, taken: f32| {
        if asked.noise.is_none {
            return 0.0;
        }
        let (told, left) = (plane.points as f32 - 3.0, plane.points as f32 - taken);
        let chance = (2.0 * asked.noise.area / left).sqrt();
        plane.unevenness * f64::from(told / left * (1.0 + CHANCE * chance))
    };
    let areas = 3.0 * asked.noise.area;
    let taken_of = |half: &Plane| areas.min(TAKEN * half.points as f32).max(3.0);
    let least_noise = f64::from(asked.noise.least);
    let in_relief = |found: &Plane, radius: u32| {
        let is_rough = radius / 2 >= RELIEF_RADIUS && RELIEF * least_noise < found.unevenness;
        let quarter = is_rough.then(|| plane(radius / 4))??;
        let is_even = || found.unevenness < noise(&quarter, areas).max(least_noise);
        (areas < quarter.points as f32 && !is_even()).then_some(quarter)
    };
    let found = radii.find_map(jagged);
    let is_jagged = found.is_some();
    let even = || {
        let mut radius = asked.largest(block).min(clean);
        let mut found = plane(radius)?;
        while radius > 1
            && let Some(half) = plane(radius / 2)
        {
            if found.unevenness < noise(&half, taken_of(&half)).max(least_noise) {
                if let Some(quarter) = in_relief(&found, radius) {
                    (radius, found) = (radius / 4, quarter);
                    continue;
                }
                let sides2 = [radius, radius / 2].map(|radius| (2 * radius + 1).pow(2));
                let sides2 = f64::from(sides2[0] - sides2[1]);
                let bend2 = found.bend2(&half, sides2, least_noise, asked.noise.area.into());
                return Some((radius, found, bend2));
            }
            (radius, found) = (radius / 2, half);
        }
        Some((radius, found, 0.0))
    };
    let (radius, plane, bend2) = found.map(|(radius, plane)| (radius, plane, 0.0)).or_else(even)?;
    let (radius, points) = (radius as f32, plane.points as f32);
    let side = 2.0 * radius + 1.0;
    let window = EvenWindow {
        radius,
        q: plane.q.map(|q| q as f32),
        ray: plane.ray.map(|ray| ray as f32),
        steepness: plane.steepness_squared.sqrt() as f32,
        unevenness: plane.unevenness as f32,
        noise: noise(&plane, 3.0) as f32,
        per_noise: 12.0 * asked.noise.area / points / (side * side),
        bend2: bend2 as f32,
    };
    Some((window, asked.estimate(&plane, is_jagged)))
}
