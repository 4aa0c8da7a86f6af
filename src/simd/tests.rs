//! Every instruction set's operations give what the portable ones give.

use super::portable::Portable;
use super::twice::Twice;
use super::{Along, Baseline, GROUP, Groups, Simd};

const FLOATS: [f32; 16] = [
    0.0,
    -0.0,
    1.5,
    -2.5,
    0.1,
    -7.3,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MIN_POSITIVE,
    1e-41,
    3.5,
    123_456.7,
    -1e30,
    2.5,
    1.0,
];

/// Sixteen floats each, of which every lane meets many values.
fn floats() -> impl Iterator<Item = ([f32; 16], [f32; 16])> {
    (0..16).flat_map(|i| {
        (0..16).map(move |j| {
            let a = std::array::from_fn(|l| FLOATS[(l + i) % 16]);
            (a, std::array::from_fn(|l| FLOATS[(3 * l + j) % 16]))
        })
    })
}

/// What operations gave, lane by lane, as bits. NaN are one value: only their signs and payloads differ.
#[derive(Debug, Default, PartialEq)]
struct Results(Vec<u64>);

impl Results {
    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn floats<S: Simd>(&mut self, values: impl IntoIterator<Item = S::F>) {
        for value in values {
            let mut lanes = [0.0_f32; 2 * GROUP];
            // SAFETY: as the caller's; there is room for a pair.
            unsafe { S::store(lanes.as_mut_ptr(), value) };
            let bits = |v: f32| if v.is_nan() { f32::NAN.to_bits() } else { v.to_bits() };
            self.0.extend(lanes[..S::LANES].iter().map(|v| u64::from(bits(*v))));
        }
    }

    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn integers<S: Simd>(&mut self, values: impl IntoIterator<Item = S::I>) {
        for value in values {
            let mut lanes = [0_i32; 2 * GROUP];
            // SAFETY: as the caller's; there is room for a pair.
            unsafe { S::store_i(lanes.as_mut_ptr(), value) };
            self.0.extend(lanes[..S::LANES].iter().map(|v| *v as u64));
        }
    }

    /// # Safety
    /// The processor has the instruction set of `S`.
    unsafe fn doubles<S: Simd>(&mut self, values: impl IntoIterator<Item = S::D>) {
        for value in values {
            let mut lanes = [0.0_f64; 2 * GROUP];
            // SAFETY: as the caller's; there is room for a pair.
            unsafe { S::store_d(lanes.as_mut_ptr(), value) };
            let bits = |v: f64| if v.is_nan() { f64::NAN.to_bits() } else { v.to_bits() };
            self.0.extend(lanes[..S::LANES].iter().map(|v| bits(*v)));
        }
    }
}

/// Those of two groups or pairs.
///
/// # Safety
/// The processor has the instruction set of `S`.
unsafe fn of_lanes<S: Simd>(a: &[f32; 16], b: &[f32; 16]) -> Results {
    let mut results = Results::default();
    // SAFETY: as the caller's; no more than sixteen lanes are loaded.
    unsafe {
        let (x, y) = (S::load(a.as_ptr()), S::load(b.as_ptr()));
        let bits = S::bits(S::lt(x, y));
        let tenth = S::splat_d(0.1);
        let (dx, dy) = (S::widen(x), S::widen(y));
        results.floats::<S>([
            S::add(x, y),
            S::sub(x, y),
            S::mul(x, y),
            S::div(x, y),
            S::sqrt(x),
            S::min(x, y),
            S::max(x, y),
            S::le(x, y),
            S::and(x, y),
            S::or(x, y),
            S::xor(x, y),
            S::and_not(x, y),
            S::select(S::mask(bits), x, y),
            S::next_lane(x, y),
            S::previous_lane(x, y),
            S::abs(x),
            S::finite(x),
            S::narrow(S::mul_d(dx, tenth)),
        ]);
        let [i, j] = small::<S>([x, y]);
        let mut loaded = [0_i32; 16];
        S::store_i(loaded.as_mut_ptr(), i);
        results.integers::<S>([
            i,
            j,
            S::add_i(i, j),
            S::sub_i(i, j),
            S::select_bits_i(bits, i, j),
            S::load_i(loaded.as_ptr()),
        ]);
        results.floats::<S>([S::float_i(i)]);
        let mut loaded = [0.0_f64; 16];
        S::store_d(loaded.as_mut_ptr(), dy);
        results.doubles::<S>([
            dx,
            S::add_d(dx, tenth),
            S::sub_d(dx, dy),
            S::mul_d(dx, dy),
            S::div_d(dx, dy),
            S::sqrt_d(dx),
            S::max_d(dx, dy),
            S::select_bits_d(bits, dx, dy),
            S::load_d(loaded.as_ptr()),
        ]);
        let masks = [bits, S::bits(S::eq(x, y)), S::bits_lt_d(dx, dy)];
        results.0.extend(masks.map(u64::from));
    }
    results
}

/// What is only done with groups.
///
/// # Safety
/// The processor has the instruction set of `S`.
unsafe fn of_groups<S: Groups>(a: &[f32; 16], b: &[f32; 16]) -> Results {
    let mut results = Results::default();
    // SAFETY: as the caller's; no more than sixteen lanes are loaded.
    unsafe {
        let (x, y) = (S::load(a.as_ptr()), S::load(b.as_ptr()));
        let (dx, dy) = (S::widen(x), S::widen(y));
        let [i, _] = small::<S>([x, y]);
        let doubles: [f64; 16] = std::array::from_fn(|l| f64::from(a[l]));
        results.doubles::<S>([
            S::load_fours_d(|i| doubles.as_ptr().add(3 + 6 * i)),
            // A zero's sign may get lost.
            S::add_d(
                S::prefix_sum_d(S::mul_d(S::widen(S::float_i(i)), S::splat_d(0.1))),
                S::splat_d(0.0),
            ),
            S::last_d(dx),
        ]);
        let mut fours = [0.0; 10];
        let first = fours.as_mut_ptr();
        S::store_fours_d(dx, |half| first.add(1 + 5 * half));
        results.doubles::<S>([S::load_d(fours.as_ptr()), S::load_d(fours.as_ptr().add(2))]);
        results.doubles::<S>([S::load_pairs_d(|i| doubles.as_ptr().add(1 + 4 * i))]);
        results.doubles::<S>(S::pair_d(dx, dy));
        results.doubles::<S>(S::unpair_d(dx, dy));
        results.doubles::<S>(S::transpose_fours_d([dx, dy, S::add_d(dx, dx), S::add_d(dy, dy)]));
        let rows = [0, 1, 2, 3, 4, 5, 6, 7].map(|row| S::load_d(doubles.as_ptr().add(row)));
        results.doubles::<S>(S::transpose_d(rows));
    }
    results
}

/// What goes along a row does as it says.
///
/// # Safety
/// The processor has the instruction set of `S`.
unsafe fn assert_goes_along<S: Along>() {
    let floats: [f32; 256] = std::array::from_fn(|i| i as f32);
    let integers: [i32; 24] = std::array::from_fn(|i| (i as i32).wrapping_pow(9));
    let bits = |v: &f32| u64::from(v.to_bits());
    let (mut found, mut expected) = (Results::default(), Results::default());
    // SAFETY: as the caller's; all places are inside the floats.
    unsafe {
        let from = floats.as_ptr();
        found.floats::<S>([S::load_fours(|four| from.add(101 - 7 * four))]);
        expected.0.extend((0..S::LANES).map(|l| bits(&floats[101 - 7 * (l / 4) + l % 4])));

        let (mut fours, mut stored) = ([0.0; 20], [0.0; 20]);
        let to = fours.as_mut_ptr();
        S::store_fours(S::load(from), |four| to.add(15 - 5 * four));
        (0..S::LANES).for_each(|l| stored[15 - 5 * (l / 4) + l % 4] = floats[l]);
        found.0.extend(fours.iter().map(bits));
        expected.0.extend(stored.iter().map(bits));

        let rows = [0, 1, 2, 3].map(|row| S::load(from.add(16 * row)));
        found.floats::<S>(S::transpose_fours(rows));
        let lanes = (0..4).flat_map(|i| (0..S::LANES).map(move |l| 16 * (l % 4) + l / 4 * 4 + i));
        expected.0.extend(lanes.map(|at| bits(&floats[at])));

        let rows = [0, 1, 2, 3, 4, 5, 6, 7].map(|row| S::load_i(integers.as_ptr().add(row)));
        let mut by_lanes = [0_i32; 8 * 16];
        S::store_by_lanes(rows, by_lanes.as_mut_ptr());
        found.0.extend(by_lanes.map(|integer| integer as u64));
        let stored =
            (0..16).flat_map(|l| (0..8).map(move |i| if l < S::LANES { l + i } else { 0 }));
        expected.0.extend(stored.map(|at| integers[at] as u64));

        let mut carry = S::splat_i(7);
        for _ in 0..2 {
            found.integers::<S>([S::running_sum_i(S::load_i(integers.as_ptr()), &mut carry)]);
        }
        let mut sum = 7_i32;
        for lane in (0..S::LANES).chain(0..S::LANES) {
            sum = sum.wrapping_add(integers[lane]);
            expected.0.push(sum as u64);
        }
        found.integers::<S>([carry]);
        expected.0.extend((0..S::LANES).map(|_| sum as u64));
    }
    assert_eq!(found, expected);
}

/// Points are taken apart, however far apart they are.
///
/// # Safety
/// The processor has the instruction set of `S`.
unsafe fn assert_loads_points<S: Simd>() {
    let floats: [f32; 256] = std::array::from_fn(|i| i as f32);
    for step in [3, 4, 5, 8] {
        let (mut found, mut expected) = (Results::default(), Results::default());
        // SAFETY: as the caller's; all points are inside the floats.
        unsafe {
            let from = floats.as_ptr().add(1);
            found.floats::<S>(S::load_points(from, step * size_of::<f32>()));
        }
        let lanes = (0..3).flat_map(|c| (0..S::LANES).map(move |l| 1 + l * step + c));
        expected.0.extend(lanes.map(|at| u64::from(floats[at].to_bits())));
        assert_eq!(found, expected, "{step} floats apart");
    }
}

/// Points are stored, however far apart they are, and nothing else.
///
/// # Safety
/// The processor has the instruction set of `S`.
unsafe fn assert_stores_points<S: Simd>() {
    let value = |c, lane| (10 * lane + c) as f32;
    let fields: [[f32; 16]; 4] =
        std::array::from_fn(|c| std::array::from_fn(|lane| value(c, lane)));
    for (step, place) in [(3, 0), (4, 3), (8, 0), (8, 3), (8, 4), (8, 7), (9, 4), (12, 4)] {
        let (mut found, mut expected) = ([-1.0; 200], [-1.0; 200]);
        // SAFETY: as the caller's; all points are inside the floats.
        unsafe {
            let lanes = fields.each_ref().map(|field| S::load(field.as_ptr()));
            let first = found.as_mut_ptr().add(1);
            S::store_points(lanes, place, first, step * size_of::<f32>());
        }
        for lane in 0..S::LANES {
            for c in 0..if place > 0 { 4 } else { 3 } {
                expected[1 + lane * step + if c < 3 { c } else { place }] = value(c, lane);
            }
        }
        assert_eq!(found, expected, "{step} floats apart, the fourth at {place}");
    }
}

/// Products are added and subtracted, rounded once if `fuses`, else twice.
///
/// # Safety
/// The processor has the instruction set of `S`.
unsafe fn assert_adds_products<S: Simd>(fuses: bool) {
    for (a, b) in floats() {
        let c: [f32; 16] = std::array::from_fn(|l| b[(l + 5) % 16] - a[l]);
        let (mut found, mut expected) = (Results::default(), Results::default());
        // SAFETY: as the caller's; no more than sixteen lanes are loaded.
        unsafe {
            let [x, y, z] = [a, b, c].map(|lanes| S::load(lanes.as_ptr()));
            found.floats::<S>([S::mul_add(x, y, z), S::neg_mul_add(x, y, z)]);
            // Doubles hold products of floats, but not of their thirds.
            let third = S::splat_d(1.0 / 3.0);
            let [x, y, z] = [x, y, z].map(|lanes| S::mul_d(S::widen(lanes), third));
            found.doubles::<S>([S::mul_add_d(x, y, z), S::neg_mul_add_d(x, y, z)]);
        }
        for sign in [1.0, -1.0] {
            let lanes = (0..S::LANES).map(|l| (sign * a[l], b[l], c[l]));
            let sum = |(a, b, c): (f32, f32, f32)| if fuses { a.mul_add(b, c) } else { a * b + c };
            let bits = |v: f32| u64::from(if v.is_nan() { f32::NAN } else { v }.to_bits());
            expected.0.extend(lanes.map(sum).map(bits));
        }
        for sign in [1.0, -1.0] {
            let third = |v: f32| f64::from(v) * (1.0 / 3.0);
            let lanes = (0..S::LANES).map(|l| (sign * third(a[l]), third(b[l]), third(c[l])));
            let sum = |(a, b, c): (f64, f64, f64)| if fuses { a.mul_add(b, c) } else { a * b + c };
            let bits = |v: f64| if v.is_nan() { f64::NAN } else { v }.to_bits();
            expected.0.extend(lanes.map(sum).map(bits));
        }
        assert_eq!(found, expected, "{a:?} {b:?} {c:?}");
    }
}

/// Integers of numbers that fit, to the nearest and towards zero.
///
/// # Safety
/// The processor has the instruction set of `S`.
unsafe fn small<S: Simd>(values: [S::F; 2]) -> [S::I; 2] {
    // SAFETY: as the caller's.
    unsafe {
        let [x, y] = values.map(|v| S::select(S::lt(S::abs(v), S::splat(1e6)), v, S::splat(-0.5)));
        [S::round_i(x), S::truncate_i(y)]
    }
}

/// # Safety
/// The processor has the instruction set of `S`.
unsafe fn assert_as_portable<S: Groups>(fuses: bool) {
    // SAFETY: as the caller's, and the portable path runs everywhere.
    unsafe {
        assert_goes_along::<Portable>();
        assert_goes_along::<S>();
        assert_goes_along::<S::Widest>();
        assert_loads_points::<Portable>();
        assert_stores_points::<Portable>();
        assert_loads_points::<S>();
        assert_stores_points::<S>();
        assert_loads_points::<S::Pair>();
        assert_stores_points::<S::Pair>();
        assert_adds_products::<Portable>(false);
        assert_adds_products::<S>(fuses);
        assert_adds_products::<S::Pair>(fuses);
    }
    for (a, b) in floats() {
        // SAFETY: as the caller's, and the portable path runs everywhere.
        unsafe {
            assert_eq!(of_lanes::<S>(&a, &b), of_lanes::<Portable>(&a, &b), "{a:?} {b:?}");
            assert_eq!(of_groups::<S>(&a, &b), of_groups::<Portable>(&a, &b), "{a:?} {b:?}");
            let pairs = of_lanes::<S::Pair>(&a, &b);
            assert_eq!(pairs, of_lanes::<Twice<Portable>>(&a, &b), "pairs of {a:?} {b:?}");
        }
    }
}

#[test]
fn operations_equal_the_portable_ones() {
    // SAFETY: every processor has these.
    unsafe { assert_as_portable::<Baseline>(cfg!(target_arch = "aarch64")) };
}

#[cfg(target_arch = "x86_64")]
#[test]
fn operations_of_avx_equal_the_portable_ones() {
    use super::{avx512::Avx512, x86::Avx2};
    use crate::isa::Isa;
    // SAFETY: they are there.
    unsafe {
        if Isa::Avx2.is_available() {
            assert_as_portable::<Avx2>(true);
        }
        if Isa::Avx512.is_available() {
            assert_as_portable::<Avx512>(true);
        }
    }
}
