//! Where in the image an estimate is hard: how far the nearest depth edge and the nearest crease are.

use crate::render::{Frame, NO_SURFACE};
use crate::vector::{Vector, dot};

/// A part of the image, by what is near.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Band {
    /// Within 8 px of a depth edge.
    DepthEdge,
    /// Within 10 px of a crease, and not in the band of a depth edge.
    Crease,
    /// All the rest.
    Elsewhere,
}

impl Band {
    /// All bands.
    pub const ALL: [Band; 3] = [Band::DepthEdge, Band::Crease, Band::Elsewhere];
}

/// Distances in pixels, row by row, up to [`Distances::REACH`]; infinite beyond.
#[derive(Clone, Debug)]
pub struct Distances {
    /// To the nearest pixel at a depth edge: next to another surface with a gap between them, or to nothing.
    pub depth_edge: Vec<f32>,
    /// To the nearest pixel at a crease: next to another surface without a gap, at an angle above 10 degrees.
    pub crease: Vec<f32>,
}

impl Distances {
    /// The farthest distance that is told apart.
    pub const REACH: usize = 24;

    /// The distances of an exact frame (of a noisy one, its edges are noisy too).
    pub fn of(exact: &Frame) -> Self {
        let (width, height) = (exact.width(), exact.height());
        let (mut gaps, mut creases) = (Vec::new(), Vec::new());
        for y in 0..height {
            for x in 0..width {
                for (nx, ny) in [(x + 1, y), (x, y + 1)] {
                    if nx >= width || ny >= height {
                        continue;
                    }
                    match border(exact, (x, y), (nx, ny)) {
                        Some(Band::DepthEdge) => gaps.extend([(x, y), (nx, ny)]),
                        Some(Band::Crease) => creases.extend([(x, y), (nx, ny)]),
                        _ => {}
                    }
                }
            }
        }
        Distances {
            depth_edge: spread(&gaps, width, height),
            crease: spread(&creases, width, height),
        }
    }

    /// The band of pixel number `at`.
    pub fn band(&self, at: usize) -> Band {
        if self.depth_edge[at] <= 8.0 {
            Band::DepthEdge
        } else if self.crease[at] <= 10.0 {
            Band::Crease
        } else {
            Band::Elsewhere
        }
    }
}

/// What lies between two neighbouring pixels.
fn border(frame: &Frame, a: (usize, usize), b: (usize, usize)) -> Option<Band> {
    let at = |(x, y): (usize, usize)| y * frame.width() + x;
    let (i, j) = (at(a), at(b));
    if frame.surfaces[i] == frame.surfaces[j] {
        return None;
    }
    if frame.surfaces[i] == NO_SURFACE || frame.surfaces[j] == NO_SURFACE {
        return Some(Band::DepthEdge);
    }
    let double = |v: [f32; 3]| -> Vector { v.map(f64::from) };
    let middle = frame.camera.ray((a.0 + b.0) as f64 / 2.0, (a.1 + b.1) as f64 / 2.0);
    let extended = |at: usize| {
        let normal = double(frame.normals[at]);
        dot(double(frame.points[at]), normal) / dot(middle, normal)
    };
    let (zi, zj) = (f64::from(frame.points[i][2]), f64::from(frame.points[j][2]));
    let tolerance = 0.01 * zi.min(zj);
    if (zi - zj).abs() > tolerance && (extended(i) - extended(j)).abs() > tolerance {
        return Some(Band::DepthEdge);
    }
    let cosine = dot(double(frame.normals[i]), double(frame.normals[j]));
    (cosine < 10f64.to_radians().cos()).then_some(Band::Crease)
}

/// The distance map of the pixels listed.
fn spread(pixels: &[(usize, usize)], width: usize, height: usize) -> Vec<f32> {
    let mut map = vec![f32::INFINITY; width * height];
    const REACH: usize = Distances::REACH;
    for &(x, y) in pixels {
        for ny in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
            for nx in x.saturating_sub(REACH)..(x + REACH + 1).min(width) {
                let distance = (nx as f32 - x as f32).hypot(ny as f32 - y as f32);
                let to = &mut map[ny * width + nx];
                *to = to.min(distance);
            }
        }
    }
    map
}
