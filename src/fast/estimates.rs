//! Normals and curvatures of pixels side by side: as a method finds them, and turned to the viewpoint.

use super::arithmetic::Floats;
use super::lanes::{Bits, LANES};
use crate::methods::Estimate;
use crate::simd::Simd;
use crate::vector::dot;

/// What a method finds for some pixels side by side: normals of unit length, not yet turned, and curvatures.
pub(crate) struct Found<S: Simd> {
    pub normal: [Floats<S>; 3],
    pub curvature: Floats<S>,
    /// The lanes whose sums are too near to the rounding of the rings: the plain form decides.
    pub doubtful: u32,
}

impl<S: Simd> Found<S> {
    /// Takes the normals and curvatures of some lanes of another.
    #[inline(always)]
    pub fn take(&mut self, lanes: u32, other: &Self) {
        // SAFETY: there is a group, so there is the instruction set.
        let mask = unsafe { S::mask(lanes) };
        for c in 0..3 {
            self.normal[c].take(mask, other.normal[c]);
        }
        self.curvature.take(mask, other.curvature);
    }

    /// Takes those of some lanes of another; returns which of them are doubtful there.
    #[inline(always)]
    pub fn take_certain(&mut self, lanes: u32, other: &Self) -> u32 {
        self.take(lanes, other);
        lanes & other.doubtful
    }

    /// Takes those that `precisely` gives for some lanes; returns the others.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn take_precise(
        &mut self,
        lanes: u32,
        precisely: impl Fn(usize) -> Option<Estimate>,
    ) -> u32 {
        const { assert!(S::LANES == LANES) };
        if lanes == 0 {
            return 0;
        }
        let (estimates, left) = all_precise(lanes, precisely);
        // SAFETY: as the caller's; the arrays hold so many lanes each.
        unsafe {
            let of_lanes = |lanes: &[f32; LANES]| Floats::load(lanes.as_ptr());
            let [x, y, z] = &estimates.normal;
            let normal = [of_lanes(x), of_lanes(y), of_lanes(z)];
            let curvature = of_lanes(&estimates.curvature);
            self.take(lanes & !left, &Found { normal, curvature, doubtful: 0 });
        }
        left
    }
}

/// What `precisely` gives for some lanes, and those for which that is nothing.
#[cold]
#[inline(never)]
fn all_precise(lanes: u32, precisely: impl Fn(usize) -> Option<Estimate>) -> (Estimates, u32) {
    let (mut estimates, mut left) = (Estimates::NONE, 0);
    for lane in Bits(lanes) {
        match precisely(lane) {
            Some(estimate) => estimates.put(lane, estimate),
            None => left |= 1 << lane,
        }
    }
    (estimates, left)
}

/// Normals and curvatures of pixels side by side.
#[repr(align(64))]
pub(crate) struct Estimates {
    pub normal: [[f32; LANES]; 3],
    pub curvature: [f32; LANES],
}

impl Estimates {
    pub const NONE: Self =
        Estimates { normal: [[f32::NAN; LANES]; 3], curvature: [f32::NAN; LANES] };

    #[inline(always)]
    pub fn put(&mut self, lane: usize, estimate: Estimate) {
        for (to, from) in self.normal.iter_mut().zip(estimate.normal) {
            to[lane] = from;
        }
        self.curvature[lane] = estimate.curvature;
    }

    /// What was found for `lanes`, turned to the viewpoint.
    ///
    /// # Safety
    /// The processor has the instruction set of `S`.
    #[inline(always)]
    pub unsafe fn of<S: Simd>(
        Found { normal, curvature, .. }: Found<S>,
        point: [Floats<S>; 3],
        viewpoint: [f32; 3],
        lanes: u32,
    ) -> Self {
        const { assert!(S::LANES == LANES) };
        // SAFETY: as the caller's; the arrays hold so many lanes each.
        unsafe {
            let normal = turned(normal, point, viewpoint);
            let mask = S::mask(lanes);
            let none = S::splat(f32::NAN);
            let mut estimates = Self::NONE;
            for c in 0..3 {
                let to = estimates.normal[c].as_mut_ptr();
                S::store(to, S::select(mask, normal[c].0, none));
            }
            S::store(estimates.curvature.as_mut_ptr(), S::select(mask, curvature.0, none));
            estimates
        }
    }
}

/// Normals turned to the viewpoint: `orientation::turn_to_viewpoint`.
///
/// # Safety
/// The processor has the instruction set of `S`.
#[inline(always)]
pub(crate) unsafe fn turned<S: Simd>(
    mut normal: [Floats<S>; 3],
    [x, y, z]: [Floats<S>; 3],
    viewpoint: [f32; 3],
) -> [Floats<S>; 3] {
    // SAFETY: as the caller's.
    unsafe {
        let [vx, vy, vz] = viewpoint;
        let viewpoint = [Floats::<S>::splat(vx), Floats::splat(vy), Floats::splat(vz)];
        let cosine = dot([viewpoint[0] - x, viewpoint[1] - y, viewpoint[2] - z], normal);
        let flip = S::and(S::lt(cosine.0, S::splat(0.0)), S::splat(-0.0));
        for axis in &mut normal {
            axis.0 = S::xor(axis.0, flip);
        }
        normal
    }
}
