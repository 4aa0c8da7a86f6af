//! The windows that a pixel can have besides the one around it, and which of them is best.
//!
//! A window is worth what error it leaves in the slope of a plane through its points. Noise of variance v in n points
//! leaves 12 v / (n L^2) in a window of side L; points that do not lie in one plane, or not in that of the pixel,
//! bend it by some share of their deviation over L.

use super::depth_change::SummedChanges;
use super::planes::{InverseDepths, Plane};
use super::rect::Rect;

/// Where in its window a pixel stands: in the middle, at the middle of an edge, in a corner.
const PLACES: [(i8, i8); 9] =
    [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];

/// Inverse depths that deviate less than this many alpha from a plane are as good as in it.
const EVEN: f64 = 0.02;
/// Among many small samples, one has by chance a variance far below the noise's. So the noise's variance is taken to
/// be this many standard deviations of a sample's variance above it.
const CHANCE: f64 = 5.0;
/// What the part of a window's variance that is not noise counts.
const MISFIT: f64 = 3.0;
/// What the squared distance of the points next to the pixel from the window's plane counts, where it is more than
/// `NEAR_NOISE` variances of their mean.
const NEAR: f64 = 9.0;
const NEAR_NOISE: f64 = 4.0;
/// On steep surfaces the sensor's noise along the rows and columns looks like depth changes. A window with some is
/// still on one surface if its points deviate from the plane by less than the plane changes in this many pixels:
/// across a true change it would be side / 6 pixels, so the window must be at least `JAGGED_SIDE` wide and have
/// `JAGGED_POINTS` of its points.
const JAGGED: f64 = 1.4;
const JAGGED_SIDE: usize = 7;
const JAGGED_POINTS: f64 = 0.8;

/// What candidates are measured by.
pub(crate) struct Candidates<'a> {
    pub planes: &'a InverseDepths,
    pub changes: &'a SummedChanges,
    /// Width and height of the image.
    pub size: (usize, usize),
    pub alpha: f64,
}

/// A window, the plane in it, and the expected squared error of the plane's slope.
#[derive(Clone)]
pub(crate) struct Choice {
    pub rect: Rect,
    pub plane: Plane,
    pub cost: f64,
}

impl Choice {
    /// The variance that counts as noise in a plane whose deviation is all noise.
    pub fn of_noise(rect: &Rect, plane: Plane) -> Choice {
        let length = rect.side() as f64;
        let cost = 12.0 * plane.unevenness / (plane.points * length * length);
        Choice { rect: rect.clone(), plane, cost }
    }
}

impl Candidates<'_> {
    /// The smallest variance that is told from none.
    pub fn least_noise(&self) -> f64 {
        (EVEN * self.alpha).powi(2)
    }

    /// The best window of one of the sides with the pixel in one of the nine places; none if all have depth changes
    /// or too few points. `found` is scratch memory.
    pub fn best(
        &self,
        pixel: (usize, usize),
        sides: impl Iterator<Item = usize> + Clone,
        found: &mut Vec<(Rect, Plane)>,
    ) -> Option<Choice> {
        let near = Rect::around(pixel, 1, self.size);
        let near =
            if self.changes.none_in(&near) { near } else { Rect::around(pixel, 0, self.size) };
        let near = self.planes.mean(&near)?;
        // Where there is no depth change as far as any window reaches, none need be asked.
        let reach = sides.clone().max().unwrap_or(0);
        let all_smooth = self.changes.none_in(&Rect::around(pixel, reach, self.size));

        found.clear();
        for side in sides {
            for rect in windows(pixel, side, self.size) {
                let smooth = all_smooth || self.changes.none_in(&rect);
                if !smooth && side < JAGGED_SIDE {
                    continue;
                }
                if let Some(plane) = self.planes.plane(&rect)
                    && (smooth || is_jagged(&plane, side))
                {
                    found.push((rect, plane));
                }
            }
        }

        let noise =
            |plane: &Plane| plane.unevenness * (1.0 + CHANCE * (2.0 / (plane.points - 3.0)).sqrt());
        let noise = found.iter().map(|(_, plane)| noise(plane)).fold(f64::INFINITY, f64::min);
        let noise = noise.max(self.least_noise());
        let mut best: Option<(f64, usize)> = None;
        for (i, (rect, plane)) in found.iter().enumerate() {
            let length = rect.side() as f64;
            let distance = near.inverse_depth - plane.at(near.position);
            let astray = (distance * distance - NEAR_NOISE * noise / near.points).max(0.0);
            let misfit = (plane.unevenness - noise).max(0.0);
            let bend = MISFIT * misfit + NEAR * astray;
            let cost = (12.0 * noise / plane.points + bend) / (length * length);
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, i));
            }
        }
        best.map(|(cost, i)| Choice { rect: found[i].0.clone(), plane: found[i].1, cost })
    }
}

fn is_jagged(plane: &Plane, side: usize) -> bool {
    plane.unevenness <= (JAGGED * plane.steepness()).powi(2)
        && plane.points >= JAGGED_POINTS * (side * side) as f64
}

/// The nine windows of a side that have the pixel in one of its places; at the border of the image they are moved
/// inside.
fn windows(
    (x, y): (usize, usize),
    side: usize,
    (width, height): (usize, usize),
) -> impl Iterator<Item = Rect> {
    let range = move |at: usize, place: i8, size: usize| {
        let side = side.min(size);
        let start = match place {
            0 => at.saturating_sub(side / 2),
            1 => at,
            _ => (at + 1).saturating_sub(side),
        };
        let start = start.min(size - side);
        start..start + side
    };
    PLACES.into_iter().map(move |(px, py)| Rect { x: range(x, px, width), y: range(y, py, height) })
}
