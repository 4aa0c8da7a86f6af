//! The paper's semantics against the paper's equations, written down once more: slow, in doubles, no integral images,
//! nalgebra for the eigenvectors, distances by looking at every depth change.
//!
//! The maps are held to the bit, as `docs/paper.md` says their f32 operations. Generated clouds with every way of
//! missing points, rendered scenes with noise, and real frames where `IINE_TEST_DATA` has them.

mod clouds;

use clouds::{Cloud, Kind, Random, angle, compute, normal};
use iine::{Depth, DistanceMetric, Estimator, Maps, Method, Options, Semantics};
use iine_scenes::{Camera, Noise, REAL_FRAMES, drop_out, real_frame, scene};
use nalgebra::{Matrix2, Matrix3, SymmetricEigen, Vector2, Vector3};

const METHODS: [Method; 3] =
    [Method::CovarianceMatrix, Method::Average3DGradient, Method::AverageDepthChange];

/// A plane is defined where the middle eigenvalue is this many times the smallest.
const DEFINED: f64 = 1.01;

/// Tangents with a smaller sine between them span no plane: a thousandth of a degree.
const PARALLEL: f64 = 2e-5;

/// A window: its first and last columns and rows.
#[derive(Clone, Copy)]
struct Window {
    left: usize,
    right: usize,
    top: usize,
    bottom: usize,
}

/// What the reference says of a pixel's normal.
enum Expected {
    None,
    /// The normal, and the curvature if the method gives one; `is_defined` if rounding has no say in its direction.
    Normal {
        normal: Vector3<f64>,
        curvature: Option<f64>,
        is_defined: bool,
    },
    /// The points are so nearly in line that rounding decides whether they are.
    Undecided,
}

/// The equations on a cloud.
struct Reference<'a> {
    cloud: &'a Cloud,
    options: &'a Options,
    /// The pixels that are 1 in C.
    changes: Vec<(usize, usize)>,
}

impl<'a> Reference<'a> {
    fn new(cloud: &'a Cloud, options: &'a Options) -> Self {
        let mut reference = Reference { cloud, options, changes: Vec::new() };
        for y in 0..cloud.height {
            for x in 0..cloud.width {
                if reference.is_change(x, y) {
                    reference.changes.push((x, y));
                }
            }
        }
        reference
    }

    /// P, if it is not missing.
    fn point(&self, x: usize, y: usize) -> Option<Vector3<f64>> {
        let point = self.cloud.points[y * self.cloud.width + x];
        let is_zero = self.options.zero_is_missing && point == [0.0; 3];
        let is_there = point.iter().all(|c| c.is_finite()) && !is_zero;
        is_there.then(|| Vector3::from(point.map(f64::from)))
    }

    /// D, in the floats of the maps.
    fn depth(&self, x: usize, y: usize) -> Option<f32> {
        self.point(x, y)?;
        let [px, py, pz] = self.cloud.points[y * self.cloud.width + x];
        Some(match self.options.paper.depth {
            Depth::Range => (px * px + py * py + pz * pz).sqrt(),
            _ => pz,
        })
    }

    /// f_DC, Eq. 4.
    fn smallest_depth_change(&self, depth: f32) -> f32 {
        self.options.paper.alpha * depth * depth
    }

    /// C, Eq. 6-7; after a gap the change lies before the pixel that ends it.
    fn is_change(&self, x: usize, y: usize) -> bool {
        let is_apart = |before: Option<(usize, f32)>, after: Option<f32>| {
            let (Some((gap, before)), Some(after)) = (before, after) else { return false };
            let threshold = self.options.paper.gamma * self.smallest_depth_change(before);
            (after - before).abs() >= threshold * gap as f32
        };
        let in_row = x + 1 < self.cloud.width
            && is_apart(
                (0..=x).rev().find_map(|from| Some((x + 1 - from, self.depth(from, y)?))),
                self.depth(x + 1, y),
            );
        let in_column = || {
            y + 1 < self.cloud.height
                && is_apart(
                    (0..=y).rev().find_map(|from| Some((y + 1 - from, self.depth(x, from)?))),
                    self.depth(x, y + 1),
                )
        };
        in_row || in_column()
    }

    /// B, Eq. 5, within its limits.
    fn depth_radius(&self, x: usize, y: usize) -> f32 {
        let paper = &self.options.paper;
        self.depth(x, y).map_or(f32::NAN, |depth| {
            (paper.beta * self.smallest_depth_change(depth))
                .max(paper.least_depth_radius as f32)
                .min(paper.largest_radius as f32)
        })
    }

    /// T: the distance of the nearest pixel that is 1 in C.
    fn distance(&self, x: usize, y: usize) -> f32 {
        let offsets = self.changes.iter().map(|(cx, cy)| (x.abs_diff(*cx), y.abs_diff(*cy)));
        match self.options.paper.distance_metric {
            DistanceMetric::Chamfer => offsets
                .map(|(dx, dy)| 4 * dx.min(dy) + 3 * (dx.max(dy) - dx.min(dy)))
                .min()
                .map_or(f32::INFINITY, |thirds| thirds as f32 / 3.0),
            _ => offsets
                .map(|(dx, dy)| dx * dx + dy * dy)
                .min()
                .map_or(f32::INFINITY, |squared| (squared as f32).sqrt()),
        }
    }

    /// R, Eq. 8; 0 for no window.
    fn smoothing_radius(&self, x: usize, y: usize) -> f32 {
        let depth_radius = self.depth_radius(x, y);
        if depth_radius.is_nan() {
            return 0.0;
        }
        let radius = depth_radius.min(self.distance(x, y) / std::f32::consts::SQRT_2);
        if radius < self.options.paper.smallest_radius as f32 { 0.0 } else { radius }
    }

    /// The pixels up to `radius` away, inside the image.
    fn window(&self, x: usize, y: usize, radius: usize) -> Window {
        Window {
            left: x.saturating_sub(radius),
            right: (x + radius).min(self.cloud.width - 1),
            top: y.saturating_sub(radius),
            bottom: (y + radius).min(self.cloud.height - 1),
        }
    }

    fn expected(&self, method: Method, window: &Window) -> Expected {
        match method {
            Method::CovarianceMatrix => self.covariance_matrix(window),
            Method::Average3DGradient => self.gradients(window),
            _ => self.smoothed_depth_changes(window),
        }
    }

    /// Eq. 16-25 over the points that are there: the covariance matrix, and of how many points.
    fn covariance(&self, window: &Window) -> (Matrix3<f64>, usize) {
        let points: Vec<Vector3<f64>> = (window.top..=window.bottom)
            .flat_map(|y| (window.left..=window.right).filter_map(move |x| self.point(x, y)))
            .collect();
        let count = points.len() as f64;
        let mean = points.iter().sum::<Vector3<f64>>() / count;
        let mut matrix = Matrix3::zeros();
        for point in &points {
            let d = point - mean;
            matrix += d * d.transpose() / count;
        }
        (matrix, points.len())
    }

    /// Whether the window's points are on one line of the image: the pixels' own covariance matrix tells.
    fn are_in_line(&self, window: &Window) -> bool {
        let pixels: Vec<Vector2<f64>> = (window.top..=window.bottom)
            .flat_map(|y| (window.left..=window.right).map(move |x| (x, y)))
            .filter(|(x, y)| self.point(*x, *y).is_some())
            .map(|(x, y)| Vector2::new(x as f64, y as f64))
            .collect();
        let mean = pixels.iter().sum::<Vector2<f64>>() / pixels.len() as f64;
        let square = |pixel: &Vector2<f64>| (pixel - mean) * (pixel - mean).transpose();
        pixels.iter().map(square).sum::<Matrix2<f64>>().determinant() < 1e-6
    }

    fn covariance_matrix(&self, window: &Window) -> Expected {
        let (matrix, count) = self.covariance(window);
        let eigen = SymmetricEigen::new(matrix);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let [smallest, middle, _] = order.map(|i| eigen.eigenvalues[i]);
        let evenness = middle / matrix.trace();
        if count < 3 || matrix.trace() == 0.0 || evenness < 1e-13 || self.are_in_line(window) {
            return Expected::None;
        }
        if evenness < 1e-11 {
            return Expected::Undecided;
        }
        Expected::Normal {
            normal: eigen.eigenvectors.column(order[0]).into_owned(),
            curvature: Some(smallest.max(0.0) / matrix.trace()),
            // Of points nearly in line, doubles do not tell the direction.
            is_defined: middle >= DEFINED * smallest && evenness > 1e-9,
        }
    }

    /// The mean of P(m + step) - P(m - step) over the pixels m that have all their neighbours in the window.
    fn mean_difference(&self, window: &Window, dx: usize, dy: usize) -> Option<Vector3<f64>> {
        let mut differences = Vec::new();
        for y in window.top + 1..window.bottom {
            for x in window.left + 1..window.right {
                let pair = self.point(x + dx, y + dy).zip(self.point(x - dx, y - dy));
                differences.extend(pair.map(|(ahead, behind)| ahead - behind));
            }
        }
        let count = differences.len() as f64;
        (count > 0.0).then(|| differences.iter().sum::<Vector3<f64>>() / count)
    }

    fn gradients(&self, window: &Window) -> Expected {
        let tangents = self.mean_difference(window, 1, 0).zip(self.mean_difference(window, 0, 1));
        tangents.map_or(Expected::None, cross_product)
    }

    /// Eq. 9-15, z over as many pixels as x and y.
    fn smoothed_depth_changes(&self, window: &Window) -> Expected {
        let (middle_x, middle_y) =
            ((window.left + window.right) / 2, (window.top + window.bottom) / 2);
        let tangent = |pixels: Vec<(usize, usize)>, mean: Option<Vector3<f64>>| {
            let there: Vec<usize> = (0..pixels.len())
                .filter(|i| self.point(pixels[*i].0, pixels[*i].1).is_some())
                .collect();
            let (&first, &last) = there.first().zip(there.last())?;
            if first == last {
                return None;
            }
            let end = |i: usize| self.point(pixels[i].0, pixels[i].1);
            let mut tangent = end(last)? - end(first)?;
            tangent.z = mean?.z / 2.0 * (last - first) as f64;
            Some(tangent)
        };
        let row = (window.left..=window.right).map(|x| (x, middle_y)).collect();
        let column = (window.top..=window.bottom).map(|y| (middle_x, y)).collect();
        let tangents = tangent(row, self.mean_difference(window, 1, 0))
            .zip(tangent(column, self.mean_difference(window, 0, 1)));
        tangents.map_or(Expected::None, cross_product)
    }
}

/// Eq. 9.
fn cross_product((horizontal, vertical): (Vector3<f64>, Vector3<f64>)) -> Expected {
    let product = horizontal.cross(&vertical);
    let lengths = horizontal.norm() * vertical.norm();
    if lengths == 0.0 {
        return Expected::None;
    }
    if product.norm() <= 1e-9 * lengths {
        return Expected::Undecided;
    }
    let is_defined = product.norm() > PARALLEL * lengths;
    Expected::Normal { normal: product.normalize(), curvature: None, is_defined }
}

/// What was compared, and how far normals and curvatures were from the reference.
#[derive(Default)]
struct Differences {
    angles: Vec<f64>,
    curvature: f64,
    without_window: usize,
    without_normal: usize,
    undecided: usize,
    windows: usize,
}

impl Differences {
    /// Compares every `step`-th pixel of the maps, and of the normals of every method.
    fn add(&mut self, cloud: &Cloud, options: &Options, step: usize) {
        let mut options = options.clone();
        options.semantics = Semantics::Paper;
        let reference = Reference::new(cloud, &options);
        let pixels = cloud.points.len();
        let mut estimator = Estimator::new(options.clone());

        let [mut radii, mut distances, mut areas] = [(); 3].map(|()| vec![7.0; pixels]);
        let mut changes = vec![7; pixels];
        let mut maps = Maps {
            depth_radii: Some(&mut radii),
            depth_changes: Some(&mut changes),
            distances: Some(&mut distances),
            smoothing_areas: Some(&mut areas),
            ..Maps::default()
        };
        estimator.compute_maps(&cloud.view(), &mut maps).unwrap();

        let mut expected_changes = vec![0; pixels];
        for (x, y) in &reference.changes {
            expected_changes[y * cloud.width + x] = 1;
        }
        assert_eq!(changes, expected_changes, "C");
        let sampled =
            || (0..pixels).step_by(step).map(|at| (at, at % cloud.width, at / cloud.width));
        for (at, x, y) in sampled() {
            let same = |name: &str, found: f32, expected: f32| {
                let is_same =
                    found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan();
                assert!(is_same, "{name} at {x},{y}: {found}, not {expected}; {options:?}");
            };
            same("B", radii[at], reference.depth_radius(x, y));
            same("T", distances[at], reference.distance(x, y));
            same("R", areas[at], reference.smoothing_radius(x, y));
        }

        check_eigenvalues(&reference, &mut estimator, &areas, step);

        for method in METHODS {
            estimator.options_mut().method = method;
            let found = compute(&mut estimator, cloud);
            for (at, x, y) in sampled() {
                let what = || format!("{method:?} at {x},{y}: {:?}; {options:?}", found[at]);
                if areas[at] == 0.0 {
                    assert!(found[at].iter().all(|c| c.is_nan()), "no window: {}", what());
                    self.without_window += 1;
                    continue;
                }
                let window = reference.window(x, y, areas[at] as usize);
                self.windows += 1;
                match reference.expected(method, &window) {
                    Expected::Undecided => self.undecided += 1,
                    Expected::None => {
                        assert!(found[at].iter().all(|c| c.is_nan()), "no normal: {}", what());
                        self.without_normal += 1;
                    }
                    Expected::Normal { normal: expected, curvature, is_defined } => {
                        let normal = normal(&found[at])
                            .unwrap_or_else(|| panic!("not {expected}: {}", what()));
                        let point = reference.point(x, y).expect("a point where there is a window");
                        let viewpoint = Vector3::from(options.viewpoint.map(f64::from));
                        let towards = (viewpoint - point).normalize().dot(&Vector3::from(normal));
                        assert!(towards > -1e-6, "turned away: {}", what());
                        if is_defined {
                            let degrees = angle(normal, expected.into());
                            self.angles.push(degrees.min(180.0 - degrees));
                        }
                        match curvature {
                            Some(curvature) => {
                                let difference = (f64::from(found[at][3]) - curvature).abs();
                                assert!(difference <= 1e-5, "curvature {curvature}: {}", what());
                                self.curvature = self.curvature.max(difference);
                            }
                            None => assert!(found[at][3].is_nan(), "a curvature: {}", what()),
                        }
                    }
                }
            }
        }
    }

    fn check(&mut self, what: &str) {
        self.angles.sort_by(f64::total_cmp);
        let percentile = |p: f64| {
            let last = self.angles.len().saturating_sub(1);
            self.angles.get((last as f64 * p) as usize).copied().unwrap_or(0.0)
        };
        let (p999, largest) = (percentile(0.999), percentile(1.0));
        println!(
            "{what}: {} normals, p99.9 {p999:.1e}, largest {largest:.1e} deg, curvature {:.1e}, {} without a window, \
             {} without a normal, {} undecided",
            self.angles.len(),
            self.curvature,
            self.without_window,
            self.without_normal,
            self.undecided,
        );
        assert!(p999 <= 0.001, "{what}: {p999} deg at p99.9");
        // A normal's floats alone are up to 6e-6 deg; the rest is what sums in doubles lose where the middle
        // eigenvalue is next to the smallest.
        assert!(largest <= 0.01, "{what}: {largest} deg");
        assert!(self.undecided * 100 <= self.windows, "{what}: {} undecided", self.undecided);
    }
}

/// Compares every `step`-th pixel's eigenvalues; `radii` is R.
fn check_eigenvalues(reference: &Reference, estimator: &mut Estimator, radii: &[f32], step: usize) {
    let cloud = reference.cloud;
    estimator.options_mut().method = Method::CovarianceMatrix;
    let mut eigenvalues = vec![7.0; 3 * radii.len()];
    let mut maps = Maps { eigenvalues: Some(&mut eigenvalues), ..Maps::default() };
    estimator.compute_maps(&cloud.view(), &mut maps).unwrap();
    for at in (0..radii.len()).step_by(step) {
        let (x, y, found) = (at % cloud.width, at / cloud.width, &eigenvalues[3 * at..3 * at + 3]);
        if radii[at] == 0.0 {
            assert!(found.iter().all(|value| value.is_nan()), "no window at {x},{y}: {found:?}");
            continue;
        }
        let (matrix, _) = reference.covariance(&reference.window(x, y, radii[at] as usize));
        let mut expected = SymmetricEigen::new(matrix).eigenvalues;
        expected.as_mut_slice().sort_by(f64::total_cmp);
        // What a mean in doubles is off by.
        let rounding = 1e-14 * reference.point(x, y).expect("a point").norm();
        for (found, expected) in found.iter().zip(expected.iter()) {
            let difference = (f64::from(*found) - expected).abs();
            let allowed = 1e-6 * expected.abs() + 1e-10 * matrix.trace() + rounding * rounding;
            assert!(difference <= allowed, "at {x},{y}: {found}, not {expected}");
        }
    }
}

/// Options of every kind: (smallest, least, largest radius), beta, gamma, and the rest.
fn option_sets() -> Vec<Options> {
    let with = |radii: [u32; 3], beta: f32, gamma: f32| {
        let mut options = Options::default();
        [
            options.paper.smallest_radius,
            options.paper.least_depth_radius,
            options.paper.largest_radius,
        ] = radii;
        options.paper.beta = beta;
        options.paper.gamma = gamma;
        options
    };
    let mut sets = vec![
        Options::default(),
        with([1, 1, 20], 400.0, 5.0),
        with([1, 2, 9], 1500.0, 1.5),
        with([3, 3, 4], 800.0, 40.0),
        with([2, 8, 13], 1100.0, 8.0),
    ];
    sets[1].paper.distance_metric = DistanceMetric::Chamfer;
    sets[1].zero_is_missing = true;
    sets[2].paper.depth = Depth::Range;
    sets[2].viewpoint = [0.3, -2.0, 5.0];
    sets[3].threads = 2;
    sets[4].zero_is_missing = true;
    sets[4].paper.depth = Depth::Range;
    sets[4].paper.distance_metric = DistanceMetric::Chamfer;
    sets
}

#[test]
fn generated_clouds_match_the_equations() {
    for (seed, kind) in (0..).zip(Kind::ALL) {
        let mut differences = Differences::default();
        for (i, mut options) in option_sets().into_iter().enumerate() {
            if matches!(kind, Kind::Millimetres | Kind::MixedUnits) {
                options.paper.alpha *= 1e-3;
                options.paper.beta *= 1e-3;
            }
            let (width, height) = [(121, 93), (64, 48), (97, 64)][i % 3];
            differences.add(&Cloud::new(kind, width, height, seed), &options, 2);
        }
        assert!(
            differences.angles.len() > 10_000,
            "{kind:?}: {} normals",
            differences.angles.len()
        );
        let has_holes = kind == Kind::Steps || format!("{kind:?}").starts_with("Nan");
        assert!(!has_holes || differences.without_window > 100);
        differences.check(&format!("{kind:?}"));
    }
}

#[test]
fn every_size_matches_the_equations() {
    let mut differences = Differences::default();
    let mut random = Random::new(5);
    let lengths = [1, 2, 3, 4, 5, 7, 8, 11, 16, 17, 23, 33];
    for (i, width) in lengths.into_iter().enumerate() {
        for (j, height) in lengths.into_iter().enumerate() {
            let seed = (i * lengths.len() + j) as u64;
            let kind = random.pick(&Kind::ALL);
            let options = &option_sets()[(i + j) % 5];
            differences.add(&Cloud::new(kind, width, height, seed), options, 1);
        }
    }
    assert!(differences.without_normal > 100);
    differences.check("sizes");
}

#[test]
fn clouds_without_surfaces_match_the_equations() {
    let mut differences = Differences::default();
    for options in option_sets() {
        for point in [[f32::NAN; 3], [0.0; 3], [0.1, 0.2, 1.0], [f32::INFINITY, 0.0, 1.0]] {
            let cloud = Cloud { width: 31, height: 23, points: vec![point; 31 * 23] };
            differences.add(&cloud, &options, 1);
        }
        // A line in space.
        let line = Cloud::of(31, 23, |x, _| [0.25 * x as f32, 0.0, 1.0]);
        differences.add(&line, &options, 1);
        // A ninth of the coordinates, so of nearly a third of the points, is anything.
        let mut cloud = Cloud::new(Kind::Noisy, 64, 48, 3);
        let mut random = Random::new(11);
        for coordinate in cloud.points.iter_mut().flatten() {
            if random.below(9) == 0 {
                *coordinate =
                    random.pick(&[f32::NAN, f32::INFINITY, -f32::INFINITY, 0.0, -0.0, 1e3]);
            }
        }
        differences.add(&cloud, &options, 1);
    }
    assert!(differences.without_normal > 1000 && differences.without_window > 1000);
    assert!(differences.angles.len() > 1000);
    differences.check("no surfaces");
}

#[test]
fn rendered_scenes_match_the_equations() {
    let noises = [Noise::None, Noise::Nguyen, Noise::Khoshelham, Noise::Gaussian(0.002)];
    for (i, name) in ["tabletop", "room", "steps", "sphere", "crease-90"].into_iter().enumerate() {
        let (width, height) = if i == 0 { (640, 480) } else { (320, 240) };
        let exact = scene(name).unwrap().render(&Camera::with_size(width, height));
        let mut random = iine_scenes::Random::new(i as u64);
        let mut frame = noises[i % noises.len()].apply(&exact, &mut random);
        drop_out(&mut frame, [0.0, 0.02][i % 2], &mut random);
        let cloud = Cloud { width, height, points: frame.points };
        for (j, options) in option_sets().iter().enumerate().filter(|(j, _)| (i + j) % 3 == 0) {
            let mut differences = Differences::default();
            differences.add(&cloud, options, if i == 0 { 101 } else { 29 });
            assert!(differences.angles.len() > 100);
            differences.check(&format!("{name} {width}x{height}, options {j}"));
        }
    }
}

#[test]
fn real_frames_match_the_equations() {
    for (i, name) in REAL_FRAMES.into_iter().enumerate() {
        let Some(pcd) = real_frame("real_frames_match_the_equations", name) else { continue };
        let cloud = Cloud { width: pcd.width, height: pcd.height, points: pcd.points };
        let sets = option_sets();
        let j = if name == "ouster_os1_128" { 4 } else { 2 * (i % 2) };
        let mut differences = Differences::default();
        differences.add(&cloud, &sets[j], 211);
        assert!(differences.angles.len() > 100);
        differences.check(&format!("{name}, options {j}"));
    }
}

/// The other tests' form of SDC is, in a window without missing points, that of Eq. 10-15 as printed, with z
/// extended from 2 to 2 r pixels.
#[test]
fn whole_windows_are_the_printed_equations() {
    let cloud = Cloud::new(Kind::Noisy, 64, 48, 9);
    let options = Options::default();
    let reference = Reference::new(&cloud, &options);
    let p = |x: usize, y: usize| reference.point(x, y).unwrap();
    // S, Eq. 3, over the pixels up to r away.
    let mean_z = |x: usize, y: usize, r: usize| {
        let (mut sum, mut count) = (0.0, 0.0);
        for y in y - r..=y + r {
            for x in x - r..=x + r {
                sum += p(x, y).z;
                count += 1.0;
            }
        }
        sum / count
    };
    for (x, y, r) in [(20, 20, 2), (31, 17, 5), (30, 24, 11), (40, 25, 1)] {
        let mut horizontal = (p(x + r, y) - p(x - r, y)) / 2.0;
        let mut vertical = (p(x, y + r) - p(x, y - r)) / 2.0;
        horizontal.z = (mean_z(x + 1, y, r - 1) - mean_z(x - 1, y, r - 1)) / 2.0 * r as f64;
        vertical.z = (mean_z(x, y + 1, r - 1) - mean_z(x, y - 1, r - 1)) / 2.0 * r as f64;
        let printed = horizontal.cross(&vertical).normalize();
        let Expected::Normal { normal, .. } =
            reference.smoothed_depth_changes(&reference.window(x, y, r))
        else {
            panic!("a normal");
        };
        assert!(angle(printed.into(), normal.into()) < 1e-9);
    }
}
