//! Instructions per pixel of every method, counted by callgrind: a guard against getting slower that does not depend
//! on the machine's load.
//!
//! `cargo test --release --test instruction_counts -- print` prints the counts beside the bounds, and what of them
//! is the windows (`sweep`) and the sums and normals (`tile`). After a change that is meant to cost, or that saves, set
//! the bounds to the counts and 15 %: `... -- print` ends with the table as it should then be. With `IINE_ISA=sse2`
//! it does so for the other column.
//!
//! A cloud far from the camera's origin, as in a map's frame, one point of which misses its x, may take a quarter more; one
//! with a far plane for "no return", as simulators write, with PCL's semantics three times as many, with the paper's CM 4.8
//! times; one in millimetres, whose windows are as large as depth changes and the image let them be, four times, or eight; and
//! the paper's CM with a second pass for both one-sided and crease windows 2.3 times as many, or with zeros for "no return", as
//! many sensors write them, 3.2 times; PCL's 4 times.
//!
//! The program runs itself under valgrind: `count-frames N K S` computes N frames of scene S of case K. The counts are the
//! difference between two frames and one, so neither start nor the first frame's allocations are in them.

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

/// What is computed, and the instructions a pixel at most: with AVX2, with SSE2. The paper has no border policies.
type Case = (Semantics, Method, BorderPolicy, u64, u64);

const CASES: [Case; 10] = [
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

/// A variant of the generated cloud, and how it is computed.
#[derive(Clone, Copy)]
struct Scene {
    name: &'static str,
    /// Of the case's bound.
    percent: u64,
    /// How many metres the cloud is moved to the right; if it is, a point misses its x.
    moved: f32,
    /// The depth of a plane in place of missing points, in metres; NaN for none.
    plane: f32,
    /// So many are a metre.
    units: f32,
    second_pass: bool,
}

/// The cloud as it is, and those variants that a case is counted with.
fn scenes((semantics, method, policy, ..): Case) -> Vec<Scene> {
    let usual = Scene {
        name: "",
        percent: 100,
        moved: 0.0,
        plane: f32::NAN,
        units: 1.0,
        second_pass: false,
    };
    let far = Scene { name: ", far away, one x missing", percent: 125, moved: 1000.0, ..usual };
    let mut scenes = vec![usual, far];
    let far_plane = Scene { name: ", with a far plane", percent: 300, plane: 65504.0, ..usual };
    if semantics == Pcl {
        scenes.push(far_plane);
        // Windows at the border with missing points are walked over, and mirrored ones are the largest.
        let percent = if (method, policy) == (Average3DGradient, Mirror) { 800 } else { 400 };
        scenes.push(Scene { name: ", in millimetres", percent, units: 1000.0, ..usual });
    }
    let second_pass = Scene { name: ", with a second pass", second_pass: true, ..usual };
    let name = ", with a second pass and zeros";
    match (semantics, method, policy) {
        (Paper, CovarianceMatrix, _) => scenes.extend([
            Scene { percent: 480, ..far_plane },
            Scene { percent: 230, ..second_pass },
            Scene { name, percent: 320, plane: 0.0, ..second_pass },
        ]),
        (Pcl, CovarianceMatrix, Ignore) => scenes.push(Scene { percent: 400, ..second_pass }),
        _ => {}
    }
    scenes
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|word| word == "count-frames") {
        let number = |k: usize| arguments[k].parse::<usize>().expect("a number");
        let case = CASES[number(2)];
        frames(number(1), case, scenes(case)[number(3)]);
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
    for (number, case) in CASES.into_iter().enumerate() {
        let (semantics, method, policy, avx2, sse2) = case;
        let bound = if isa == Isa::Avx2 { avx2 } else { sse2 };
        for (scene, Scene { name, percent, .. }) in scenes(case).into_iter().enumerate() {
            let [count, stages @ ..] = count(number, scene, isa);
            let bound = bound * percent / 100;
            let verdict = if count <= bound { "ok" } else { "FAILED" };
            let isa_name = isa.name();
            println!(
                "{verdict} {semantics:?} {method:?} {policy:?} {isa_name}{name}: \
                 {count} instructions a pixel, at most {bound}"
            );
            good &= count <= bound;
            if scene > 0 {
                continue;
            }
            assert!(stages.iter().all(|share| *share > 0), "a stage's functions are not found");
            let [sweep, tile] = stages;
            if printing {
                println!("   sweep: {sweep}\n   tile: {tile}");
            }
            let raised = count + (count * 15).div_ceil(100);
            let [avx2, sse2] = if isa == Isa::Avx2 { [raised, sse2] } else { [avx2, raised] };
            table.push(format!("    ({semantics:?}, {method:?}, {policy:?}, {avx2}, {sse2}),"));
        }
    }
    if printing {
        println!("{}", table.join("\n"));
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What is counted.
fn frames(number: usize, (semantics, method, border_policy, ..): Case, scene: Scene) {
    let Scene { moved, plane, units, second_pass, .. } = scene;
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

/// Instructions a pixel of a scene of a case, both by their numbers: all, those of the sweeps, and those of the tiles.
fn count(case: usize, scene: usize, isa: Isa) -> [u64; 3] {
    let started = [1, 2].map(|number| {
        let output = Path::new(env!("CARGO_TARGET_TMPDIR"))
            .join(format!("callgrind.{}.{case}.{scene}.{number}", isa.name()));
        let child = Command::new("valgrind")
            .arg("--tool=callgrind")
            .arg(format!("--callgrind-out-file={}", output.display()))
            .arg(std::env::current_exe().expect("this test's path"))
            .arg("count-frames")
            .args([number, case, scene].map(|number| number.to_string()))
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
    std::array::from_fn(|k| two[k].saturating_sub(one[k]).div_ceil(pixels))
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
    // Methods of `Job`, "Job::name", or of another module "<impl Job>::name".
    let stage = |names: &[&str]| {
        let is =
            |line: &str, name: &str| line.contains("Job") && line.contains(&format!("::{name} ["));
        sum(&|line| names.iter().any(|name| is(line, name)))
    };
    [total, stage(&["sweep", "depths", "radii"]), stage(&["tiles"])]
}
