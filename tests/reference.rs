//! The normals against a slow, obvious computation in doubles: over each pixel's window, whose side the maps tell, no
//! integral images, nalgebra for the eigenvectors. Generated clouds, and real frames where `IINE_TEST_DATA` has them.

mod clouds;

use clouds::{Cloud, Kind, angle, compute, methods, normal, options};
use iine::{BorderPolicy, Estimator, Maps, Method, Normals, Options};
use iine_scenes::{REAL_FRAMES, real_frame};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// What the reference says of a pixel.
struct Expected {
    normal: Vector3<f64>,
    curvature: Option<f64>,
}

/// A plane is defined where the middle eigenvalue is this many times the smallest.
const DEFINED: f64 = 1.01;

/// Whether a window around pixel (x, y), and what is next to it, lies inside the image.
fn is_inside(cloud: &Cloud, (x, y): (usize, usize), (width, height): (usize, usize)) -> bool {
    let (reach_x, reach_y) = (width / 2 + 2, height / 2 + 2);
    x >= reach_x && y >= reach_y && x + reach_x < cloud.width && y + reach_y < cloud.height
}

/// Whether a method looks at parts of the window, each clipped by itself.
fn is_of_parts(method: Method) -> bool {
    matches!(method, Method::AverageDepthChange | Method::Simple3DGradient)
}

/// The reference for pixel (x, y) with a window of a size, clipped at the border of the image; none where it has nothing
/// to say: the points define no plane, or the window crosses the border and the method looks at parts of it.
fn reference(
    cloud: &Cloud,
    method: Method,
    pixel: (usize, usize),
    (width, height): (usize, usize),
) -> Option<Expected> {
    if is_of_parts(method) && !is_inside(cloud, pixel, (width, height)) {
        return None;
    }
    let (x, y) = (pixel.0 as isize, pixel.1 as isize);
    let (half_x, half_y) = ((width / 2) as isize, (height / 2) as isize);
    let (columns, rows) = (0..cloud.width as isize, 0..cloud.height as isize);
    let z = |x: isize, y: isize| f64::from(cloud.points[y as usize * cloud.width + x as usize][2]);
    let at = |x: isize, y: isize| {
        if !columns.contains(&x) || !rows.contains(&y) {
            return None;
        }
        let point = cloud.points[y as usize * cloud.width + x as usize];
        point.iter().all(|c| c.is_finite()).then(|| Vector3::from(point.map(f64::from)))
    };
    let (left, top) = (x - half_x, y - half_y);
    let (right, bottom) = (left + width as isize, top + height as isize);
    let tangents = |horizontal: Vector3<f64>, vertical: Vector3<f64>| {
        let sine = horizontal.cross(&vertical).norm() / (horizontal.norm() * vertical.norm());
        // A thousandth of a degree between the tangents: no plane.
        (sine > 2e-5)
            .then(|| Expected { normal: horizontal.cross(&vertical).normalize(), curvature: None })
    };
    match method {
        Method::CovarianceMatrix => {
            let points: Vec<Vector3<f64>> =
                (top..bottom).flat_map(|y| (left..right).filter_map(move |x| at(x, y))).collect();
            let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            let mut matrix = Matrix3::zeros();
            for point in &points {
                let d = point - mean;
                matrix += d * d.transpose();
            }
            let eigen = SymmetricEigen::new(matrix);
            let mut order = [0, 1, 2];
            order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
            let [smallest, middle, largest] = order.map(|i| eigen.eigenvalues[i]);
            // Doubles cannot tell the direction of a line's normal; a single place has none.
            if middle < DEFINED * smallest || middle <= 1e-9 * largest {
                return None;
            }
            let normal = eigen.eigenvectors.column(order[0]).into_owned();
            Some(Expected { normal, curvature: Some(smallest.max(0.0) / matrix.trace()) })
        }
        Method::Average3DGradient => {
            let (mut horizontal, mut vertical) = (Vector3::zeros(), Vector3::zeros());
            // None in the outermost rows and columns, as in PCL.
            for y in top.max(1)..bottom.min(rows.end - 1) {
                for x in left.max(1)..right.min(columns.end - 1) {
                    if let (Some(a), Some(b)) = (at(x + 1, y), at(x - 1, y)) {
                        horizontal += a - b;
                    }
                    if let (Some(a), Some(b)) = (at(x, y + 1), at(x, y - 1)) {
                        vertical += a - b;
                    }
                }
            }
            tangents(horizontal, vertical)
        }
        Method::AverageDepthChange => {
            let (quarter_x, quarter_y) = ((width / 4) as isize, (height / 4) as isize);
            let mean_z = |left: isize, top: isize| {
                let (mut sum, mut count) = (0.0, 0.0);
                for y in top..top + half_y {
                    for x in left..left + half_x {
                        if z(x, y).is_finite() {
                            sum += z(x, y);
                            count += 1.0;
                        }
                    }
                }
                sum / count
            };
            // Windows of 3 are rounded as PCL rounds them.
            if (half_x, half_y) == (1, 1) {
                return None;
            }
            let mut horizontal = at(x + quarter_x + 1, y)? - at(x - quarter_x - 1, y)?;
            let mut vertical = at(x + 1, y + quarter_y)? - at(x - 1, y - quarter_y)?;
            horizontal.z = mean_z(x + 1, y - quarter_y) - mean_z(left, y - quarter_y);
            vertical.z = mean_z(x - quarter_x, y + 1) - mean_z(x - quarter_x, top);
            tangents(horizontal, vertical)
        }
        Method::Simple3DGradient => {
            let column = |x| (top..bottom).filter_map(|y| at(x, y)).sum::<Vector3<f64>>();
            let row = |y| (left..right).filter_map(|x| at(x, y)).sum::<Vector3<f64>>();
            tangents(column(x + half_x) - column(left), row(y + half_y) - row(top))
        }
        _ => None,
    }
}

/// How far normals and curvatures were from the reference.
#[derive(Default)]
struct Differences {
    angles: Vec<f64>,
    curvature: f64,
    wrong_side: usize,
    missing: usize,
}

impl Differences {
    /// Compares every `step`-th pixel.
    fn add(&mut self, cloud: &Cloud, options: &Options, step: usize) {
        let mut estimator = Estimator::new(options.clone());
        let found = compute(&mut estimator, cloud);
        let mut sides = vec![0.0; cloud.points.len()];
        let mut maps = Maps { smoothing_areas: Some(&mut sides), ..Maps::default() };
        estimator.compute_maps(&cloud.view(), &mut maps).unwrap();
        for at in (0..found.len()).step_by(step) {
            if sides[at] == 0.0 {
                assert!(found[at].iter().all(|c| c.is_nan()), "a normal without a window");
                continue;
            }
            let pixel = (at % cloud.width, at / cloud.width);
            let size = (sides[at] as usize, sides[at] as usize);
            if !is_inside(cloud, pixel, size) {
                continue;
            }
            let Some(expected) = reference(cloud, options.method, pixel, size) else { continue };
            let Some(normal) = normal(&found[at]) else {
                self.missing += 1;
                continue;
            };
            let degrees = angle(normal, expected.normal.into());
            self.angles.push(degrees.min(180.0 - degrees));
            if let Some(curvature) = expected.curvature {
                self.curvature = self.curvature.max((f64::from(found[at][3]) - curvature).abs());
            }
            let point = Vector3::from(cloud.points[at].map(f64::from));
            let viewpoint = Vector3::from(options.viewpoint.map(f64::from));
            let towards = (viewpoint - point).normalize().dot(&Vector3::from(normal));
            if towards < -1e-6 {
                self.wrong_side += 1;
            }
        }
    }

    fn check(&mut self, what: &str, method: Method) {
        assert_eq!(self.missing, 0, "{what}: no normal");
        assert!(!self.angles.is_empty(), "{what}: nothing to compare");
        self.angles.sort_by(f64::total_cmp);
        let percentile = |p: f64| self.angles[((self.angles.len() - 1) as f64 * p) as usize];
        let (p999, worst) = (percentile(0.999), percentile(1.0));
        println!(
            "{what}: {} normals, p50 {:.1e}, p99.9 {p999:.1e}, largest {worst:.1e} deg, curvature {:.1e}",
            self.angles.len(),
            percentile(0.5),
            self.curvature,
        );
        let allowed = if method == Method::CovarianceMatrix { 0.001 } else { 0.01 };
        assert!(p999 <= allowed, "{what}: {p999} deg at p99.9");
        assert!(worst <= 0.01, "{what}: {worst} deg");
        assert!(self.curvature <= 1e-5, "{what}: curvature {}", self.curvature);
        assert_eq!(self.wrong_side, 0, "{what}: turned away from the viewpoint");
    }
}

#[test]
fn generated_clouds_match_the_reference() {
    for (seed, kind) in (0..).zip(Kind::ALL) {
        let cloud = Cloud::new(kind, 121, 93, seed);
        for method in methods() {
            let mut differences = Differences::default();
            for smoothing in [3.0, 5.0, 7.0, 10.0, 20.0] {
                for depth_dependent in [false, true] {
                    if matches!(kind, Kind::Millimetres | Kind::MixedUnits) && depth_dependent {
                        continue; // windows of a hundred pixels
                    }
                    differences.add(&cloud, &options(method, smoothing, depth_dependent), 1);
                }
            }
            differences.check(&format!("{kind:?} {method:?}"), method.0);
        }
    }
}

/// Windows of the caller's choice: oblong ones, and such as are clipped at the border. The viewpoint decides the side.
#[test]
fn chosen_windows_match_the_reference() {
    let sizes = [(3, 9), (9, 3), (12, 2), (2, 12), (9, 4), (4, 9), (5, 5), (40, 7)];
    let cloud = Cloud::new(Kind::NanPixels, 41, 33, 3);
    let (width, height) = (cloud.width, cloud.height);
    for method in methods() {
        let mut compared = [0; 2];
        for size in sizes {
            for pixel in (0..width * height).step_by(7).map(|at| (at % width, at / width)) {
                let inside = is_inside(&cloud, pixel, size);
                if !inside && method.1 == BorderPolicy::Mirror {
                    continue;
                }
                let Some(expected) = reference(&cloud, method.0, pixel, size) else { continue };
                let towards = |viewpoint: [f32; 3]| {
                    let mut options = options(method, 10.0, false);
                    options.viewpoint = viewpoint;
                    let mut found = [0.0; 4];
                    let mut normal = Normals::interleaved(&mut found, 1, 1, 4, 0, Some(3)).unwrap();
                    let rect = (size.0 as u32, size.1 as u32);
                    let mut estimator = Estimator::new(options);
                    estimator.compute_window(&cloud.view(), pixel, rect, &mut normal).unwrap();
                    found
                };
                let found = towards([0.0; 3]);
                let what = format!("{method:?} {size:?} {pixel:?}: {found:?}");
                let normal = normal(&found).expect(&what);
                let degrees = angle(normal, expected.normal.into());
                assert!(degrees.min(180.0 - degrees) < 1e-4, "{what}, not {}", expected.normal);
                if let Some(curvature) = expected.curvature {
                    assert!((f64::from(found[3]) - curvature).abs() < 1e-6, "{what}");
                }
                compared[usize::from(inside)] += 1;

                let point = cloud.points[pixel.1 * width + pixel.0];
                if point.iter().all(|c| c.is_finite()) {
                    let cosine: f64 = (0..3).map(|c| normal[c] * f64::from(point[c])).sum();
                    assert!(cosine <= 1e-6, "{what}");
                    let from_behind = point.map(|c| 2.0 * c);
                    let [x, y, z, _] = towards(from_behind);
                    let other = [-x, -y, -z, found[3]].map(f32::to_bits);
                    assert!(cosine > -1e-6 || other == found.map(f32::to_bits), "{what}");
                }
            }
        }
        let is_clipped = method.1 == BorderPolicy::Ignore && !is_of_parts(method.0);
        assert!(compared[1] > 500 && (compared[0] > 100) == is_clipped, "{method:?} {compared:?}");
    }
}

#[test]
fn planes_at_all_tilts_match_the_reference() {
    for method in methods() {
        let mut differences = Differences::default();
        for seed in 0..60 {
            let kind = if seed % 2 == 0 { Kind::Plane } else { Kind::SteepPlane };
            let cloud = Cloud::new(kind, 48, 40, seed);
            differences.add(&cloud, &options(method, 9.0, false), 1);
        }
        differences.check(&format!("planes {method:?}"), method.0);
    }
}

#[test]
fn real_frames_match_the_reference() {
    for name in REAL_FRAMES {
        let Some(pcd) = real_frame("real_frames_match_the_reference", name) else { continue };
        let cloud = Cloud { width: pcd.width, height: pcd.height, points: pcd.points };
        for method in methods() {
            for (smoothing, depth_dependent, step) in
                [(10.0, true, 3), (5.0, false, 7), (20.0, true, 23)]
            {
                // Away from the border both policies are the same.
                if method.1 == BorderPolicy::Mirror && smoothing > 5.0 {
                    continue;
                }
                let mut differences = Differences::default();
                differences.add(&cloud, &options(method, smoothing, depth_dependent), step);
                differences.check(&format!("{name} {method:?} smoothing {smoothing}"), method.0);
            }
        }
    }
}
