//! The Rust API: `cargo bench -p iine-benches`, with `-- method` and so on for one group. Throughput is in pixels.
//!
//! Generated clouds, and the real frames of `IINE_TEST_DATA` (default `../shared/data`) that are there. One thread;
//! depth-dependent smoothing, as in the comparison with PCL (`scripts/bench`). Every output is checked before it is
//! timed.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use iine::{BorderPolicy, Estimator, Isa, Method, Options};
use iine_benches::{Cloud, POINT};
use iine_scenes::real_frame;

const FRAMES: [&str; 5] = [
    "table_scene_mug_stereo_textured",
    "office1",
    "milk_cartoon_all_small_clorox",
    "kinect_capture0001",
    "realsense_d435",
];

fn options(method: Method) -> Options {
    let mut options = Options::default();
    options.method = method;
    options.depth_dependent_smoothing = true;
    options
}

fn frame(name: &str) -> Option<Cloud> {
    let pcd = real_frame("normals", name)?;
    let mut data = Vec::with_capacity(POINT * pcd.points.len());
    for [x, y, z] in pcd.points {
        data.extend([x, y, z, 1.0]);
    }
    Some(Cloud { name: name.to_owned(), width: pcd.width, height: pcd.height, data })
}

/// Checks, then times, one configuration.
fn bench(c: &mut Criterion, group: &str, id: &str, cloud: &Cloud, options: &Options, isa: Isa) {
    let mut group = c.benchmark_group(group);
    group.throughput(Throughput::Elements(cloud.pixels() as u64));
    let mut checked = false;
    group.bench_function(BenchmarkId::new(id, &cloud.name), |bencher| {
        let mut estimator = Estimator::with_isa(options.clone(), isa);
        let mut output = cloud.output();
        if !checked {
            cloud.compute(&mut estimator, &mut output);
            cloud.check(options, &output);
            checked = true;
        }
        bencher.iter(|| cloud.compute(&mut estimator, &mut output));
    });
}

/// Every instruction set the processor has; the plain form is timed with one method only.
fn isas(c: &mut Criterion) {
    let cloud = Cloud::generated(640, 480);
    for method in Method::ALL {
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            if isa != Isa::Scalar || method == Method::Average3DGradient {
                bench(
                    c,
                    "isa",
                    &format!("{method:?}/{}", isa.name()),
                    &cloud,
                    &options(method),
                    isa,
                );
            }
        }
    }
}

fn methods(c: &mut Criterion) {
    let cloud = Cloud::generated(640, 480);
    let frames = FRAMES.into_iter().filter_map(frame);
    for cloud in std::iter::once(cloud).chain(frames) {
        for method in Method::ALL {
            for border_policy in BorderPolicy::ALL {
                let mut options = options(method);
                options.border_policy = border_policy;
                if options.check().is_ok() {
                    bench(
                        c,
                        "method",
                        &format!("{method:?}/{border_policy:?}"),
                        &cloud,
                        &options,
                        Isa::active(),
                    );
                }
            }
        }
    }
}

fn image_sizes(c: &mut Criterion) {
    for (width, height) in [(320, 240), (640, 480), (1280, 960), (2560, 1920), (4096, 3072)] {
        let cloud = Cloud::generated(width, height);
        for method in Method::ALL {
            bench(c, "image size", &format!("{method:?}"), &cloud, &options(method), Isa::active());
        }
    }
}

fn smoothing_sizes(c: &mut Criterion) {
    let cloud = Cloud::generated(640, 480);
    for method in Method::ALL {
        for size in [5, 10, 20, 30, 40, 50] {
            let mut options = options(method);
            options.normal_smoothing_size = size as f32;
            bench(
                c,
                "smoothing size",
                &format!("{method:?}/{size}"),
                &cloud,
                &options,
                Isa::active(),
            );
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    targets = isas, methods, image_sizes, smoothing_sizes
}
criterion_main!(benches);
