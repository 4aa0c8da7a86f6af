//! The estimator's options: a setter for each, which refuses what is out of range and then changes nothing.

use super::boundary::{guard, reference_mut};
use super::estimator::iine_estimator;
use crate::options::is_positive;
use crate::{BorderPolicy, Depth, DistanceMetric, Error, Method, Options, PaperOptions, Semantics};

/// Sets one option, if its value is in range.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
unsafe fn set<T>(
    estimator: *mut iine_estimator,
    option: impl FnOnce(&mut Options) -> &mut T,
    value: Result<T, Error>,
) -> i32 {
    guard(|| {
        // SAFETY: promised by the caller.
        let options = unsafe { reference_mut(estimator) }?.estimator.options_mut();
        *option(options) = value?;
        Ok(())
    })
}

/// Sets parameters of the paper's semantics, which are in range or not together.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
unsafe fn set_paper(estimator: *mut iine_estimator, change: impl FnOnce(&mut PaperOptions)) -> i32 {
    guard(|| {
        // SAFETY: promised by the caller.
        let options = unsafe { reference_mut(estimator) }?.estimator.options_mut();
        let mut paper = options.paper.clone();
        change(&mut paper);
        paper.check()?;
        options.paper = paper;
        Ok(())
    })
}

/// The value, if it is in range.
fn checked<T>(value: T, is_in_range: bool) -> Result<T, Error> {
    if is_in_range { Ok(value) } else { Err(Error::OptionValue) }
}

/// The value that has this number: `all` are in the order of theirs, from 0.
fn known<T: Copy>(all: &[T], number: i32) -> Result<T, Error> {
    let value = usize::try_from(number).ok().and_then(|number| all.get(number));
    value.copied().ok_or(Error::OptionValue)
}

fn switch(number: i32) -> Result<bool, Error> {
    known(&[false, true], number)
}

/// Sets the method: one of IINE_METHOD_*; default IINE_METHOD_AVERAGE_3D_GRADIENT.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_method(
    estimator: *mut iine_estimator,
    method: i32,
) -> i32 {
    let value = known(&Method::ALL, method);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.method, value) }
}

/// Sets the border policy: one of IINE_BORDER_POLICY_*; default IINE_BORDER_POLICY_IGNORE.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_border_policy(
    estimator: *mut iine_estimator,
    border_policy: i32,
) -> i32 {
    let value = known(&BorderPolicy::ALL, border_policy);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.border_policy, value) }
}

/// Sets the smoothing size in pixels: finite, above 0; default 10. The side of a pixel's window is
/// min(distance to the nearest depth change, smoothing size) rounded down; where that minimum is not above 2 there is no
/// normal. Depth-dependent smoothing adds to the size; without it, sizes up to 2 give no normals but
/// those of one-sided windows.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_normal_smoothing_size(
    estimator: *mut iine_estimator,
    normal_smoothing_size: f32,
) -> i32 {
    let value = checked(normal_smoothing_size, is_positive(normal_smoothing_size));
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.normal_smoothing_size, value) }
}

/// Whether a tenth of a pixel's z (signed, in the cloud's unit) is added to its smoothing size: 0 (the default)
/// or 1.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE for any other number.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_depth_dependent_smoothing(
    estimator: *mut iine_estimator,
    depth_dependent_smoothing: i32,
) -> i32 {
    let value = switch(depth_dependent_smoothing);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.depth_dependent_smoothing, value) }
}

/// Sets the factor of the depth change threshold: two neighbours are a depth change apart if their z differ by
/// more than 2 * factor * (|z| + 1), in the cloud's unit, z being that of the left or upper one, or if either z is not
/// finite. Any number; default 0.02.
///
/// Errors: IINE_ERROR_NULL_POINTER.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_max_depth_change_factor(
    estimator: *mut iine_estimator,
    max_depth_change_factor: f32,
) -> i32 {
    // SAFETY: promised by the caller.
    unsafe {
        set(estimator, |options| &mut options.max_depth_change_factor, Ok(max_depth_change_factor))
    }
}

/// Sets the point that normals are turned towards, in the cloud's coordinates. Any numbers; default (0, 0, 0).
///
/// Errors: IINE_ERROR_NULL_POINTER.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_viewpoint(
    estimator: *mut iine_estimator,
    x: f32,
    y: f32,
    z: f32,
) -> i32 {
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.viewpoint, Ok([x, y, z])) }
}

/// Sets the number of threads: 1 (the default) computes on the calling thread, 0 takes one per processor. The result
/// does not depend on it, bit for bit. They are started by the next computation, and live until another number is asked
/// for, the scratch memory is released or the estimator is freed; a fork of the process starts its own with its next
/// computation. Where memory for starting them or handing them work is missing, the process may be aborted. On Linux they
/// keep off the core that the calling thread is on, if they may run on as many cores as there are threads.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE above 1024.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_threads(
    estimator: *mut iine_estimator,
    threads: u32,
) -> i32 {
    let threads = threads as usize;
    let value = checked(threads, threads <= Options::MOST_THREADS);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.threads, value) }
}

/// Sets whose definition of the windows and sums is followed: one of IINE_SEMANTICS_*; default IINE_SEMANTICS_PCL.
///
/// With IINE_SEMANTICS_PAPER the border policy, the smoothing size, depth dependent smoothing and the depth change
/// factor have no effect, and IINE_METHOD_SIMPLE_3D_GRADIENT is not supported; the iine_estimator_set_paper_*
/// functions set what takes their place.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_semantics(
    estimator: *mut iine_estimator,
    semantics: i32,
) -> i32 {
    let value = known(&Semantics::ALL, semantics);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.semantics, value) }
}

/// Sets alpha: the smallest depth change that the sensor can tell at depth d is alpha d^2 (Eq. 4). In 1/unit of
/// length; finite, above 0; default 0.0028, the paper's for a Kinect and metres. See `iine_alpha_of_sensor`.
///
/// Used by IINE_SEMANTICS_PAPER, and by one-sided and crease windows.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_paper_alpha(
    estimator: *mut iine_estimator,
    alpha: f32,
) -> i32 {
    // SAFETY: promised by the caller.
    unsafe { set_paper(estimator, |paper| paper.alpha = alpha) }
}

/// Sets beta: the radius of the window in pixels is beta alpha d^2 (Eq. 5). In pixels/unit of length; finite,
/// above 0; default 1200: with the default alpha 7 px at 1.5 m, 13 px at 2 m.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_paper_beta(
    estimator: *mut iine_estimator,
    beta: f32,
) -> i32 {
    // SAFETY: promised by the caller.
    unsafe { set_paper(estimator, |paper| paper.beta = beta) }
}

/// Sets gamma: neighbours whose depths differ by gamma alpha d^2 or more are a depth change apart (Eq. 6); with
/// one-sided windows also in IINE_SEMANTICS_PCL. Without unit; finite, above 0; default 5.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_paper_gamma(
    estimator: *mut iine_estimator,
    gamma: f32,
) -> i32 {
    // SAFETY: promised by the caller.
    unsafe { set_paper(estimator, |paper| paper.gamma = gamma) }
}

/// Sets the limits of the window's radius, in pixels: where it is below `smallest_radius` there is no window;
/// what the depth asks for (Eq. 5) is at least `least_depth_radius` and at most `largest_radius`. With
/// IINE_SEMANTICS_PAPER; `largest_radius` is also that of one-sided and crease windows.
///
/// 1 <= smallest_radius <= least_depth_radius <= largest_radius <= 1000; default 2, 5, 20.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_paper_radii(
    estimator: *mut iine_estimator,
    smallest_radius: u32,
    least_depth_radius: u32,
    largest_radius: u32,
) -> i32 {
    let change = |paper: &mut PaperOptions| {
        paper.smallest_radius = smallest_radius;
        paper.least_depth_radius = least_depth_radius;
        paper.largest_radius = largest_radius;
    };
    // SAFETY: promised by the caller.
    unsafe { set_paper(estimator, change) }
}

/// Sets how the distance to the nearest depth change is measured with IINE_SEMANTICS_PAPER: one of
/// IINE_DISTANCE_METRIC_*; default IINE_DISTANCE_METRIC_EUCLIDEAN.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_paper_distance_metric(
    estimator: *mut iine_estimator,
    distance_metric: i32,
) -> i32 {
    let value = known(&DistanceMetric::ALL, distance_metric);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.paper.distance_metric, value) }
}

/// Sets what a point's depth is with IINE_SEMANTICS_PAPER: one of IINE_DEPTH_*; default IINE_DEPTH_Z.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_paper_depth(
    estimator: *mut iine_estimator,
    depth: i32,
) -> i32 {
    let value = known(&Depth::ALL, depth);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.paper.depth, value) }
}

/// Whether points at (0, 0, 0) are missing, as LiDARs and some depth cameras write them: 0 (the default) or 1.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE for any other number.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_zero_is_missing(
    estimator: *mut iine_estimator,
    zero_is_missing: i32,
) -> i32 {
    let value = switch(zero_is_missing);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.zero_is_missing, value) }
}

/// Whether pixels near a depth change get a window on their own side of it, so that every pixel with two neighbours on its
/// surface that are not in line with it has a normal: 0 (the default) or 1. With either semantics; takes alpha and
/// gamma from `iine_estimator_set_paper_alpha` and `iine_estimator_set_paper_gamma`, and no window's radius is above the
/// largest of `iine_estimator_set_paper_radii`.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE for any other number.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_one_sided_windows(
    estimator: *mut iine_estimator,
    one_sided_windows: i32,
) -> i32 {
    let value = switch(one_sided_windows);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.one_sided_windows, value) }
}

/// Whether a second pass gives every pixel, but on round surfaces, that window around or beside it whose plane is expected to
/// be nearest to the surface (docs/paper.md), so that edges without a depth change stay sharp and flat surfaces become
/// smoother: 0 (the default) or 1. With either semantics; takes alpha from `iine_estimator_set_paper_alpha`, and no window's
/// radius is above the largest of `iine_estimator_set_paper_radii`.
///
/// Errors: IINE_ERROR_NULL_POINTER, IINE_ERROR_OPTION_VALUE for any other number.
///
/// # Safety
/// `estimator` is NULL or a live estimator that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn iine_estimator_set_crease_windows(
    estimator: *mut iine_estimator,
    crease_windows: i32,
) -> i32 {
    let value = switch(crease_windows);
    // SAFETY: promised by the caller.
    unsafe { set(estimator, |options| &mut options.crease_windows, value) }
}

/// The alpha of a stereo or structured light sensor: disparity_step / (focal * baseline), as its depth is
/// focal * baseline / disparity.
///
/// `disparity_step` and `focal` in pixels, `baseline` in the cloud's unit of length; all finite and above 0, else
/// the result is a number that `iine_estimator_set_paper_alpha` may refuse. A Kinect's 1/8 px, 580 px and 0.075 m
/// give 0.0029.
#[unsafe(no_mangle)]
pub extern "C" fn iine_alpha_of_sensor(disparity_step: f32, focal: f32, baseline: f32) -> f32 {
    PaperOptions::alpha_of_sensor(disparity_step, focal, baseline)
}
