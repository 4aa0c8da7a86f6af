//! What the experiments compute, on numbers that can be checked by hand.

use iine_experiments::errors::{Score, angle, by_band, towards_camera};
use iine_experiments::plot::{Axis, Panel, Scale, svg};
use iine_experiments::table::Row;
use iine_experiments::{exchange, figures, parallel, ranking};
use iine_scenes::{Band, Camera, scene};

const NAN: f32 = f32::NAN;

#[test]
fn angles_are_exact_at_both_ends_and_need_no_unit_length() {
    assert_eq!(angle([0.0, 0.0, -1.0], [0.0, 0.0, -3.0]), 0.0);
    assert_eq!(angle([2.0, 0.0, 0.0], [0.0, 0.5, 0.0]), 90.0);
    assert_eq!(angle([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 180.0);
    let tiny = angle([0.0, 0.0, 1.0], [1e-6, 0.0, 1.0]);
    assert!((tiny / 1e-6f32.to_degrees() - 1.0).abs() < 1e-5);
}

#[test]
fn normals_are_turned_to_the_camera() {
    assert_eq!(towards_camera([0.0, 0.6, 0.8], [0.0, 0.0, 2.0]), [0.0, -0.6, -0.8]);
    assert_eq!(towards_camera([0.0, 0.6, -0.8], [0.0, 0.0, 2.0]), [0.0, 0.6, -0.8]);
    assert!(towards_camera([NAN; 3], [0.0, 0.0, 2.0])[0].is_nan());
}

#[test]
fn scores_are_signed_folded_and_middle_angles() {
    let score = Score { points: 8, angles: vec![180.0, 10.0, 100.0, 30.0] };
    assert_eq!(score.mean(), 80.0);
    assert_eq!(score.folded(), (0.0 + 10.0 + 80.0 + 30.0) / 4.0);
    assert_eq!(score.median(), 100.0);
    assert_eq!(score.coverage(), 0.5);
    assert!(Score::default().mean().is_nan() && Score::default().median().is_nan());
}

#[test]
fn every_pixel_with_a_point_counts_in_its_band() {
    let frame = scene("box").expect("a known name").render(&Camera::with_size(160, 120));
    let bands = Band::map(&frame);
    let pixels = 160 * 120;
    let in_band = |band: Band| {
        let points = (0..pixels).filter(|at| !frame.points[*at][2].is_nan());
        points.filter(|at| bands[*at] == band).count()
    };
    let mut normals = frame.normals.clone();
    let exact = by_band(&frame, &bands, &normals, 0..pixels);
    for (score, band) in exact.iter().zip(Band::ALL) {
        assert!(in_band(band) > 100, "{band:?}");
        assert_eq!((score.points, score.angles.len()), (in_band(band), in_band(band)));
        assert!(score.mean() < 1e-3);
    }
    // One pixel that is not estimated, in each of the ways that estimators say so, and one with half a normal.
    let elsewhere: Vec<usize> = (0..pixels).filter(|at| bands[*at] == Band::Elsewhere).collect();
    let none = [[NAN; 3], [0.0; 3], [f32::INFINITY; 3], [0.0, 0.0, NAN]];
    for (normal, at) in none.into_iter().zip(&elsewhere) {
        normals[*at] = normal;
    }
    let [edges, creases, rest] = by_band(&frame, &bands, &normals, 0..pixels);
    assert_eq!((edges.coverage(), creases.coverage()), (1.0, 1.0));
    assert_eq!(rest.angles.len() + none.len(), rest.points);
    assert_eq!(by_band(&frame, &bands, &normals, std::iter::once(elsewhere[9]))[2].points, 1);
}

/// A row with these numbers.
fn row(who: &str, band: &str, normals: usize, error: f64) -> Row {
    let (scene, noise) = ("box".to_owned(), "none".to_owned());
    let (who, band) = (who.to_owned(), band.to_owned());
    Row { scene, noise, who, band, points: 100, normals, mean: error, median: error, folded: error }
}

#[test]
fn rows_are_read_back() {
    let mut rows = Row::of(
        "box",
        "none",
        "iine SDC",
        [(); 3].map(|()| Score { points: 4, angles: vec![8.0, 4.0] }),
    );
    for row in &mut rows {
        assert_eq!(row.to_string().parse::<Row>().as_ref(), Ok(&*row));
        assert_eq!(row.mean, 6.0);
    }
    assert_eq!((rows[3].points, rows[3].normals), (12, 6));
    assert_eq!(rows[0].to_string().split(',').count(), Row::HEADER.split(',').count());
    assert!("box,none,1".parse::<Row>().is_err());
}

#[test]
fn a_mode_leads_only_over_peers_that_cover_no_more() {
    let [edges, creases, elsewhere] = ["depth edges", "creases", "elsewhere"];
    let report = ranking::report(&[
        row("iine A", edges, 60, 1.0),
        row("iine A", creases, 100, 3.0),
        row("iine A", elsewhere, 90, 1.0),
        row("iine B", edges, 100, 4.0),
        row("iine B", creases, 100, 2.0),
        row("iine B", elsewhere, 95, 1.0),
        row("peer", edges, 80, 3.5),
        row("peer", creases, 90, 2.25),
        row("peer", elsewhere, 99, 9.0),
    ]);
    let has = |text: &str| assert!(report.contains(text), "{text}\n{report}");
    has(
        "| depth edges | mean | **behind by 0.50** | iine B 4.00 at 100.00 % | peer 3.50 at 80.00 % |",
    );
    has("| creases | mean | ahead by 0.25 | iine B 2.00 at 100.00 % | peer 2.25 at 90.00 % |");
    has("| elsewhere | mean | **covers less** | - | peer 9.00 at 99.00 % |");
    has("In 3 of 9 columns");
    has("| iine A | **1.00** | **1.00** | **1.00** | 60.00 | 3.00 |");
}

#[test]
fn figures_show_least_times_and_mean_errors_over_the_number_of_points() {
    let times =
        "iine SDC-5,9\nPCL-kNN-25,40\niine SDC-5,2\niine SDC-5,3\niine SDC-7,2\nPCL-kNN-49,80\n";
    let (plot, text) = figures::times(times).expect("times");
    assert!(text.contains("| iine SDC | 2.0 (25 points) | 2.0 (49 points) | 1.0 |"), "{text}");
    assert!(text.contains("| PCL-kNN | 40.0 (25 points) | 80.0 (49 points) | 2.0 |"), "{text}");
    assert_eq!(plot.matches("<circle").count(), 4);
    assert!(figures::times("iine SDC,1").is_err());

    let rows = [
        row("iine SDC-5", "all", 90, 1.0),
        row("iine CM-5", "all", 90, 3.0),
        row("PCL-kNN-25", "all", 100, 2.0),
    ];
    let (_, text) = figures::errors(&rows, &["none"]).expect("scores");
    assert!(text.contains("| none | iine SDC | 1.00 | 1.00 to 1.00 | 90.0 |"), "{text}");
    assert!(text.contains("| none | iine CM | 3.00 | 3.00 to 3.00 | 90.0 |"), "{text}");
    assert!(text.contains("| none | PCL-kNN | 2.00 | 2.00 to 2.00 | 100.0 |"), "{text}");
}

#[test]
fn plots_are_true_to_scale_and_well_formed() {
    let log = Axis { label: "a < b & c", scale: Scale::Log };
    let curve = vec![(1.0, 10.0), (10.0, 100.0), (100.0, 1000.0), (0.0, 5.0)];
    let panel =
        Panel { x: log, y: log, curves: vec![("curve".to_owned(), curve)], ..Panel::default() };
    let plot = svg(&[panel.clone(), panel], 2);
    let places = |name: &str| -> Vec<f64> {
        let before = format!(" {name}=\"");
        let values = plot.split(&before).skip(1);
        values.map(|v| v.split('"').next().expect("quoted").parse().expect("a number")).collect()
    };
    let (x, y) = (places("cx"), places("cy"));
    assert_eq!(x.len(), 6, "0 has no place on a logarithmic axis");
    assert!((x[1] - x[0] - (x[2] - x[1])).abs() < 0.21 && x[0] < x[1]);
    assert!((y[1] - y[0] - (y[2] - y[1])).abs() < 0.21 && y[0] > y[1]);
    assert!(plot.contains("a &lt; b &amp; c") && !plot.contains("NaN"));
    for label in [">1<", ">10<", ">100<", ">1000<", ">curve<"] {
        assert!(plot.contains(label), "{label}");
    }
    assert_eq!(plot.matches('<').count(), plot.matches('>').count());
    assert_eq!(plot.matches("<text").count(), plot.matches("</text>").count());
}

#[test]
fn clouds_and_normals_go_through_files() {
    let frame = scene("sphere").expect("a known name").render(&Camera::with_size(8, 6));
    let path = std::env::temp_dir().join(format!("iine-experiments-{}", std::process::id()));
    exchange::write_cloud(&path, &frame).expect("written");
    let bytes = std::fs::read(&path).expect("readable");
    let start = bytes.iter().position(|byte| *byte == b'\n').expect("a line of text") + 1;
    assert_eq!(&bytes[..start], b"8 6 6.5625 3.5 2.5\n");
    std::fs::write(&path, &bytes[start..]).expect("written");
    let back = exchange::read_normals(&path, 48).expect("as many");
    assert!(exchange::read_normals(&path, 47).is_err());
    std::fs::remove_file(&path).expect("removed");
    let bits =
        |numbers: &[[f32; 3]]| numbers.iter().flatten().map(|c| c.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&back), bits(&frame.points));
}

#[test]
fn parallel_results_keep_their_order() {
    let numbers: Vec<usize> = (0..100).collect();
    assert_eq!(parallel::map(numbers.clone(), |n| n), numbers);
}
