//! Generated clouds and ways to compute and compare their normals, for the tests that hold the fast paths to the
//! plain form.

#![allow(dead_code)] // every test takes what it needs

use iine::{
    BorderPolicy, Depth, DistanceMetric, Error, Estimator, Isa, Method, Normals, Options, Points,
    Semantics,
};

/// Numbers that look random, the same for the same seed.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 16
    }

    /// A whole number below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    /// A number from `low` up to `high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.next() % 0x100_0000) as f32 / 0x100_0000 as f32
    }

    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

/// What a cloud is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Wavy,
    Noisy,
    Plane,
    SteepPlane,
    Steps,
    NanPixels,
    NanBlocks,
    NanRows,
    NanBorders,
    XOrYNan,
    Infinite,
    Zeros,
    NegativeZ,
    Shifted,
    Millimetres,
    /// z in other units than x and y: all windows are nearly lines.
    MixedUnits,
}

impl Kind {
    pub const ALL: [Kind; 16] = [
        Kind::Wavy,
        Kind::Noisy,
        Kind::Plane,
        Kind::SteepPlane,
        Kind::Steps,
        Kind::NanPixels,
        Kind::NanBlocks,
        Kind::NanRows,
        Kind::NanBorders,
        Kind::XOrYNan,
        Kind::Infinite,
        Kind::Zeros,
        Kind::NegativeZ,
        Kind::Shifted,
        Kind::Millimetres,
        Kind::MixedUnits,
    ];
}

/// An organized cloud.
#[derive(Clone, Debug)]
pub struct Cloud {
    pub width: usize,
    pub height: usize,
    pub points: Vec<[f32; 3]>,
}

impl Cloud {
    /// A cloud of the points that `point` gives for each column and row, asked row by row.
    pub fn of(
        width: usize,
        height: usize,
        mut point: impl FnMut(usize, usize) -> [f32; 3],
    ) -> Cloud {
        let points = (0..width * height).map(|at| point(at % width, at / width)).collect();
        Cloud { width, height, points }
    }

    pub fn view(&self) -> Points<'_> {
        Points::interleaved(self.points.as_flattened(), self.width, self.height, 3, 0).unwrap()
    }

    /// A cloud of the kind, the same for the same seed.
    pub fn new(kind: Kind, width: usize, height: usize, seed: u64) -> Cloud {
        let mut random = Random::new(seed);
        let slope = match kind {
            Kind::SteepPlane => 3.0,
            _ => 0.6,
        };
        let [a, b] = [random.between(-slope, slope), random.between(-slope, slope)];
        let wave = random.between(0.005, 0.02);
        let is_plane = matches!(kind, Kind::Plane | Kind::SteepPlane);
        let mut cloud = Cloud::of(width, height, |column, row| {
            let u = (column as f32 - width as f32 / 2.0) / 525.0;
            let v = (row as f32 - height as f32 / 2.0) / 525.0;
            let mut z = 1.2 / (1.0 - a * u - b * v);
            if !is_plane {
                z += wave * (0.21 * column as f32).sin() * (0.17 * row as f32 + 0.5).cos();
            }
            if kind == Kind::Noisy {
                z += random.between(-0.003, 0.003);
            }
            if kind == Kind::Steps {
                z += 0.4 * ((column / 11 + row / 17) % 3) as f32;
            }
            [u * z, v * z, z]
        });
        cloud.change(kind, &mut random);
        cloud
    }

    /// A surface with or without a wave, a step, noise, depth steps, missing and odd points, anywhere and of any size.
    pub fn random(random: &mut Random) -> Cloud {
        let [width, height] = [(); 2].map(|()| match random.below(4) {
            0 => 1 + random.below(30),
            _ => 20 + random.below(80),
        });
        let or_none = |random: &mut Random, low: f32, high: f32| match random.below(2) {
            0 => 0.0,
            _ => random.between(low, high),
        };
        let focal = random.between(30.0, 600.0);
        let depth = random.between(-1.5, 2.5).exp();
        let slope = [(); 2].map(|()| random.between(-1.0, 1.0));
        let [wave, step] = [or_none(random, 0.0, 0.3), or_none(random, -0.5, 0.5)];
        let [noise, depth_step] = [(); 2].map(|()| or_none(random, -10.0, -2.0));
        let [missing, odd] = [(); 2].map(|()| or_none(random, 0.0, 0.5).powi(3));
        let change = random.pick(&ODD);
        let scale = or_none(random, -7.0, 7.0).exp();
        let offset = [(); 3].map(|()| or_none(random, -50.0, 50.0));
        let mut cloud = Cloud::of(width, height, |column, row| {
            let u = (column as f32 - width as f32 / 2.0) / focal;
            let v = (row as f32 - height as f32 / 2.0) / focal;
            let mut z =
                1.0 + slope[0] * u + slope[1] * v + wave * (20.0 * u).sin() * (30.0 * v).cos();
            z += if u + 2.0 * v > 0.1 { step } else { 0.0 };
            if noise < 0.0 {
                z *= 1.0 + noise.exp() * random.between(-1.0, 1.0);
            }
            if depth_step < 0.0 {
                z = depth_step.exp() * (z / depth_step.exp()).round();
            }
            z *= depth;
            let mut point = [u * z, v * z, z];
            for c in 0..3 {
                point[c] = scale * (point[c] + offset[c]);
            }
            if random.between(0.0, 1.0) < missing {
                point = [f32::NAN; 3];
            } else if random.between(0.0, 1.0) < odd {
                point = change(point);
            }
            point
        });
        if random.below(4) == 0 {
            let last = cloud.points.last_mut().expect("points");
            *last = random.pick(&ODD)(*last);
        }
        cloud
    }

    fn change(&mut self, kind: Kind, random: &mut Random) {
        let (width, height) = (self.width, self.height);
        let pixels = width * height;
        let nan = [f32::NAN; 3];
        match kind {
            Kind::NanPixels => {
                for _ in 0..1 + pixels / 150 {
                    self.points[random.below(pixels)] = nan;
                }
            }
            Kind::NanBlocks => {
                for _ in 0..1 + pixels / 800 {
                    let (x, y) = (random.below(width), random.below(height));
                    let (w, h) = (1 + random.below(9), 1 + random.below(9));
                    self.fill(x..x + w, y..y + h, nan);
                }
            }
            Kind::NanRows => {
                let (x, y) = (random.below(width), random.below(height));
                self.fill(0..width, y..y + 1, nan);
                self.fill(x..x + 1, 0..height, nan);
            }
            Kind::NanBorders => {
                let [left, right, up, down] = [(); 4].map(|()| random.below(3));
                self.fill(0..left, 0..height, nan);
                self.fill(width.saturating_sub(right)..width, 0..height, nan);
                self.fill(0..width, 0..up, nan);
                self.fill(0..width, height.saturating_sub(down)..height, nan);
                // And single ones in the outermost rows and columns.
                for _ in 0..2 {
                    let along = random.below(width);
                    self.points[along] = nan;
                    self.points[pixels - 1 - random.below(width)] = nan;
                    self.points[random.below(height) * width] = nan;
                    self.points[random.below(height) * width + width - 1] = nan;
                }
            }
            Kind::XOrYNan => {
                for _ in 0..1 + pixels / 200 {
                    let c = random.below(2);
                    let value = random.pick(&[f32::NAN, f32::INFINITY]);
                    self.points[random.below(pixels)][c] = value;
                }
            }
            Kind::Infinite => {
                for _ in 0..1 + pixels / 200 {
                    let value = random.pick(&[f32::INFINITY, f32::NEG_INFINITY]);
                    self.points[random.below(pixels)] = [value; 3];
                }
            }
            Kind::Zeros => {
                for _ in 0..1 + pixels / 300 {
                    let (x, y) = (random.below(width), random.below(height));
                    self.fill(x..x + 4, y..y + 3, [0.0; 3]);
                }
            }
            Kind::NegativeZ => self.points.iter_mut().for_each(|p| p[2] = -p[2]),
            Kind::Shifted => self.points.iter_mut().flatten().for_each(|c| *c += 100.0),
            Kind::Millimetres => self.points.iter_mut().flatten().for_each(|c| *c *= 1000.0),
            Kind::MixedUnits => self.points.iter_mut().for_each(|point| point[2] *= 1000.0),
            _ => {}
        }
    }

    /// Makes all points of some columns and rows, as far as they are inside, this one.
    pub fn fill(
        &mut self,
        columns: std::ops::Range<usize>,
        rows: std::ops::Range<usize>,
        point: [f32; 3],
    ) {
        for y in rows.start..rows.end.min(self.height) {
            for x in columns.start..columns.end.min(self.width) {
                self.points[y * self.width + x] = point;
            }
        }
    }
}

/// What becomes of a point that is out of the ordinary.
pub const ODD: [fn([f32; 3]) -> [f32; 3]; 8] = [
    |_| [f32::NAN; 3],
    |_| [0.0; 3],
    |[_, y, z]| [f32::NAN, y, z],
    |[x, _, z]| [x, f32::INFINITY, z],
    |[x, y, _]| [x, y, f32::INFINITY],
    |[x, y, z]| [x, y, -z],
    |point| point.map(|c| 100.0 * c),
    |point| point.map(|c| 1e-3 * c),
];

/// The methods with the border policies that they support.
pub fn methods() -> impl Iterator<Item = (Method, BorderPolicy)> {
    Method::ALL
        .into_iter()
        .flat_map(|method| BorderPolicy::ALL.map(|policy| (method, policy)))
        .filter(|combination| *combination != (Method::Simple3DGradient, BorderPolicy::Mirror))
}

/// The instruction sets of the fast path that this processor has.
pub fn fast_isas() -> impl Iterator<Item = Isa> {
    Isa::ALL.into_iter().filter(|isa| *isa != Isa::Scalar && isa.is_available())
}

/// Whether an instruction set adds products rounded once.
pub fn fuses(isa: Isa) -> bool {
    matches!(isa, Isa::Avx2 | Isa::Avx512 | Isa::Neon)
}

pub fn options(
    (method, border_policy): (Method, BorderPolicy),
    normal_smoothing_size: f32,
    depth_dependent_smoothing: bool,
) -> Options {
    let mut options = Options::default();
    options.method = method;
    options.border_policy = border_policy;
    options.normal_smoothing_size = normal_smoothing_size;
    options.depth_dependent_smoothing = depth_dependent_smoothing;
    options
}

/// The paper's methods with its defaults, small and large windows, few and many depth changes, other depths.
pub fn paper_options() -> Vec<Options> {
    let mut all = Vec::new();
    for method in Method::ALL.into_iter().filter(|method| *method != Method::Simple3DGradient) {
        for variant in 0..5 {
            let mut options = Options::default();
            options.semantics = Semantics::Paper;
            options.method = method;
            let paper = &mut options.paper;
            match variant {
                0 => {}
                1 => {
                    (paper.smallest_radius, paper.least_depth_radius) = (1, 1);
                    (paper.largest_radius, paper.gamma) = (6, 2.0);
                }
                2 => {
                    (paper.least_depth_radius, paper.largest_radius) = (25, 40);
                    paper.gamma = 50.0;
                }
                3 => {
                    paper.depth = Depth::Range;
                    options.zero_is_missing = true;
                    options.viewpoint = [0.5, -1.0, 0.25];
                }
                _ => paper.distance_metric = DistanceMetric::Chamfer,
            }
            all.push(options);
        }
    }
    all
}

/// Windows near depth changes and creases, on both semantics.
pub fn edge_options() -> Vec<Options> {
    let mut all = Vec::new();
    for semantics in [Semantics::Paper, Semantics::Pcl] {
        for method in Method::ALL {
            if semantics == Semantics::Paper && method == Method::Simple3DGradient {
                continue; // not the paper's
            }
            // What tells the windows is the same for all methods.
            let one_of_both = [[true, false], [false, true]].into_iter();
            let one_of_both = one_of_both.filter(|_| method == Method::CovarianceMatrix);
            for [one_sided, crease] in one_of_both.chain([[true, true]]) {
                let mut options = Options::default();
                options.semantics = semantics;
                options.method = method;
                options.one_sided_windows = one_sided;
                options.crease_windows = crease;
                all.push(options);
            }
        }
    }
    all
}

/// Any options but windows near edges.
pub fn random_options(random: &mut Random) -> Options {
    let methods: Vec<_> = methods().collect();
    let size = if random.below(2) == 0 { 10.0 } else { random.between(2.01, 40.0) };
    let mut options = options(random.pick(&methods), size, random.below(2) == 0);
    if random.below(2) == 0 {
        options.max_depth_change_factor = random.between(-6.0, 0.0).exp();
    }
    if random.below(3) == 0 {
        options.viewpoint = [(); 3].map(|()| random.between(-3.0, 3.0));
    }
    if options.method != Method::Simple3DGradient {
        options.semantics = random.pick(&Semantics::ALL);
    }
    options.zero_is_missing = random.below(3) == 0;
    let paper = &mut options.paper;
    if random.below(2) == 0 {
        paper.alpha *= random.between(-3.0, 2.0).exp();
        paper.beta = random.between(3.0, 9.0).exp();
        paper.gamma = random.between(-1.0, 4.0).exp();
        paper.smallest_radius = 1 + random.below(4) as u32;
        paper.least_depth_radius = paper.smallest_radius + random.below(10) as u32;
        paper.largest_radius = paper.least_depth_radius + random.below(20) as u32;
        paper.distance_metric = random.pick(&DistanceMetric::ALL);
        paper.depth = random.pick(&Depth::ALL);
    }
    options
}

/// nx, ny, nz, curvature of every pixel.
pub fn compute(estimator: &mut Estimator, cloud: &Cloud) -> Vec<[f32; 4]> {
    let mut found = vec![[7.0; 4]; cloud.width * cloud.height];
    compute_to(&mut found, estimator, cloud).unwrap();
    found
}

/// The indices' normals, by the estimator, in an array of their own.
pub fn compute_listed(estimator: &mut Estimator, cloud: &Cloud, indices: &[i32]) -> Vec<[f32; 4]> {
    let mut found = vec![[7.0; 4]; indices.len()];
    let data = found.as_flattened_mut();
    let mut normals = Normals::interleaved(data, indices.len(), 1, 4, 0, Some(3)).unwrap();
    estimator.compute_indices(&cloud.view(), indices, &mut normals).unwrap();
    found
}

/// [`compute`], to where the normals are to be written.
pub fn compute_to(
    found: &mut [[f32; 4]],
    estimator: &mut Estimator,
    cloud: &Cloud,
) -> Result<(), Error> {
    let data = found.as_flattened_mut();
    let mut normals = Normals::interleaved(data, cloud.width, cloud.height, 4, 0, Some(3)).unwrap();
    estimator.compute(&cloud.view(), &mut normals)
}

/// The angle between two unit vectors in degrees, well conditioned also where it is small.
pub fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let sine = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
    let cosine = a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    sine.atan2(cosine).to_degrees()
}

/// The normal of a pixel in doubles, if it has one.
pub fn normal(found: &[f32; 4]) -> Option<[f64; 3]> {
    let normal = [found[0], found[1], found[2]].map(f64::from);
    normal.iter().all(|c| c.is_finite()).then_some(normal)
}

/// Panics at the first pixel whose bits differ.
pub fn assert_same_bits(a: &[[f32; 4]], b: &[[f32; 4]], width: usize, what: &str) {
    assert_eq!(a.len(), b.len());
    for (at, (a, b)) in a.iter().zip(b).enumerate() {
        assert!(
            a.map(f32::to_bits) == b.map(f32::to_bits),
            "{what}: pixel {},{}: {a:?} and {b:?}",
            at % width,
            at / width
        );
    }
}
