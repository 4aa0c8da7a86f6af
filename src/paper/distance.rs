//! Step 2: the distance transform map (the paper's T): how far the nearest depth change is, in pixels.

use std::iter::repeat_n;

use crate::Error;
use crate::memory::table;
use crate::options::DistanceMetric;

/// The distance map of a depth change map; infinite everywhere if there is no change.
pub(crate) fn distance_map(
    changes: &[bool],
    width: usize,
    height: usize,
    metric: DistanceMetric,
) -> Result<Vec<f32>, Error> {
    match metric {
        DistanceMetric::Euclidean => euclidean(changes, width, height),
        DistanceMetric::Chamfer => chamfer(changes, width, height),
    }
}

/// Exact, in linear time (Meijster, Roerdink and Hesselink, *A General Algorithm for Computing Distance Transforms in
/// Linear Time*, 2000): distances along the columns, then for every row the lower envelope of their parabolas.
fn euclidean(changes: &[bool], width: usize, height: usize) -> Result<Vec<f32>, Error> {
    // Farther than any pixel, with a square that still fits.
    let far = (width + height) as i64;
    let mut columns = table(repeat_n(far, width * height))?;
    for at in 0..width * height {
        if changes[at] {
            columns[at] = 0;
        } else if at >= width {
            columns[at] = (columns[at - width] + 1).min(far);
        }
    }
    for at in (0..width * (height - 1)).rev() {
        columns[at] = columns[at].min(columns[at + width] + 1);
    }

    let mut map = table(repeat_n(f32::INFINITY, width * height))?;
    // The parabolas of the envelope: their columns, and from which column on each is the lowest.
    let mut envelope: Vec<(i64, i64)> = Vec::new();
    envelope.try_reserve(width)?;
    for (row, distances) in columns.chunks_exact(width).zip(map.chunks_exact_mut(width)) {
        let height_at = |x: i64, i: i64| (x - i) * (x - i) + row[i as usize] * row[i as usize];
        envelope.clear();
        for i in (0..width as i64).filter(|i| row[*i as usize] < far) {
            let mut from = 0;
            while let Some(&(last, last_from)) = envelope.last() {
                if height_at(last_from, last) > height_at(last_from, i) {
                    envelope.pop();
                    continue;
                }
                let (a, b) = (row[last as usize], row[i as usize]);
                from = (i * i - last * last + b * b - a * a).div_euclid(2 * (i - last)) + 1;
                break;
            }
            if from < width as i64 {
                envelope.push((i, from));
            }
        }
        let mut end = width as i64;
        while let Some((i, from)) = envelope.pop() {
            for x in from..end {
                distances[x as usize] = (height_at(x, i) as f32).sqrt();
            }
            end = end.min(from);
        }
    }
    Ok(map)
}

/// Steps with weights 3 and 4 (Borgefors, *Distance Transformations in Digital Images*, 1986), over 3: the least that lead
/// to every pixel from a change, in two passes.
fn chamfer(changes: &[bool], width: usize, height: usize) -> Result<Vec<f32>, Error> {
    const STRAIGHT: u32 = 3;
    const DIAGONAL: u32 = 4;
    // Weights can be added to it.
    const FAR: u32 = u32::MAX / 2;
    let mut map = table(changes.iter().map(|&change| if change { 0 } else { FAR }))?;
    let step = |to: &mut u32, from: u32, weight: u32| *to = (*to).min(from + weight);
    // The steps along a row, one way or the other.
    let along_step = |before: u32, to: &mut u32| {
        step(to, before, STRAIGHT);
        *to
    };
    let from_next_row = |row: &mut [u32], next: &[u32]| {
        row.iter_mut().zip(next).for_each(|(to, from)| step(to, *from, STRAIGHT));
        row[1..].iter_mut().zip(next).for_each(|(to, from)| step(to, *from, DIAGONAL));
        row.iter_mut().zip(&next[1..]).for_each(|(to, from)| step(to, *from, DIAGONAL));
    };
    for y in 0..height {
        let (above, row) = map[..(y + 1) * width].split_at_mut(y * width);
        if y > 0 {
            from_next_row(row, &above[(y - 1) * width..]);
        }
        row.iter_mut().fold(FAR, along_step);
    }
    for y in (0..height).rev() {
        let (row, below) = map[y * width..].split_at_mut(width);
        if y + 1 < height {
            from_next_row(row, &below[..width]);
        }
        row.iter_mut().rfold(FAR, along_step);
    }
    let pixels = |value| if value >= FAR { f32::INFINITY } else { value as f32 / STRAIGHT as f32 };
    table(map.into_iter().map(pixels))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changes(width: usize, height: usize, seed: usize) -> Vec<bool> {
        (0..width * height).map(|i| (i * 7919 + seed * 104_729) % 97 < seed % 5).collect()
    }

    #[test]
    fn euclidean_distances_are_exact() {
        for (seed, (width, height)) in [(1, 1), (1, 9), (9, 1), (7, 5), (31, 23), (64, 48)]
            .into_iter()
            .enumerate()
            .cycle()
            .take(60)
        {
            let changes = changes(width, height, seed + width);
            let found = euclidean(&changes, width, height).unwrap();
            for at in 0..width * height {
                let squared = (0..width * height)
                    .filter(|other| changes[*other])
                    .map(|other| {
                        (at % width).abs_diff(other % width).pow(2)
                            + (at / width).abs_diff(other / width).pow(2)
                    })
                    .min();
                let expected = squared.map_or(f32::INFINITY, |squared| (squared as f32).sqrt());
                assert_eq!(found[at], expected);
            }
        }
    }

    #[test]
    fn chamfer_distances_are_within_six_percent() {
        let (width, height) = (64, 48);
        let changes = changes(width, height, 1);
        let [exact, chamfer] =
            [euclidean, chamfer].map(|map| map(&changes, width, height).unwrap());
        for (exact, chamfer) in exact.into_iter().zip(chamfer) {
            assert!((chamfer - exact).abs() <= 0.06 * exact, "{chamfer} for {exact}");
        }
    }
}
