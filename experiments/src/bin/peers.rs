//! How accurate iine is beside other libraries; scripts/peers runs the steps.
//!
//! usage: peers scenes                 the names of the scenes
//!        peers clouds SCENE FOLDER    writes the scene with every noise, for the peers
//!        peers scores SCENE FOLDER    prints the scores of our modes, and of the normals that the peers wrote
//!        peers scores SCENE FOLDER PEER
//!                                     the same, over the pixels that PEER has a normal for
//!        peers report SCORES.csv      prints the tables of docs/accuracy.md

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use iine_experiments::errors::{Score, by_band, is_normal, towards_camera};
use iine_experiments::modes::Mode;
use iine_experiments::ranking::OURS;
use iine_experiments::table::Row;
use iine_experiments::{exchange, parallel, ranking, table};
use iine_scenes::{Band, Camera, Frame, Noise, Random, SCENES, scene};

const NOISES: [&str; 4] = ["none", "nguyen", "khoshelham", "matched"];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments[..] {
        ["scenes"] => {
            println!("{}", SCENES.join("\n"));
            Ok(())
        }
        ["clouds", scene, folder] => clouds(scene, Path::new(folder)),
        ["scores", scene, folder] => scores(scene, Path::new(folder), None),
        ["scores", scene, folder, peer] => scores(scene, Path::new(folder), Some(peer)),
        ["report", path] => table::read(path).map(|rows| print!("{}", ranking::report(&rows))),
        _ => Err("usage: peers scenes | clouds SCENE FOLDER | scores SCENE FOLDER [PEER] | \
                  report SCORES.csv"
            .into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// A scene under one noise.
struct Noisy {
    noise: &'static str,
    file: String,
    frame: Frame,
}

/// A scene as it is, and under every noise.
fn frames(name: &str) -> Result<(Frame, Vec<Noisy>), String> {
    let exact = scene(name).ok_or(format!("unknown scene: {name}"))?.render(&Camera::default());
    let mut frames = Vec::new();
    for noise in NOISES {
        let model = Noise::by_name(noise).ok_or(format!("unknown noise: {noise}"))?;
        let frame = model.apply(&exact, &mut Random::new(1));
        frames.push(Noisy { noise, file: format!("{name}-{noise}"), frame });
    }
    Ok((exact, frames))
}

fn clouds(name: &str, folder: &Path) -> Result<(), String> {
    for Noisy { file, frame, .. } in frames(name)?.1 {
        exchange::write_cloud(&folder.join(file + ".cloud"), &frame)?;
    }
    Ok(())
}

fn scores(name: &str, folder: &Path, peer: Option<&str>) -> Result<(), String> {
    let (exact, frames) = frames(name)?;
    let bands = Band::map(&exact);
    for noisy in &frames {
        for (who, scores) in scores_of(noisy, &bands, folder, peer)? {
            Row::of(name, noisy.noise, &who, scores).iter().for_each(|row| println!("{row}"));
        }
    }
    Ok(())
}

/// The scores of our modes, and of the normals that the peers wrote, on one frame; over the pixels that a peer has a normal
/// for, if one is named.
fn scores_of(
    noisy: &Noisy,
    bands: &[Band],
    folder: &Path,
    peer: Option<&str>,
) -> Result<Vec<(String, [Score; 3])>, String> {
    let frame = &noisy.frame;
    let read = |path: &Path| exchange::read_normals(path, frame.points.len());
    let peers = peers_of(folder, &noisy.file)?;
    let mut pixels: Vec<usize> = (0..frame.points.len()).collect();
    if let Some(peer) = peer {
        let found = peers.iter().find(|(who, _)| who == peer);
        let (_, path) = found.ok_or(format!("no normals of {peer} in {}", folder.display()))?;
        let normals = read(path)?;
        pixels.retain(|at| is_normal(normals[*at]));
    }
    let score = |normals: &[[f32; 3]]| by_band(frame, bands, normals, pixels.iter().copied());
    let ours = parallel::map(Mode::all(), |mode| {
        let normals = mode.normals(&frame.points, frame.width()).map_err(|e| e.to_string())?;
        Ok((format!("{OURS}{}", mode.name), score(&normals)))
    });
    let mut found = ours.into_iter().collect::<Result<Vec<_>, String>>()?;
    for (who, path) in peers {
        let mut normals = read(&path)?;
        for (normal, point) in normals.iter_mut().zip(&frame.points) {
            *normal = towards_camera(*normal, *point);
        }
        found.push((who, score(&normals)));
    }
    Ok(found)
}

/// The names of the peers that wrote normals of a cloud, and the files.
fn peers_of(folder: &Path, cloud: &str) -> Result<Vec<(String, PathBuf)>, String> {
    let files = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut peers: Vec<(String, PathBuf)> = files
        .filter_map(|file| {
            let path = file.ok()?.path();
            let name = path.file_name()?.to_str()?.strip_prefix(cloud)?.strip_prefix('.')?;
            Some((name.strip_suffix(".normals")?.to_owned(), path.clone()))
        })
        .collect();
    peers.sort();
    Ok(peers)
}
