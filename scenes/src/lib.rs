//! Organized point clouds whose true normals are known: a small ray caster, sensor noise, and PCD files.
//!
//! Lengths are metres, x points right, y down, z away from the camera, which is at the origin.
//!
//! ```
//! use iine_scenes::{Camera, Noise, Random, scene};
//!
//! let exact = scene("tabletop").expect("a known name").render(&Camera::with_size(64, 48));
//! let noisy = Noise::Nguyen.apply(&exact, &mut Random::new(1));
//! assert_eq!(noisy.points.len(), 64 * 48);
//! ```

mod bands;
mod lzf;
mod noise;
mod pcd;
mod random;
mod real;
mod render;
mod shapes;
mod stage;
mod vector;

pub use bands::Band;
pub use noise::{Noise, drop_out};
pub use pcd::Pcd;
pub use random::Random;
pub use real::{REAL_FRAMES, real_frame};
pub use render::{Camera, Frame, NO_SURFACE, Scene};
pub use shapes::Shape;
pub use stage::{SCENES, plane, scene};
pub use vector::Vector;
