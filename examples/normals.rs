//! The Rust API on a generated cloud: a ramp with a step in depth.
//!
//! `cargo run --release --example normals`

use iine::{Estimator, Method, Normals, Options, Points};

fn main() -> Result<(), iine::Error> {
    let (width, height, focal_length) = (320, 240, 262.5);
    let mut cloud = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let u = (column as f32 - width as f32 / 2.0) / focal_length;
            let v = (row as f32 - height as f32 / 2.0) / focal_length;
            let distance = if column < width / 2 { 2.0 } else { 3.0 };
            let z = distance / (1.0 + 0.5 * v); // the plane z + y / 2 = distance
            cloud.extend([u * z, v * z, z]);
        }
    }

    // nx, ny, nz, curvature per pixel; pixels without a normal get NaN.
    let mut normals = vec![0.0; 4 * width * height];
    let mut options = Options::default();
    options.method = Method::CovarianceMatrix;
    let mut estimator = Estimator::new(options);
    estimator.compute(
        &Points::interleaved(&cloud, width, height, 3, 0)?,
        &mut Normals::interleaved(&mut normals, width, height, 4, 0, Some(3))?,
    )?;

    let covered = normals.chunks(4).filter(|normal| !normal[0].is_nan()).count();
    println!("{covered} of {} pixels have a normal", width * height);
    assert!(covered > 0);
    println!("one of them: {:.3?}", &normals[4 * (120 * width + 80)..][..4]);
    Ok(())
}
