//! Memory that is not there is an error, whatever it was for; nothing is broken then, and nothing is written, or NaN
//! everywhere where it is missed in the middle of a frame.

mod clouds;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};

use clouds::{
    Cloud, Kind, assert_same_bits, compute, compute_to, edge_options, methods, options,
    paper_options,
};
use iine::{Error, Estimator, Isa, Maps, Method, Normals, Options, Semantics};

/// How many more blocks there is memory for.
static LEFT: AtomicUsize = AtomicUsize::new(usize::MAX);

thread_local! {
    /// The least bytes of a block that is counted.
    static LEAST: Cell<usize> = const { Cell::new(LARGE) };
}

/// What threads and their pool ask for is less, as is what the plain form's short lists do: without it, they abort.
const LARGE: usize = 4096;

/// Has nothing for those who ask for a block that is counted when no more are left.
struct Limited;

impl Limited {
    fn has(&self, size: usize) -> bool {
        let one_less =
            |left: usize| if left < usize::MAX { left.checked_sub(1) } else { Some(left) };
        size < LEAST.get()
            || LEFT.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_less).is_ok()
    }
}

// SAFETY: everything is the system allocator's.
unsafe impl GlobalAlloc for Limited {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !self.has(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: as the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as the caller's.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if !self.has(size) {
            return std::ptr::null_mut();
        }
        // SAFETY: as the caller's.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Limited = Limited;

/// Runs `work` with memory for no block, for one, and so on, until it succeeds; returns how many that took. On one thread
/// every block counts, but in the plain form.
fn until_there_is_enough(
    (isa, threads): (Isa, usize),
    mut work: impl FnMut() -> Result<(), Error>,
    what: &str,
) -> usize {
    for blocks in 0..1000 {
        LEFT.store(blocks, Ordering::Relaxed);
        LEAST.set(if threads == 1 && isa != Isa::Scalar { 0 } else { LARGE });
        let result = work();
        LEAST.set(LARGE);
        LEFT.store(usize::MAX, Ordering::Relaxed);
        match result {
            Ok(()) => return blocks,
            Err(error) => assert_eq!(error, Error::OutOfMemory, "{what}"),
        }
    }
    panic!("{what}: never enough memory");
}

fn all_options() -> Vec<Options> {
    let all = methods().map(|method| options(method, 10.0, true));
    all.chain(paper_options()).chain(edge_options()).collect()
}

// One test: the limit is for all threads.
#[test]
fn memory_that_is_not_there_is_an_error() {
    missed_in_the_middle();
    missed_for_another_width();
    for (isa, width, height) in [(Isa::active(), 320, 240), (Isa::Scalar, 76, 54)] {
        let cloud = Cloud::new(Kind::NanBlocks, width, height, 20);
        for options in all_options() {
            normals(isa, &cloud, &options);
            maps(isa, &cloud, &options);
        }
    }
}

/// The lower half is so much deeper that its windows need more memory than the upper half's.
fn missed_in_the_middle() {
    let mut cloud = Cloud::new(Kind::NanBlocks, 120, 400, 21);
    let half = cloud.points.len() / 2;
    for coordinate in cloud.points[half..].as_flattened_mut() {
        *coordinate *= 300.0;
    }
    for method in methods() {
        let options = options(method, 10.0, true);
        let expected = compute(&mut Estimator::new(options.clone()), &cloud);
        let mut found = vec![[7.0; 4]; cloud.points.len()];
        let mut none = 0;
        until_there_is_enough(
            (Isa::active(), 1),
            || {
                found.fill([7.0; 4]);
                let result = compute_to(&mut found, &mut Estimator::new(options.clone()), &cloud);
                if result.is_err() {
                    let all = found.as_flattened();
                    let are_none = all.iter().all(|c| c.is_nan());
                    none += usize::from(are_none);
                    assert!(
                        are_none || all.iter().all(|c| *c == 7.0),
                        "{method:?}: partial output"
                    );
                }
                result
            },
            "two depths",
        );
        assert!(none > 0, "{method:?}: never in the middle");
        assert_same_bits(&found, &expected, cloud.width, "two depths");
    }
}

/// What was held for a frame before is for that frame still, or for none.
fn missed_for_another_width() {
    let narrow = Cloud::new(Kind::NanBlocks, 64, 24, 22);
    let wide = Cloud::new(Kind::NanBlocks, 400, 24, 23);
    for options in all_options() {
        let expected = compute(&mut Estimator::new(options.clone()), &narrow);
        let mut found = vec![[7.0; 4]; wide.points.len()];
        let what = format!("another width: {options:?}");
        until_there_is_enough(
            (Isa::active(), 1),
            || {
                let blocks = LEFT.swap(usize::MAX, Ordering::Relaxed);
                let mut estimator = Estimator::new(options.clone());
                compute(&mut estimator, &narrow);
                LEFT.store(blocks, Ordering::Relaxed);
                let result = compute_to(&mut found, &mut estimator, &wide);
                LEFT.store(usize::MAX, Ordering::Relaxed);
                let again = compute(&mut estimator, &narrow);
                assert_same_bits(&again, &expected, narrow.width, &what);
                result
            },
            &what,
        );
    }
}

/// The normals of all pixels, and of a list of some.
fn normals(isa: Isa, cloud: &Cloud, options: &Options) {
    let expected = compute(&mut Estimator::with_isa(options.clone(), isa), cloud);
    let indices: Vec<i32> = (0..cloud.points.len() as i32).step_by(2).collect();
    // Of the plain form next to nothing is shared out.
    for threads in 1..=if isa == Isa::Scalar { 1 } else { 2 } {
        let mut options = options.clone();
        options.threads = threads;
        let what = format!("{isa:?} {options:?}");
        let mut found = vec![[7.0; 4]; cloud.points.len()];
        let blocks = until_there_is_enough(
            (isa, threads),
            || {
                let mut estimator = Estimator::with_isa(options.clone(), isa);
                let result = compute_to(&mut found, &mut estimator, cloud);
                if result.is_err() {
                    LEFT.store(usize::MAX, Ordering::Relaxed);
                    let untouched = found.as_flattened().iter().all(|c| *c == 7.0);
                    assert!(untouched, "{what}: partial output");
                    let again = compute(&mut estimator, cloud);
                    assert_same_bits(&again, &expected, cloud.width, &what);
                }
                result
            },
            &what,
        );
        assert!(blocks > 1, "{what}: {blocks}");
        assert_same_bits(&found, &expected, cloud.width, &what);

        let mut listed = vec![[7.0; 4]; indices.len()];
        let blocks = until_there_is_enough(
            (isa, threads),
            || {
                let mut estimator = Estimator::with_isa(options.clone(), isa);
                let data = listed.as_flattened_mut();
                let mut normals =
                    Normals::interleaved(data, indices.len(), 1, 4, 0, Some(3)).unwrap();
                estimator.compute_indices(&cloud.view(), &indices, &mut normals)
            },
            &what,
        );
        assert!(blocks > 1, "{what}: {blocks} for a list");
    }
}

/// The maps, and the normal of one window.
fn maps(isa: Isa, cloud: &Cloud, options: &Options) {
    let pixels = cloud.points.len();
    for zero_is_missing in [false, true] {
        let mut options = options.clone();
        options.zero_is_missing = zero_is_missing;
        let what = format!("{isa:?} {options:?}");
        let mut distances = vec![7.0; pixels];
        let mut depth_changes = vec![7; pixels];
        let mut eigenvalues = vec![7.0; 3 * pixels];
        let has_eigenvalues = options.method == Method::CovarianceMatrix;
        let mut estimator = Estimator::with_isa(options.clone(), isa);
        until_there_is_enough(
            (isa, 1),
            || {
                let mut maps = Maps {
                    distances: Some(&mut distances),
                    depth_changes: Some(&mut depth_changes),
                    eigenvalues: has_eigenvalues.then_some(&mut eigenvalues),
                    ..Maps::default()
                };
                let result = estimator.compute_maps(&cloud.view(), &mut maps);
                if result.is_err() {
                    let mut floats = distances.iter().chain(&eigenvalues);
                    let untouched = floats.all(|value| *value == 7.0);
                    assert!(untouched && depth_changes.iter().all(|change| *change == 7), "{what}");
                }
                result
            },
            &what,
        );
        let mut found = [7.0; 4];
        let blocks = until_there_is_enough(
            (isa, 1),
            || {
                let mut normal = Normals::interleaved(&mut found, 1, 1, 4, 0, Some(3)).unwrap();
                estimator.compute_window(&cloud.view(), (40, 30), (9, 9), &mut normal)
            },
            &what,
        );
        let copies = zero_is_missing && options.semantics == Semantics::Pcl;
        assert_eq!(blocks > 0, copies, "{what}");
    }
}
