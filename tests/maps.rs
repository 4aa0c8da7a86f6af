//! The maps behind the normals, and what the options that are not PCL's say about missing points: the same everywhere.

mod clouds;

use clouds::{Cloud, Kind, assert_same_bits, compute, methods, options};
use iine::{BorderPolicy, Error, Estimator, Isa, Maps, Method, Normals, Options, Semantics};
use iine_scenes::{REAL_FRAMES, real_frame};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Every map that a combination of options has, written.
fn all_maps(estimator: &mut Estimator, cloud: &Cloud) -> Vec<f32> {
    let pixels = cloud.points.len();
    let [mut radii, mut distances, mut areas] = [(); 3].map(|()| vec![0.0; pixels]);
    let (mut changes, mut eigenvalues) = (vec![7; pixels], vec![0.0; 3 * pixels]);
    let is_paper = estimator.options().semantics == Semantics::Paper;
    let has_eigenvalues = estimator.options().method == Method::CovarianceMatrix;
    let mut maps = Maps {
        depth_radii: is_paper.then_some(&mut radii[..]),
        depth_changes: Some(&mut changes),
        distances: Some(&mut distances),
        smoothing_areas: Some(&mut areas),
        eigenvalues: has_eigenvalues.then_some(&mut eigenvalues[..]),
    };
    estimator.compute_maps(&cloud.view(), &mut maps).unwrap();
    let changes = changes.into_iter().map(f32::from).collect();
    [radii, changes, distances, areas, eigenvalues].concat()
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Compares every `step`-th pixel's eigenvalues with those of its window's points, summed one by one, and all with the
/// curvatures; gives the number of windows compared. With PCL's semantics those across the border are left out.
fn check_eigenvalues(cloud: &Cloud, options: Options, step: usize) -> usize {
    let Cloud { width, height, .. } = *cloud;
    let what = format!("{options:?}");
    let is_paper = options.semantics == Semantics::Paper;
    let mut estimator = Estimator::new(options);
    let pixels = cloud.points.len();
    let (mut areas, mut eigenvalues) = (vec![0.0; pixels], vec![0.0; 3 * pixels]);
    let mut maps = Maps {
        smoothing_areas: Some(&mut areas),
        eigenvalues: Some(&mut eigenvalues),
        ..Maps::default()
    };
    estimator.compute_maps(&cloud.view(), &mut maps).unwrap();
    let normals = compute(&mut estimator, cloud);
    let mut compared = 0;
    for (at, values) in eigenvalues.chunks_exact(3).enumerate() {
        let size = areas[at] as usize;
        if size == 0 {
            assert!(values.iter().all(|value| value.is_nan()));
            continue;
        }
        assert!(0.0 <= values[0] && values[0] <= values[1] && values[1] <= values[2]);
        // The curvature is the smallest over their sum.
        let trace = values.iter().map(|value| f64::from(*value)).sum::<f64>();
        let curvature = f64::from(normals[at][3]);
        let difference = (f64::from(values[0]) - curvature * trace).abs();
        assert!(difference <= 1e-5 * trace, "{what} at {at}");

        let (x, y) = (at % width, at / width);
        let is_inside = |at: usize, count: usize| at >= size && at + size < count;
        if at % step != 0 || !(is_paper || is_inside(x, width) && is_inside(y, height)) {
            continue;
        }
        let range = |at: usize, count: usize| {
            let (before, after) =
                if is_paper { (size, size + 1) } else { (size / 2, size.div_ceil(2)) };
            at.saturating_sub(before)..(at + after).min(count)
        };
        let points: Vec<Vector3<f64>> = range(y, height)
            .flat_map(|y| range(x, width).map(move |x| y * width + x))
            .map(|at| Vector3::from(cloud.points[at].map(f64::from)))
            .filter(|point| point.iter().all(|c| c.is_finite()))
            .collect();
        let count = points.len() as f64;
        let mean = points.iter().sum::<Vector3<f64>>() / count;
        let matrix: Matrix3<f64> =
            points.iter().map(|p| (p - mean) * (p - mean).transpose() / count).sum();
        let mut expected = SymmetricEigen::new(matrix).eigenvalues;
        expected.as_mut_slice().sort_by(f64::total_cmp);
        for (found, expected) in values.iter().zip(expected.iter()) {
            let difference = (f64::from(*found) - expected).abs();
            let allowed = 1e-6 * expected.abs() + 1e-10 * matrix.trace();
            assert!(difference <= allowed, "{what} at {x},{y}: {found}, not {expected}");
        }
        compared += 1;
    }
    compared
}

#[test]
fn eigenvalues_are_those_of_the_windows_points() {
    for (seed, kind) in (0..).zip(Kind::ALL) {
        // High enough for several bands of rows.
        let cloud = Cloud::new(kind, 64, 170, seed);
        for policy in BorderPolicy::ALL {
            for semantics in Semantics::ALL {
                let mut options = options((Method::CovarianceMatrix, policy), 7.0, false);
                options.semantics = semantics;
                if options.check().is_ok() {
                    let compared = check_eigenvalues(&cloud, options, 1);
                    assert!(compared > 100, "{kind:?}: {compared}");
                }
            }
        }
    }
}

#[test]
fn eigenvalues_of_real_frames() {
    for name in REAL_FRAMES {
        let Some(frame) = real_frame("eigenvalues_of_real_frames", name) else { continue };
        let cloud = Cloud { points: frame.points, width: frame.width, height: frame.height };
        for semantics in Semantics::ALL {
            let mut options = options((Method::CovarianceMatrix, BorderPolicy::Ignore), 10.0, true);
            options.semantics = semantics;
            let compared = check_eigenvalues(&cloud, options, 101);
            assert!(compared > 100, "{name}: {compared}");
        }
    }
}

#[test]
fn maps_that_do_not_go_together_are_refused() {
    let cloud = Cloud::new(Kind::Noisy, 12, 9, 1);
    for method in Method::ALL {
        for semantics in Semantics::ALL {
            let mut options = Options::default();
            (options.method, options.semantics) = (method, semantics);
            let mut estimator = Estimator::new(options);
            let mut check = |radii: usize, eigenvalues: usize, expected| {
                let (mut radii, mut eigenvalues) = (vec![7.0; radii], vec![7.0; eigenvalues]);
                let mut distances = [7.0; 12 * 9];
                let mut maps = Maps {
                    depth_radii: (!radii.is_empty()).then_some(&mut radii[..]),
                    distances: Some(&mut distances),
                    eigenvalues: (!eigenvalues.is_empty()).then_some(&mut eigenvalues[..]),
                    ..Maps::default()
                };
                let found = estimator.compute_maps(&cloud.view(), &mut maps);
                assert_eq!(found, expected, "{method:?} {semantics:?}");
                if expected.is_err() {
                    assert!(
                        [&radii, &eigenvalues, &distances[..]].concat().iter().all(|v| *v == 7.0)
                    );
                }
            };
            let is_paper = semantics == Semantics::Paper;
            let is_known = !(is_paper && method == Method::Simple3DGradient);
            let when = |ok: bool| if ok { Ok(()) } else { Err(Error::Unsupported) };
            check(0, 0, when(is_known));
            check(12 * 9, 0, when(is_known && is_paper));
            check(0, 3 * 12 * 9, when(method == Method::CovarianceMatrix));
            if is_known {
                check(0, 12 * 9, Err(Error::Size));
                check(12 * 9 - 1, 0, Err(Error::Size));
            }
        }
    }
}

/// The ignored border is the smoothing size rounded down.
#[test]
fn the_ignored_border_is_of_whole_pixels() {
    let (width, height) = (30, 24);
    let cloud = Cloud::new(Kind::Plane, width, height, 1);
    for (size, border) in [(7.0, 7), (7.5, 7), (7.999, 7), (8.0, 8)] {
        let mut areas = vec![0.0; width * height];
        let mut maps = Maps { smoothing_areas: Some(&mut areas), ..Maps::default() };
        let options = options((Method::default(), BorderPolicy::Ignore), size, false);
        Estimator::new(options).compute_maps(&cloud.view(), &mut maps).unwrap();
        for (at, area) in areas.into_iter().enumerate() {
            let (x, y) = (at % width, at / width);
            let inside =
                (border..width - border).contains(&x) && (border..height - border).contains(&y);
            assert_eq!(area > 0.0, inside, "{size}: {x} {y}");
        }
    }
}

/// The paper's C: that a point is missing is no change, but a change across missing points is marked at the last of them.
#[test]
fn of_missing_points_the_last_before_a_change_is_marked() {
    let missing = [f32::NAN; 3];
    for (behind, marked) in [(1.0, None), (3.0, Some(3))] {
        let along = |at: usize| if at < 2 { 1.0 } else { behind };
        for is_row in [true, false] {
            let cloud = Cloud::of(6, 6, |x, y| match if is_row { x } else { y } {
                2 | 3 => missing,
                at => [x as f32 * 0.01, y as f32 * 0.01, along(at)],
            });
            let mut options = Options::default();
            options.semantics = Semantics::Paper;
            let mut changes = vec![7; 36];
            let mut maps = Maps { depth_changes: Some(&mut changes), ..Maps::default() };
            Estimator::new(options).compute_maps(&cloud.view(), &mut maps).unwrap();
            for (at, change) in changes.into_iter().enumerate() {
                let place = if is_row { at % 6 } else { at / 6 };
                assert_eq!(change == 1, marked == Some(place), "{behind} {is_row}: {at}");
            }
        }
    }
}

/// PCL's map: a z that is not finite marks its pixel and those beside it, but not along the last row and column.
#[test]
fn pixels_of_the_last_row_or_column_are_not_told_apart() {
    let (width, height) = (7, 6);
    for missing in 0..width * height {
        let mut cloud = Cloud::of(width, height, |x, y| [x as f32 * 0.01, y as f32 * 0.01, 1.0]);
        cloud.points[missing] = [f32::NAN; 3];
        let mut changes = vec![7; width * height];
        let mut maps = Maps { depth_changes: Some(&mut changes), ..Maps::default() };
        Estimator::new(Options::default()).compute_maps(&cloud.view(), &mut maps).unwrap();
        let (at_x, at_y) = (missing % width, missing / width);
        let is_last = |x: usize, y: usize| x == width - 1 || y == height - 1;
        for (at, change) in changes.into_iter().enumerate() {
            let (x, y) = (at % width, at / width);
            // Told apart by the left or upper one of the two.
            let is_beside =
                x.abs_diff(at_x) + y.abs_diff(at_y) == 1 && !is_last(x.min(at_x), y.min(at_y));
            let is_corner = (at_x, at_y) == (width - 1, height - 1);
            let is_marked = is_beside || at == missing && !is_corner;
            assert_eq!(change == 1, is_marked, "{at_x},{at_y}: {x},{y}");
        }
    }
}

#[test]
fn zeros_that_are_missing_are_as_nan() {
    for seed in 0..6 {
        let zeros = Cloud::new(Kind::Zeros, 41, 33, seed);
        let mut nans = zeros.clone();
        let is_zero = |point: &&mut [f32; 3]| **point == [0.0; 3];
        let changed = nans.points.iter_mut().filter(is_zero).map(|p| *p = [f32::NAN; 3]).count();
        assert!(changed > 10);
        for method in methods() {
            for semantics in Semantics::ALL {
                for [one_sided, creases] in [[false, false], [true, false], [true, true]] {
                    let mut options = options(method, 6.0, false);
                    options.semantics = semantics;
                    (options.one_sided_windows, options.crease_windows) = (one_sided, creases);
                    options.zero_is_missing = true;
                    if options.check().is_err() {
                        continue;
                    }
                    let what = format!("{options:?}");
                    let mut missing = Estimator::with_isa(options.clone(), Isa::Scalar);
                    let found = compute(&mut missing, &zeros);
                    let maps = all_maps(&mut missing, &zeros);
                    let window = window(&mut missing, &zeros, (20, 16), (21, 17));

                    options.zero_is_missing = false;
                    let mut plain = Estimator::with_isa(options, Isa::Scalar);
                    let expected = compute(&mut plain, &nans);
                    assert_same_bits(&found, &expected, zeros.width, &what);
                    assert_eq!(bits(&maps), bits(&all_maps(&mut plain, &nans)), "{what}");
                    // A pixel that is a zero itself has a side towards the viewpoint, one that is NaN has none.
                    let expected = self::window(&mut plain, &nans, (20, 16), (21, 17));
                    let same = |sign: f32| {
                        (0..3).all(|i| window[i].to_bits() == (sign * expected[i]).to_bits())
                            || window[0].is_nan() && expected[0].is_nan()
                    };
                    assert!(same(1.0) || same(-1.0), "{what}: {window:?}");
                    assert_ne!(bits(&maps), bits(&all_maps(&mut plain, &zeros)), "zeros do matter");
                }
            }
        }
    }
}

/// One-sided and crease windows see a point that lacks a coordinate nowhere, nor do the maps then.
#[test]
fn points_without_x_are_missing_to_the_second_pass() {
    let mut lacking = Cloud::new(Kind::Wavy, 41, 33, 3);
    let mut nans = lacking.clone();
    for at in (10..17).flat_map(|y| (y * 41 + 20)..(y * 41 + 26)) {
        lacking.points[at][0] = f32::NAN;
        nans.points[at] = [f32::NAN; 3];
    }
    for semantics in Semantics::ALL {
        for one_sided in [false, true] {
            let mut options = options((Method::CovarianceMatrix, BorderPolicy::Mirror), 6.0, false);
            options.semantics = semantics;
            (options.one_sided_windows, options.crease_windows) = (one_sided, !one_sided);
            let mut estimator = Estimator::new(options);
            let [found, expected] = [&lacking, &nans].map(|cloud| compute(&mut estimator, cloud));
            assert_same_bits(&found, &expected, 41, "normals");
            let [found, expected] = [&lacking, &nans].map(|cloud| all_maps(&mut estimator, cloud));
            assert_eq!(bits(&found), bits(&expected), "{:?}", estimator.options());
        }
    }
}

/// One pixel's normal over a window of this size.
fn window(
    estimator: &mut Estimator,
    cloud: &Cloud,
    pixel: (usize, usize),
    size: (u32, u32),
) -> [f32; 4] {
    let mut found = [7.0; 4];
    let mut normal = Normals::interleaved(&mut found, 1, 1, 4, 0, Some(3)).unwrap();
    estimator.compute_window(&cloud.view(), pixel, size, &mut normal).unwrap();
    found
}

#[test]
fn windows_of_the_papers_methods() {
    let cloud = Cloud::new(Kind::NanPixels, 41, 33, 2);
    for method in [Method::CovarianceMatrix, Method::Average3DGradient, Method::AverageDepthChange]
    {
        let mut options = Options::default();
        (options.method, options.semantics) = (method, Semantics::Paper);
        let mut estimator = Estimator::new(options);
        let pixels = cloud.points.len();
        let mut areas = vec![0.0; pixels];
        let mut maps = Maps { smoothing_areas: Some(&mut areas), ..Maps::default() };
        estimator.compute_maps(&cloud.view(), &mut maps).unwrap();
        let whole = compute(&mut estimator, &cloud);
        let mut compared = 0;
        for at in (0..pixels).filter(|at| areas[*at] > 0.0) {
            let side = 2 * areas[at] as u32 + 1;
            let pixel = (at % cloud.width, at / cloud.width);
            let found = window(&mut estimator, &cloud, pixel, (side, side));
            for (a, b) in found.iter().zip(whole[at]) {
                assert!((a - b).abs() < 1e-5 || a.is_nan() && b.is_nan(), "{method:?} {pixel:?}");
            }
            compared += 1;
        }
        assert!(compared > pixels / 2);
        for size in [(0, 0), (0, 5), (5, 0), (1, 1)] {
            for pixel in [(0, 0), (40, 32)] {
                let found = window(&mut estimator, &cloud, pixel, size);
                assert!(found.iter().all(|c| c.is_nan()), "{method:?} {size:?}: {found:?}");
            }
        }
        let found = window(&mut estimator, &cloud, (3, 4), (u32::MAX, u32::MAX));
        assert!(found[..3].iter().all(|c| c.is_finite()));
    }
}
