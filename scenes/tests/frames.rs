//! The scenes' truth is true, the noise is as published, and real frames can be read.

use iine_scenes::{
    Camera, Noise, Pcd, REAL_FRAMES, Random, SCENES, drop_out, plane, real_frame, scene,
};

#[test]
fn every_scene_fills_a_good_part_of_the_image_with_unit_normals_that_face_the_camera() {
    for name in SCENES {
        let frame = scene(name).expect("a known name").render(&Camera::with_size(160, 120));
        let mut seen = 0;
        for (point, normal) in frame.points.iter().zip(&frame.normals) {
            if point[2].is_nan() {
                continue;
            }
            seen += 1;
            let dot = |a: &[f32; 3], b: &[f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            assert!((dot(normal, normal) - 1.0).abs() < 1e-5, "{name}");
            assert!(dot(point, normal) <= 0.0, "{name}");
        }
        assert!(seen > 160 * 120 / 4, "{name}: {seen}");
    }
}

#[test]
fn truth_is_the_normal_of_the_points() {
    // Central differences of the exact points, where all five pixels see one surface.
    for name in SCENES {
        let frame = scene(name).expect("a known name").render(&Camera::default());
        let (mut sum, mut count) = (0.0, 0.0);
        for at in (641..640 * 479 - 1).step_by(97) {
            let around = [at - 1, at + 1, at - 640, at + 640];
            let same = around.iter().all(|&other| frame.surfaces[other] == frame.surfaces[at]);
            if !same || frame.points[at][2].is_nan() || at % 640 == 0 || at % 640 == 639 {
                continue;
            }
            let [left, right, up, down] = around.map(|other| frame.points[other].map(f64::from));
            let d = |a: [f64; 3], b: [f64; 3]| [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
            let (h, v) = (d(left, right), d(up, down));
            let n =
                [v[1] * h[2] - v[2] * h[1], v[2] * h[0] - v[0] * h[2], v[0] * h[1] - v[1] * h[0]];
            let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
            let cosine: f64 = (0..3).map(|i| n[i] / length * f64::from(frame.normals[at][i])).sum();
            sum += cosine.abs().min(1.0).acos().to_degrees();
            count += 1.0;
        }
        assert!(sum / count < 0.1, "{name}: {} deg", sum / count);
    }
}

#[test]
fn noise_has_the_published_size() {
    let exact = plane(0.0, 0.0, 2.0).render(&Camera::default());
    let deviation = |noise: Noise| {
        let noisy = noise.apply(&exact, &mut Random::new(7));
        let squares =
            noisy.points.iter().map(|point| (f64::from(point[2]) - 2.0).powi(2)).sum::<f64>();
        (squares / noisy.points.len() as f64).sqrt()
    };
    let nguyen = 0.0012 + 0.0019 * 1.6 * 1.6;
    assert!((deviation(Noise::Nguyen) / nguyen - 1.0).abs() < 0.01);
    // A sigma of 0.5 units, and rounding, whose mean square error adds 1/12.
    let khoshelham = 2.85e-3 * 4.0 * (0.25f64 + 1.0 / 12.0).sqrt();
    assert!((deviation(Noise::Khoshelham) / khoshelham - 1.0).abs() < 0.05);
    assert!((deviation(Noise::Gaussian(0.003)) / 0.003 - 1.0).abs() < 0.01);
    assert_eq!(deviation(Noise::None), 0.0);
}

#[test]
fn equal_seeds_give_equal_frames() {
    let exact = scene("tabletop").expect("a known name").render(&Camera::with_size(160, 120));
    let make = |seed| {
        let mut random = Random::new(seed);
        let mut frame = Noise::Nguyen.apply(&exact, &mut random);
        drop_out(&mut frame, 0.1, &mut random);
        frame.points.into_iter().map(|point| point.map(f32::to_bits)).collect::<Vec<_>>()
    };
    assert_eq!(make(3), make(3));
    assert_ne!(make(3), make(4));
}

#[test]
fn what_is_written_is_read_back() {
    let frame = scene("box").expect("a known name").render(&Camera::with_size(31, 17));
    let pcd = Pcd { width: 31, height: 17, points: frame.points };
    let path = std::env::temp_dir().join(format!("iine-scenes-{}.pcd", std::process::id()));
    pcd.write(&path, ["x", "y", "z"]).expect("written");
    let back = Pcd::read(&path).expect("read");
    std::fs::remove_file(&path).expect("removed");
    assert_eq!((back.width, back.height), (31, 17));
    let bits = |pcd: &Pcd| pcd.points.iter().flatten().map(|c| c.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&back), bits(&pcd));
}

#[test]
fn ascii_files_are_read() {
    let text = b"VERSION 0.7\nFIELDS rgb x y z\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
        VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n9 1 2 3\n9 nan nan nan\n";
    let pcd = Pcd::parse(text).expect("read");
    assert_eq!(pcd.points[0], [1.0, 2.0, 3.0]);
    assert!(pcd.points[1][2].is_nan());
}

#[test]
fn real_frames_are_read() {
    let frames = [
        ("kinect_capture0001", 640, 480, 0.81),
        ("milk_cartoon_all_small_clorox", 640, 480, 0.786),
        ("office1", 640, 480, 0.828),
        ("ouster_os1_128", 1024, 128, 1.0),
        ("realsense_d435", 640, 480, 0.933),
        ("table_scene_mug_stereo_textured", 640, 480, 0.681),
    ];
    assert_eq!(frames.map(|(name, ..)| name), REAL_FRAMES);
    for (name, width, height, valid) in frames {
        let Some(pcd) = real_frame("real_frames_are_read", name) else { continue };
        assert_eq!((pcd.width, pcd.height), (width, height), "{name}");
        let finite = pcd.points.iter().filter(|point| point.iter().all(|c| c.is_finite())).count();
        let share = finite as f64 / pcd.points.len() as f64;
        assert!((share - valid).abs() < 0.004, "{name}: {share}");
    }
}
