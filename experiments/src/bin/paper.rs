//! The experiments of the paper; scripts/experiments runs the steps.
//!
//! usage: paper cloud SIGMA WxH CLOUD                  writes the scene with this noise in z, for PCL
//!        paper errors SIGMA WxH STEP CLOUD SIDE...    prints scores of ours and of PCL's kNN, for windows of these
//!                                                     sides, at every STEP-th pixel of every STEP-th row
//!        paper times WxH SIDE...                      prints our times for such windows
//!        paper figures FOLDER                         draws Fig. 4, 5 and 8 from the CSV files there
//!        paper pictures FOLDER FRAME.pcd...           Fig. 9: normals by fixed and by adaptive windows

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use iine::{Error, Estimator, Method, Normals, Points, Semantics};
use iine_experiments::errors::{Score, angle, by_band};
use iine_experiments::modes::Mode;
use iine_experiments::ranking::OURS;
use iine_experiments::table::{self, Row};
use iine_experiments::{exchange, figures, parallel, picture};
use iine_scenes::{Band, Camera, Frame, Noise, Pcd, Random, scene};

/// Depth edges, creases, planes and curved things, as the paper's rendered mesh has.
const SCENE: &str = "tabletop";
/// The depth of the scene's nearest points in metres.
const NEAREST: f64 = 0.9;

const PAPER: [Method; 3] =
    [Method::AverageDepthChange, Method::CovarianceMatrix, Method::Average3DGradient];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match &arguments[..] {
        ["cloud", sigma, size, cloud] => write_cloud(sigma, size, Path::new(cloud)),
        ["errors", sigma, size, step, cloud, sides @ ..] => errors(sigma, size, step, cloud, sides),
        ["times", size, sides @ ..] => times(size, sides),
        ["figures", folder] => draw(Path::new(folder)),
        ["pictures", folder, frames @ ..] => pictures(Path::new(folder), frames),
        _ => Err("see the head of experiments/src/bin/paper.rs for the arguments".to_owned()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("paper: {message}");
            ExitCode::FAILURE
        }
    }
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("not a number: {text}"))
}

/// The scene without noise, and with this standard deviation in z, in metres.
fn frames(sigma: &str, size: &str) -> Result<(Frame, Frame), String> {
    let (width, height) = size.split_once('x').ok_or(format!("not a size: {size}"))?;
    let camera = Camera::with_size(number(width)?, number(height)?);
    let exact = scene(SCENE).expect("a known scene").render(&camera);
    let noisy = Noise::Gaussian(number(sigma)?).apply(&exact, &mut Random::new(1));
    Ok((exact, noisy))
}

fn write_cloud(sigma: &str, size: &str, path: &Path) -> Result<(), String> {
    exchange::write_cloud(path, &frames(sigma, size)?.1)
}

/// A method with windows of one side, for noise of this size.
fn fixed(semantics: Semantics, method: Method, side: u32, sigma: f64) -> Mode {
    let mut mode = Mode::new(semantics, method, false, false);
    mode.name = format!("{OURS}{}-{side}", mode.name);
    mode.options.normal_smoothing_size = side as f32;
    let paper = &mut mode.options.paper;
    (paper.least_depth_radius, paper.largest_radius) = (side / 2, side / 2);
    paper.smallest_radius = paper.smallest_radius.min(side / 2);
    // What the sensor's noise does to neighbours is no depth change: their difference has sigma * sqrt(2).
    let noise_alone = 8.0 * sigma / (f64::from(paper.alpha) * NEAREST * NEAREST);
    paper.gamma = paper.gamma.max(noise_alone as f32);
    mode
}

fn errors(sigma: &str, size: &str, step: &str, cloud: &str, sides: &[&str]) -> Result<(), String> {
    let (exact, noisy) = frames(sigma, size)?;
    let (width, step) = (noisy.width(), number::<usize>(step)?);
    let bands = Band::map(&exact);
    let score = |normals: &[[f32; 3]]| -> [Score; 3] {
        let pixels = 0..normals.len();
        let pixels = pixels.filter(|at| at % width % step == 0 && at / width % step == 0);
        by_band(&noisy, &bands, normals, pixels)
    };
    let mut modes = Vec::new();
    for method in PAPER {
        for side in sides {
            modes.push(fixed(Semantics::Paper, method, number(side)?, number(sigma)?));
        }
    }
    let scored = parallel::map(modes, |mode| {
        let normals = mode.normals(&noisy.points, width).map_err(|e| e.to_string())?;
        Ok::<_, String>((mode.name, score(&normals)))
    });
    let print = |who: &str, scores| {
        Row::of(SCENE, sigma, who, scores).iter().for_each(|row| println!("{row}"));
    };
    for scored in scored {
        let (who, scores) = scored?;
        print(&who, scores);
    }
    for side in sides {
        let points = number::<usize>(side)?.pow(2);
        let path = cloud.replace(".cloud", &format!(".PCL-kNN-{points}.normals"));
        let normals = exchange::read_normals(Path::new(&path), noisy.points.len())?;
        print(&format!("PCL-kNN-{points}"), score(&normals));
    }
    Ok(())
}

/// Times as a pipeline has them: the estimator keeps its memory from frame to frame.
fn times(size: &str, sides: &[&str]) -> Result<(), String> {
    let (frame, _) = frames("0", size)?;
    let mut normals = vec![[f32::NAN; 4]; frame.points.len()];
    let mut compute = |estimator: &mut Estimator| -> Result<f64, Error> {
        let start = Instant::now();
        let (width, height) = (frame.width(), frame.height());
        estimator.compute(
            &Points::interleaved(frame.points.as_flattened(), width, height, 3, 0)?,
            &mut Normals::interleaved(normals.as_flattened_mut(), width, height, 4, 0, Some(3))?,
        )?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    };
    let paper = PAPER.map(|method| (Semantics::Paper, method));
    let pcl = Method::ALL.map(|method| (Semantics::Pcl, method));
    for (semantics, method) in paper.into_iter().chain(pcl) {
        for side in sides {
            let mode = fixed(semantics, method, number(side)?, 0.0);
            let mut estimator = Estimator::new(mode.options);
            let time = compute(&mut estimator).and_then(|_| compute(&mut estimator));
            println!("{},{:.3}", mode.name, time.map_err(|e| e.to_string())?);
        }
    }
    Ok(())
}

fn draw(folder: &Path) -> Result<(), String> {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
    };
    let rows = table::read(folder.join("errors.csv"))?;
    let mut sigmas: Vec<&str> = rows.iter().map(|row| row.noise.as_str()).collect();
    sigmas.dedup();
    sigmas.retain(|sigma| *sigma != "0");

    let (plot, times) = figures::times(&read("times.csv")?)?;
    write("fig4.svg", &plot)?;
    let (plot, noise_free) = figures::errors(&rows, &["0"])?;
    write("fig5.svg", &plot)?;
    let (plot, noisy) = figures::errors(&rows, &sigmas)?;
    write("fig8.svg", &plot)?;
    let real = figures::real_frames(&read("fig9.csv")?);
    let report = format!(
        "\n### Time (Fig. 4)\n\n{times}\n\
         ### Error without noise (Fig. 5)\n{noise_free}\n\
         ### Error with noise (Fig. 8)\n{noisy}\n\
         ### Real frames (Fig. 9)\n\nMedian angle in degrees between SDC's normals 10 px apart:\n\n{real}"
    );
    write("report.md", &report)
}

/// SDC's normals of real frames, where B is one radius everywhere and where it grows with the depth: pictures of the
/// depth and of both, and the median angle between normals 10 px apart.
fn pictures(folder: &Path, frames: &[&str]) -> Result<(), String> {
    println!("frame,fixed,adaptive");
    for frame in frames {
        let path = Path::new(frame);
        let pcd = Pcd::read(path).map_err(|e| format!("{frame}: {e}"))?;
        let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into());
        let adaptive = Mode::new(Semantics::Paper, Method::AverageDepthChange, false, false);
        let mut fixed = adaptive.clone();
        fixed.options.paper.largest_radius = fixed.options.paper.least_depth_radius;
        let normals = |mode: &Mode| mode.normals(&pcd.points, pcd.width).map_err(|e| e.to_string());
        let (fixed, adaptive) = (normals(&fixed)?, normals(&adaptive)?);
        println!(
            "{name},{:.2},{:.2}",
            roughness(&fixed, pcd.width),
            roughness(&adaptive, pcd.width)
        );
        let shown = [
            picture::of_depths(&pcd.points),
            picture::of_normals(&fixed),
            picture::of_normals(&adaptive),
        ];
        picture::write(&folder.join(format!("fig9-{name}.png")), pcd.width, &shown)?;
    }
    Ok(())
}

/// The median angle in degrees between the normals of pixels that are 10 apart in a row.
fn roughness(normals: &[[f32; 3]], width: usize) -> f64 {
    let pairs = normals.chunks(width).flat_map(|row| row.iter().zip(&row[10..]));
    let both = pairs.filter(|(a, b)| a[0].is_finite() && b[0].is_finite());
    let angles: Vec<f32> = both.map(|(a, b)| angle(*a, *b)).collect();
    Score { points: angles.len(), angles }.median()
}
