//! What a Kinect makes of an exact cloud. A noisy depth keeps its pixel's ray, so x and y follow z.
//!
//! The truth of a noisy pixel is the surface that its depth was taken from: with lateral noise, the one its
//! displaced ray hit.

use crate::random::Random;
use crate::render::{Frame, Sight};
use crate::vector::dot;

/// A sensor noise model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// None.
    None,
    /// Axial and lateral noise after Nguyen, Izadi and Lovell, *Modeling Kinect Sensor Noise for Improved 3D
    /// Reconstruction and Tracking*, 2012. Angles above 80 deg, where the model diverges, count as 80.
    Nguyen,
    /// Disparity noise of 0.5 px, rounded to whole device units, after Khoshelham and Elberink, *Accuracy and
    /// Resolution of Kinect Depth Data for Indoor Mapping Applications*, 2012: 1/z = 3 - 2.85e-3 d.
    Khoshelham,
    /// As Khoshelham's, but alike in neighbouring pixels, as a sensor's matching windows leave it: means over 7 x 7 pixels, of
    /// the same standard deviation.
    Matched,
    /// Normally distributed in z with this standard deviation in metres (the paper's Fig. 8).
    Gaussian(f64),
}

const STEEPEST: f64 = 80.0 / 180.0 * std::f64::consts::PI;

impl Noise {
    /// The model called `name`: none, nguyen, khoshelham, matched, or gaussian-S with S in metres.
    pub fn by_name(name: &str) -> Option<Noise> {
        match name {
            "none" => Some(Noise::None),
            "nguyen" => Some(Noise::Nguyen),
            "khoshelham" => Some(Noise::Khoshelham),
            "matched" => Some(Noise::Matched),
            _ => name.strip_prefix("gaussian-")?.parse().ok().map(Noise::Gaussian),
        }
    }

    /// The frame as the sensor sees it.
    pub fn apply(self, exact: &Frame, random: &mut Random) -> Frame {
        let Frame { scene, camera, .. } = exact;
        let matched = match self {
            Noise::Matched => means(camera.width, camera.height, random),
            _ => Vec::new(),
        };
        scene.render_by(camera, |[x, y], ray| {
            let sight = scene.look(ray)?;
            let seen = match self {
                Noise::None => sight,
                Noise::Gaussian(sigma) => Sight { z: sight.z + sigma * random.normal(), ..sight },
                Noise::Khoshelham => {
                    Sight { z: through_disparity(sight.z, random.normal()), ..sight }
                }
                Noise::Matched => {
                    let noise = matched[y * camera.width + x];
                    Sight { z: through_disparity(sight.z, noise), ..sight }
                }
                Noise::Nguyen => {
                    let sigma = lateral(angle(&sight, ray));
                    let [x, y] = [x, y].map(|at| at as f64 + sigma * random.normal());
                    let (aside, z_noise) = (camera.ray(x, y), random.normal());
                    let seen = scene.look(aside)?;
                    Sight { z: seen.z + axial(angle(&seen, aside), seen.z) * z_noise, ..seen }
                }
            };
            (seen.z > 0.0).then_some(seen)
        })
    }
}

/// The angle between the surface's normal and the ray.
fn angle(sight: &Sight, ray: [f64; 3]) -> f64 {
    let cosine = -dot(sight.normal, ray) / dot(ray, ray).sqrt();
    cosine.clamp(0.0, 1.0).acos().min(STEEPEST)
}

/// Nguyen's lateral standard deviation in pixels.
fn lateral(theta: f64) -> f64 {
    0.8 + 0.035 * theta / (std::f64::consts::FRAC_PI_2 - theta)
}

/// Nguyen's axial standard deviation in metres.
fn axial(theta: f64, z: f64) -> f64 {
    let frontal = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
    if theta <= std::f64::consts::FRAC_PI_3 {
        return frontal;
    }
    let left = std::f64::consts::FRAC_PI_2 - theta;
    frontal + 0.0001 * theta * theta / (z.sqrt() * left * left)
}

/// Normally distributed, row by row, and alike in pixels next to each other.
fn means(width: usize, height: usize, random: &mut Random) -> Vec<f64> {
    const SIDE: usize = 7;
    let columns = width + SIDE - 1;
    let own: Vec<f64> = (0..columns * (height + SIDE - 1)).map(|_| random.normal()).collect();
    let mean = |at: usize| {
        let (x, y) = (at % width, at / width);
        let rows = own[y * columns..].chunks(columns).take(SIDE);
        rows.map(|row| row[x..x + SIDE].iter().sum::<f64>()).sum::<f64>() / SIDE as f64
    };
    (0..width * height).map(mean).collect()
}

/// A depth as it comes back from a disparity in whole device units, with this noise in standard deviations.
fn through_disparity(z: f64, noise: f64) -> f64 {
    const UNIT: f64 = 2.85e-3;
    const SIGMA: f64 = 0.5;
    let disparity = (3.0 - 1.0 / z) / UNIT + SIGMA * noise;
    1.0 / (3.0 - UNIT * disparity.round())
}

/// Removes every point with this probability.
pub fn drop_out(frame: &mut Frame, probability: f64, random: &mut Random) {
    for point in &mut frame.points {
        if random.uniform() < probability {
            *point = [f32::NAN; 3];
        }
    }
}
