//! Views of memory: one that does not fit is refused, outputs of another size too, and fields may lie anywhere.

mod clouds;

use clouds::{Cloud, Kind, assert_same_bits, compute, fast_isas, options};
use iine::{BorderPolicy, Error, Estimator, Isa, Maps, Method, Normals, Points};

const WIDTH: usize = 6;
const HEIGHT: usize = 4;

#[test]
fn points_that_do_not_fit_are_refused() {
    let data = [0.0; 1000];
    // Floats from a point and from a row to the next, and how many there are from the first to the last.
    for (stride, row, length) in [(3, 0, 72), (4, 0, 95), (3, 20, 78), (7, 45, 135 + 35 + 3)] {
        let found = |length: usize| {
            Points::interleaved(&data[..length], WIDTH, HEIGHT, stride, row).map(|_| ()).err()
        };
        assert_eq!(found(length), None);
        assert_eq!(found(length - 1), Some(Error::Size));
        assert_eq!(found(0), Some(Error::Size));
    }
    for (stride, row) in [(0, 0), (2, 0), (3, 17), (7, 41)] {
        let found = Points::interleaved(&data, WIDTH, HEIGHT, stride, row);
        assert_eq!(found.err(), Some(Error::Stride), "{stride} {row}");
    }
    const LARGE: usize = 1 << (usize::BITS / 2 + 1); // its square is no usize
    for (width, height) in [(0, 1), (1, 0), (usize::MAX, 1), (1, usize::MAX), (LARGE, LARGE)] {
        let found = Points::interleaved(&data, width, height, 3, 0);
        assert_eq!(found.err(), Some(Error::Size), "{width} {height}");
    }
    for (row, length) in [(0, 24), (9, 33)] {
        let found = |short: usize| {
            let planes = [0, 1, 2].map(|c| &data[..length - usize::from(c == short)]);
            Points::planes(planes, WIDTH, HEIGHT, row).map(|_| ()).err()
        };
        assert_eq!([0, 1, 2].map(found), [Some(Error::Size); 3]);
        assert_eq!(found(3), None);
    }
    assert_eq!(Points::planes([&data; 3], WIDTH, HEIGHT, 5).err(), Some(Error::Stride));
}

#[test]
fn normals_that_do_not_fit_are_refused() {
    let mut data = [0.0; 1000];
    let mut check = |stride, row, curvature, length, expected: Option<Error>| {
        let data = &mut data[..length];
        let found = Normals::interleaved(data, WIDTH, HEIGHT, stride, row, curvature);
        assert_eq!(found.err(), expected, "{stride} {row} {curvature:?} {length}");
    };
    for (stride, row, curvature, length) in
        [(3, 0, None, 72), (4, 0, Some(3), 96), (4, 0, None, 95), (8, 50, Some(6), 197)]
    {
        check(stride, row, curvature, length, None);
        check(stride, row, curvature, length - 1, Some(Error::Size));
    }
    for (stride, row, curvature) in
        [(2, 0, None), (3, 0, Some(3)), (4, 0, Some(4)), (4, 0, Some(usize::MAX)), (4, 23, Some(3))]
    {
        check(stride, row, curvature, 1000, Some(Error::Stride));
    }
    for curvature in 0..3 {
        check(4, 0, Some(curvature), 1000, Some(Error::Overlap));
    }
}

#[test]
fn normals_may_be_planes() {
    let cloud = Cloud::new(Kind::Wavy, WIDTH, HEIGHT, 1);
    let method = (Method::CovarianceMatrix, BorderPolicy::Mirror);
    let mut estimator = Estimator::new(options(method, 3.0, false));
    let fields = compute(&mut estimator, &cloud);
    for (row, length) in [(WIDTH, 24), (9, 33)] {
        let mut planes = [[7.0_f32; 33]; 4];
        for short in 0..=4 {
            let [nx, ny, nz, curvature] = &mut planes;
            let lengths = [0, 1, 2, 3].map(|plane| length - usize::from(plane == short));
            let normal = [&mut nx[..lengths[0]], &mut ny[..lengths[1]], &mut nz[..lengths[2]]];
            let curvature = Some(&mut curvature[..lengths[3]]);
            let view = Normals::planes(normal, curvature, WIDTH, HEIGHT, row);
            if short < 4 {
                assert_eq!(view.err(), Some(Error::Size), "{short}");
            } else {
                estimator.compute(&cloud.view(), &mut view.unwrap()).unwrap();
            }
        }
        for at in 0..33 {
            let pixel = fields.get(at / row * WIDTH + at % row).filter(|_| at % row < WIDTH);
            let expected = pixel.copied().unwrap_or([7.0; 4]).map(f32::to_bits);
            assert_eq!(planes.map(|plane| plane[at].to_bits()), expected);
        }
    }
    let mut planes = [[0.0; 24]; 3];
    let normal = planes.each_mut().map(|plane| &mut plane[..]);
    let found = Normals::planes(normal, None, WIDTH, HEIGHT, WIDTH - 1);
    assert_eq!(found.err(), Some(Error::Stride));
}

#[test]
fn outputs_of_another_size_are_refused() {
    let cloud = Cloud::new(Kind::Wavy, WIDTH, HEIGHT, 1);
    let points = cloud.view();
    let mut estimator =
        Estimator::new(options((Method::default(), BorderPolicy::Mirror), 3.0, false));
    let mut data = [7.0; 3 * WIDTH * HEIGHT];
    for (width, height) in [(WIDTH - 1, HEIGHT), (WIDTH, HEIGHT - 1), (HEIGHT, WIDTH)] {
        let mut normals = Normals::interleaved(&mut data, width, height, 3, 0, None).unwrap();
        assert_eq!(estimator.compute(&points, &mut normals), Err(Error::Size));
    }
    for (width, height) in [(3, 1), (5, 1), (1, 4), (4, 2), (2, 2)] {
        let mut normals = Normals::interleaved(&mut data, width, height, 3, 0, None).unwrap();
        let found = estimator.compute_indices(&points, &[0, 1, 2, 3], &mut normals);
        assert_eq!(found, Err(Error::Size), "{width} {height}");
    }
    for (width, height) in [(2, 1), (1, 2)] {
        let mut normal = Normals::interleaved(&mut data, width, height, 3, 0, None).unwrap();
        let found = estimator.compute_window(&points, (2, 2), (3, 3), &mut normal);
        assert_eq!(found, Err(Error::Size));
    }
    assert_eq!(data, [7.0; 3 * WIDTH * HEIGHT]);

    let pixels = WIDTH * HEIGHT;
    for map in 0..3 {
        for length in [0, pixels - 1, pixels + 1] {
            let lengths: [usize; 3] =
                std::array::from_fn(|other| if other == map { length } else { pixels });
            let mut changes = vec![7; lengths[0]];
            let (mut distances, mut areas) = (vec![7.0; lengths[1]], vec![7.0; lengths[2]]);
            let mut maps = Maps {
                depth_changes: Some(&mut changes),
                distances: Some(&mut distances),
                smoothing_areas: Some(&mut areas),
                ..Maps::default()
            };
            assert_eq!(estimator.compute_maps(&points, &mut maps), Err(Error::Size));
            assert!(changes.iter().all(|change| *change == 7));
            assert!(distances.iter().chain(&areas).all(|value| *value == 7.0));
        }
    }
}

/// Where the fields of a point or normal are among its first four floats.
const NOT_SIDE_BY_SIDE: [[usize; 3]; 5] = [[0, 1, 3], [0, 2, 3], [2, 1, 0], [1, 2, 0], [0, 3, 1]];

#[test]
fn fields_need_not_be_side_by_side() {
    const STRIDE: usize = 5;
    let (width, height) = (67, 29);
    let cloud = Cloud::new(Kind::NanBlocks, width, height, 5);
    for method in [Method::CovarianceMatrix, Method::Average3DGradient] {
        for isa in fast_isas().chain([Isa::Scalar]) {
            let options = options((method, BorderPolicy::Mirror), 5.0, true);
            let mut estimator = Estimator::with_isa(options, isa);
            let expected = compute(&mut estimator, &cloud);
            for fields in NOT_SIDE_BY_SIDE {
                let mut data = vec![f32::NAN; STRIDE * width * height];
                for (to, from) in data.chunks_mut(STRIDE).zip(&cloud.points) {
                    for c in 0..3 {
                        to[fields[c]] = from[c];
                    }
                }
                let mut out = vec![7.0; STRIDE * width * height];
                let strides = [4 * STRIDE, 0];
                let (from, to) = (data.as_ptr(), out.as_mut_ptr());
                let curvature = to.wrapping_add(4);
                // SAFETY: both arrays outlive the views, hold these fields, and are not touched otherwise meanwhile.
                unsafe {
                    let points = fields.map(|field| from.wrapping_add(field));
                    let points = Points::from_raw(points, width, height, strides).unwrap();
                    let normals = fields.map(|field| to.wrapping_add(field));
                    let curvature = Some((curvature, strides));
                    let mut normals =
                        Normals::from_raw(normals, width, height, strides, curvature).unwrap();
                    estimator.compute(&points, &mut normals).unwrap();
                }
                let place = |of: &[f32]| [of[fields[0]], of[fields[1]], of[fields[2]], of[4]];
                let found: Vec<_> = out.chunks(STRIDE).map(place).collect();
                assert_same_bits(&found, &expected, width, &format!("{isa:?} {fields:?}"));
                let other = 6 - fields.iter().sum::<usize>();
                assert!(out.chunks(STRIDE).all(|of| of[other] == 7.0), "{isa:?} {fields:?}");
            }
        }
    }
}

/// A curvature that starts where it would be side by side with the normal, but has strides of its own.
#[test]
fn curvatures_have_strides_of_their_own() {
    let (width, height) = (67, 29);
    let cloud = Cloud::new(Kind::NanBlocks, width, height, 5);
    for isa in fast_isas().chain([Isa::Scalar]) {
        let options = options((Method::CovarianceMatrix, BorderPolicy::Mirror), 5.0, true);
        let mut estimator = Estimator::with_isa(options, isa);
        let expected = compute(&mut estimator, &cloud);
        // Normals every four floats, curvatures every eight: in the first half of a row between the normals.
        let (mut out, row) = (vec![7.0; 8 * width * height + 8], 8 * width);
        let to = out.as_mut_ptr();
        // SAFETY: the array outlives the view, holds its fields, and is not touched otherwise meanwhile.
        unsafe {
            let normals = [0, 1, 2].map(|field| to.wrapping_add(field));
            let curvature = Some((to.wrapping_add(3), [4 * 8, 4 * row]));
            let mut normals =
                Normals::from_raw(normals, width, height, [4 * 4, 4 * row], curvature).unwrap();
            estimator.compute(&cloud.view(), &mut normals).unwrap();
        }
        let found: Vec<[f32; 4]> = (0..width * height)
            .map(|at| {
                let (x, first) = (at % width, at / width * row);
                let normal = &out[first + 4 * x..][..3];
                [normal[0], normal[1], normal[2], out[first + 8 * x + 3]]
            })
            .collect();
        assert_same_bits(&found, &expected, width, &format!("{isa:?}"));
    }
}
