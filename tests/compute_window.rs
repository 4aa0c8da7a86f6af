//! A normal from a window of the caller's choice: the one that `compute` would have chosen gives what it gives.

use iine::{BorderPolicy, Error, Estimator, Method, Normals, Options, Points};

const WIDTH: usize = 33;
const HEIGHT: usize = 27;

fn cloud() -> Vec<f32> {
    (0..WIDTH * HEIGHT)
        .flat_map(|i| {
            let (u, v) = ((i % WIDTH) as f32 * 0.01, (i / WIDTH) as f32 * 0.01);
            let z = 1.0 + 0.3 * u + 0.02 * (30.0 * v).sin();
            [u * z, v * z, z]
        })
        .collect()
}

fn window(
    estimator: &mut Estimator,
    points: &Points,
    pixel: (usize, usize),
    size: (u32, u32),
) -> Result<[f32; 4], Error> {
    let mut found = [0.0; 4];
    let mut normal = Normals::interleaved(&mut found, 1, 1, 4, 0, Some(3))?;
    estimator.compute_window(points, pixel, size, &mut normal)?;
    Ok(found)
}

#[test]
fn the_window_that_compute_takes_gives_its_normal() -> Result<(), Error> {
    let data = cloud();
    let points = Points::interleaved(&data, WIDTH, HEIGHT, 3, 0)?;
    for method in Method::ALL {
        for border_policy in BorderPolicy::ALL {
            let mut options = Options::default();
            (options.method, options.border_policy) = (method, border_policy);
            options.normal_smoothing_size = 6.0;
            let mut estimator = Estimator::new(options);
            if estimator.options().check().is_err() {
                continue;
            }
            let mut all = vec![0.0; 4 * WIDTH * HEIGHT];
            let mut normals = Normals::interleaved(&mut all, WIDTH, HEIGHT, 4, 0, Some(3))?;
            estimator.compute(&points, &mut normals)?;
            for (x, y) in [(6, 6), (15, 13), (26, 20)] {
                let found = window(&mut estimator, &points, (x, y), (6, 6))?;
                for (i, value) in found.iter().enumerate() {
                    let expected = all[4 * (y * WIDTH + x) + i];
                    let close = (value - expected).abs() < 1e-4; // `compute` may sum in another order
                    assert!(close || value.is_nan() && expected.is_nan(), "{method:?} {x} {y}");
                }
            }
        }
    }
    Ok(())
}

#[test]
fn oblong_empty_and_misplaced_windows() -> Result<(), Error> {
    let data = cloud();
    let points = Points::interleaved(&data, WIDTH, HEIGHT, 3, 0)?;
    let mut estimator = Estimator::new(Options::default());
    assert!(window(&mut estimator, &points, (10, 10), (12, 2))?[2] < 0.0);
    assert!(window(&mut estimator, &points, (0, 0), (1000, 1000))?[2] < 0.0);
    assert!(window(&mut estimator, &points, (10, 10), (0, 5))?[0].is_nan());
    assert_eq!(window(&mut estimator, &points, (WIDTH, 0), (5, 5)), Err(Error::Index));
    Ok(())
}
