//! What a user can choose, with PCL's defaults.

use crate::Error;

/// How a pixel's normal is computed from its window; `NormalEstimationMethod` in PCL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum Method {
    /// Eigenvector of the smallest eigenvalue of the window's covariance matrix
    /// (the paper's CM, Eq. 16-25; PCL's `COVARIANCE_MATRIX`). The only method that gives a curvature.
    CovarianceMatrix = 0,
    /// Cross product of the window's mean 3-D gradients (PCL's `AVERAGE_3D_GRADIENT`, its default).
    #[default]
    Average3DGradient = 1,
    /// Cross product of smoothed depth changes (the paper's SDC, Eq. 9-15, as PCL computes it:
    /// `AVERAGE_DEPTH_CHANGE`).
    AverageDepthChange = 2,
    /// Cross product of the differences of the window's outermost strips (PCL's `SIMPLE_3D_GRADIENT`);
    /// not with [`BorderPolicy::Mirror`].
    Simple3DGradient = 3,
}

impl Method {
    /// Every method, in the order of the numbers.
    pub const ALL: [Method; 4] = [
        Method::CovarianceMatrix,
        Method::Average3DGradient,
        Method::AverageDepthChange,
        Method::Simple3DGradient,
    ];
}

/// What happens where a window would cross the border of the image; `BorderPolicy` in PCL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum BorderPolicy {
    /// The outer `normal_smoothing_size` rows and columns (rounded down) get no normal.
    #[default]
    Ignore = 0,
    /// Windows are folded back at the border.
    Mirror = 1,
}

impl BorderPolicy {
    /// Every policy, in the order of the numbers.
    pub const ALL: [BorderPolicy; 2] = [BorderPolicy::Ignore, BorderPolicy::Mirror];
}

/// The options of an [`Estimator`](crate::Estimator). Start from [`Options::default`], which is PCL's.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// The method; default [`Method::Average3DGradient`].
    pub method: Method,
    /// The border policy; default [`BorderPolicy::Ignore`].
    pub border_policy: BorderPolicy,
    /// Side of the window in pixels; finite, above 0, default 10. The window is
    /// `min(distance to the nearest depth change, normal_smoothing_size)` rounded down, and pixels where that
    /// minimum is not above 2 get no normal.
    pub normal_smoothing_size: f32,
    /// Adds a tenth of the pixel's z (signed, in the cloud's unit) to the smoothing size; default off.
    pub depth_dependent_smoothing: bool,
    /// Two neighbours are a depth change apart if their z differ by more than
    /// `2 * max_depth_change_factor * (|z| + 1)`; in the cloud's unit, default 0.02, any number.
    pub max_depth_change_factor: f32,
    /// The point the normals are turned towards, in the cloud's coordinates; default the origin.
    pub viewpoint: [f32; 3],
    /// Worker threads: 1 (the default) computes on the calling thread, 0 takes one per core.
    /// The result does not depend on it, bit for bit.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            method: Method::default(),
            border_policy: BorderPolicy::default(),
            normal_smoothing_size: 10.0,
            depth_dependent_smoothing: false,
            max_depth_change_factor: 20.0 * 0.001,
            viewpoint: [0.0; 3],
            threads: 1,
        }
    }
}

impl Options {
    /// Refuses what [`Estimator::compute`](crate::Estimator::compute) could not honour.
    pub fn check(&self) -> Result<(), Error> {
        if !(self.normal_smoothing_size.is_finite() && self.normal_smoothing_size > 0.0) {
            return Err(Error::OptionValue);
        }
        if self.method == Method::Simple3DGradient && self.border_policy == BorderPolicy::Mirror {
            return Err(Error::Unsupported);
        }
        Ok(())
    }

    /// `BORDER_POLICY_IGNORE`: how many rows and columns at each border get no normal.
    pub(crate) fn ignored_border(&self) -> usize {
        match self.border_policy {
            BorderPolicy::Ignore => self.normal_smoothing_size as usize,
            BorderPolicy::Mirror => 0,
        }
    }
}
