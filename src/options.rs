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
    /// not with [`BorderPolicy::Mirror`], nor with [`Semantics::Paper`].
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
    /// The outer `normal_smoothing_size` rows and columns (rounded down) get no normal unless `one_sided_windows` are on.
    #[default]
    Ignore = 0,
    /// Windows are folded back at the border.
    Mirror = 1,
}

impl BorderPolicy {
    /// Every policy, in the order of the numbers.
    pub const ALL: [BorderPolicy; 2] = [BorderPolicy::Ignore, BorderPolicy::Mirror];
}

/// Whose definition of the windows and of the methods' sums is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum Semantics {
    /// PCL's class, step by step; pixels get the answers that PCL gives.
    #[default]
    Pcl = 0,
    /// The paper as published: windows by [`PaperOptions`], clipped at the border of the image, and sums over the
    /// finite points in them. [`Method::AverageDepthChange`] is the paper's SDC, [`Method::CovarianceMatrix`] its
    /// CM; [`Method::Simple3DGradient`] is not in the paper and not supported. The border policy, the smoothing
    /// size, fixed or depth-dependent, and the depth change factor have no effect.
    Paper = 1,
}

impl Semantics {
    /// Both, in the order of the numbers.
    pub const ALL: [Semantics; 2] = [Semantics::Pcl, Semantics::Paper];
}

/// How the distance to the nearest depth change is measured (the paper's T).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum DistanceMetric {
    /// Exact Euclidean distance.
    #[default]
    Euclidean = 0,
    /// Borgefors' 3-4 chamfer distance, divided by 3: at most 6 % off.
    Chamfer = 1,
}

impl DistanceMetric {
    /// Both, in the order of the numbers.
    pub const ALL: [DistanceMetric; 2] = [DistanceMetric::Euclidean, DistanceMetric::Chamfer];
}

/// What counts as a point's depth d in [`Semantics::Paper`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum Depth {
    /// z, for cameras.
    #[default]
    Z = 0,
    /// The distance from the origin, for spinning LiDARs.
    Range = 1,
}

impl Depth {
    /// Both, in the order of the numbers.
    pub const ALL: [Depth; 2] = [Depth::Z, Depth::Range];
}

/// The parameters of [`Semantics::Paper`]. Lengths are in the cloud's unit; the defaults are for a Kinect and metres.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PaperOptions {
    /// Smallest depth change that the sensor can tell, at depth d: f_DC(d) = alpha d^2 (Eq. 4). In 1/unit of length;
    /// finite, above 0, default 0.0028, the paper's for a Kinect. See [`PaperOptions::alpha_of_sensor`].
    pub alpha: f32,
    /// Radius of the window over f_DC: B = beta f_DC(d) (Eq. 5). In pixels/unit of length; finite, above 0,
    /// default 1200: with the default alpha 7 px at 1.5 m, 13 px at 2 m.
    pub beta: f32,
    /// Neighbours whose depths differ by gamma f_DC(d) or more are a depth change apart (Eq. 6). Without unit;
    /// finite, above 0, default 5.
    pub gamma: f32,
    /// Where R is below this, in pixels, there is no window. From 1 to `least_depth_radius`, default 2.
    pub smallest_radius: u32,
    /// B is at least this, in pixels: the noise of near points does not vanish with their depth. Up to
    /// `largest_radius`, default 5.
    pub least_depth_radius: u32,
    /// B is at most this, in pixels. Up to 1000, default 20.
    pub largest_radius: u32,
    /// How T is measured; default [`DistanceMetric::Euclidean`].
    pub distance_metric: DistanceMetric,
    /// What a point's depth is; default [`Depth::Z`].
    pub depth: Depth,
}

impl Default for PaperOptions {
    fn default() -> Self {
        PaperOptions {
            alpha: 0.0028,
            beta: 1200.0,
            gamma: 5.0,
            smallest_radius: 2,
            least_depth_radius: 5,
            largest_radius: 20,
            distance_metric: DistanceMetric::default(),
            depth: Depth::default(),
        }
    }
}

impl PaperOptions {
    /// The largest radius that can be asked for.
    pub(crate) const MOST_RADIUS: u32 = 1000;

    /// The alpha of a stereo or structured light sensor: its depth is focal * baseline / disparity, so that one
    /// disparity step is a depth change of step / (focal * baseline) d^2.
    ///
    /// `disparity_step` and `focal` in pixels, `baseline` in the cloud's unit of length. A Kinect's 1/8 px, 580 px
    /// and 0.075 m give 0.0029.
    pub fn alpha_of_sensor(disparity_step: f32, focal: f32, baseline: f32) -> f32 {
        disparity_step / (focal * baseline)
    }

    /// Refuses what is out of range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let in_range = is_positive(self.alpha)
            && is_positive(self.beta)
            && is_positive(self.gamma)
            && self.smallest_radius >= 1
            && self.smallest_radius <= self.least_depth_radius
            && self.least_depth_radius <= self.largest_radius
            && self.largest_radius <= Self::MOST_RADIUS;
        if in_range { Ok(()) } else { Err(Error::OptionValue) }
    }
}

/// Finite and above 0.
pub(crate) fn is_positive(number: f32) -> bool {
    number.is_finite() && number > 0.0
}

/// The options of an [`Estimator`](crate::Estimator). Start from [`Options::default`], which is PCL's.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// The method; default [`Method::Average3DGradient`].
    pub method: Method,
    /// The border policy; default [`BorderPolicy::Ignore`].
    pub border_policy: BorderPolicy,
    /// Side of the largest window in pixels; finite, above 0, default 10. The side of a pixel's window is
    /// `min(distance to the nearest depth change, normal_smoothing_size)` rounded down, and pixels where that
    /// minimum is not above 2 get no normal but that of `one_sided_windows`.
    pub normal_smoothing_size: f32,
    /// Adds a tenth of the pixel's z (signed, in the cloud's unit) to the smoothing size; default off.
    pub depth_dependent_smoothing: bool,
    /// Two neighbours are a depth change apart if their z differ by more than
    /// `2 * max_depth_change_factor * (|z| + 1)`, z being that of the left or upper one, or if either z is not finite; in
    /// the cloud's unit, default 0.02, any number.
    pub max_depth_change_factor: f32,
    /// The point the normals are turned towards, in the cloud's coordinates; default the origin.
    pub viewpoint: [f32; 3],
    /// Worker threads: 1 (the default) computes on the calling thread, 0 takes one per processor; at most 1024.
    /// The result does not depend on it, bit for bit. On Linux they keep off the core that the calling thread is on, if they
    /// may run on as many cores as there are threads.
    pub threads: usize,
    /// Whose windows and sums; default [`Semantics::Pcl`].
    pub semantics: Semantics,
    /// The parameters of [`Semantics::Paper`], of `one_sided_windows` and of `crease_windows`.
    pub paper: PaperOptions,
    /// Takes points at (0, 0, 0) as missing, as LiDARs and some depth cameras write them; default off.
    pub zero_is_missing: bool,
    /// Gives pixels near a depth change a window on their own side of it, so that every pixel with two neighbours on its
    /// surface that are not in line with it has a normal; default off. Takes [`PaperOptions::alpha`],
    /// [`PaperOptions::gamma`] and [`PaperOptions::largest_radius`] in either semantics.
    pub one_sided_windows: bool,
    /// In a second pass gives every pixel, but on round surfaces, that window around or beside it whose plane is expected to be
    /// nearest to the surface (docs/paper.md), so that edges without a depth change stay sharp and flat surfaces become
    /// smoother; default off. Takes [`PaperOptions::alpha`] and [`PaperOptions::largest_radius`] in either semantics.
    pub crease_windows: bool,
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
            semantics: Semantics::default(),
            paper: PaperOptions::default(),
            zero_is_missing: false,
            one_sided_windows: false,
            crease_windows: false,
        }
    }
}

impl Options {
    /// The most worker threads that can be asked for.
    pub(crate) const MOST_THREADS: usize = 1024;

    /// Refuses what [`Estimator::compute`](crate::Estimator::compute) could not honour. Looks at `paper` with
    /// [`Semantics::Paper`], one-sided or crease windows only, and at the smoothing size with [`Semantics::Pcl`] only.
    ///
    /// Errors: [`Error::OptionValue`] for a number out of its range, [`Error::Unsupported`] for [`Method::Simple3DGradient`]
    /// with [`BorderPolicy::Mirror`] or [`Semantics::Paper`].
    pub fn check(&self) -> Result<(), Error> {
        if self.threads > Self::MOST_THREADS {
            return Err(Error::OptionValue);
        }
        if self.semantics == Semantics::Paper {
            if self.method == Method::Simple3DGradient {
                return Err(Error::Unsupported);
            }
            return self.paper.check();
        }
        if self.has_second_pass() {
            // It asks for some of them.
            self.paper.check()?;
        }
        if !is_positive(self.normal_smoothing_size) {
            return Err(Error::OptionValue);
        }
        if self.method == Method::Simple3DGradient && self.border_policy == BorderPolicy::Mirror {
            return Err(Error::Unsupported);
        }
        Ok(())
    }

    /// Whether more than PCL's windows and sums is asked for.
    pub(crate) fn is_beyond_pcl(&self) -> bool {
        self.semantics != Semantics::Pcl || self.zero_is_missing || self.has_second_pass()
    }

    /// Whether some pixels may take other windows than their own.
    pub(crate) fn has_second_pass(&self) -> bool {
        self.one_sided_windows || self.crease_windows
    }

    /// Whether the method is the paper's CM.
    pub(crate) fn is_cm_of_paper(&self) -> bool {
        self.semantics == Semantics::Paper && self.method == Method::CovarianceMatrix
    }

    /// `BORDER_POLICY_IGNORE`: how many rows and columns at each border get no normal.
    pub(crate) fn ignored_border(&self) -> usize {
        match self.border_policy {
            BorderPolicy::Ignore => self.normal_smoothing_size as usize,
            BorderPolicy::Mirror => 0,
        }
    }
}
