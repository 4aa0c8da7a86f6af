//! Writes a scene as a PCD file, and its true normals as another.

use std::process::ExitCode;

use iine_scenes::{Camera, Noise, Pcd, Random, SCENES, drop_out, plane, scene};

const USAGE: &str = "\
usage: make-scene SCENE --output FILE [options]
  --output FILE     the cloud: binary PCD with x y z, missing points NaN
  --truth FILE      the true normals, facing the camera: binary PCD with normal_x normal_y normal_z
  --noise MODEL     none (default), nguyen, khoshelham, matched, or gaussian-S with S in metres
  --dropout P       remove every point with this probability (default 0)
  --seed N          of noise and dropouts (default 1)
  --size WxH        pixels (default 640x480)
  --focal F         focal length in pixels (default 525 * W / 640)
  --tilt D          scene plane only: degrees from frontal (default 30)
  --azimuth D       scene plane only: direction of the tilt in degrees (default 20)
  --distance Z      scene plane only: metres (default 1.5)";

fn main() -> ExitCode {
    match run(std::env::args().skip(1)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}\n{USAGE}\nscenes: {}", SCENES.join(" "));
            ExitCode::FAILURE
        }
    }
}

fn run(mut arguments: impl Iterator<Item = String>) -> Result<(), String> {
    let name = arguments.next().ok_or("no scene named")?;
    let (mut output, mut truth, mut noise) = (None, None, Noise::None);
    let (mut dropout, mut seed, mut camera, mut focal) = (0.0, 1, Camera::default(), None);
    let (mut tilt, mut azimuth, mut distance) = (30.0, 20.0, 1.5);
    while let Some(option) = arguments.next() {
        let value = arguments.next().ok_or(format!("{option} lacks its value"))?;
        let number = || value.parse::<f64>().map_err(|_| format!("not a number: {value}"));
        match option.as_str() {
            "--output" => output = Some(value),
            "--truth" => truth = Some(value),
            "--noise" => {
                noise = Noise::by_name(&value).ok_or(format!("unknown noise: {value}"))?;
            }
            "--dropout" => dropout = number()?,
            "--seed" => seed = value.parse().map_err(|_| format!("not a seed: {value}"))?,
            "--size" => {
                let size = value.split_once('x').and_then(|(width, height)| {
                    Some(Camera::with_size(width.parse().ok()?, height.parse().ok()?))
                });
                camera = size.ok_or(format!("not a size: {value}"))?;
            }
            "--focal" => focal = Some(number()?),
            "--tilt" => tilt = number()?,
            "--azimuth" => azimuth = number()?,
            "--distance" => distance = number()?,
            _ => return Err(format!("unknown option: {option}")),
        }
    }
    camera.focal = focal.unwrap_or(camera.focal);
    let scene = match name.as_str() {
        "plane" => plane(tilt, azimuth, distance),
        name => scene(name).ok_or(format!("unknown scene: {name}"))?,
    };
    let output = output.ok_or("--output is missing")?;
    let mut random = Random::new(seed);
    let exact = scene.render(&camera);
    let mut frame = noise.apply(&exact, &mut random);
    drop_out(&mut frame, dropout, &mut random);
    let (width, height) = (frame.width(), frame.height());
    let write = |path: String, points, names| {
        let written = Pcd { width, height, points }.write(&path, names);
        written.map_err(|error| format!("{path}: {error}"))
    };
    write(output, frame.points, ["x", "y", "z"])?;
    match truth {
        Some(truth) => write(truth, frame.normals, ["normal_x", "normal_y", "normal_z"]),
        None => Ok(()),
    }
}
