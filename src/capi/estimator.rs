//! The estimator handle.

use std::alloc::{Layout, alloc};

use super::boundary::{check, guard, read_sized, reference, reference_mut, write};
use super::types::{iine_maps, iine_normals, iine_points};
use crate::{Error, Estimator, Maps, Normals, Options, Points};

/// Estimates normals. Owns its options and its scratch memory, which is reused from frame to frame.
///
/// One estimator is used by one thread at a time; different estimators freely.
#[allow(non_camel_case_types)]
pub struct iine_estimator {
    pub(super) estimator: Estimator,
}

/// Makes an estimator with the default options and writes it to `*estimator`.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_MISALIGNED, IINE_ERROR_OUT_OF_MEMORY.
///
/// # Safety
/// `estimator` is NULL or valid for a write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_new(estimator: *mut *mut iine_estimator) -> i32 {
    guard(|| {
        check(estimator)?;
        // SAFETY: it has a size.
        let new = unsafe { alloc(Layout::new::<iine_estimator>()) }.cast::<iine_estimator>();
        if new.is_null() {
            return Err(Error::OutOfMemory);
        }
        // SAFETY: there is room for one; the rest is promised by the caller.
        unsafe {
            new.write(iine_estimator { estimator: Estimator::new(Options::default()) });
            write(estimator, new)
        }
    })
}

/// Frees an estimator. NULL is fine.
///
/// # Safety
/// `estimator` is NULL, or came from `iine_estimator_new` and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_free(estimator: *mut iine_estimator) {
    guard(|| {
        if !estimator.is_null() {
            // SAFETY: promised by the caller; it was allocated as a box's content is.
            drop(unsafe { Box::from_raw(estimator) });
        }
        Ok(())
    });
}

/// # Safety
/// `points` is NULL or a struct as its `struct_size` says, whose pixels are readable for `'a`.
unsafe fn read_points<'a>(points: *const iine_points) -> Result<Points<'a>, Error> {
    // SAFETY: promised by the caller.
    let p = unsafe { read_sized(points, &[size_of::<iine_points>()]) }?;
    let (width, height) = (p.width as usize, p.height as usize);
    // SAFETY: promised by the caller.
    unsafe { Points::from_raw([p.x, p.y, p.z], width, height, [p.point_stride, p.row_stride]) }
}

/// # Safety
/// `normals` is NULL or a struct as its `struct_size` says, whose fields are writable for `width` x `height`
/// pixels for `'a`.
unsafe fn read_normals<'a>(
    normals: *const iine_normals,
    width: usize,
    height: usize,
    packed_rows: bool,
) -> Result<Normals<'a>, Error> {
    // SAFETY: promised by the caller.
    let n = unsafe { read_sized(normals, &[size_of::<iine_normals>()]) }?;
    let row_stride = |stride| if packed_rows { 0 } else { stride };
    let strides = [n.point_stride, row_stride(n.row_stride)];
    let curvature_strides = [n.curvature_point_stride, row_stride(n.curvature_row_stride)];
    let curvature = (!n.curvature.is_null()).then_some((n.curvature, curvature_strides));
    // SAFETY: promised by the caller.
    unsafe { Normals::from_raw([n.nx, n.ny, n.nz], width, height, strides, curvature) }
}

/// Computes the normal of every pixel of `points` into `normals`.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_STRUCT_SIZE, IINE_ERROR_SIZE, IINE_ERROR_STRIDE,
/// IINE_ERROR_MISALIGNED, IINE_ERROR_OVERLAP, IINE_ERROR_UNSUPPORTED, IINE_ERROR_OUT_OF_MEMORY,
/// IINE_ERROR_THREADS. Nothing is written then; as to IINE_ERROR_OUT_OF_MEMORY, see there. IINE_ERROR_UNSUPPORTED is for
/// IINE_METHOD_SIMPLE_3D_GRADIENT with IINE_BORDER_POLICY_MIRROR or IINE_SEMANTICS_PAPER.
///
/// # Safety
/// The pointers are NULL or valid as their structs say, for the whole call; no other thread uses `estimator` or
/// writes to the points or accesses the normals meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_compute(
    estimator: *mut iine_estimator,
    points: *const iine_points,
    normals: *const iine_normals,
) -> i32 {
    guard(|| {
        // SAFETY: promised by the caller.
        let (estimator, points) = unsafe { read_request(estimator, points) }?;
        // SAFETY: promised by the caller.
        let mut normals = unsafe { read_normals(normals, points.width(), points.height(), false) }?;
        estimator.compute(&points, &mut normals)
    })
}

/// Computes the normals of the pixels that `indices` lists (row * width + column, any order, repeats allowed):
/// element k of `normals`, `normals->point_stride` bytes after element k - 1, belongs to indices[k] and equals
/// what `iine_estimator_compute` gives for that pixel. With a `count` of 0 only the estimator and the points are
/// looked at, and `indices` and `normals` may be NULL.
///
/// Errors: as `iine_estimator_compute`, also in what is written then, and IINE_ERROR_INDEX if an index is outside the
/// cloud.
///
/// # Safety
/// As `iine_estimator_compute`; `indices` is NULL or valid for `count` reads, and no other thread writes to it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_compute_indices(
    estimator: *mut iine_estimator,
    points: *const iine_points,
    indices: *const i32,
    count: usize,
    normals: *const iine_normals,
) -> i32 {
    guard(|| {
        // SAFETY: promised by the caller.
        let (estimator, points) = unsafe { read_request(estimator, points) }?;
        if count == 0 {
            return Ok(());
        }
        check(indices)?;
        if count > isize::MAX as usize / size_of::<i32>() {
            return Err(Error::Size);
        }
        // SAFETY: promised by the caller.
        let mut normals = unsafe { read_normals(normals, count, 1, true) }?;
        normals.check_disjoint_from_indices(indices, count)?;
        // SAFETY: promised by the caller; neither NULL nor misaligned, and the size fits.
        let indices = unsafe { std::slice::from_raw_parts(indices, count) };
        estimator.compute_indices(&points, indices, &mut normals)
    })
}

/// Computes the normal of pixel (`x`, `y`) from the window of `rect_width` x `rect_height` pixels around it,
/// whatever the depth changes, the smoothing size and the ignored border say, into the first element of `normal`
/// (as PCL's `computePointNormal` after `setRectSize`).
///
/// The window starts at (x - rect_width / 2, y - rect_height / 2). What lies outside the image is left out with
/// IINE_BORDER_POLICY_IGNORE and folded back with IINE_BORDER_POLICY_MIRROR. NaN is written where the window gives no
/// normal, as one of size 0 never does. Where the pixel's point is not finite, the normal may point to either side. The
/// border policy has no effect with IINE_SEMANTICS_PAPER; one-sided and crease windows have none at all, nor do they make
/// points missing here. Takes time proportional to the window's area, or, with missing zeros in PCL's semantics, to the
/// cloud's.
///
/// Errors: as `iine_estimator_compute` but for IINE_ERROR_THREADS, IINE_ERROR_INDEX if the pixel is outside the cloud, and
/// IINE_ERROR_OPTION_VALUE if a size is negative. Nothing is written then.
///
/// # Safety
/// As `iine_estimator_compute`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_compute_window(
    estimator: *mut iine_estimator,
    points: *const iine_points,
    x: u32,
    y: u32,
    rect_width: i32,
    rect_height: i32,
    normal: *const iine_normals,
) -> i32 {
    guard(|| {
        // SAFETY: promised by the caller.
        let (estimator, points) = unsafe { read_request(estimator, points) }?;
        // SAFETY: promised by the caller.
        let mut normal = unsafe { read_normals(normal, 1, 1, true) }?;
        let size = |size| u32::try_from(size).map_err(|_| Error::OptionValue);
        let size = (size(rect_width)?, size(rect_height)?);
        estimator.compute_window(&points, (x as usize, y as usize), size, &mut normal)
    })
}

/// Computes the maps behind the normals: those whose pointers in `maps` are not NULL.
///
/// The maps are those of the smoothing area map's own windows, whatever one-sided windows and crease windows make of them.
/// A map must overlap neither another map nor the range of bytes from a coordinate's first pixel to its last.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_STRUCT_SIZE, IINE_ERROR_SIZE, IINE_ERROR_STRIDE,
/// IINE_ERROR_MISALIGNED, IINE_ERROR_OVERLAP, IINE_ERROR_OUT_OF_MEMORY; IINE_ERROR_UNSUPPORTED for depth radii
/// without IINE_SEMANTICS_PAPER, eigenvalues without IINE_METHOD_COVARIANCE_MATRIX, and as
/// `iine_estimator_compute`. Nothing is written then.
///
/// # Safety
/// The pointers are NULL or valid as their structs say, for the whole call; each map is valid for as many writes as
/// it has elements; no other thread uses `estimator` meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_compute_maps(
    estimator: *mut iine_estimator,
    points: *const iine_points,
    maps: *const iine_maps,
) -> i32 {
    guard(|| {
        // SAFETY: promised by the caller.
        let (estimator, points) = unsafe { read_request(estimator, points) }?;
        // SAFETY: promised by the caller.
        let maps = unsafe { read_sized(maps, &iine_maps::SIZES) }?;
        let pixels = points.width() * points.height();
        check_maps_disjoint(&maps, pixels, &points)?;
        // SAFETY: promised by the caller; they overlap nothing.
        let mut maps = unsafe {
            Maps {
                depth_radii: optional_slice(maps.depth_radii, pixels)?,
                depth_changes: optional_slice(maps.depth_changes, pixels)?,
                distances: optional_slice(maps.distances, pixels)?,
                smoothing_areas: optional_slice(maps.smoothing_areas, pixels)?,
                eigenvalues: optional_slice(maps.eigenvalues, 3 * pixels)?,
            }
        };
        estimator.compute_maps(&points, &mut maps)
    })
}

/// The estimator and the points that a function was given.
///
/// # Safety
/// As `iine_estimator_compute`.
unsafe fn read_request<'a>(
    estimator: *mut iine_estimator,
    points: *const iine_points,
) -> Result<(&'a mut Estimator, Points<'a>), Error> {
    // SAFETY: as the caller's.
    unsafe { Ok((&mut reference_mut(estimator)?.estimator, read_points(points)?)) }
}

/// Refuses maps of `pixels` elements that overlap each other or reach into the points' fields.
fn check_maps_disjoint(maps: &iine_maps, pixels: usize, points: &Points) -> Result<(), Error> {
    let float_bytes = pixels * size_of::<f32>();
    let maps = [
        (maps.depth_changes.addr(), pixels),
        (maps.distances.addr(), float_bytes),
        (maps.smoothing_areas.addr(), float_bytes),
        (maps.depth_radii.addr(), float_bytes),
        (maps.eigenvalues.addr(), 3 * float_bytes),
    ];
    let mut seen = maps.map(|_| (0, 0));
    for (i, (start, bytes)) in maps.into_iter().enumerate() {
        if start == 0 {
            continue;
        }
        let end = start.checked_add(bytes).ok_or(Error::Size)?;
        let overlaps_map = seen.into_iter().any(|(from, to)| start < to && from < end);
        if overlaps_map || points.reach_into(start, end) {
            return Err(Error::Overlap);
        }
        seen[i] = (start, end);
    }
    Ok(())
}

/// # Safety
/// `pointer` is NULL or valid for `length` writes for `'a`, and nobody else uses it meanwhile.
unsafe fn optional_slice<'a, T>(
    pointer: *mut T,
    length: usize,
) -> Result<Option<&'a mut [T]>, Error> {
    if pointer.is_null() {
        return Ok(None);
    }
    check(pointer)?;
    // SAFETY: promised by the caller; the length passed as a count of pixels, so its bytes fit.
    Ok(Some(unsafe { std::slice::from_raw_parts_mut(pointer, length) }))
}

/// Writes to `*bytes` how much scratch memory the estimator holds, in bytes.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_MISALIGNED.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread changes; `bytes` is NULL or valid for a write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_scratch_size(
    estimator: *const iine_estimator,
    bytes: *mut usize,
) -> i32 {
    guard(|| {
        // SAFETY: promised by the caller.
        let size = unsafe { reference(estimator) }?.estimator.scratch_size();
        // SAFETY: promised by the caller.
        unsafe { write(bytes, size) }
    })
}

/// Frees the estimator's scratch memory and ends its worker threads; the next computation
/// makes them anew.
///
/// Errors: IINE_ERROR_NULL_POINTER.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_release_scratch(estimator: *mut iine_estimator) -> i32 {
    guard(|| {
        // SAFETY: promised by the caller.
        unsafe { reference_mut(estimator) }?.estimator.release_scratch();
        Ok(())
    })
}
