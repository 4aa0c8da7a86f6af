//! Clouds for programs in other languages, and the normals that they give back.
//!
//! A cloud is a line of text, "WIDTH HEIGHT FOCAL CENTER_X CENTER_Y", and x, y, z of every pixel as little-endian
//! f32; normals are such numbers alone.

use std::io;
use std::path::Path;

use iine_scenes::Frame;

/// Writes a frame's points.
pub fn write_cloud(path: impl AsRef<Path>, frame: &Frame) -> io::Result<()> {
    let camera = &frame.camera;
    let [x, y] = camera.center;
    let header = format!("{} {} {} {x} {y}\n", camera.width, camera.height, camera.focal);
    let mut bytes = header.into_bytes();
    bytes.extend(frame.points.iter().flatten().flat_map(|number| number.to_le_bytes()));
    std::fs::write(path, bytes)
}

/// Reads the normals of so many pixels.
///
/// Errors: those of the file system, and `InvalidData` where the length is another.
pub fn read_normals(path: impl AsRef<Path>, pixels: usize) -> io::Result<Vec<[f32; 3]>> {
    let bytes = std::fs::read(&path)?;
    if bytes.len() != 12 * pixels {
        let text = format!("{}: not {pixels} normals", path.as_ref().display());
        return Err(io::Error::new(io::ErrorKind::InvalidData, text));
    }
    let (numbers, _) = bytes.as_chunks::<4>();
    let (normals, _) = numbers.as_chunks::<3>();
    Ok(normals.iter().map(|normal| normal.map(f32::from_le_bytes)).collect())
}
