//! Clouds for programs in other languages, and the normals that they give back.
//!
//! A cloud is a line of text, "WIDTH HEIGHT FOCAL CENTER_X CENTER_Y", and x, y, z of every pixel as little-endian
//! f32; normals are such numbers alone.

use std::path::Path;

use iine_scenes::Frame;

/// Writes a frame's points.
///
/// Errors: what went wrong, as text.
pub fn write_cloud(path: &Path, frame: &Frame) -> Result<(), String> {
    let camera = &frame.camera;
    let [x, y] = camera.center;
    let header = format!("{} {} {} {x} {y}\n", camera.width, camera.height, camera.focal);
    let mut bytes = header.into_bytes();
    bytes.extend(frame.points.iter().flatten().flat_map(|number| number.to_le_bytes()));
    std::fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}

/// Reads the normals of so many pixels.
///
/// Errors: what went wrong, as text.
pub fn read_normals(path: &Path, pixels: usize) -> Result<Vec<[f32; 3]>, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    if bytes.len() != 12 * pixels {
        return Err(format!("{}: not {pixels} normals", path.display()));
    }
    let (numbers, _) = bytes.as_chunks::<4>();
    let (normals, _) = numbers.as_chunks::<3>();
    Ok(normals.iter().map(|normal| normal.map(f32::from_le_bytes)).collect())
}
