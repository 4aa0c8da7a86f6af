//! Intrinsics of each of a group's registers.

/// Applies an intrinsic to each of a group's registers: written out, as compilers take minutes over so many small
/// loops.
macro_rules! each {
    ([$($i:literal)+] $op:path, $a:expr) => {{
        let a = $a;
        [$($op(a[$i])),+]
    }};
    ([$($i:literal)+] $op:path, $a:expr, $b:expr) => {{
        let (a, b) = ($a, $b);
        [$($op(a[$i], b[$i])),+]
    }};
    ([$($i:literal)+] $op:path, $a:expr, $b:expr, $c:expr) => {{
        let (a, b, c) = ($a, $b, $c);
        [$($op(a[$i], b[$i], c[$i])),+]
    }};
    (2 $op:path, $($operand:expr),+) => { each!([0 1] $op, $($operand),+) };
    (4 $op:path, $($operand:expr),+) => { each!([0 1 2 3] $op, $($operand),+) };
}

/// Methods that call one function each, of all of a group or, `of N` registers, of each.
macro_rules! calls {
    (of $n:tt: $($name:ident($($operand:ident: $type:ty),*) -> $result:ty = $function:path;)*) => {
        $(#[inline(always)]
        unsafe fn $name($($operand: $type),*) -> $result {
            unsafe { each!($n $function, $($operand),*) }
        })*
    };
    ($($name:ident($($operand:ident: $type:ty),*) $(-> $result:ty)? = $function:path;)*) => {
        $(#[inline(always)]
        unsafe fn $name($($operand: $type),*) $(-> $result)? {
            unsafe { $function($($operand),*) }
        })*
    };
}

/// Methods that fill, load and store each register, or group, by what does so with one `of N` lanes.
macro_rules! memory {
    ($($number:ident, $type:ident, [$($i:literal)+] of $lanes:expr,
        $splat:ident = $splat_one:path, $load:ident = $load_one:path, $store:ident = $store_one:path;)*) => {
        $(#[inline(always)]
        unsafe fn $splat(value: $number) -> Self::$type {
            // SAFETY: as the caller's.
            unsafe { [$splat_one(value); [$($i),+].len()] }
        }
        #[inline(always)]
        unsafe fn $load(from: *const $number) -> Self::$type {
            // SAFETY: as the caller's.
            unsafe { [$($load_one(from.add($lanes * $i))),+] }
        }
        #[inline(always)]
        unsafe fn $store(to: *mut $number, value: Self::$type) {
            // SAFETY: as the caller's.
            unsafe { $($store_one(to.add($lanes * $i), value[$i]);)+ }
        })*
    };
}

/// What groups do with doubles in four registers of two, by what loads and stores a register, and what makes one of the first
/// lanes of two, or of the second ones.
macro_rules! doubles_by_twos {
    ($load:path, $store:path, $firsts:path, $seconds:path) => {
        #[inline(always)]
        unsafe fn load_fours_d(place: impl Fn(usize) -> *const f64) -> Self::D {
            unsafe {
                let two = |i: usize| place(i / 2).add(i % 2 * 2);
                [$load(two(0)), $load(two(1)), $load(two(2)), $load(two(3))]
            }
        }
        #[inline(always)]
        unsafe fn store_fours_d(value: Self::D, place: impl Fn(usize) -> *mut f64) {
            for (i, two) in value.into_iter().enumerate() {
                unsafe { $store(place(i / 2).add(i % 2 * 2), two) };
            }
        }
        #[inline(always)]
        unsafe fn transpose_fours_d(rows: [Self::D; 4]) -> [Self::D; 4] {
            let [a, b, c, d] = rows;
            let mut columns = rows;
            for half in [0, 2] {
                for i in 0..2 {
                    unsafe {
                        columns[2 * i][half] = $firsts(a[half + i], b[half + i]);
                        columns[2 * i][half + 1] = $firsts(c[half + i], d[half + i]);
                        columns[2 * i + 1][half] = $seconds(a[half + i], b[half + i]);
                        columns[2 * i + 1][half + 1] = $seconds(c[half + i], d[half + i]);
                    }
                }
            }
            columns
        }
        #[inline(always)]
        unsafe fn join_halves_d(a: Self::D, b: Self::D) -> [Self::D; 2] {
            [[a[0], a[1], b[0], b[1]], [a[2], a[3], b[2], b[3]]]
        }
        #[inline(always)]
        unsafe fn load_pairs_d(place: impl Fn(usize) -> *const f64) -> Self::D {
            unsafe { [$load(place(0)), $load(place(1)), $load(place(2)), $load(place(3))] }
        }
        #[inline(always)]
        unsafe fn pair_d(a: Self::D, b: Self::D) -> [Self::D; 2] {
            let mut pairs = [a, b];
            for i in 0..4 {
                unsafe {
                    pairs[i / 2][i % 2 * 2] = $firsts(a[i], b[i]);
                    pairs[i / 2][i % 2 * 2 + 1] = $seconds(a[i], b[i]);
                }
            }
            pairs
        }
        #[inline(always)]
        unsafe fn unpair_d(first: Self::D, last: Self::D) -> [Self::D; 2] {
            let mut lanes = [first, last];
            for i in 0..4 {
                unsafe {
                    let two = &[first, last][i / 2][i % 2 * 2..];
                    lanes[0][i] = $firsts(two[0], two[1]);
                    lanes[1][i] = $seconds(two[0], two[1]);
                }
            }
            lanes
        }
    };
}
