//! Line plots as SVG: panels side by side, each with its axes, and one legend for all.

use std::fmt::Write;

use crate::ranking::distinct;

/// The scale of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Scale {
    /// Even steps, from 0.
    #[default]
    Linear,
    /// Even factors.
    Log,
}

/// An axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Axis {
    /// What it says, with the unit.
    pub label: &'static str,
    /// How it is divided.
    pub scale: Scale,
}

/// One plot.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// What is above it.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Named curves; a name has the same colour in every panel.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
}

/// Colours that people who see few colours tell apart too (Okabe and Ito), and how the lines of each round of them
/// are dashed.
const COLOURS: [&str; 7] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00", "#56b4e9"];
const DASHES: [&str; 3] = ["", "6 3", "2 3"];

const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 48.0;
const LEGEND: f64 = 190.0;
const LINE: f64 = 18.0;

/// From values to places along an axis.
struct Range {
    scale: Scale,
    low: f64,
    high: f64,
}

impl Range {
    fn new(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> =
            values.filter(|v| v.is_finite() && (*v > 0.0 || scale == Scale::Linear)).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        match scale {
            _ if values.is_empty() => Range { scale, low: 1.0, high: 2.0 },
            Scale::Linear => {
                Range { scale, low: 0.0, high: if high > 0.0 { high * 1.05 } else { 1.0 } }
            }
            Scale::Log => Range { scale, low: low / 1.15, high: high * 1.15 },
        }
    }

    /// From 0 to 1 within the range.
    fn place(&self, value: f64) -> f64 {
        let of = |v: f64| if self.scale == Scale::Log { v.ln() } else { v };
        (of(value) - of(self.low)) / (of(self.high) - of(self.low))
    }

    /// Round numbers within the range.
    fn ticks(&self) -> Vec<f64> {
        let inside = |v: &f64| (self.low..=self.high).contains(v);
        match self.scale {
            Scale::Linear => {
                let rough = (self.high - self.low) / 5.0;
                let power = 10f64.powf(rough.log10().floor());
                let step = [1.0, 2.0, 5.0, 10.0].map(|f| f * power);
                let step = step.into_iter().find(|step| *step >= rough).unwrap_or(rough);
                (0..=6).map(|i| f64::from(i) * step).filter(inside).collect()
            }
            Scale::Log => {
                let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
                // A label for every decade alone where there are many.
                let steps: &[f64] =
                    if self.high / self.low > 2000.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
                decades
                    .flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)))
                    .filter(inside)
                    .collect()
            }
        }
    }
}

/// The number of a tick, without the digits that a power of ten leaves behind.
fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The panels, row by row in so many columns, as a whole SVG file.
pub fn svg(panels: &[Panel], columns: usize) -> String {
    let curves = panels.iter().flat_map(|panel| &panel.curves);
    let names = distinct(curves.map(|(name, _)| name.as_str()));
    let style = |name: &str| {
        let at = names.iter().position(|known| *known == name).expect("a known name");
        let dash = DASHES[at / COLOURS.len() % DASHES.len()];
        (COLOURS[at % COLOURS.len()], dash)
    };
    let rows = panels.len().div_ceil(columns);
    let width = WIDTH * columns.min(panels.len()) as f64 + LEGEND;
    let height = (HEIGHT * rows as f64).max(TOP + LINE * (names.len() + 1) as f64);
    let mut out = String::new();
    let mut draw = |text: String| writeln!(out, "{text}").expect("a string takes any text");
    draw(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>"
    ));
    for (at, panel) in panels.iter().enumerate() {
        let left = WIDTH * (at % columns) as f64 + LEFT;
        let top = HEIGHT * (at / columns) as f64 + TOP;
        draw_panel(&mut draw, panel, (left, top), &style);
    }
    let left = width - LEGEND + 10.0;
    for (at, name) in names.iter().enumerate() {
        let y = TOP + LINE * (at as f64 + 0.5);
        let (colour, dash) = style(name);
        draw(line(&[(left, y), (left + 28.0, y)], colour, dash));
        draw(text((left + 36.0, y + 4.0), "start", "", name));
    }
    draw("</svg>".to_owned());
    out
}

fn draw_panel<'a>(
    draw: &mut impl FnMut(String),
    panel: &'a Panel,
    (left, top): (f64, f64),
    style: &impl Fn(&str) -> (&'a str, &'a str),
) {
    let (width, height) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    let points = || panel.curves.iter().flat_map(|(_, points)| points);
    let xs = Range::new(panel.x.scale, points().map(|point| point.0));
    let ys = Range::new(panel.y.scale, points().map(|point| point.1));
    let x = |value: f64| left + width * xs.place(value);
    let y = |value: f64| top + height * (1.0 - ys.place(value));
    let (bottom, middle) = (top + height, left + width / 2.0);
    for tick in xs.ticks() {
        draw(line(&[(x(tick), top), (x(tick), bottom)], "#dddddd", ""));
        draw(text((x(tick), bottom + 16.0), "middle", "", &number(tick)));
    }
    for tick in ys.ticks() {
        draw(line(&[(left, y(tick)), (left + width, y(tick))], "#dddddd", ""));
        draw(text((left - 6.0, y(tick) + 4.0), "end", "", &number(tick)));
    }
    draw(line(&[(left, top), (left, bottom), (left + width, bottom)], "black", ""));
    draw(text((middle, top - 10.0), "middle", "font-weight=\"bold\"", &panel.title));
    draw(text((middle, bottom + 36.0), "middle", "", panel.x.label));
    let (label_x, label_y) = (left - 46.0, top + height / 2.0);
    let turned = format!("transform=\"rotate(-90 {label_x} {label_y})\"");
    draw(text((label_x, label_y), "middle", &turned, panel.y.label));
    for (name, points) in &panel.curves {
        let (colour, dash) = style(name);
        let drawable = |&&(a, b): &&(f64, f64)| xs.place(a).is_finite() && ys.place(b).is_finite();
        let places: Vec<_> = points.iter().filter(drawable).map(|&(a, b)| (x(a), y(b))).collect();
        draw(line(&places, colour, dash));
        for (x, y) in places {
            draw(format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{colour}\"/>"));
        }
    }
}

fn line(points: &[(f64, f64)], colour: &str, dash: &str) -> String {
    let points: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let points = points.join(" ");
    let width = if colour == "#dddddd" { 1.0 } else { 1.6 };
    format!(
        "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
         stroke-dasharray=\"{dash}\"/>"
    )
}

fn text((x, y): (f64, f64), anchor: &str, more: &str, words: &str) -> String {
    let words = escape(words);
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {more}>{words}</text>")
}
