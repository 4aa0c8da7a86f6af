//! Angles to the true normals, by band, with coverage.

use iine_scenes::{Band, Frame};

/// What an estimate is worth in a part of the image.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// Pixels with a point.
    pub points: usize,
    /// Angles to the truth in degrees, of those that got a normal.
    pub angles: Vec<f32>,
}

impl Score {
    /// Mean angle in degrees; NaN if there is no normal.
    pub fn mean(&self) -> f64 {
        self.angles.iter().map(|angle| f64::from(*angle)).sum::<f64>() / self.angles.len() as f64
    }

    /// Mean angle in degrees between the lines of the normals, 0 to 90; NaN if there is no normal.
    pub fn folded(&self) -> f64 {
        let fold = |angle: &f32| f64::from(angle.min(180.0 - angle));
        self.angles.iter().map(fold).sum::<f64>() / self.angles.len() as f64
    }

    /// Median angle in degrees; NaN if there is no normal.
    pub fn median(&self) -> f64 {
        let mut angles = self.angles.clone();
        angles.sort_by(f32::total_cmp);
        angles.get(angles.len() / 2).map_or(f64::NAN, |angle| f64::from(*angle))
    }

    /// Share of the points that got a normal, from 0 to 1.
    pub fn coverage(&self) -> f64 {
        self.angles.len() as f64 / self.points as f64
    }

    /// Adds another score's pixels.
    pub fn add(&mut self, other: &Score) {
        self.points += other.points;
        self.angles.extend_from_slice(&other.angles);
    }
}

/// The angle between two normals of any length in degrees, 0 to 180.
pub fn angle(a: [f32; 3], b: [f32; 3]) -> f32 {
    let (a, b) = (a.map(f64::from), b.map(f64::from));
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let sine = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
    sine.atan2(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).to_degrees() as f32
}

/// The normal turned to the camera, which is at the origin.
pub fn towards_camera(normal: [f32; 3], point: [f32; 3]) -> [f32; 3] {
    let dot: f32 = normal.iter().zip(point).map(|(n, p)| n * p).sum();
    if dot > 0.0 { normal.map(|c| -c) } else { normal }
}

/// Whether there is a normal: whatever is finite and not zero.
pub fn is_normal(normal: [f32; 3]) -> bool {
    normal.iter().all(|c| c.is_finite()) && normal != [0.0; 3]
}

/// The scores of normals at some pixels in the bands of [`Band::ALL`].
pub fn by_band(
    frame: &Frame,
    bands: &[Band],
    normals: &[[f32; 3]],
    pixels: impl Iterator<Item = usize>,
) -> [Score; 3] {
    let mut scores = [(); 3].map(|()| Score::default());
    for at in pixels.filter(|at| !frame.points[*at][2].is_nan()) {
        let normal = normals[at];
        let score = &mut scores[bands[at] as usize];
        score.points += 1;
        if is_normal(normal) {
            score.angles.push(angle(normal, frame.normals[at]));
        }
    }
    scores
}
