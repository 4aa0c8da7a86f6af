//! Organized clouds to measure with, and what the measured output is held to.

use iine::{Estimator, Isa, Normals, Options, Points};

/// Floats of a point and of a normal, as `pcl::PointXYZ` and `pcl::Normal` have them.
pub const POINT: usize = 4;
pub const NORMAL: usize = 8;

/// An organized cloud.
pub struct Cloud {
    pub name: String,
    pub width: usize,
    pub height: usize,
    pub data: Vec<f32>,
}

impl Cloud {
    /// A wavy surface with a Kinect's depth steps, objects before it, their shadows, and holes. What is seen around
    /// a pixel does not depend on the size of the image, so that a pixel costs as much in all of them.
    /// `benches/cpp` has the same.
    pub fn generated(width: usize, height: usize) -> Cloud {
        use std::f32::consts::TAU;
        let focal_length = 525.0 * width as f32 / 640.0;
        let mut data = Vec::with_capacity(POINT * width * height);
        for row in 0..height {
            for column in 0..width {
                let (phase_x, phase_y) =
                    ((column % 160) as f32 / 160.0, (row % 120) as f32 / 120.0);
                let wave = 0.15 * (TAU * phase_x).sin() * (TAU * phase_y).cos();
                let beside = (30..80).contains(&(row % 120));
                let object = beside && (40..100).contains(&(column % 160));
                let shadow = beside && (34..40).contains(&(column % 160));
                let z = quantized(2.0 + wave - if object { 0.5 } else { 0.0 });
                if shadow || is_hole(column, row) {
                    data.extend([f32::NAN; POINT]);
                } else {
                    let x = (column as f32 - 0.5 * width as f32) / focal_length * z;
                    let y = (row as f32 - 0.5 * height as f32) / focal_length * z;
                    data.extend([x, y, z, 1.0]);
                }
            }
        }
        Cloud { name: format!("{width}x{height}"), width, height, data }
    }

    pub fn pixels(&self) -> usize {
        self.width * self.height
    }

    pub fn points(&self) -> Points<'_> {
        Points::interleaved(&self.data, self.width, self.height, POINT, 0).expect("a valid cloud")
    }

    /// Memory for this cloud's normals.
    pub fn output(&self) -> Vec<f32> {
        vec![0.0; NORMAL * self.pixels()]
    }

    pub fn compute(&self, estimator: &mut Estimator, output: &mut [f32]) {
        let mut normals = Normals::interleaved(output, self.width, self.height, NORMAL, 0, Some(4))
            .expect("a valid output");
        estimator.compute(&self.points(), &mut normals).expect("normals");
    }

    /// Panics unless the pixels that have a normal in `output` are those of the plain form, which specifies them.
    /// Of large images it is asked for a part: it is slow.
    #[allow(dead_code)]
    pub fn check(&self, options: &Options, output: &[f32]) {
        let window = (options.normal_smoothing_size as usize).pow(2);
        let step = (self.pixels() * window / 20_000_000).max(1);
        let indices: Vec<i32> = (0..self.pixels() as i32).step_by(step).collect();
        let mut expected = vec![0.0; POINT * indices.len()];
        let mut normals = Normals::interleaved(&mut expected, indices.len(), 1, POINT, 0, Some(3))
            .expect("a valid output");
        Estimator::with_isa(options.clone(), Isa::Scalar)
            .compute_indices(&self.points(), &indices, &mut normals)
            .expect("normals");
        let covered = expected.chunks(POINT).filter(|normal| !normal[0].is_nan()).count();
        assert!(covered > indices.len() / 4, "{}: {covered} of {}", self.name, indices.len());
        for (index, expected) in indices.iter().zip(expected.chunks(POINT)) {
            let found = output[NORMAL * *index as usize];
            assert_eq!(
                found.is_nan(),
                expected[0].is_nan(),
                "{}: pixel {index}, {options:?}",
                self.name
            );
        }
    }
}

/// The depth as a Kinect tells it, in steps of disparity.
fn quantized(z: f32) -> f32 {
    const STEP: f32 = 0.00285;
    1.0 / ((1.0 / (z * STEP)).round() * STEP)
}

/// Round holes in one of 16 cells.
fn is_hole(column: usize, row: usize) -> bool {
    const CELL: usize = 20;
    let hash = ((column / CELL) as u32).wrapping_mul(0x9e37_79b9)
        ^ ((row / CELL) as u32).wrapping_mul(0x85eb_ca6b);
    let hash = (hash ^ hash >> 15).wrapping_mul(0x2c1b_3c6d);
    let hash = hash ^ hash >> 12;
    let [x, y] = [column, row].map(|at| (at % CELL) as i32 - CELL as i32 / 2);
    let radius = 2 + (hash >> 8) as i32 % 6;
    hash.is_multiple_of(16) && x * x + y * y <= radius * radius
}
