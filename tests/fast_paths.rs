//! Instruction sets that fuse products with sums give the same bits, those that cannot too, and all what the plain form
//! gives within the rounding of the sums.

mod clouds;

use clouds::{
    Cloud, Kind, ODD, Random, angle, assert_same_bits, compute, compute_listed, edge_options,
    fast_isas, fuses, methods, normal, options, paper_options, random_options,
};
use iine::{BorderPolicy, Depth, Estimator, Isa, Method, Normals, Options, Points, Semantics};

const SMOOTHING: [f32; 6] = [3.0, 5.0, 7.0, 10.0, 20.0, 40.0];

/// The largest differences seen; printed in the end.
#[derive(Debug, Default)]
struct Worst {
    angle: [f64; 4],
    curvature: f32,
    computations: usize,
}

/// Degrees that a normal may differ from the plain form's. In PCL's AVERAGE_3D_GRADIENT and SIMPLE_3D_GRADIENT it is the
/// rounding to integers (`gradients.rs` doubts normals that it could turn by more than 1.5e-4 radians, 0.009 degrees), and so
/// in AVERAGE_DEPTH_CHANGE where that sums integers. COVARIANCE_MATRIX and the paper's methods sum in doubles.
fn allowed(options: &Options) -> f64 {
    match options.method {
        Method::CovarianceMatrix => 1e-3,
        _ if options.semantics == Semantics::Paper => 1e-3,
        _ => 6e-3,
    }
}

/// Cosine between a normal and its line of sight from which on the side is certain. At the viewpoint it never is.
const EDGE_ON: f64 = 1e-5;

impl Worst {
    fn check(&mut self, cloud: &Cloud, what: &str, options: &iine::Options) {
        let plain = compute(&mut Estimator::with_isa(options.clone(), Isa::Scalar), cloud);
        let mut first: [Option<Vec<[f32; 4]>>; 2] = [None, None];
        for isa in fast_isas() {
            let found = compute(&mut Estimator::with_isa(options.clone(), isa), cloud);
            self.computations += 1;
            match &mut first[usize::from(fuses(isa))] {
                Some(first) => assert_same_bits(
                    first,
                    &found,
                    cloud.width,
                    &format!("{isa:?} and the first of its kind, {what}, {options:?}"),
                ),
                none => *none = Some(found),
            }
        }
        let least = usize::from(cfg!(target_arch = "aarch64")); // NEON fuses
        assert!(first[least].is_some(), "the least path is always there");
        let pixels = || plain.iter().enumerate();
        let fast = first.iter().flatten();
        for (fast, (at, plain)) in fast.flat_map(|fast| fast.iter().zip(pixels())) {
            let place = || {
                let (x, y) = (at % cloud.width, at / cloud.width);
                format!("{what} pixel {x},{y}: {fast:?}, plain {plain:?}; {options:?}")
            };
            assert_eq!(fast.map(f32::is_nan), plain.map(f32::is_nan), "{}", place());
            if let (Some(a), Some(b)) = (normal(fast), normal(plain)) {
                let mut degrees = angle(a, b);
                let sight: [f64; 3] = std::array::from_fn(|c| {
                    f64::from(cloud.points[at][c]) - f64::from(options.viewpoint[c])
                });
                let length = sight.iter().map(|c| c * c).sum::<f64>().sqrt();
                let cosine = a.iter().zip(sight).map(|(n, s)| n * s).sum::<f64>() / length;
                if cosine.is_nan() || cosine.abs() < EDGE_ON {
                    degrees = degrees.min(180.0 - degrees);
                }
                let worst = &mut self.angle[options.method as usize];
                *worst = worst.max(degrees);
                assert!(degrees <= allowed(options), "{degrees} deg, {}", place());
            }
            if !fast[3].is_nan() {
                let difference = (fast[3] - plain[3]).abs();
                self.curvature = self.curvature.max(difference);
                assert!(difference <= 1e-5, "curvature, {}", place());
            }
        }
    }

    fn check_every_kind(&mut self, width: usize, height: usize, settings: &[Options]) {
        for (seed, kind) in (0..).zip(Kind::ALL) {
            let cloud = Cloud::new(kind, width, height, seed);
            for options in settings {
                self.check(&cloud, &format!("{kind:?}"), options);
            }
        }
    }
}

impl Drop for Worst {
    fn drop(&mut self) {
        println!("{self:?}");
    }
}

#[test]
fn all_sizes_equal_the_plain_form() {
    let mut worst = Worst::default();
    let mut kinds = Kind::ALL.into_iter().cycle();
    let mut seed = 0;
    for width in (1..=40).chain(63..=66) {
        for height in [1, 2, 3, 5, 8, 13, 24, 41] {
            // Walking over windows as large as the image takes long, so not every size meets every option.
            let every = if width * height > 250 { 9 } else { 2 };
            for method in methods() {
                for smoothing in SMOOTHING {
                    for depth_dependent in [false, true] {
                        seed += 1;
                        let kind = kinds.next().expect("without end");
                        if seed % every != 0 {
                            continue;
                        }
                        let cloud = Cloud::new(kind, width, height, seed);
                        let what = format!("{kind:?} {width}x{height} seed {seed}");
                        worst.check(&cloud, &what, &options(method, smoothing, depth_dependent));
                    }
                }
            }
        }
    }
}

#[test]
fn every_kind_equals_the_plain_form() {
    let mut worst = Worst::default();
    let mut all = Vec::new();
    for method in methods() {
        for smoothing in SMOOTHING {
            all.extend([false, true].map(|dependent| options(method, smoothing, dependent)));
        }
    }
    worst.check_every_kind(77, 53, &all);
}

#[test]
fn the_papers_windows_equal_the_plain_form() {
    let mut worst = Worst::default();
    let mut kinds = Kind::ALL.into_iter().cycle();
    let settings = paper_options();
    let mut settings = settings.iter().cycle();
    for width in (1..=40).chain([63, 64, 65, 130]) {
        for height in [1, 2, 3, 5, 8, 13, 24, 41] {
            let seed = (100 * width + height) as u64;
            let kind = kinds.next().expect("without end");
            let cloud = Cloud::new(kind, width, height, seed);
            for options in settings.by_ref().take(if width * height > 250 { 1 } else { 4 }) {
                worst.check(&cloud, &format!("{kind:?} {width}x{height} seed {seed}"), options);
            }
        }
    }
    worst.check_every_kind(77, 53, &paper_options());
    let cloud = Cloud::new(Kind::NanBlocks, 640, 300, 3);
    for options in paper_options().iter().step_by(5) {
        worst.check(&cloud, "several tiles", options);
    }
}

/// Radii beyond the image.
#[test]
fn the_papers_largest_windows_equal_the_plain_form() {
    let mut worst = Worst::default();
    for (seed, kind) in (0..).zip([Kind::Wavy, Kind::NanPixels, Kind::Shifted]) {
        let cloud = Cloud::new(kind, 61, 37, seed);
        for mut options in paper_options().into_iter().step_by(5) {
            options.paper.gamma = 1e4;
            (options.paper.least_depth_radius, options.paper.largest_radius) = (1000, 1000);
            worst.check(&cloud, &format!("{kind:?}"), &options);
            options.crease_windows = true;
            options.one_sided_windows = true;
            worst.check(&cloud, &format!("{kind:?}"), &options);
        }
    }
}

#[test]
fn windows_near_depth_changes_and_creases_equal_the_plain_form() {
    let mut worst = Worst::default();
    worst.check_every_kind(93, 71, &edge_options());
    let cloud = Cloud::new(Kind::NanBlocks, 640, 300, 3);
    let mut options = Options::default();
    options.semantics = Semantics::Paper;
    options.one_sided_windows = true;
    options.crease_windows = true;
    worst.check(&cloud, "several tiles", &options);
    let mut cloud = Cloud::new(Kind::NanBlocks, 240, 180, 4);
    let mut random = Random::new(4);
    let noise: Vec<_> = (0..80 * 60).map(|_| random.between(-0.003, 0.003)).collect();
    for (at, point) in cloud.points.iter_mut().enumerate() {
        let cell = at / 240 / 3 * 80 + at % 240 / 3;
        *point = point.map(|coordinate| coordinate * (1.0 + noise[cell]));
    }
    for options in edge_options() {
        worst.check(&cloud, "noise that pixels share", &options);
    }
    for (seed, period) in [(5, 11), (6, 17), (7, 23)] {
        let mut cloud = Cloud::new(Kind::NanPixels, 240, 180, seed);
        for (at, point) in cloud.points.iter_mut().enumerate() {
            let fold = ((at % 240 + at / 240 / 2) % period).abs_diff(period / 2) as f32;
            let nearer = 1.0 - 0.003 * fold + random.between(-0.001, 0.001);
            *point = point.map(|coordinate| coordinate * nearer);
        }
        for options in edge_options() {
            worst.check(&cloud, "relief", &options);
        }
    }
}

/// Rows or columns of which only every third has points: the middle lines of windows have one point, or none.
#[test]
fn sparse_lines_equal_the_plain_form() {
    let mut worst = Worst::default();
    for axis in 0..2 {
        let mut cloud = Cloud::new(Kind::Wavy, 93, 71, 5);
        for (at, point) in cloud.points.iter_mut().enumerate() {
            if [at % 93, at / 93][axis] % 3 != 1 {
                *point = [f32::NAN; 3];
            }
        }
        for mut options in paper_options() {
            options.paper.smallest_radius = 1;
            options.paper.least_depth_radius = 1;
            options.paper.largest_radius = 5;
            for second_pass in [false, true] {
                options.crease_windows = second_pass;
                options.one_sided_windows = second_pass;
                worst.check(&cloud, &format!("axis {axis}"), &options);
            }
        }
    }
}

/// Several tiles and many groups a row.
#[test]
fn wide_clouds_equal_the_plain_form() {
    let mut worst = Worst::default();
    for (seed, kind) in (100..).zip([Kind::Wavy, Kind::NanBlocks, Kind::Steps, Kind::Shifted]) {
        for (height, smoothing) in [(3, 3.0), (45, 10.0), (135, 5.0)] {
            let cloud = Cloud::new(kind, 640, height, seed);
            for method in methods() {
                let options = options(method, smoothing, seed % 2 == 0);
                worst.check(&cloud, &format!("{kind:?}"), &options);
            }
        }
    }
}

/// A wide-angle camera's, or turned to a robot's axes: from some row on coordinates are larger than any depth, so what
/// sums of integers allow is found out late in a tile.
#[test]
fn points_far_off_the_axis_equal_the_plain_form() {
    let mut worst = Worst::default();
    for (seed, kind) in (0..).zip([Kind::Wavy, Kind::NanBlocks, Kind::Steps]) {
        for (first, off) in [(0, 1e2), (40, 1e2), (40, 1e5), (75, 1e5)] {
            let mut cloud = Cloud::new(kind, 81, 150, seed);
            for [x, y, _] in &mut cloud.points[first * 81..] {
                (*x, *y) = (off * *x, *y - off);
            }
            for method in methods() {
                let options = options(method, 10.0, true);
                worst.check(&cloud, &format!("{kind:?}, off by {off} from {first}"), &options);
            }
        }
    }
}

/// A far plane for "no return", surfaces that go from near to far without a depth change, and points at the camera.
#[test]
fn depths_orders_of_magnitude_apart_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (131, 90);
    let mut clouds = Vec::new();
    for (seed, kind) in (0..).zip([Kind::NanBlocks, Kind::Noisy, Kind::Zeros]) {
        for far in [200.0, 65504.0, 1e25] {
            let mut cloud = Cloud::new(kind, width, height, seed);
            for (at, point) in cloud.points.iter_mut().enumerate() {
                if !point[2].is_finite() {
                    let [x, y] = [at % width, at / width].map(|at| at as f32 / 100.0);
                    *point = [x * far, y * far, far];
                }
            }
            clouds.push((format!("{kind:?}, a plane at {far}"), cloud));
        }
    }
    for (growth, sign) in [(1.03, 1.0), (1.036, -1.0)] {
        let cloud = Cloud::of(width, height, |x, y| {
            let z = (1.4 * f32::powi(growth, (x + y) as i32) - 1.0) * sign;
            let hole = (y * width + x).is_multiple_of(97) && y > 20;
            [x as f32 / 100.0 * z, y as f32 / 100.0 * z, if hole { f32::NAN } else { z }]
        });
        clouds.push((format!("growing by {growth}"), cloud));
    }
    for (seed, near) in (0..).zip([1e-3, -1e-20]) {
        let mut cloud = Cloud::new(Kind::Noisy, width, height, seed);
        for point in cloud.points.iter_mut().skip(3000).step_by(3001) {
            *point = point.map(|c| c * near);
        }
        clouds.push((format!("points at {near}"), cloud));
    }
    let of_pcl = methods().flat_map(|method| {
        [5.0, 10.0, 20.0].map(|smoothing| options(method, smoothing, smoothing == 10.0))
    });
    let all_options: Vec<Options> = of_pcl.chain(paper_options()).collect();
    let edge_options = edge_options();
    for (what, cloud) in &clouds {
        // Where a depth's square is infinite, the second pass tells no surfaces apart.
        let is_square_finite = |point: &[f32; 3]| !(point[2] * point[2]).is_infinite();
        let is_known = cloud.points.iter().all(is_square_finite);
        let edge_options = edge_options.iter().filter(|_| is_known);
        for options in all_options.iter().chain(edge_options) {
            worst.check(cloud, what, options);
            let mut estimator = Estimator::new(options.clone());
            let all = compute(&mut estimator, cloud);
            let indices: Vec<i32> = (0..all.len() as i32).rev().step_by(3).collect();
            let listed = compute_listed(&mut estimator, cloud, &indices);
            let expected: Vec<_> = indices.iter().map(|index| all[*index as usize]).collect();
            assert_same_bits(&expected, &listed, listed.len(), &format!("indices, {what}"));
        }
    }
}

/// Zeros, or a driver's largest float: also where they take more room than a window.
#[test]
fn points_for_no_return_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (120, 90);
    for depth in [0.0, 100.0, 1e15, f32::MAX] {
        for (seed, (across, down)) in [(1, 1), (37, 23), (width, 31)].into_iter().enumerate() {
            for (x, y) in [(30, 20), (70, 59)] {
                let mut cloud = Cloud::new(Kind::Wavy, width, height, seed as u64);
                cloud.fill(x..x + across, y..y + down, [0.0, 0.0, depth]);
                for method in methods() {
                    let what = format!("{across}x{down} at {depth}");
                    worst.check(&cloud, &what, &options(method, 8.0, false));
                }
            }
        }
    }
}

/// Markers for "no return" here and there, which with so large a gamma are on the surfaces around them: a window's points
/// are then far apart along the line of sight.
#[test]
fn windows_with_far_markers_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (31, 30);
    for seed in 0..200 {
        let mut random = Random::new(seed);
        let slope = [(); 2].map(|()| random.between(-0.5, 0.5));
        let [left, top] = [width, height].map(|end| random.below(end));
        let size = 1 + random.below(8);
        let is_in_block =
            |x: usize, y: usize| (left..left + size).contains(&x) && (top..top + size).contains(&y);
        let depth_only = random.below(2) == 0;
        let one_in = random.pick(&[1000, 200, 50, 10]);
        let noise = random.pick(&[0.0, 0.1]);
        let cloud = Cloud::of(width, height, |x, y| {
            let [u, v] = [x, y].map(|at| at as f32 / 60.0 - 0.25);
            let z = 1.0 + slope[0] * u + slope[1] * v + noise * random.between(0.0, 1.0);
            let is_marked = is_in_block(x, y) || random.below(one_in) == 0;
            match (is_marked, depth_only) {
                (false, _) => [u * z, v * z, z],
                (true, false) => [65504.0; 3],
                (true, true) => [u * z, v * z, 65504.0],
            }
        });
        for mut options in edge_options() {
            options.paper.gamma = 140.0;
            options.paper.depth = random.pick(&Depth::ALL);
            options.paper.largest_radius = 5 + random.below(20) as u32;
            worst.check(&cloud, &format!("seed {seed}"), &options);
        }
    }
}

/// So far away that a point twenty times as far is no depth change: sums about that one would lose what its window's others
/// are to each other.
#[test]
fn windows_with_one_far_point_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (80, 60);
    let is_cm = |options: &Options| options.method == Method::CovarianceMatrix;
    let all_options: Vec<_> = paper_options().into_iter().filter(is_cm).collect();
    for seed in 0..6 {
        let mut random = Random::new(seed);
        let focal = random.between(1e4, 1e5);
        let cloud = Cloud::of(width, height, |x, y| {
            let [u, v] = [x, y].map(|at| at as f32 / focal);
            let mut z = 2000.0 * (1.0 + u + random.between(0.0, 1e-7));
            if random.below(1000) == 0 {
                z *= 20.0;
            }
            [(u - 0.6) * z, (v + 0.8) * z, z]
        });
        for options in &all_options {
            worst.check(&cloud, &format!("seed {seed}"), options);
        }
    }
}

/// Seen from aside, points at the camera in front of others: those of a window are far apart along a line, which leaves more
/// rounding in what tells how even they are than there is in their sums.
#[test]
fn points_at_the_camera_seen_from_aside_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (60, 50);
    for seed in 0..10 {
        let mut random = Random::new(seed);
        let ray = [(); 2].map(|()| random.between(-6.0, 6.0));
        let focal = random.between(1e3, 1e5);
        let cloud = Cloud::of(width, height, |x, y| {
            let [u, v] = [x, y].map(|at| at as f32 / focal);
            let point = [ray[0] + u, ray[1] + v, 1.0].map(|c| 8.8 * c);
            if random.below(40) == 0 { point.map(|c| 1e-3 * c) } else { point }
        });
        for options in edge_options() {
            worst.check(&cloud, &format!("seed {seed}"), &options);
        }
    }
}

/// All but depth changes from each pixel to the next, up and down: what sums of integers that wrap around must still
/// tell apart.
#[test]
fn the_steepest_surfaces_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (101, 90);
    for factor in [0.02, 0.1] {
        let mut depths = vec![2.0_f32];
        while depths.len() < width + height {
            let z = depths[depths.len() - 1];
            let turned = depths.len() / 60 % 2 == 1;
            let step = 1.96 * factor * (z + 1.0) * if turned { -0.9 } else { 1.0 };
            depths.push(z + step);
        }
        for (across, along) in [(1.0, 0.0), (0.0, -1.0), (0.7, 0.7)] {
            let cloud = Cloud::of(width, height, |x, y| {
                let steps = if along < 0.0 { height - y } else { y } as f32;
                let z = depths[(across * x as f32 + f32::abs(along) * steps) as usize];
                [(x as f32 - 50.0) / 60.0 * z, (y as f32 - 45.0) / 60.0 * z, z]
            });
            for (method, border_policy) in methods() {
                if method != Method::AverageDepthChange {
                    continue;
                }
                for smoothing in SMOOTHING {
                    let mut options = options((method, border_policy), smoothing, false);
                    options.max_depth_change_factor = factor;
                    worst.check(&cloud, "steep", &options);
                }
            }
        }
    }
}

/// Coordinates at both ends of what sums of integers allow, and a window's side a power of two as they are.
#[test]
fn points_on_opposite_sides_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (80, 60);
    for (columns, rows) in [(40, 0), (0, 30)] {
        let cloud = Cloud::of(width, height, |x, y| {
            let side = |at: usize, middle: usize, along: usize| match middle {
                0 => (along as f32 - 40.0) / 40.0,
                _ if at < middle => -2.0,
                _ => 2.0,
            };
            [side(x, columns, x), side(y, rows, y), 2.0 - (x + y) as f32 / 512.0]
        });
        for method in methods() {
            worst.check(&cloud, "opposite", &options(method, 16.0, false));
        }
    }
}

/// Depths in a smaller unit than x and y: windows are nearly lines, whose two smaller eigenvalues floats do not tell apart.
#[test]
fn depths_in_another_unit_equal_the_plain_form() {
    let mut worst = Worst::default();
    for (seed, kind) in (0..).zip(Kind::ALL) {
        for units in [10.0, 100.0, 1000.0, 1e5] {
            let mut cloud = Cloud::new(kind, 70, 50, seed);
            cloud.points.iter_mut().for_each(|point| point[2] *= units);
            let what = format!("{kind:?}, {units} units a metre");
            for method in methods() {
                worst.check(&cloud, &what, &options(method, 10.0, true));
            }
            for mut options in paper_options() {
                options.paper.alpha /= units;
                options.paper.beta /= units;
                worst.check(&cloud, &what, &options);
            }
        }
    }
}

/// No depth change map tells whether the last point of all belongs to those next to it.
#[test]
fn a_last_point_apart_equals_the_plain_form() {
    let mut worst = Worst::default();
    for (seed, change) in (0..).zip(ODD) {
        for kind in [Kind::Wavy, Kind::Plane, Kind::Steps] {
            let mut cloud = Cloud::new(kind, 61, 47, seed);
            let last = cloud.points.last_mut().expect("points");
            *last = change(*last);
            let what = format!("{kind:?}, the last {last:?}");
            for method in methods() {
                for smoothing in SMOOTHING {
                    worst.check(&cloud, &what, &options(method, smoothing, false));
                }
            }
        }
    }
}

/// Many equal depths, as of a sensor with depth steps, beside far ones: sums of integers round all of them alike.
#[test]
fn depth_steps_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (96, 70);
    for seed in 0..12_usize {
        // Steps that no integers are multiples of.
        let step = 0.003 * (1.0 + seed as f32 / 7.0);
        let far = [8.0, 20.0, 40.0][seed % 3];
        let cloud = Cloud::of(width, height, |x, y| {
            let [u, v] = [(x as f32 - 48.0) / 525.0, (y as f32 - 35.0) / 525.0];
            let z = if x > 80 { far } else { 1.0 + 0.7 * u - 0.3 * v };
            let z = step * (z / step).round();
            [u * z, v * z, z]
        });
        for method in methods() {
            for smoothing in SMOOTHING {
                worst.check(
                    &cloud,
                    &format!("steps of {step}"),
                    &options(method, smoothing, false),
                );
            }
        }
    }
}

/// Flat in front of the camera, with zeros for "no return": windows near these have no slope at all.
#[test]
fn flat_depths_with_zeros_equal_the_plain_form() {
    let mut worst = Worst::default();
    let (width, height) = (96, 70);
    for seed in 0..6 {
        let mut random = Random::new(seed as u64);
        let step = [0.1, 0.3][seed % 2];
        let cloud = Cloud::of(width, height, |x, y| {
            let [u, v] = [(x as f32 - 48.0) / 400.0, (y as f32 - 35.0) / 400.0];
            let z = step * ((2.0 + (0.5 + seed as f32) * u + 0.5 * v) / step).round();
            if random.below(20) == 0 { [0.0; 3] } else { [u * z, v * z, z] }
        });
        for options in &edge_options() {
            worst.check(&cloud, &format!("flat, seed {seed}"), options);
        }
    }
}

/// Blocks of one point, as a sensor may write it for "no return", and of points that lack a coordinate.
#[test]
fn blocks_of_one_point_equal_the_plain_form() {
    let mut worst = Worst::default();
    let odd = [[0.0; 3], [0.3, 0.2, 1.0], [0.3, 0.2, 9.0], [f32::NAN, 0.2, 1.2]];
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let (width, height) = (30 + random.below(60), 30 + random.below(40));
        let mut cloud = Cloud::new(Kind::Wavy, width, height, seed);
        for _ in 0..4 {
            let point = random.pick(&odd);
            let [left, top] = [width, height].map(|end| random.below(end));
            let [columns, rows] = [(); 2].map(|()| 1 + random.below(60));
            cloud.fill(left..left + columns, top..top + rows, point);
        }
        for _ in 0..3 {
            worst.check(&cloud, &format!("seed {seed}"), &random_options(&mut random));
        }
    }
}

/// Windows that go far beyond the border, or have all of the image; in millimetres, as the depths let each be.
#[test]
fn windows_as_large_as_the_image_equal_the_plain_form() {
    let mut worst = Worst::default();
    for seed in 0..900 {
        let mut random = Random::new(seed);
        let [width, height] = [(); 2].map(|()| 3 + random.below(30));
        let kind = Kind::ALL[seed as usize % Kind::ALL.len()];
        let mut cloud = Cloud::new(kind, width, height, seed);
        if seed % 2 == 0 {
            cloud.points.as_flattened_mut().iter_mut().for_each(|metres| *metres *= 1000.0);
        }
        let size = random.between(2.01, 1.2 * (width + height) as f32);
        let method = random.pick(&methods().collect::<Vec<_>>());
        let options = options(method, size, random.below(2) == 0);
        worst.check(&cloud, &format!("{kind:?} {width}x{height} seed {seed}"), &options);
    }
}

/// Windows as large as the image cost no more than others: by walking over them this would take hours.
#[test]
fn windows_as_large_as_the_image_are_summed() {
    let cloud = Cloud::new(Kind::Plane, 640, 480, 0);
    let small = normal(&compute(&mut Estimator::new(Options::default()), &cloud)[240 * 640 + 320]);
    for method in [Method::CovarianceMatrix, Method::Average3DGradient] {
        let options = options((method, BorderPolicy::Mirror), 5000.0, false);
        for found in compute(&mut Estimator::new(options), &cloud) {
            let degrees = angle(normal(&found).unwrap(), small.unwrap());
            assert!(degrees < 0.01, "{method:?}: {degrees} deg");
        }
    }
}

/// What no list of cases would bring together.
#[test]
fn random_clouds_and_options_equal_the_plain_form() {
    let mut worst = Worst::default();
    for seed in 0..300 {
        let mut random = Random::new(seed);
        let cloud = Cloud::random(&mut random);
        for _ in 0..3 {
            worst.check(&cloud, &format!("seed {seed}"), &random_options(&mut random));
        }
    }
}

const CANARY: f32 = -12345.5;

/// The cloud in an array of points of `stride` floats, rows `row` floats apart.
fn laid_out(cloud: &Cloud, stride: usize, row: usize) -> Vec<f32> {
    let mut data = vec![f32::NAN; row * cloud.height];
    for (at, point) in cloud.points.iter().enumerate() {
        let start = at / cloud.width * row + at % cloud.width * stride;
        data[start..start + 3].copy_from_slice(point);
    }
    data
}

/// Calls `check` with an estimator of each instruction set, the scalar one too, for all options, and with what it makes of the
/// cloud.
fn for_each_isa(
    cloud: &Cloud,
    all: impl Iterator<Item = Options>,
    mut check: impl FnMut(Isa, &mut Estimator, &[[f32; 4]]),
) {
    for options in all {
        for isa in fast_isas().chain([Isa::Scalar]) {
            let mut estimator = Estimator::with_isa(options.clone(), isa);
            let expected = compute(&mut estimator, cloud);
            check(isa, &mut estimator, &expected);
        }
    }
}

#[test]
fn layouts_of_points_do_not_matter() {
    for (width, height) in [(67, 29), (16, 9), (3, 3)] {
        let cloud = Cloud::new(Kind::NanBlocks, width, height, 5);
        let all = methods().map(|method| options(method, 5.0, true)).chain(paper_options());
        for_each_isa(&cloud, all, |isa, estimator, expected| {
            let mut check = |points: &Points, what: &str| {
                let mut found = vec![[7.0; 4]; width * height];
                let data = found.as_flattened_mut();
                let mut normals = Normals::interleaved(data, width, height, 4, 0, Some(3)).unwrap();
                estimator.compute(points, &mut normals).unwrap();
                assert_same_bits(&found, expected, width, &format!("{isa:?} {what}"));
            };
            for stride in [3, 4, 5, 8] {
                for padding in [0, 1, 7] {
                    let row = width * stride + padding;
                    let data = laid_out(&cloud, stride, row);
                    // Not one float more than needed: the last point ends the buffer.
                    let end = data.len() - padding - (stride - 3);
                    let data = data[..end].to_vec().into_boxed_slice();
                    let points = Points::interleaved(&data, width, height, stride, row).unwrap();
                    check(&points, &format!("stride {stride}, padding {padding}"));
                }
            }
            for padding in [0, 3] {
                let row = width + padding;
                let planes = [0, 1, 2].map(|c| {
                    let mut plane = vec![f32::NAN; row * height - padding];
                    for (at, point) in cloud.points.iter().enumerate() {
                        plane[at / width * row + at % width] = point[c];
                    }
                    plane
                });
                let [x, y, z] = &planes;
                let points = Points::planes([x, y, z], width, height, row).unwrap();
                check(&points, &format!("planes, padding {padding}"));
            }
        });
    }
}

#[test]
fn other_bytes_of_the_output_stay() {
    for (width, height) in [(67, 29), (16, 9), (3, 3)] {
        let cloud = Cloud::new(Kind::NanBlocks, width, height, 6);
        let all = methods().map(|method| options(method, 5.0, false));
        for_each_isa(&cloud, all, |isa, estimator, expected| {
            for (stride, curvature) in
                [(3, None), (4, None), (4, Some(3)), (5, Some(3)), (8, Some(4)), (8, None)]
            {
                for padding in [0, 5] {
                    let row = width * stride + padding;
                    let mut data = vec![CANARY; row * height];
                    let mut normals =
                        Normals::interleaved(&mut data, width, height, stride, row, curvature)
                            .unwrap();
                    estimator.compute(&cloud.view(), &mut normals).unwrap();
                    for (at, value) in data.into_iter().enumerate() {
                        let (y, in_row) = (at / row, at % row);
                        let (x, field) = (in_row / stride, in_row % stride);
                        let expected = match field {
                            _ if x >= width => CANARY,
                            0..3 => expected[y * width + x][field],
                            _ if Some(field) == curvature => expected[y * width + x][3],
                            _ => CANARY,
                        };
                        assert_eq!(
                            value.to_bits(),
                            expected.to_bits(),
                            "{isa:?} stride {stride}, padding {padding}, float {at}"
                        );
                    }
                }
            }
        });
    }
}

/// Points and normals as disjoint fields of one array, as in `pcl::PointNormal`, packed, and with rows padded.
#[test]
fn points_and_normals_may_share_an_array() {
    let (width, height) = (67, 29);
    let cloud = Cloud::new(Kind::NanPixels, width, height, 7);
    let all = methods().map(|method| options(method, 7.0, false));
    for_each_isa(&cloud, all, |isa, estimator, expected| {
        // Floats a point, first floats of the normal and the curvature, floats after a row.
        for (stride, first, curvature, padding) in
            [(12, 4, 8, 0), (7, 3, 6, 0), (8, 3, 7, 2), (9, 6, 3, 4)]
        {
            let row = width * stride + padding;
            let mut data = laid_out(&cloud, stride, row);
            let before = data.clone();
            let base = data.as_mut_ptr();
            let place = |field: usize| base.wrapping_add(field);
            let strides = [4 * stride, 4 * row];
            // SAFETY: the array outlives both views and is not touched but through them meanwhile; their
            // fields are inside it, and disjoint.
            unsafe {
                let from = [0, 1, 2].map(|c| place(c).cast_const());
                let points = Points::from_raw(from, width, height, strides).unwrap();
                let to = [0, 1, 2].map(|c| place(first + c));
                let curvature = Some((place(curvature), strides));
                let mut normals = Normals::from_raw(to, width, height, strides, curvature).unwrap();
                estimator.compute(&points, &mut normals).unwrap();
            }
            for (at, (value, before)) in data.into_iter().zip(before).enumerate() {
                let (y, in_row) = (at / row, at % row);
                let (x, field) = (in_row / stride, in_row % stride);
                let expected = match field {
                    _ if x >= width => before,
                    _ if (first..first + 3).contains(&field) => {
                        expected[y * width + x][field - first]
                    }
                    _ if field == curvature => expected[y * width + x][3],
                    _ => before,
                };
                assert_eq!(
                    value.to_bits(),
                    expected.to_bits(),
                    "{isa:?} stride {stride}, float {at}"
                );
            }
        }
    });
}

/// Normals as three planes, or side by side, and curvatures as one; rows packed and padded.
#[test]
fn normals_and_curvatures_may_be_planes() {
    let (width, height) = (67, 29);
    let cloud = Cloud::new(Kind::NanPixels, width, height, 7);
    let all = methods().map(|method| options(method, 7.0, false));
    for_each_isa(&cloud, all, |isa, estimator, fields| {
        for (stride, padding, has_curvature) in
            [(1, 0, true), (1, 5, true), (1, 5, false), (3, 0, true), (3, 5, true)]
        {
            let row = width + padding;
            let plane = row * height;
            // Floats from nx to ny, and from a row of normals to the next.
            let (step, normal_row) = if stride == 1 { (plane, row) } else { (1, stride * row) };
            let mut expected = vec![CANARY; 4 * plane];
            for (at, fields) in fields.iter().enumerate() {
                let (x, y) = (at % width, at / width);
                for c in 0..3 {
                    expected[y * normal_row + x * stride + c * step] = fields[c];
                }
                if has_curvature {
                    expected[3 * plane + y * row + x] = fields[3];
                }
            }
            let mut data = vec![CANARY; 4 * plane];
            let base = data.as_mut_ptr();
            let to = [0, 1, 2].map(|c| base.wrapping_add(c * step));
            let strides = [4 * stride, 4 * normal_row];
            let curvature = has_curvature.then(|| (base.wrapping_add(3 * plane), [4, 4 * row]));
            // SAFETY: the array outlives the view and is not touched but through it meanwhile; the fields are inside it.
            let normals = unsafe { Normals::from_raw(to, width, height, strides, curvature) };
            estimator.compute(&cloud.view(), &mut normals.unwrap()).unwrap();
            let bits = |data: Vec<f32>| data.into_iter().map(f32::to_bits).collect::<Vec<_>>();
            let what = format!("{isa:?} stride {stride}, padding {padding}");
            assert!(bits(data) == bits(expected), "{what}, curvature {has_curvature}");
        }
    });
}

/// A surface that is seen exactly edge-on keeps the side that the method gives, as in PCL: AVERAGE_DEPTH_CHANGE's is the other.
#[test]
fn edge_on_normals_are_not_turned() {
    let (width, height) = (40, 30);
    let cloud = Cloud::of(width, height, |x, y| [x as f32 * 0.25, y as f32 * 0.25, 1.0]);
    for (method, z) in [
        (Method::Average3DGradient, -1.0),
        (Method::Simple3DGradient, -1.0),
        (Method::AverageDepthChange, 1.0),
    ] {
        let mut options = options((method, BorderPolicy::Ignore), 6.0, false);
        options.viewpoint = [3.0, 2.0, 1.0];
        for isa in Isa::ALL {
            let found = compute(&mut Estimator::with_isa(options.clone(), isa), &cloud);
            let normal = &found[12 * width + 20][..3];
            assert_eq!(normal, [0.0, 0.0, z], "{method:?} {isa:?}");
        }
    }
}

/// Windows of one point, and beside them, in the same lanes, windows whose points lie on a line: both are left to the end.
#[test]
fn windows_of_one_point_are_told_from_their_neighbours() {
    let cloud = Cloud::of(90, 40, |x, _| [0.3 + 0.01 * x.saturating_sub(44) as f32, 0.2, 1.0]);
    let mut worst = Worst::default();
    for method in methods() {
        worst.check(&cloud, "a point and a line", &options(method, 6.0, false));
    }
    for options in paper_options() {
        worst.check(&cloud, "a point and a line", &options);
    }
}
