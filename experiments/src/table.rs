//! Scores as lines of text, so that one program computes them and another draws or tabulates them.

use std::fmt;
use std::str::FromStr;

use crate::errors::Score;

/// The names of the bands in [`iine_scenes::Band::ALL`], and of all of them together.
pub const BANDS: [&str; 4] = ["depth edges", "creases", "elsewhere", "all"];

/// What one method's normals of one scene are worth in one band: a line of a CSV file.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The scene.
    pub scene: String,
    /// The noise on it.
    pub noise: String,
    /// Whose normals.
    pub who: String,
    /// One of [`BANDS`].
    pub band: String,
    /// Pixels with a point.
    pub points: usize,
    /// Pixels with a normal.
    pub normals: usize,
    /// Mean angle to the truth in degrees.
    pub mean: f64,
    /// Median angle to the truth in degrees.
    pub median: f64,
    /// Mean angle to the truth in degrees, folded at 90.
    pub folded: f64,
}

impl Row {
    /// The names of the columns.
    pub const HEADER: &str = "scene,noise,who,band,points,normals,mean,median,folded";

    /// The rows of a method's scores by band.
    pub fn of(scene: &str, noise: &str, who: &str, bands: [Score; 3]) -> [Row; 4] {
        let mut all = Score::default();
        bands.iter().for_each(|score| all.add(score));
        let [edges, creases, elsewhere] = bands;
        let mut names = BANDS.iter();
        [edges, creases, elsewhere, all].map(|score| Row {
            scene: scene.to_owned(),
            noise: noise.to_owned(),
            who: who.to_owned(),
            band: names.next().expect("as many names").to_string(),
            points: score.points,
            normals: score.angles.len(),
            mean: score.mean(),
            median: score.median(),
            folded: score.folded(),
        })
    }

    /// Normals over points.
    pub fn coverage(&self) -> f64 {
        self.normals as f64 / self.points as f64
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Row { scene, noise, who, band, points, normals, mean, median, folded } = self;
        write!(f, "{scene},{noise},{who},{band},{points},{normals},")?;
        write!(f, "{mean:.4},{median:.4},{folded:.4}")
    }
}

impl FromStr for Row {
    type Err = String;

    fn from_str(line: &str) -> Result<Row, String> {
        let fields: Vec<&str> = line.split(',').collect();
        let [scene, noise, who, band, points, normals, mean, median, folded] = fields[..] else {
            return Err(format!("not a line of scores: {line}"));
        };
        let wrong = |_| format!("not a number in: {line}");
        let count = |text: &str| text.parse().map_err(|_| format!("not a count in: {line}"));
        Ok(Row {
            scene: scene.to_owned(),
            noise: noise.to_owned(),
            who: who.to_owned(),
            band: band.to_owned(),
            points: count(points)?,
            normals: count(normals)?,
            mean: mean.parse().map_err(wrong)?,
            median: median.parse().map_err(wrong)?,
            folded: folded.parse().map_err(wrong)?,
        })
    }
}

/// The rows of a CSV file with a header.
///
/// Errors: what is wrong with the file, as text.
pub fn read(path: impl AsRef<std::path::Path>) -> Result<Vec<Row>, String> {
    let path = path.as_ref();
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    text.lines().skip(1).map(str::parse).collect()
}
