//! Points and normals lie between pages that nobody may touch: no byte outside them is read or written, and none
//! between a pixel's fields and the next one's is changed.

#![cfg(unix)]

mod clouds;

use std::ptr::null_mut;

use clouds::{
    Cloud, Kind, assert_same_bits, compute, edge_options, fast_isas, methods, options,
    paper_options,
};
use iine::{Estimator, Normals, Points};

/// Floats between two pages that nobody may touch.
struct Enclosed {
    map: *mut libc::c_void,
    length: usize,
    first: *mut f32,
    count: usize,
}

impl Enclosed {
    /// So many floats, right before the page behind them or, if `at_start`, right behind the one before.
    fn new(count: usize, at_start: bool) -> Self {
        // SAFETY: a question.
        let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) } as usize;
        let bytes = count * size_of::<f32>();
        let inner = bytes.next_multiple_of(page);
        let length = inner + 2 * page;
        // SAFETY: a new map, of which the pages between the outer ones become accessible.
        let map = unsafe {
            let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
            let map = libc::mmap(null_mut(), length, libc::PROT_NONE, flags, -1, 0);
            assert_ne!(map, libc::MAP_FAILED);
            let access = libc::PROT_READ | libc::PROT_WRITE;
            assert_eq!(libc::mprotect(map.byte_add(page), inner, access), 0);
            map
        };
        let offset = if at_start { page } else { page + inner - bytes };
        let mut enclosed =
            Enclosed { map, length, first: map.wrapping_byte_add(offset).cast(), count };
        enclosed.floats().fill(UNTOUCHED);
        enclosed
    }

    fn floats(&mut self) -> &mut [f32] {
        // SAFETY: as many accessible floats, which are borrowed with the map.
        unsafe { std::slice::from_raw_parts_mut(self.first, self.count) }
    }
}

impl Drop for Enclosed {
    fn drop(&mut self) {
        // SAFETY: mapped in `new`.
        unsafe { libc::munmap(self.map, self.length) };
    }
}

/// What stays where it was.
const UNTOUCHED: f32 = -77.0;

/// Floats from a point to the next one, and from a normal; and the place of its curvature.
const LAYOUTS: [(usize, usize, Option<usize>); 4] =
    [(4, 8, Some(4)), (3, 3, None), (4, 4, Some(3)), (12, 12, Some(9))];

fn check(cloud: &Cloud, options: &iine::Options, isa: iine::Isa) {
    let (width, height) = (cloud.width, cloud.height);
    let pixels = width * height;
    let mut estimator = Estimator::with_isa(options.clone(), isa);
    let expected = compute(&mut estimator, cloud);
    for (point_step, step, curvature) in LAYOUTS {
        for at_start in [false, true] {
            let what = format!("{isa:?}, {step} floats, curvature {curvature:?}, {options:?}");
            let fields = curvature.map_or(3, |place| place + 1);
            let mut points = Enclosed::new((pixels - 1) * point_step + 3, at_start);
            for (to, point) in points.floats().chunks_mut(point_step).zip(&cloud.points) {
                to[..3].copy_from_slice(point);
            }
            let mut normals = Enclosed::new((pixels - 1) * step + fields, at_start);
            let view = Points::interleaved(points.floats(), width, height, point_step, 0).unwrap();
            let output = normals.floats();
            let mut to = Normals::interleaved(output, width, height, step, 0, curvature).unwrap();
            estimator.compute(&view, &mut to).unwrap();
            let mut found = expected.clone();
            for (at, (pixel, found)) in
                normals.floats().chunks_mut(step).zip(&mut found).enumerate()
            {
                for (place, value) in pixel.iter().enumerate() {
                    match place {
                        0..3 => found[place] = *value,
                        _ if Some(place) == curvature => found[3] = *value,
                        _ => assert_eq!(*value, UNTOUCHED, "pixel {at}, float {place}: {what}"),
                    }
                }
            }
            assert_same_bits(&expected, &found, width, &what);
        }
    }
}

#[test]
fn nothing_else_is_read_or_written() {
    let all = methods().map(|combination| options(combination, 7.0, true));
    let all: Vec<_> = all.chain(paper_options()).chain(edge_options()).collect();
    // Rows of whole groups, and of less.
    for (width, height) in [(64, 24), (37, 21)] {
        let cloud = Cloud::new(Kind::NanBlocks, width, height, 3);
        for options in &all {
            for isa in fast_isas() {
                check(&cloud, options, isa);
            }
        }
    }
}
