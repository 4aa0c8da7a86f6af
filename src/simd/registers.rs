//! An intrinsic of each of a group's registers.

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
