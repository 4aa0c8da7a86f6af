//! Prints mean and median error with coverage by band, per scene, noise and mode.
//!
//! usage: bands [SCENE,...|all [NOISE,... [MODE,...]]]

use std::sync::Mutex;

use iine::{Method, Semantics};
use iine_experiments::errors::by_band;
use iine_experiments::modes::Mode;
use iine_scenes::{Camera, Distances, Noise, Random, SCENES, scene};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let list = |i: usize, default: &str| -> Vec<String> {
        let text = arguments.get(i).map_or(default, String::as_str);
        let text = if text == "all" { SCENES.join(",") } else { text.to_owned() };
        text.split(',').map(str::to_owned).collect()
    };
    let (scenes, noises) = (list(0, "all"), list(1, "none,nguyen,khoshelham"));
    let wanted =
        arguments.get(2).map(|text| text.split(',').map(str::to_owned).collect::<Vec<_>>());
    let mut modes = Vec::new();
    for semantics in Semantics::ALL {
        for method in Method::ALL {
            if semantics == Semantics::Paper && method == Method::Simple3DGradient {
                continue;
            }
            for (one_sided, creases) in [(false, false), (true, false), (false, true), (true, true)]
            {
                modes.push(Mode::new(semantics, method, one_sided, creases));
            }
        }
    }
    modes.retain(|mode| wanted.as_ref().is_none_or(|wanted| wanted.contains(&mode.name)));

    let jobs = Mutex::new(
        scenes
            .iter()
            .flat_map(|scene| noises.iter().map(move |noise| (scene, noise)))
            .collect::<Vec<_>>(),
    );
    jobs.lock().expect("jobs").reverse();
    let work = || {
        while let Some((name, noise_name)) = {
            let mut jobs = jobs.lock().expect("jobs");
            jobs.pop()
        } {
            let exact = scene(name).expect("a known scene").render(&Camera::default());
            let distances = Distances::of(&exact);
            let noise = Noise::by_name(noise_name).expect("a known noise");
            let frame = noise.apply(&exact, &mut Random::new(1));
            let mut text = String::new();
            for mode in &modes {
                let normals = mode.normals(&frame.points, frame.width()).expect("normals");
                text += &format!("{name:10} {noise_name:10} {:12}", mode.name);
                for score in by_band(&frame, &distances, &normals) {
                    text += &format!(
                        " | {:6.2} {:6.2} {:6.2}%",
                        score.mean(),
                        score.median(),
                        100.0 * score.coverage()
                    );
                }
                text += "\n";
            }
            print!("{text}");
        }
    };
    println!("scene noise mode | depth edge: mean median coverage | crease | elsewhere");
    std::thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
}
