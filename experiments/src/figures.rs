//! The figures of the paper from the lines that the experiments printed, and what they come to.
//!
//! A method's name ends with the size of its window: the side, or for kNN the number of points.

use crate::plot::{Axis, Panel, Scale, svg};
use crate::table::Row;

const KNN: &str = "PCL-kNN";
const SDC: &str = "iine SDC";
const POINTS: Axis = Axis { label: "points in the window", scale: Scale::Log };

/// A name without the size, and how many points the window has.
fn name_and_points(who: &str) -> Result<(String, f64), String> {
    let parsed = who.rsplit_once('-').and_then(|(name, size)| Some((name, size.parse().ok()?)));
    let (name, size): (&str, f64) = parsed.ok_or(format!("no size of a window in {who}"))?;
    Ok((name.to_owned(), if name == KNN { size } else { size * size }))
}

/// A method's name, and its values over the number of points.
type Curve = (String, Vec<(f64, f64)>);

fn curves(values: impl Iterator<Item = (String, f64)>) -> Result<Vec<Curve>, String> {
    let mut curves: Vec<Curve> = Vec::new();
    for (who, value) in values {
        let (name, points) = name_and_points(&who)?;
        match curves.iter_mut().find(|(known, _)| *known == name) {
            Some((_, curve)) => curve.push((points, value)),
            None => curves.push((name, vec![(points, value)])),
        }
    }
    Ok(curves)
}

/// A plot and what it says, or what is wrong with its lines.
type Drawn = Result<(String, String), String>;

/// Fig. 4 from lines "WHO,MILLISECONDS", of which the least count: the plot, and what it says.
pub fn times(lines: &str) -> Drawn {
    let mut all: Vec<(String, f64)> = Vec::new();
    for line in lines.lines() {
        let (who, time) = line.split_once(',').ok_or(format!("not a time: {line}"))?;
        let time: f64 = time.parse().map_err(|_| format!("not a time: {line}"))?;
        match all.iter_mut().find(|(known, _)| known == who) {
            Some((_, least)) => *least = least.min(time),
            None => all.push((who.to_owned(), time)),
        }
    }
    let curves = curves(all.into_iter())?;
    let mut text = "| least ms | smallest window | largest window | slowest over fastest |\n\
                    |---|---:|---:|---:|\n"
        .to_owned();
    for (name, curve) in &curves {
        let (first, last) = (curve[0], curve[curve.len() - 1]);
        let slowest = curve.iter().map(|point| point.1).fold(0.0, f64::max);
        let fastest = curve.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
        text += &format!(
            "| {name} | {:.1} ({} points) | {:.1} ({} points) | {:.1} |\n",
            first.1,
            first.0,
            last.1,
            last.0,
            slowest / fastest
        );
    }
    let y = Axis { label: "milliseconds", scale: Scale::Log };
    let panel = Panel { title: "Time, one thread".to_owned(), x: POINTS, y, curves };
    Ok((svg(&[panel], 1), text))
}

/// Fig. 5 (noise "0") or Fig. 8 (all others) from scores: a column of plots for every noise, one of the whole image, one
/// of what is near depth edges, and one of what is near neither those nor creases; and what they say.
pub fn errors(rows: &[Row], noises: &[&str]) -> Drawn {
    let mut panels = Vec::new();
    let mut text = String::new();
    for band in ["all", "depth edges", "elsewhere"] {
        let mut lines = Vec::new();
        for noise in noises {
            let rows: Vec<&Row> =
                rows.iter().filter(|r| r.noise == *noise && r.band == band).collect();
            let curves = curves(rows.iter().map(|row| (row.who.clone(), row.mean)))?;
            lines.extend(curves.iter().map(|curve| line(noise, curve, &curves, &rows)));
            let title = match *noise {
                "0" => format!("No noise: {band}"),
                sigma => format!("Noise in z of {sigma} m: {band}"),
            };
            let y = Axis { label: "mean error in degrees", scale: Scale::Linear };
            panels.push(Panel { title, x: POINTS, y, curves });
        }
        let some = panels.last().and_then(|panel| panel.curves.first());
        let windows = some.into_iter().flat_map(|(_, curve)| curve);
        let heads: String = windows.map(|(points, _)| format!(" {points} points |")).collect();
        text += &format!(
            "\nMean error in degrees, {band}:\n\n| noise, m | |{heads} times SDC's | cover % |\n"
        );
        text += &format!("|---|---|{}\n", "---:|".repeat(heads.matches('|').count() + 2));
        text += &lines.concat();
    }
    Ok((svg(&panels, noises.len()), text))
}

/// A method's errors by window, the least and the most that they are of SDC's in the same window, and the coverage.
fn line(noise: &str, (name, curve): &Curve, all: &[Curve], rows: &[&Row]) -> String {
    let errors: String = curve.iter().map(|(_, error)| format!(" {error:.2} |")).collect();
    let sdc = all.iter().find(|(known, _)| known == SDC).map_or(&[][..], |(_, sdc)| sdc);
    let ratios = || curve.iter().zip(sdc).map(|((_, error), (_, sdc))| error / sdc);
    let (least, most) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
    let row = rows.iter().find(|row| row.who.starts_with(&format!("{name}-")));
    let coverage = row.map_or(f64::NAN, |row| 100.0 * row.coverage());
    format!("| {noise} | {name} |{errors} {least:.2} to {most:.2} | {coverage:.1} |\n")
}

/// What the lines "FRAME,FIXED,ADAPTIVE" of Fig. 9 say, after one with their names.
pub fn real_frames(lines: &str) -> String {
    let rows = lines.lines().skip(1).map(|line| format!("| {} |\n", line.replace(',', " | ")));
    format!(
        "| frame | fixed windows | adaptive windows |\n|---|---:|---:|\n{}",
        rows.collect::<String>()
    )
}
