//! Ways of using the library that are compared.

use iine::{Error, Estimator, Method, Normals, Options, Points, Semantics};

/// A named set of options.
#[derive(Clone, Debug)]
pub struct Mode {
    /// Semantics, method and extras, as the tables print them.
    pub name: String,
    /// The options.
    pub options: Options,
}

/// A short name of a method.
fn method_name(method: Method, semantics: Semantics) -> &'static str {
    match (method, semantics) {
        (Method::CovarianceMatrix, Semantics::Paper) => "CM",
        (Method::AverageDepthChange, Semantics::Paper) => "SDC",
        (Method::Average3DGradient, Semantics::Paper) => "3DG",
        (Method::CovarianceMatrix, _) => "pcl-COV",
        (Method::AverageDepthChange, _) => "pcl-ADC",
        (Method::Average3DGradient, _) => "pcl-A3G",
        (_, _) => "pcl-S3G",
    }
}

impl Mode {
    /// A mode with one-sided windows (`o`) and crease windows (`c`) on or off.
    pub fn new(semantics: Semantics, method: Method, one_sided: bool, creases: bool) -> Self {
        let mut options = Options::default();
        options.semantics = semantics;
        options.method = method;
        options.one_sided_windows = one_sided;
        options.crease_windows = creases;
        let mut name = method_name(method, semantics).to_owned();
        if one_sided {
            name += "+o";
        }
        if creases {
            name += "+c";
        }
        Mode { name, options }
    }

    /// A mode for depths without noise, with both extras: the paper's windows, `side` pixels wide everywhere.
    pub fn of_exact_depths(method: Method, side: u32) -> Self {
        let mut mode = Mode::new(Semantics::Paper, method, true, true);
        mode.name = format!("{}-{side}+o+c", method_name(method, Semantics::Paper));
        let paper = &mut mode.options.paper;
        // Depth changes are where they are by default.
        let threshold = paper.gamma * paper.alpha;
        paper.alpha = 1e-4;
        paper.gamma = threshold / paper.alpha;
        paper.smallest_radius = 1;
        paper.least_depth_radius = side / 2;
        paper.largest_radius = side / 2;
        mode
    }

    /// Every method of either semantics, plain and with the extras; and the paper's for depths without noise.
    pub fn all() -> Vec<Mode> {
        let mut modes = Vec::new();
        for semantics in Semantics::ALL {
            for method in Method::ALL {
                if semantics == Semantics::Paper && method == Method::Simple3DGradient {
                    continue; // not in the paper
                }
                for one_sided in [false, true] {
                    for creases in [false, true] {
                        modes.push(Mode::new(semantics, method, one_sided, creases));
                    }
                }
                if semantics == Semantics::Paper {
                    modes.extend([3, 5].map(|side| Mode::of_exact_depths(method, side)));
                }
            }
        }
        modes
    }

    /// Normals of an organized cloud, row by row; NaN where there is none.
    ///
    /// Errors: as [`Estimator::compute`].
    pub fn normals(&self, points: &[[f32; 3]], width: usize) -> Result<Vec<[f32; 3]>, Error> {
        let height = points.len() / width;
        let mut normals = vec![[f32::NAN; 3]; points.len()];
        Estimator::new(self.options.clone()).compute(
            &Points::interleaved(points.as_flattened(), width, height, 3, 0)?,
            &mut Normals::interleaved(normals.as_flattened_mut(), width, height, 3, 0, None)?,
        )?;
        Ok(normals)
    }
}
