//! Prints mean and median error with coverage by band, per scene, noise and mode; and of the normals that the pixels
//! have without noise, as `truth`: noise moves points to where other pixels look.
//!
//! usage: bands [SCENE,...|all [NOISE,... [MODE,...]]]

use iine_experiments::errors::by_band;
use iine_experiments::modes::Mode;
use iine_experiments::parallel;
use iine_scenes::{Band, Camera, Noise, Random, SCENES, scene};

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
    let mut modes = Mode::all();
    modes.retain(|mode| wanted.as_ref().is_none_or(|wanted| wanted.contains(&mode.name)));

    println!("scene noise mode | depth edge: mean median coverage | crease | elsewhere");
    let jobs = scenes.iter().flat_map(|scene| noises.iter().map(move |noise| (scene, noise)));
    let texts = parallel::map(jobs.collect(), |(name, noise_name)| {
        let exact = scene(name).expect("a known scene").render(&Camera::default());
        let bands = Band::map(&exact);
        let noise = Noise::by_name(noise_name).expect("a known noise");
        let frame = noise.apply(&exact, &mut Random::new(1));
        let mut text = String::new();
        let found = modes.iter().map(|mode| {
            let normals = mode.normals(&frame.points, frame.width()).expect("normals");
            (mode.name.as_str(), normals)
        });
        for (who, normals) in found.chain([("truth", exact.normals.clone())]) {
            text += &format!("{name:10} {noise_name:10} {who:12}");
            for score in by_band(&frame, &bands, &normals, 0..normals.len()) {
                text += &format!(
                    " | {:6.2} {:6.2} {:6.2}%",
                    score.mean(),
                    score.median(),
                    100.0 * score.coverage()
                );
            }
            text += "\n";
        }
        text
    });
    print!("{}", texts.concat());
}
