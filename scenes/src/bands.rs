//! Where in the image an estimate is hard: near depth edges and creases.

use crate::render::{Frame, NO_SURFACE};
use crate::vector::{Vector, dot};

/// A part of the image, by what is near.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Band {
    /// Within 8 px of a depth edge: of a pixel next to another surface with a gap between them, or to nothing.
    DepthEdge,
    /// Within 10 px of a crease, and not in the band of a depth edge: of a pixel next to another surface without a gap, at
    /// an angle above 10 degrees.
    Crease,
    /// All the rest.
    Elsewhere,
}

impl Band {
    /// All bands.
    pub const ALL: [Band; 3] = [Band::DepthEdge, Band::Crease, Band::Elsewhere];

    /// The bands of an exact frame's pixels, row by row (of a noisy one, its edges are noisy too).
    pub fn map(exact: &Frame) -> Vec<Band> {
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
        let mut map = vec![Band::Elsewhere; width * height];
        for (band, pixels, reach) in [(Band::Crease, creases, 10), (Band::DepthEdge, gaps, 8)] {
            for (x, y) in pixels {
                for ny in y.saturating_sub(reach)..(y + reach + 1).min(height) {
                    for nx in x.saturating_sub(reach)..(x + reach + 1).min(width) {
                        if x.abs_diff(nx).pow(2) + y.abs_diff(ny).pow(2) <= reach.pow(2) {
                            map[ny * width + nx] = band;
                        }
                    }
                }
            }
        }
        map
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
