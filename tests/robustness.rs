//! Whatever the options and the points are: no panic, and a normal exactly where the plain form gives one.

mod clouds;

use clouds::{Cloud, Kind, Random, angle, compute, compute_listed, fast_isas, normal};
use iine::{
    BorderPolicy, Depth, DistanceMetric, Estimator, Isa, Maps, Method, Normals, Options, Semantics,
};

const VALUES: [f32; 18] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-42,
    0.0,
    -0.0,
    1e30,
    -1e30,
    1e19,
    -1e10,
    1e-20,
    1.0,
    1.0,
    1.001,
    -1.0,
];

const SIZES: [f32; 14] = [
    1e30,
    f32::MAX,
    0.001,
    f32::MIN_POSITIVE,
    1.0,
    1.999,
    2.0,
    2.5,
    3.0,
    4.0,
    6.0,
    9.5,
    17.0,
    64.0,
];

const FACTORS: [f32; 9] =
    [0.02, 0.02, 0.05, 0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30];

fn random_cloud(random: &mut Random, seed: u64) -> Cloud {
    let (width, height) = (1 + random.below(26), 1 + random.below(26));
    let mut cloud = Cloud::new(random.pick(&Kind::ALL), width, height, seed);
    match random.below(4) {
        0 => {}
        1 => {
            for _ in 0..1 + random.below(4) {
                let (at, c) = (random.below(width * height), random.below(3));
                cloud.points[at][c] = random.pick(&VALUES);
            }
        }
        2 => cloud.points.iter_mut().flatten().for_each(|c| *c = random.pick(&VALUES)),
        _ => {
            let scale = random.pick(&[1e-30, 1e-12, 1e-6, 1e6, 1e12, 1e18, 1e30]);
            cloud.points.iter_mut().flatten().for_each(|c| *c *= scale);
        }
    }
    cloud
}

fn random_options(random: &mut Random) -> Options {
    let mut options = Options::default();
    options.method = random.pick(&Method::ALL);
    options.border_policy = random.pick(&BorderPolicy::ALL);
    options.normal_smoothing_size = random.pick(&SIZES);
    options.depth_dependent_smoothing = random.below(2) == 0;
    options.max_depth_change_factor = random.pick(&FACTORS);
    options.viewpoint = [(); 3].map(|()| match random.below(4) {
        0 => random.pick(&VALUES),
        _ => 0.0,
    });
    options.threads = random.pick(&[1, 1, 1, 1, 1, 1, 1, 2]);
    options
}

#[test]
fn nothing_panics() {
    let mut random = Random::new(21);
    let (mut clouds, mut differing) = (0, 0);
    for seed in 0..12_000 {
        let cloud = random_cloud(&mut random, seed);
        let options = random_options(&mut random);
        if options.check().is_err() {
            continue;
        }
        clouds += 1;
        let plain = compute(&mut Estimator::with_isa(options.clone(), Isa::Scalar), &cloud);
        let isas: Vec<Isa> = fast_isas().collect();
        let isa = random.pick(&isas);
        let mut estimator = Estimator::with_isa(options.clone(), isa);
        let fast = compute(&mut estimator, &cloud);
        for (at, (a, b)) in fast.iter().zip(&plain).enumerate() {
            if a.map(f32::is_nan) != b.map(f32::is_nan) {
                differing += 1;
                if differing < 30 {
                    let (w, h) = (cloud.width, cloud.height);
                    println!(
                        "seed {seed} {w}x{h} {isa:?} pixel {},{}: {a:?}, plain {b:?}; point {:?}; {options:?}",
                        at % w,
                        at / w,
                        cloud.points[at]
                    );
                }
            }
            let length = a[..3].iter().map(|c| c * c).sum::<f32>();
            // AVERAGE_DEPTH_CHANGE's smallest windows are computed in floats, as in PCL, and overflow as in PCL.
            let as_plain = options.method == Method::AverageDepthChange
                && a.map(f32::to_bits) == b.map(f32::to_bits);
            if (length - 1.0).abs() > 1e-4 && !as_plain {
                println!("seed {seed} length {length} {isa:?} {a:?} plain {b:?} {options:?}");
                differing += 1;
            }
        }
        let index = random.below(cloud.points.len()) as i32;
        let one = compute_listed(&mut estimator, &cloud, &[index])[0];
        assert_eq!(one.map(f32::to_bits), fast[index as usize].map(f32::to_bits));
    }
    println!("{clouds} clouds");
    assert_eq!(differing, 0);
}

/// The options that PCL does not have; PCL's semantics without any of the switches about every 16th time.
fn random_options_beyond_pcl(random: &mut Random) -> Options {
    let mut options = random_options(random);
    if options.normal_smoothing_size > 64.0 {
        options.normal_smoothing_size = 12.0;
    }
    options.semantics = random.pick(&Semantics::ALL);
    let parameter = |random: &mut Random, default: f32| {
        default * random.pick(&[1.0, 1.0, 1.0, 0.3, 3.0, 1e-6, 1e6, 1e-38, 1e35])
    };
    let paper = &mut options.paper;
    paper.alpha = parameter(random, paper.alpha);
    paper.beta = parameter(random, paper.beta);
    paper.gamma = parameter(random, paper.gamma);
    let mut radii = [(); 3].map(|()| 1 + random.below(9) as u32);
    radii.sort();
    [paper.smallest_radius, paper.least_depth_radius, paper.largest_radius] = radii;
    paper.distance_metric = random.pick(&DistanceMetric::ALL);
    paper.depth = random.pick(&Depth::ALL);
    [options.zero_is_missing, options.one_sided_windows, options.crease_windows] =
        [(); 3].map(|()| random.below(2) == 0);
    options
}

#[test]
fn nothing_panics_beyond_pcl() {
    let mut random = Random::new(22);
    let (mut clouds, mut with_normal) = (0, 0);
    for seed in 0..6_000 {
        let cloud = random_cloud(&mut random, seed);
        let options = random_options_beyond_pcl(&mut random);
        if options.check().is_err() {
            continue;
        }
        clouds += 1;
        let mut estimator = Estimator::new(options.clone());
        let found = compute(&mut estimator, &cloud);
        let what = |at: usize| {
            let (x, y) = (at % cloud.width, at / cloud.width);
            format!("seed {seed} pixel {x},{y}: {:?}; {options:?}", found[at])
        };
        let is_paper = options.semantics == Semantics::Paper;
        // PCL's AVERAGE_DEPTH_CHANGE overflows in floats, and has no length then.
        let overflows = !is_paper && options.method == Method::AverageDepthChange;
        for (at, normal) in found.iter().enumerate().filter(|_| !overflows) {
            let is_missing = cloud.points[at].iter().any(|c| !c.is_finite())
                || options.zero_is_missing && cloud.points[at] == [0.0; 3];
            let length = normal[..3].iter().map(|c| c * c).sum::<f32>().sqrt();
            if length.is_nan() {
                assert!(normal[..3].iter().all(|c| c.is_nan()), "{}", what(at));
                continue;
            }
            with_normal += 1;
            assert!(!(is_missing && is_paper), "a missing point: {}", what(at));
            assert!((length - 1.0).abs() < 1e-4, "length {length}: {}", what(at));
            let has_curvature = options.method == Method::CovarianceMatrix;
            assert_eq!(normal[3].is_nan(), !has_curvature, "{}", what(at));
            assert!(normal[3].is_nan() || (0.0..=0.33334).contains(&normal[3]), "{}", what(at));
        }

        let index = random.below(cloud.points.len());
        let mut one = compute_listed(&mut estimator, &cloud, &[index as i32])[0];
        assert_eq!(one.map(f32::to_bits), found[index].map(f32::to_bits), "{}", what(index));
        let mut normal = Normals::interleaved(&mut one, 1, 1, 4, 0, Some(3)).unwrap();
        let pixel = (index % cloud.width, index / cloud.width);
        let size = (random.below(30) as u32, random.below(30) as u32);
        estimator.compute_window(&cloud.view(), pixel, size, &mut normal).unwrap();

        let mut areas = vec![-1.0; cloud.points.len()];
        let mut maps = Maps { smoothing_areas: Some(&mut areas), ..Maps::default() };
        estimator.compute_maps(&cloud.view(), &mut maps).unwrap();
        let largest = options.paper.largest_radius as f32;
        assert!(areas.iter().all(|area| *area >= 0.0 && (*area <= largest || !is_paper)));
        let is_base = !options.one_sided_windows;
        for at in (0..found.len()).filter(|at| is_base && areas[*at] == 0.0) {
            assert!(found[at][0].is_nan(), "no window: {}", what(at));
        }
    }
    println!("{clouds} clouds, {with_normal} normals");
    assert!(with_normal > 100_000);
}

/// What docs/paper.md promises of one-sided and crease windows: scaled by a power of two, as far as depths and 1/alpha stay
/// between 1e-12 and 1e15, a cloud has the same normals.
#[test]
fn windows_near_edges_are_the_same_in_any_unit() {
    let mut random = Random::new(24);
    let mut normals = 0;
    for seed in 0..400 {
        let cloud = Cloud::random(&mut random);
        let mut options = clouds::random_options(&mut random);
        [options.one_sided_windows, options.crease_windows] =
            random.pick(&[[true, false], [false, true], [true, true]]);
        // Lengths of PCL's own that do not scale, and windows of 3 pixels that it sums in floats.
        options.depth_dependent_smoothing = false;
        options.max_depth_change_factor = f32::INFINITY;
        if options.method == Method::AverageDepthChange {
            options.semantics = Semantics::Paper;
        }
        let coordinates = cloud.points.iter().flatten().map(|c| c.abs());
        let lengths = coordinates.filter(|c| c.is_finite()).chain([options.paper.alpha.recip()]);
        let depths = cloud.points.iter().map(|point| point[2].abs());
        let depths = depths.filter(|z| z.is_finite() && *z > 0.0);
        let largest = lengths.fold(0.0, f32::max);
        let least = depths.chain([options.paper.alpha.recip()]).fold(f32::MAX, f32::min);
        let isa = random.pick(&Isa::ALL);
        let expected = compute(&mut Estimator::with_isa(options.clone(), isa), &cloud);
        for exponent in [(1e15 / largest).log2().floor(), (1e-12 / least).log2().ceil()] {
            let unit = exponent.exp2();
            let mut scaled = cloud.clone();
            scaled.points.iter_mut().flatten().for_each(|c| *c *= unit);
            let mut options = options.clone();
            options.viewpoint = options.viewpoint.map(|c| c * unit);
            options.paper.alpha /= unit;
            options.paper.beta /= unit;
            let found = compute(&mut Estimator::with_isa(options.clone(), isa), &scaled);
            for (at, (a, b)) in found.iter().zip(&expected).enumerate() {
                let [a, b] = [a, b].map(normal);
                normals += usize::from(a.is_some());
                let is_same = match (a, b) {
                    (Some(a), Some(b)) => angle(a, b) < 1e-3,
                    (a, b) => a.is_none() && b.is_none(),
                };
                let (x, y) = (at % cloud.width, at / cloud.width);
                assert!(is_same, "seed {seed} {isa:?} {x},{y} {unit}: {a:?}, {b:?}; {options:?}");
            }
        }
    }
    assert!(normals > 1_000_000, "{normals}");
}

#[test]
fn parameters_that_are_none_are_refused() {
    type Change = fn(&mut Options, f32);
    let changes: [Change; 3] = [
        |options, value| options.paper.alpha = value,
        |options, value| options.paper.beta = value,
        |options, value| options.paper.gamma = value,
    ];
    let cloud = Cloud::new(Kind::Wavy, 9, 9, 1);
    let refused = |options: Options| {
        let mut found = [7.0; 3 * 81];
        let mut normals = Normals::interleaved(&mut found, 9, 9, 3, 0, None).unwrap();
        let outcome = Estimator::new(options).compute(&cloud.view(), &mut normals);
        assert!(outcome.is_ok() || found == [7.0; 3 * 81], "outputs stay untouched");
        outcome == Err(iine::Error::OptionValue)
    };
    let mut paper = Options::default();
    paper.semantics = Semantics::Paper;
    let [mut one_sided, mut creases] = [Options::default(), Options::default()];
    one_sided.one_sided_windows = true;
    creases.crease_windows = true;
    for options in [paper.clone(), one_sided, creases] {
        assert!(!refused(options.clone()));
        for change in changes {
            for value in [0.0, -0.0, -3.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut options = options.clone();
                change(&mut options, value);
                assert!(refused(options));
            }
        }
        for radii in [[0, 5, 20], [6, 5, 20], [2, 21, 20], [2, 5, 1001]] {
            let mut options = options.clone();
            let paper = &mut options.paper;
            [paper.smallest_radius, paper.least_depth_radius, paper.largest_radius] = radii;
            assert!(refused(options));
        }
    }
}

#[test]
fn sizes_that_are_no_sizes_are_refused() {
    let cloud = Cloud::new(Kind::Wavy, 9, 9, 1);
    for size in [0.0, -0.0, -3.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for isa in Isa::ALL {
            let mut options = Options::default();
            options.normal_smoothing_size = size;
            let mut found = [7.0; 3 * 81];
            let mut normals = Normals::interleaved(&mut found, 9, 9, 3, 0, None).unwrap();
            let refused = Estimator::with_isa(options, isa).compute(&cloud.view(), &mut normals);
            assert_eq!(refused, Err(iine::Error::OptionValue));
            assert_eq!(found, [7.0; 3 * 81], "outputs stay untouched");
        }
    }
}
