//! Depths and normals as colours.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// A picture's pixels, row by row.
pub type Pixels = Vec<[u8; 3]>;

/// Every component of a normal from -1 to 1 as one colour from 0 to 255; towards the camera is bright blue, and none
/// is black.
pub fn of_normals(normals: &[[f32; 3]]) -> Pixels {
    let colour = |component: f32| (127.5 * (component + 1.0)) as u8;
    let pixel = |[x, y, z]: [f32; 3]| match x.is_finite() {
        true => [x, -y, -z].map(colour),
        false => [0; 3],
    };
    normals.iter().copied().map(pixel).collect()
}

/// z as grey, the nearest bright; none is black.
pub fn of_depths(points: &[[f32; 3]]) -> Pixels {
    let depths = || points.iter().map(|point| point[2]).filter(|z| z.is_finite());
    let (near, far) = (depths().fold(f32::INFINITY, f32::min), depths().fold(0.0, f32::max));
    let grey = |z: f32| if z.is_finite() { 255.0 - 215.0 * (z - near) / (far - near) } else { 0.0 };
    points.iter().map(|point| [grey(point[2]) as u8; 3]).collect()
}

/// Writes pictures of one size side by side as a PNG file.
///
/// Errors: what went wrong, as text.
pub fn write(path: &Path, width: usize, pictures: &[Pixels]) -> Result<(), String> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let height = pictures[0].len() / width;
    let mut pixels = Vec::with_capacity(3 * pictures.len() * pictures[0].len());
    for y in 0..height {
        for picture in pictures {
            pixels.extend_from_slice(picture[y * width..(y + 1) * width].as_flattened());
        }
    }
    let file = BufWriter::new(File::create(path).map_err(|e| failed(&e))?);
    let mut encoder = png::Encoder::new(file, (width * pictures.len()) as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(|e| failed(&e))?;
    writer.write_image_data(&pixels).map_err(|e| failed(&e))
}
