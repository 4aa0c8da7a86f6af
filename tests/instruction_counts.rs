//! Instructions per pixel of every method, counted by callgrind: a guard against getting slower that does not depend
//! on the machine's load.
//!
//! `cargo test --release --test instruction_counts -- print` prints the counts beside the bounds, and what of them
//! is the windows (`sweep`) and the sums and normals (`tile`). After a change that is meant to cost, or that saves, set
//! the bounds to the counts and 15 %: `... -- print` ends with the table as it should then be. With `IINE_ISA=sse2`
//! it does so for the other column.
//!
//! A cloud far from the camera's origin, as in a map's frame, one point of which misses its x, may take a quarter more; one
//! with a far plane for "no return", as simulators write, with PCL's semantics three times as many; one in millimetres, whose
//! windows are as large as depth changes and the image let them be, four times, or eight; and the paper's CM with a second
//! pass for both one-sided and crease windows 2.3 times as many, or with zeros for "no return", as many sensors write them,
//! 3.2 times; PCL's 4 times.
//!
//! The program runs itself under valgrind: `count-frames N SEMANTICS METHOD POLICY METRES PLANE UNITS SECOND` computes N frames of
//! a cloud that is moved to the right by so many metres, and then misses one x, with a plane at that depth in place of
//! missing points if it is not NaN, in units of which a metre has so many, and with a second pass if that is 1. The counts
//! are the difference between two frames and one, so neither start nor the first frame's allocations are in them.

#[path = "../benches/rust/lib.rs"]
mod common;

use std::path::Path;
use std::process::{Command, ExitCode};

use common::Cloud;
use iine::{BorderPolicy, Estimator, Isa, Method, Options, Semantics};

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

use BorderPolicy::{Ignore, Mirror};
use Method::{Average3DGradient, AverageDepthChange, CovarianceMatrix, Simple3DGradient};
use Semantics::{Paper, Pcl};

/// Instructions a pixel at most: with AVX2, with SSE2. The paper has no border policies.
const BOUNDS: [(Semantics, Method, BorderPolicy, u64, u64); 10] = [
    (Pcl, CovarianceMatrix, Ignore, 160, 375),
    (Pcl, CovarianceMatrix, Mirror, 196, 421),
    (Pcl, Average3DGradient, Ignore, 99, 189),
    (Pcl, Average3DGradient, Mirror, 130, 224),
    (Pcl, AverageDepthChange, Ignore, 88, 160),
    (Pcl, AverageDepthChange, Mirror, 189, 267),
    (Pcl, Simple3DGradient, Ignore, 107, 190),
    (Paper, CovarianceMatrix, Ignore, 216, 462),
    (Paper, Average3DGradient, Ignore, 160, 307),
    (Paper, AverageDepthChange, Ignore, 174, 308),
];

/// In metres: how far the cloud is moved, and the depth of the far plane.
const FAR: f32 = 1000.0;
const PLANE: f32 = 65504.0;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|word| word == "count-frames") {
        let number = |k: usize| arguments[k].parse::<usize>().expect("a number");
        let (method, policy) = (Method::ALL[number(3)], BorderPolicy::ALL[number(4)]);
        let metres = |k: usize| arguments[k].parse::<f32>().expect("a number");
        let (moved, plane, units) = (metres(5), metres(6), metres(7));
        let scene = Scene { moved, plane, units, second_pass: number(8) == 1 };
        frames(number(1), Semantics::ALL[number(2)], method, policy, scene);
        return ExitCode::SUCCESS;
    }
    if !cfg!(target_arch = "x86_64") {
        return ExitCode::SUCCESS;
    }
    if cfg!(debug_assertions) {
        println!("skipped: instruction_counts: the bounds are for --release");
        return ExitCode::SUCCESS;
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("skipped: instruction_counts: no valgrind");
        return ExitCode::SUCCESS;
    }
    let printing = arguments.iter().any(|word| word == "print");
    let asked = std::env::var("IINE_ISA").ok();
    let isa = if asked.as_deref() == Some("sse2") || !Isa::Avx2.is_available() {
        Isa::Sse2
    } else {
        Isa::Avx2
    };

    let mut good = true;
    let mut table = Vec::new();
    for (semantics, method, policy, avx2, sse2) in BOUNDS {
        let bound = if isa == Isa::Avx2 { avx2 } else { sse2 };
        let name = format!("{semantics:?} {method:?} {policy:?} {}", isa.name());
        let mut check = |count: u64, bound: u64, what: &str| {
            let verdict = if count <= bound { "ok" } else { "FAILED" };
            println!("{verdict} {name}{what}: {count} instructions a pixel, at most {bound}");
            good &= count <= bound;
        };
        let count = |scene: Scene| count(semantics, method, policy, scene, isa);
        let usual = Scene { moved: 0.0, plane: f32::NAN, units: 1.0, second_pass: false };
        let (far, _) = count(Scene { moved: FAR, ..usual });
        if semantics == Pcl {
            check(count(Scene { plane: PLANE, ..usual }).0, 3 * bound, ", with a far plane");
            // Windows at the border with missing points are walked over, and mirrored ones are the largest.
            let times = if (method, policy) == (Average3DGradient, Mirror) { 8 } else { 4 };
            check(count(Scene { units: 1000.0, ..usual }).0, times * bound, ", in millimetres");
        }
        let with_second_pass: &[_] = match (semantics, method, policy) {
            (Paper, CovarianceMatrix, _) => &[(f32::NAN, 23, ""), (0.0, 32, " and zeros")],
            (Pcl, CovarianceMatrix, Ignore) => &[(f32::NAN, 40, "")],
            _ => &[],
        };
        for (plane, tenths, what) in with_second_pass {
            let (count, _) = count(Scene { second_pass: true, plane: *plane, ..usual });
            check(count, bound * tenths / 10, &format!(", with a second pass{what}"));
        }
        let (count, stages) = count(usual);
        check(count, bound, "");
        check(far, bound + bound / 4, ", far away, one x missing");
        if printing {
            for (stage, share) in stages {
                println!("   {stage}: {share}");
            }
        }
        let raised = count + (count * 15).div_ceil(100);
        let bounds = if isa == Isa::Avx2 { [raised, sse2] } else { [avx2, raised] };
        table.push(format!(
            "    ({semantics:?}, {method:?}, {policy:?}, {}, {}),",
            bounds[0], bounds[1]
        ));
    }
    if printing {
        println!("{}", table.join("\n"));
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// How far the cloud is moved, the depth of the plane in place of missing points or NaN, how many units a metre has, and
/// whether there is a second pass.
#[derive(Clone, Copy)]
struct Scene {
    moved: f32,
    plane: f32,
    units: f32,
    second_pass: bool,
}

/// What is counted.
fn frames(
    number: usize,
    semantics: Semantics,
    method: Method,
    border_policy: BorderPolicy,
    Scene { moved, plane, units, second_pass }: Scene,
) {
    let mut cloud = Cloud::generated(WIDTH, HEIGHT);
    for (at, point) in cloud.data.chunks_mut(common::POINT).enumerate() {
        if !plane.is_nan() && point[2].is_nan() {
            let [x, y] = [at % WIDTH, at / WIDTH].map(|at| (at as f32 - 320.0) / 525.0);
            point[..3].copy_from_slice(&[x * plane, y * plane, plane]);
        }
        point[0] += moved;
        point[..3].iter_mut().for_each(|coordinate| *coordinate *= units);
    }
    if moved != 0.0 {
        // No depth change tells of it.
        cloud.data[(HEIGHT / 2 * WIDTH + WIDTH / 3) * common::POINT] = f32::NAN;
    }
    let mut options = Options::default();
    options.semantics = semantics;
    options.method = method;
    options.border_policy = border_policy;
    options.depth_dependent_smoothing = true;
    options.one_sided_windows = second_pass;
    options.crease_windows = second_pass;
    let mut estimator = Estimator::new(options);
    let mut output = cloud.output();
    for _ in 0..number {
        cloud.compute(&mut estimator, &mut output);
    }
    let covered = output.chunks(common::NORMAL).filter(|normal| !normal[0].is_nan()).count();
    assert!(covered > cloud.pixels() / 2, "{covered} normals");
}

/// Instructions a pixel, and by stage.
fn count(
    semantics: Semantics,
    method: Method,
    policy: BorderPolicy,
    Scene { moved, plane, units, second_pass }: Scene,
    isa: Isa,
) -> (u64, Vec<(&'static str, u64)>) {
    let started = [1, 2].map(|number| {
        let output = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!(
            "callgrind.{semantics:?}.{method:?}.{policy:?}.{moved}.{plane}.{units}.{second_pass}.{number}"
        ));
        let child = Command::new("valgrind")
            .arg("--tool=callgrind")
            .arg(format!("--callgrind-out-file={}", output.display()))
            .arg(std::env::current_exe().expect("this test's path"))
            .args(["count-frames", &number.to_string(), &(semantics as i32).to_string()])
            .args([(method as i32).to_string(), (policy as i32).to_string()])
            .args([moved, plane, units].map(|metres| metres.to_string()))
            .arg(u8::from(second_pass).to_string())
            .env("IINE_ISA", isa.name())
            .stderr(std::process::Stdio::null())
            .spawn();
        (child.expect("valgrind"), output)
    });
    let [one, two] = started.map(|(mut child, output)| {
        assert!(child.wait().expect("valgrind").success(), "valgrind failed");
        inclusive(&output)
    });
    let pixels = (WIDTH * HEIGHT) as u64;
    let between = |k: usize| two[k].saturating_sub(one[k]).div_ceil(pixels);
    (between(0), vec![("sweep", between(1)), ("tile", between(2))])
}

/// Instructions of the program, of the sweeps and of the tiles, each with what they call.
fn inclusive(file: &Path) -> [u64; 3] {
    let output = Command::new("callgrind_annotate")
        .args(["--inclusive=yes", "--threshold=100", "--show-percs=no"])
        .arg(file)
        .output()
        .expect("callgrind_annotate");
    let text = String::from_utf8_lossy(&output.stdout);
    // "1,234,567  file:function [object]"
    let sum = |matches: &dyn Fn(&str) -> bool| {
        let lines = text.lines().filter(|line| matches(line));
        let number =
            |line: &str| line.split_whitespace().next()?.replace(',', "").parse::<u64>().ok();
        lines.filter_map(number).sum::<u64>()
    };
    let total = sum(&|line| line.contains("PROGRAM TOTALS"));
    assert!(total > 0, "callgrind_annotate: {text}");
    let stage = |names: &[&str]| {
        sum(&|line| names.iter().any(|name| line.contains(&format!("Job::{name} ["))))
    };
    [total, stage(&["sweep", "depths", "radii"]), stage(&["tiles"])]
}
