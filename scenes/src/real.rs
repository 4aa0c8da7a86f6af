//! Real frames, which are no part of the project: files that may be there.

use std::path::PathBuf;

use crate::Pcd;

/// The names of the organized clouds that tests and benchmarks read.
pub const REAL_FRAMES: [&str; 6] = [
    "kinect_capture0001",
    "milk_cartoon_all_small_clorox",
    "office1",
    "ouster_os1_128",
    "realsense_d435",
    "table_scene_mug_stereo_textured",
];

/// A real frame, `name`.pcd in the folder that the environment's `IINE_TEST_DATA` names, by default `shared/data`
/// beside the project; none if it is not there, which a line on standard output tells of `user`.
///
/// Panics if the file can't be read.
pub fn real_frame(user: &str, name: &str) -> Option<Pcd> {
    let folder = std::env::var_os("IINE_TEST_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        PathBuf::from,
    );
    let path = folder.join(name).with_extension("pcd");
    if !path.exists() {
        println!("skipped: {user}, {name}: no {}", path.display());
        return None;
    }
    Some(Pcd::read(&path).expect("a PCD file"))
}
