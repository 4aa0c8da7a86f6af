//! The structs and numbers that cross the boundary.

use crate::{BorderPolicy, Method};

// The header's numbers are the core's.
const _: () = assert!(
    IINE_METHOD_COVARIANCE_MATRIX == Method::CovarianceMatrix as i32
        && IINE_METHOD_AVERAGE_3D_GRADIENT == Method::Average3DGradient as i32
        && IINE_METHOD_AVERAGE_DEPTH_CHANGE == Method::AverageDepthChange as i32
        && IINE_METHOD_SIMPLE_3D_GRADIENT == Method::Simple3DGradient as i32
        && IINE_BORDER_POLICY_IGNORE == BorderPolicy::Ignore as i32
        && IINE_BORDER_POLICY_MIRROR == BorderPolicy::Mirror as i32
);

/// Eigenvector of the smallest eigenvalue of the window's covariance matrix; gives a curvature.
pub const IINE_METHOD_COVARIANCE_MATRIX: i32 = 0;
/// Cross product of the window's mean 3-D gradients (the default).
pub const IINE_METHOD_AVERAGE_3D_GRADIENT: i32 = 1;
/// Cross product of smoothed depth changes.
pub const IINE_METHOD_AVERAGE_DEPTH_CHANGE: i32 = 2;
/// Cross product of the differences of the window's outermost strips; not with IINE_BORDER_POLICY_MIRROR.
pub const IINE_METHOD_SIMPLE_3D_GRADIENT: i32 = 3;

/// The outer rows and columns, as many as the smoothing size rounded down, get no normal (the default).
pub const IINE_BORDER_POLICY_IGNORE: i32 = 0;
/// Windows are folded back at the border of the image.
pub const IINE_BORDER_POLICY_MIRROR: i32 = 1;

/// An organized point cloud to read: width x height pixels of x, y, z (metres or any other unit).
///
/// The three pointers are the addresses of the first pixel's coordinates; the same strides lead from each to the
/// next pixel and to the next row. Interleaved points have y = x + 1, z = x + 2; separate planes have three
/// pointers of their own and a `point_stride` of 4. Set unused fields to zero: `iine_points p = { sizeof p };`.
/// A missing point has a non-finite coordinate.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(non_camel_case_types)]
pub struct iine_points {
    /// `sizeof(iine_points)`.
    pub struct_size: usize,
    /// Pixels in a row; 1 and up.
    pub width: u32,
    /// Rows; 1 and up. width * height is at most INT32_MAX.
    pub height: u32,
    /// The first pixel's x, aligned to 4 bytes.
    pub x: *const f32,
    /// The first pixel's y, aligned to 4 bytes.
    pub y: *const f32,
    /// The first pixel's z (depth), aligned to 4 bytes.
    pub z: *const f32,
    /// Bytes from a pixel to the next; a multiple of 4, at least 4.
    pub point_stride: usize,
    /// Bytes from a row to the next; a multiple of 4, at least width * point_stride; 0 means just that.
    pub row_stride: usize,
}

/// Where normals are written: nx, ny, nz, and curvature if its pointer is not NULL. No other byte is touched.
///
/// Pixels without a normal get NaN in all of them. The fields must not overlap the points' coordinates, but may
/// be other fields of the same array. `struct_size` first, unused fields zero: `iine_normals n = { sizeof n };`.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(non_camel_case_types)]
pub struct iine_normals {
    /// `sizeof(iine_normals)`.
    pub struct_size: usize,
    /// The first pixel's normal x, aligned to 4 bytes.
    pub nx: *mut f32,
    /// The first pixel's normal y, aligned to 4 bytes.
    pub ny: *mut f32,
    /// The first pixel's normal z, aligned to 4 bytes.
    pub nz: *mut f32,
    /// Bytes from a pixel's normal to the next; a multiple of 4, at least 4.
    pub point_stride: usize,
    /// Bytes from a row to the next; a multiple of 4, at least width * point_stride; 0 means just that.
    /// Not used by `iine_estimator_compute_indices`.
    pub row_stride: usize,
    /// The first pixel's curvature (smallest eigenvalue over the trace, 0 to 1/3), or NULL for none.
    /// NaN for the methods that give none.
    pub curvature: *mut f32,
    /// Bytes from a pixel's curvature to the next; a multiple of 4, at least 4.
    pub curvature_point_stride: usize,
    /// Bytes from a row of curvatures to the next; 0 means width * curvature_point_stride.
    pub curvature_row_stride: usize,
}

/// Where the maps behind the normals are written: each a packed array of width * height, or NULL for none.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(non_camel_case_types)]
pub struct iine_maps {
    /// `sizeof(iine_maps)`.
    pub struct_size: usize,
    /// Depth change indication map (the paper's C): 1 at a depth change, else 0.
    pub depth_changes: *mut u8,
    /// Distance in pixels to the nearest depth change (the paper's T; PCL's `getDistanceMap`).
    pub distances: *mut f32,
    /// Smoothing area map (the paper's R): the side of the pixel's window in pixels, 0 where there is none.
    pub smoothing_areas: *mut f32,
}
