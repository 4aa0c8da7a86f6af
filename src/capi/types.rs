//! The structs and numbers that cross the boundary.

use std::mem::offset_of;

use crate::{BorderPolicy, Depth, DistanceMetric, Method, Semantics};

// The header's numbers are the core's.
const _: () = assert!(
    IINE_METHOD_COVARIANCE_MATRIX == Method::CovarianceMatrix as i32
        && IINE_METHOD_AVERAGE_3D_GRADIENT == Method::Average3DGradient as i32
        && IINE_METHOD_AVERAGE_DEPTH_CHANGE == Method::AverageDepthChange as i32
        && IINE_METHOD_SIMPLE_3D_GRADIENT == Method::Simple3DGradient as i32
        && IINE_BORDER_POLICY_IGNORE == BorderPolicy::Ignore as i32
        && IINE_BORDER_POLICY_MIRROR == BorderPolicy::Mirror as i32
        && IINE_SEMANTICS_PCL == Semantics::Pcl as i32
        && IINE_SEMANTICS_PAPER == Semantics::Paper as i32
        && IINE_DISTANCE_METRIC_EUCLIDEAN == DistanceMetric::Euclidean as i32
        && IINE_DISTANCE_METRIC_CHAMFER == DistanceMetric::Chamfer as i32
        && IINE_DEPTH_Z == Depth::Z as i32
        && IINE_DEPTH_RANGE == Depth::Range as i32
);

/// Eigenvector of the smallest eigenvalue of the window's covariance matrix; gives a curvature.
pub const IINE_METHOD_COVARIANCE_MATRIX: i32 = 0;
/// Cross product of the window's mean 3-D gradients (the default).
pub const IINE_METHOD_AVERAGE_3D_GRADIENT: i32 = 1;
/// Cross product of smoothed depth changes.
pub const IINE_METHOD_AVERAGE_DEPTH_CHANGE: i32 = 2;
/// Cross product of the differences of the window's outermost strips; not with IINE_BORDER_POLICY_MIRROR, nor with
/// IINE_SEMANTICS_PAPER.
pub const IINE_METHOD_SIMPLE_3D_GRADIENT: i32 = 3;

/// The default: the outer rows and columns, as many as the smoothing size rounded down, get no normal unless one-sided
/// windows are on.
pub const IINE_BORDER_POLICY_IGNORE: i32 = 0;
/// Windows are folded back at the border of the image.
pub const IINE_BORDER_POLICY_MIRROR: i32 = 1;

/// PCL's class, step by step; pixels get the answers that PCL gives (the default).
pub const IINE_SEMANTICS_PCL: i32 = 0;
/// The paper as published: windows by its smoothing area map, clipped at the border of the image, and sums over the
/// finite points in them.
pub const IINE_SEMANTICS_PAPER: i32 = 1;

/// Exact Euclidean distance (the default).
pub const IINE_DISTANCE_METRIC_EUCLIDEAN: i32 = 0;
/// Borgefors' 3-4 chamfer distance, divided by 3: at most 6 % off.
pub const IINE_DISTANCE_METRIC_CHAMFER: i32 = 1;

/// Depth is z, for cameras (the default).
pub const IINE_DEPTH_Z: i32 = 0;
/// Depth is the distance from the origin, for spinning LiDARs.
pub const IINE_DEPTH_RANGE: i32 = 1;

/// An organized point cloud to read: width x height pixels of x, y, z (metres or any other unit).
///
/// The three pointers are the addresses of the first pixel's coordinates; the same strides lead from each to the
/// next pixel and to the next row. Interleaved points have y = x + 1, z = x + 2; separate planes have three
/// pointers of their own and a `point_stride` of 4. Clear the struct, set `struct_size`, then the fields you use.
///
/// To mark a point missing, make its z NaN, or all three. With IINE_SEMANTICS_PCL z alone decides, as in PCL: a pixel whose
/// x or y is not finite but whose z is still gets a normal, which may point to either side. With IINE_SEMANTICS_PAPER,
/// one-sided or crease windows, or missing zeros, a point is missing if any of its coordinates is not finite.
///
/// Of interleaved points the four bytes behind z may be read too, except behind the last point of a row (behind the cloud's
/// last point where rows follow each other).
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
/// Pixels without a normal get NaN in all of them, but curvature 0 where all points of a PCL window of
/// IINE_METHOD_COVARIANCE_MATRIX are one place. The fields must not overlap the points' coordinates, but may
/// be other fields of the same array. Clear the struct, set `struct_size`, then the fields you use.
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
    /// Neither this nor `curvature_row_stride` is used by `iine_estimator_compute_indices` and
    /// `iine_estimator_compute_window`; the point strides must be valid there too.
    pub row_stride: usize,
    /// The first pixel's curvature (smallest eigenvalue over the trace, 0 to 1/3), or NULL for none.
    /// NaN for the methods that give none.
    pub curvature: *mut f32,
    /// Bytes from a pixel's curvature to the next; a multiple of 4, at least 4.
    pub curvature_point_stride: usize,
    /// Bytes from a row of curvatures to the next; a multiple of 4, at least width * curvature_point_stride; 0 means just
    /// that.
    pub curvature_row_stride: usize,
}

/// Where the maps behind the normals are written: each a packed array of width * height elements unless it says
/// otherwise, or NULL for none.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(non_camel_case_types)]
pub struct iine_maps {
    /// `sizeof(iine_maps)`.
    pub struct_size: usize,
    /// Depth change indication map (the paper's C): 1 at a depth change, else 0. With IINE_SEMANTICS_PCL both pixels of a
    /// change are marked, and those at and beside a z that is not finite, but two of the last row or column are never told
    /// apart, as in PCL; with IINE_SEMANTICS_PAPER the pixel before the change (Eq. 7): of missing points only the last one
    /// before a change across them.
    pub depth_changes: *mut u8,
    /// Distance in pixels to the nearest depth change (the paper's T; PCL's `getDistanceMap`). Without any in the image:
    /// width + height, with IINE_SEMANTICS_PAPER infinity.
    pub distances: *mut f32,
    /// Smoothing area map: the side of the pixel's window in pixels, or with IINE_SEMANTICS_PAPER its radius R
    /// (Eq. 8); 0 where there is none.
    pub smoothing_areas: *mut f32,
    /// Radius that the depth asks for (the paper's B, Eq. 5), within its limits, in pixels; NaN at missing points.
    /// Only with IINE_SEMANTICS_PAPER.
    pub depth_radii: *mut f32,
    /// Eigenvalues of the covariance matrix (Eq. 16) of the finite points in every pixel's window, in the cloud's unit
    /// squared: three for every pixel, ascending, so 3 * width * height elements; NaN where there is no window, or no
    /// finite point in it. Only with IINE_METHOD_COVARIANCE_MATRIX.
    pub eigenvalues: *mut f32,
}

impl iine_maps {
    /// The sizes that the struct has had, up to this version's.
    pub(super) const SIZES: [usize; 2] =
        [offset_of!(iine_maps, depth_radii), size_of::<iine_maps>()];
}
