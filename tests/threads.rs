//! What does not depend on the number of threads, on the choice of pixels, or on the frames before: the normals. And
//! what scratch memory does.

mod clouds;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::{Cell, RefCell};
use std::process::Command;

use clouds::{
    Cloud, Kind, Random, assert_same_bits, compute, compute_listed, compute_to, edge_options,
    fast_isas, methods, options, paper_options,
};
use iine::{BorderPolicy, DistanceMetric, Error, Estimator, Isa, Method, Normals, Options};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
    static HELD: Cell<usize> = const { Cell::new(0) };
}

/// Counts how often each thread asks for memory, and how many bytes it holds (those that another one frees stay).
struct Counting;

// SAFETY: everything is the system allocator's.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // A thread that ends may ask after its counter is gone.
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
        let _ = HELD.try_with(|held| held.set(held.get().wrapping_add(layout.size())));
        // SAFETY: as the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        let _ = HELD.try_with(|held| held.set(held.get().wrapping_sub(layout.size())));
        // SAFETY: as the caller's.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// So many threads give what one gives.
fn check_threads(cloud: &Cloud, mut options: Options, numbers: &[usize]) {
    options.threads = 1;
    let one = compute(&mut Estimator::new(options.clone()), cloud);
    for threads in numbers {
        options.threads = *threads;
        let found = compute(&mut Estimator::new(options.clone()), cloud);
        let what = format!("{}x{} {options:?}", cloud.width, cloud.height);
        assert_same_bits(&found, &one, cloud.width, &what);
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    for (kind, width, height) in [
        (Kind::NanBlocks, 200, 150),
        (Kind::Steps, 641, 333),
        (Kind::XOrYNan, 97, 260),
        (Kind::Wavy, 35, 900),
    ] {
        let cloud = Cloud::new(kind, width, height, 11);
        let mut all = paper_options();
        all.extend(edge_options());
        for method in methods() {
            for depth_dependent in [false, true] {
                all.extend([5.0, 10.0, 20.0].map(|size| options(method, size, depth_dependent)));
            }
        }
        all.into_iter().for_each(|options| check_threads(&cloud, options, &[2, 3, 7]));
    }
}

/// Rows swept for their neighbours only do not know of all depth changes: their windows look larger than any is. And what is
/// above a gap in the columns counts below it, in whatever thread's rows it ends.
#[test]
fn where_depth_changes_are_far_away_the_number_of_threads_does_not_matter_either() {
    let (width, height) = (300, 600);
    let mut cloud = Cloud::new(Kind::Noisy, width, height, 21);
    for (at, point) in cloud.points.iter_mut().enumerate() {
        point[2] += (at / width / 23 % 2) as f32;
    }
    let mut with_gap = cloud.clone();
    with_gap.fill(40..80, 150..450, [f32::NAN; 3]);
    for (at, point) in with_gap.points.iter_mut().enumerate().skip(450 * width) {
        point[2] += if (40..80).contains(&(at % width)) { 20.0 } else { 0.0 };
    }
    let mut all = paper_options();
    all.extend(edge_options());
    for options in all {
        for cloud in [&cloud, &with_gap] {
            check_threads(cloud, options.clone(), &[2, 3]);
        }
    }
}

/// Rings go on from strip to strip where one thread makes both, if sums come out the same: not where the scale of integers
/// changes, nor after points that are off the axis, missing or of layers. What is incomplete above counts below.
#[test]
fn what_differs_from_strip_to_strip_does_not_depend_on_the_number_of_threads() {
    let (width, height) = (150, 1600);
    let mut cloud = Cloud::new(Kind::Noisy, width, height, 31);
    let rows = |rows: std::ops::Range<usize>| rows.start * width..rows.end * width;
    for point in &mut cloud.points[rows(100..400)] {
        *point = point.map(|c| 2.5 * c);
    }
    cloud.fill(0..70, 380..420, [f32::NAN; 3]);
    // Far from the axis, beside a strip that has nothing like it.
    for x in 90..120 {
        cloud.points[510 * width + x][0] += 400.0;
    }
    for x in 20..30 {
        cloud.points[630 * width + x][1] = f32::NAN;
    }
    cloud.fill(0..width, 700..940, [f32::NAN; 3]);
    // Behind all, where there is no return.
    cloud.fill(30..60, 1010..1090, [0.0, 0.0, 9000.0]);
    for (at, point) in cloud.points[rows(1200..1600)].iter_mut().enumerate() {
        *point = point.map(|c| c * (1.0 + at as f32 / (100 * width) as f32));
    }
    for method in methods() {
        for size in [5.0, 20.0, 120.0] {
            check_threads(&cloud, options(method, size, true), &[2, 4, 16]);
        }
    }
}

#[test]
fn listed_pixels_get_what_the_whole_cloud_gives_them() {
    let mut random = Random::new(12);
    for (kind, width, height) in
        [(Kind::NanPixels, 97, 61), (Kind::XOrYNan, 300, 140), (Kind::Wavy, 2, 9)]
    {
        let cloud = Cloud::new(kind, width, height, 13);
        let pixels = width * height;
        let mut permuted: Vec<i32> = (0..pixels as i32).collect();
        for at in (1..pixels).rev() {
            permuted.swap(at, random.below(at + 1));
        }
        let sparse = permuted[..pixels.div_ceil(50)].to_vec();
        let repeated: Vec<i32> =
            (0..pixels).map(|_| permuted[random.below(pixels.min(40))]).collect();
        let one = vec![permuted[0]];
        let last = vec![pixels as i32 - 1, 0, pixels as i32 - 1];
        let all = methods().map(|method| options(method, 7.0, true));
        let all = all.chain(paper_options()).chain(edge_options());
        for mut options in all {
            for isa in fast_isas().chain([Isa::Scalar]) {
                for threads in [1, 3] {
                    options.threads = threads;
                    let mut estimator = Estimator::with_isa(options.clone(), isa);
                    let all = compute(&mut estimator, &cloud);
                    for indices in [&permuted, &sparse, &repeated, &one, &last] {
                        if isa == Isa::Scalar && indices.len() > 2000 {
                            continue;
                        }
                        let found = compute_listed(&mut estimator, &cloud, indices);
                        let expected: Vec<_> = indices.iter().map(|i| all[*i as usize]).collect();
                        let what = format!("{isa:?} {kind:?} {options:?}");
                        assert_same_bits(&found, &expected, width, &what);
                    }
                }
            }
        }
    }
}

#[test]
fn an_empty_list_of_pixels_does_nothing() {
    let cloud = Cloud::new(Kind::Plane, 9, 7, 0);
    // Refused, if there is something to compute.
    let options = options((Method::Simple3DGradient, BorderPolicy::Mirror), 10.0, false);
    let mut estimator = Estimator::new(options);
    let mut found = [7.0; 4];
    let mut normals = Normals::interleaved(&mut found, 1, 1, 4, 0, Some(3)).unwrap();
    let mut compute =
        |indices: &[i32]| estimator.compute_indices(&cloud.view(), indices, &mut normals);
    assert_eq!(compute(&[]), Ok(()));
    assert_eq!(compute(&[0]), Err(Error::Unsupported));
    assert_eq!(found, [7.0; 4]);
}

#[test]
fn frames_before_do_not_matter() {
    let mut random = Random::new(14);
    let combinations: Vec<_> = methods().collect();
    let papers = [paper_options(), edge_options()].concat();
    let mut reused = Estimator::new(options(combinations[0], 10.0, false));
    for seed in 0..150 {
        let most = if seed % 4 == 1 { (60, 700) } else { (300, 120) };
        let (width, height) = (1 + random.below(most.0), 1 + random.below(most.1));
        let cloud = Cloud::new(random.pick(&Kind::ALL), width, height, seed);
        let smoothing = random.pick(&[3.0, 8.0, 15.0]);
        let mut options = if seed % 3 == 0 {
            papers[random.below(papers.len())].clone()
        } else {
            options(random.pick(&combinations), smoothing, seed % 2 == 0)
        };
        options.threads = random.pick(&[1, 1, 2]);
        *reused.options_mut() = options.clone();
        let found = compute(&mut reused, &cloud);
        let fresh = compute(&mut Estimator::new(options), &cloud);
        assert_same_bits(&found, &fresh, width, &format!("frame {seed}"));
    }
}

/// Threads sweep rows of their own and those around them that reach them, which are more in deeper frames.
#[test]
fn a_frame_may_be_deeper_than_the_one_before() {
    let near = Cloud::new(Kind::NanBlocks, 120, 400, 18);
    let mut far = Cloud::new(Kind::NanBlocks, 120, 400, 19);
    for coordinate in far.points.as_flattened_mut() {
        *coordinate *= 300.0;
    }
    for method in methods() {
        let mut options = options(method, 10.0, true);
        let expected = compute(&mut Estimator::new(options.clone()), &far);
        options.threads = 2;
        let mut estimator = Estimator::new(options);
        for _ in 0..2 {
            compute(&mut estimator, &near);
            let found = compute(&mut estimator, &far);
            assert_same_bits(&found, &expected, far.width, &format!("{method:?}"));
        }
    }
}

/// Computes a frame; gives the bytes of scratch memory after it, and how often this thread has allocated during it.
fn memory_of_frame(
    estimator: &mut Estimator,
    cloud: &Cloud,
    found: &mut [[f32; 4]],
) -> (usize, usize) {
    let before = ALLOCATIONS.with(Cell::get);
    compute_to(found, estimator, cloud).unwrap();
    (estimator.scratch_size(), ALLOCATIONS.with(Cell::get) - before)
}

/// The method that needs the most memory.
const LARGEST_RINGS: (Method, BorderPolicy) = (Method::CovarianceMatrix, BorderPolicy::Ignore);

/// At most 24 rows of 96 bytes a pixel and 256 rows of 4 for each thread, however high the image.
#[test]
fn scratch_memory_is_small_and_stays() {
    let sizes: &[(usize, usize)] = &[(64, 48), (640, 480), (4096, 3072)];
    for &(width, height) in sizes {
        let cloud = Cloud::new(Kind::NanBlocks, width, height, 15);
        let mut found = vec![[0.0; 4]; width * height];
        for method in methods() {
            for smoothing in [10.0, 20.0] {
                // The largest size with the default smoothing only: its cost is in time, and the bound's is here.
                if width > 1000 && (smoothing > 10.0 || method != LARGEST_RINGS) {
                    continue;
                }
                for threads in if width > 1000 { 1..2 } else { 1..3 } {
                    let mut options = options(method, smoothing, false);
                    options.threads = threads;
                    let mut estimator = Estimator::new(options);
                    assert_eq!(estimator.scratch_size(), 0);
                    let (first, _) = memory_of_frame(&mut estimator, &cloud, &mut found);
                    let (second, allocations) = memory_of_frame(&mut estimator, &cloud, &mut found);
                    println!(
                        "{width}x{height} {method:?} smoothing {smoothing} threads {threads}: {first} bytes, {:.2} \
                         a pixel",
                        first as f64 / (width * height) as f64,
                    );
                    if threads == 1 {
                        assert_eq!(first, second, "{method:?}: grew at the second frame");
                        assert_eq!(allocations, 0, "{method:?}: the second frame allocates");
                    }
                    // A tile's rings have a least size, which in tiny frames is more than their rows.
                    let most = threads * width.max(640) * (24 * 96 + 256 * 4);
                    assert!(first.max(second) <= most, "{method:?}: {first}, {second} > {most}");
                    estimator.release_scratch();
                    assert_eq!(estimator.scratch_size(), 0);
                }
            }
        }
    }
}

/// Also where later frames have larger windows. (Maps with the chamfer metric are of the plain form.)
#[test]
fn only_the_first_frame_allocates() {
    let (width, height) = (200, 150);
    let frames = [16, 17].map(|seed| Cloud::new(Kind::NanBlocks, width, height, seed));
    let mut found = vec![[0.0; 4]; width * height];
    let mut all = paper_options();
    all.extend(edge_options());
    all.retain(|options| options.paper.distance_metric == DistanceMetric::Euclidean);
    all.extend(methods().map(|method| options(method, 20.0, true)));
    for mut options in all {
        options.threads = 1;
        let what = format!("{options:?}");
        let before = HELD.with(Cell::get);
        let mut estimator = Estimator::new(options);
        let (size, _) = memory_of_frame(&mut estimator, &frames[0], &mut found);
        let held = HELD.with(Cell::get).wrapping_sub(before);
        // The workers' own structs are not counted.
        assert!((size..size + 4096).contains(&held), "{size} of {held}: {what}");
        for again in &frames {
            let memory = memory_of_frame(&mut estimator, again, &mut found);
            assert_eq!(memory, (size, 0), "{what}");
        }
        estimator.release_scratch();
        assert_eq!(estimator.scratch_size(), 0, "{what}");
    }
}

#[test]
fn more_threads_than_can_be_asked_for_are_refused() {
    let cloud = Cloud::new(Kind::Wavy, 64, 48, 18);
    for threads in [1025, usize::MAX] {
        let mut estimator = Estimator::new(Options::default());
        estimator.options_mut().threads = threads;
        assert_writes_nothing(&mut estimator, &cloud, Error::OptionValue);
    }
}

fn assert_writes_nothing(estimator: &mut Estimator, cloud: &Cloud, error: Error) {
    let mut found = vec![[7.0; 4]; cloud.width * cloud.height];
    assert_eq!(compute_to(&mut found, estimator, cloud), Err(error));
    assert!(found.as_flattened().iter().all(|c| *c == 7.0), "partial output");
}

/// While one of a pool's threads waits for the normals it must not do other work of that pool, such as to compute more.
#[test]
fn threads_of_a_pool_of_the_callers_wait_for_their_own_frames() {
    thread_local! {
        static ESTIMATOR: RefCell<Estimator> = RefCell::new(Estimator::new(Options::default()));
    }
    let cloud = Cloud::new(Kind::Wavy, 160, 120, 25);
    let expected = compute(&mut Estimator::new(Options::default()), &cloud);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    pool.scope(|scope| {
        for _ in 0..300 {
            scope.spawn(|_| {
                ESTIMATOR.with_borrow_mut(|estimator| {
                    estimator.options_mut().threads = 2;
                    let found = compute(estimator, &cloud);
                    assert_same_bits(&found, &expected, cloud.width, "in a pool");
                });
            });
        }
    });
}

/// Runs this test once more, in a process where stacks are large and two to three of them take the address space:
/// what is left beside them is more than all else that a thread asks for, or the thread would abort.
#[cfg(target_os = "linux")]
#[test]
fn threads_that_cannot_start_are_an_error() {
    const LIMITED: &str = "IINE_TEST_LIMITED";
    if std::env::var_os(LIMITED).is_none() {
        let output = Command::new("sh")
            .args(["-c", "ulimit -v 1000000 && exec \"$0\" \"$@\""])
            .arg(std::env::current_exe().unwrap())
            .args(["--exact", "threads_that_cannot_start_are_an_error", "--test-threads=1"])
            .envs([(LIMITED, "1"), ("RUST_MIN_STACK", "300000000"), ("MALLOC_ARENA_MAX", "1")])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && said.contains("1 passed"), "{output:?}");
        return;
    }
    let cloud = Cloud::new(Kind::Wavy, 64, 48, 19);
    let mut estimator = Estimator::new(Options::default());
    estimator.options_mut().threads = 1024;
    assert_writes_nothing(&mut estimator, &cloud, Error::Threads);
    estimator.options_mut().threads = 1;
    let expected = compute(&mut Estimator::new(Options::default()), &cloud);
    assert_same_bits(&compute(&mut estimator, &cloud), &expected, cloud.width, "one thread");
}

/// A fork has none of its parent's threads.
#[cfg(target_os = "linux")]
#[test]
fn a_forked_process_starts_threads_of_its_own() {
    let cloud = Cloud::new(Kind::Wavy, 64, 48, 24);
    let mut estimator = Estimator::new(Options::default());
    estimator.options_mut().threads = 2;
    let expected = compute(&mut estimator, &cloud);
    let mut unused = Estimator::new(estimator.options().clone());
    compute(&mut unused, &cloud);
    // SAFETY: the child computes, and ends before anything of the test's goes on in it.
    let child = unsafe { libc::fork() };
    if child == 0 {
        // SAFETY: these end the child: what waits for threads that are not there would do so for ever.
        unsafe { libc::alarm(60) };
        let found = compute(&mut estimator, &cloud);
        drop(unused);
        let bits =
            |normals: &[[f32; 4]]| normals.as_flattened().iter().map(|c| c.to_bits()).collect();
        let [found, expected]: [Vec<u32>; 2] = [bits(&found), bits(&expected)];
        // SAFETY: as above.
        unsafe { libc::_exit(i32::from(found != expected)) };
    }
    let mut status = 0;
    // SAFETY: the child is ours, and the status can be written to.
    assert_eq!(unsafe { libc::waitpid(child, &mut status, 0) }, child);
    assert_eq!(status, 0, "the child was stopped, or found other normals");
    assert_same_bits(&compute(&mut estimator, &cloud), &expected, cloud.width, "the parent");
}

#[test]
fn released_scratch_comes_back() {
    let cloud = Cloud::new(Kind::Wavy, 100, 80, 16);
    for threads in [1, 2] {
        let mut options = options((Method::CovarianceMatrix, BorderPolicy::Mirror), 8.0, false);
        options.threads = threads;
        let mut estimator = Estimator::new(options);
        let before = compute(&mut estimator, &cloud);
        estimator.release_scratch();
        let after = compute(&mut estimator, &cloud);
        assert_same_bits(&before, &after, cloud.width, "after release");
    }
}
