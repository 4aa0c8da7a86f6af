//! Surface normals of organized point clouds by integral images, at camera rate.
//!
//! After Holzer, Rusu, Dixon, Gedikli and Navab, *Adaptive Neighborhood Selection for Real-Time Surface Normal
//! Estimation from Organized Point Cloud Data Using Integral Images*, IROS 2012, with the semantics of PCL's class
//! `pcl::IntegralImageNormalEstimation`.
//!
//! Beyond PCL, and off by default in [`Options`]: the paper's own windows and methods ([`Semantics::Paper`]), windows on one
//! side of a depth change, and windows that keep off edges between surfaces.
//!
//! ```
//! use iine::{Estimator, Normals, Options, Points};
//!
//! let (width, height) = (64, 48);
//! let cloud: Vec<f32> = (0..width * height)
//!     .flat_map(|i| [(i % width) as f32 * 0.01, (i / width) as f32 * 0.01, 1.0])
//!     .collect();
//! let mut normals = vec![0.0; 4 * width * height];
//!
//! let mut estimator = Estimator::new(Options::default());
//! estimator.compute(
//!     &Points::interleaved(&cloud, width, height, 3, 0)?,
//!     &mut Normals::interleaved(&mut normals, width, height, 4, 0, Some(3))?,
//! )?;
//! let center = (height / 2 * width + width / 2) * 4;
//! assert!((normals[center + 2] + 1.0).abs() < 1e-6); // the plane z = 1 faces the origin
//! # Ok::<(), iine::Error>(())
//! ```

mod cache;
mod capi;
mod cloud;
mod cores;
mod depth_change;
mod distance;
mod eigen;
mod eigenvalues;
mod error;
mod estimator;
mod fast;
mod isa;
mod memory;
mod methods;
mod options;
mod orientation;
mod output;
mod paper;
mod plain;
mod rect;
mod simd;
mod smoothing_area;
mod threads;
mod vector;
mod window;

pub use cloud::{Normals, Points};
pub use error::Error;
pub use estimator::{Estimator, Maps};
pub use isa::Isa;
pub use options::{BorderPolicy, Depth, DistanceMetric, Method, Options, PaperOptions, Semantics};
