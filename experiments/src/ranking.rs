//! The tables of docs/accuracy.md: means over the scenes, and in which columns ours is ahead of every peer.

use crate::table::{BANDS, Row};

/// What the names of our modes begin with.
pub const OURS: &str = "iine ";

/// The bands that have columns; not the last, all of them together.
const SHOWN: usize = BANDS.len() - 1;
/// The columns of a band; of the errors less is better, of the coverage more.
const MEASURES: [&str; 4] = ["mean", "median", "folded", "cover %"];
const COVERAGE: usize = 3;
/// Degrees that make no difference.
const LEVEL: f64 = 0.005;
/// Points in a hundred that make no difference in coverage: at most a few pixels that float alone before an edge.
const COVERED: f64 = 0.1;

/// One line of a table: whose normals, and for every band the means over the scenes of every measure.
struct Line<'a> {
    who: &'a str,
    bands: [[f64; MEASURES.len()]; SHOWN],
}

impl Line<'_> {
    fn is_ours(&self) -> bool {
        self.who.starts_with(OURS)
    }

    fn covers_as_much(&self, other: &Line, band: usize) -> bool {
        self.bands[band][COVERAGE] >= other.bands[band][COVERAGE] - COVERED
    }
}

/// The different values, in the order in which they come first.
pub(crate) fn distinct<'a>(values: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// All tables, as Markdown.
pub fn report(rows: &[Row]) -> String {
    let noises = distinct(rows.iter().map(|row| row.noise.as_str()));
    let tables: Vec<_> = noises.iter().map(|noise| (*noise, lines(rows, noise))).collect();
    let details: String = tables.iter().map(|(noise, lines)| table(noise, lines)).collect();
    standings(&tables) + &details
}

/// The lines of one noise. Scenes without a point in a band do not count there; who has no normal at all in the band
/// of a scene that does has no mean.
fn lines<'a>(rows: &'a [Row], noise: &str) -> Vec<Line<'a>> {
    let rows: Vec<&Row> = rows.iter().filter(|r| r.noise == noise && r.points > 0).collect();
    let line = |who| {
        let values = |band| {
            let scenes = rows.iter().filter(|row| row.who == who && row.band == band);
            let count = scenes.clone().count() as f64;
            let mean = |of: fn(&Row) -> f64| scenes.clone().map(|row| of(row)).sum::<f64>() / count;
            let coverage = mean(|row| 100.0 * row.coverage());
            [mean(|row| row.mean), mean(|row| row.median), mean(|row| row.folded), coverage]
        };
        Line { who, bands: std::array::from_fn(|band| values(BANDS[band])) }
    };
    distinct(rows.iter().map(|row| row.who.as_str())).into_iter().map(line).collect()
}

/// A table of one noise; the best of every column is bold.
fn table(noise: &str, lines: &[Line]) -> String {
    let heads = BANDS[..SHOWN].iter().map(|band| format!("{band}: {}", MEASURES.join(" | ")));
    let rule = "---:|".repeat(SHOWN * MEASURES.len());
    let mut out = format!(
        "\n### Noise: {noise}\n\n| | {} |\n|---|{rule}\n",
        heads.collect::<Vec<_>>().join(" | ")
    );
    let best = |band: usize, measure: usize| {
        let values = lines.iter().map(|line| line.bands[band][measure]);
        let best =
            if measure == COVERAGE { values.reduce(f64::max) } else { values.reduce(f64::min) };
        best.map(|best| format!("{best:.2}"))
    };
    for line in lines {
        out += &format!("| {} |", line.who);
        for band in 0..SHOWN {
            for measure in 0..MEASURES.len() {
                let value = line.bands[band][measure];
                let cell = if value.is_nan() { "-".to_owned() } else { format!("{value:.2}") };
                let is_best = best(band, measure).as_ref() == Some(&cell);
                out += &if is_best { format!(" **{cell}** |") } else { format!(" {cell} |") };
            }
        }
        out.push('\n');
    }
    out
}

/// The peer that is hardest to beat in a column, and the best of the modes that cover as much as it does, with the
/// degrees by which that is better. A mode is infinitely far behind a peer if no mode covers as much.
fn hardest<'a, 'b>(
    modes: &[&'b Line<'a>],
    peers: &[&'b Line<'a>],
    (band, measure): (usize, usize),
) -> Option<(&'b Line<'a>, Option<&'b Line<'a>>, f64)> {
    let value = |line: &Line| line.bands[band][measure];
    let of_peer = |peer: &&'b Line<'a>| {
        let able = modes.iter().filter(|mode| mode.covers_as_much(peer, band));
        let best = able.min_by(|a, b| value(a).total_cmp(&value(b))).copied();
        let margin = best.map_or(f64::NEG_INFINITY, |best| value(peer) - value(best));
        (*peer, best, margin)
    };
    let all = peers.iter().filter(|peer| !value(peer).is_nan()).map(of_peer);
    all.min_by(|a, b| a.2.total_cmp(&b.2))
}

/// What the tables come to: column by column the peer that is hardest for ours, and how our modes do alone.
fn standings(tables: &[(&str, Vec<Line>)]) -> String {
    let mut rows = String::new();
    let (mut columns, mut held) = (0, 0);
    let mut alone: Vec<(&str, usize)> = Vec::new();
    for (noise, lines) in tables {
        let (modes, peers): (Vec<&Line>, Vec<&Line>) =
            lines.iter().partition(|line| line.is_ours());
        for (band, band_name) in BANDS[..SHOWN].iter().enumerate() {
            for (measure, measure_name) in MEASURES[..COVERAGE].iter().enumerate() {
                let Some((peer, ours, margin)) = hardest(&modes, &peers, (band, measure)) else {
                    continue;
                };
                columns += 1;
                held += usize::from(margin >= -LEVEL);
                let verdict = match margin {
                    _ if margin > LEVEL => format!("ahead by {margin:.2}"),
                    _ if margin >= -LEVEL => "level".to_owned(),
                    _ if margin.is_finite() => format!("**behind by {:.2}**", -margin),
                    _ => "**covers less**".to_owned(),
                };
                let show = |line: &Line| {
                    let values = line.bands[band];
                    format!("{} {:.2} at {:.2} %", line.who, values[measure], values[COVERAGE])
                };
                let ours = ours.map_or("-".to_owned(), show);
                rows += &format!(
                    "| {noise} | {band_name} | {measure_name} | {verdict} | {ours} | {} |\n",
                    show(peer)
                );
                for mode in &modes {
                    let margin =
                        hardest(&[mode], &peers, (band, measure)).map(|(.., margin)| margin);
                    let leads = usize::from(margin.is_some_and(|margin| margin >= -LEVEL));
                    match alone.iter_mut().find(|(who, _)| *who == mode.who) {
                        Some((_, count)) => *count += leads,
                        None => alone.push((mode.who, leads)),
                    }
                }
            }
        }
    }
    alone.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let alone: Vec<String> =
        alone.iter().take(3).map(|(who, count)| format!("{who} in {count}")).collect();
    format!(
        "In {held} of {columns} columns of errors no peer is ahead of ours: for every peer there is a mode of ours that \
         covers\nas much, within {COVERED} points in a hundred, with an error no larger, within {LEVEL} degrees. \
         With one and the same mode against all peers: {}.\n\n\
         | noise | band | measure | ours is | ours: degrees at coverage | the hardest peer |\n\
         |---|---|---|---|---|---|\n{rows}",
        alone.join(", ")
    )
}
