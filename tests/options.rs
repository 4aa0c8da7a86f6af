//! The options' defaults, the errors' texts and the instruction set in use.

use iine::{
    BorderPolicy, Depth, DistanceMetric, Error, Estimator, Isa, Method, Options, Semantics,
};

/// PCL's, and those that docs/paper.md has.
#[test]
fn defaults_are_as_documented() {
    let options = Options::default();
    assert_eq!(options.method, Method::Average3DGradient);
    assert_eq!(options.border_policy, BorderPolicy::Ignore);
    assert_eq!(options.normal_smoothing_size, 10.0);
    assert_eq!(options.max_depth_change_factor, 20.0 * 0.001);
    assert_eq!(options.viewpoint, [0.0; 3]);
    assert_eq!((options.threads, options.semantics), (1, Semantics::Pcl));
    assert!(!options.depth_dependent_smoothing && !options.zero_is_missing);
    assert!(!options.one_sided_windows && !options.crease_windows);
    let paper = options.paper;
    assert_eq!([paper.alpha, paper.beta, paper.gamma], [0.0028, 1200.0, 5.0]);
    let radii = [paper.smallest_radius, paper.least_depth_radius, paper.largest_radius];
    assert_eq!(radii, [2, 5, 20]);
    assert_eq!((paper.distance_metric, paper.depth), (DistanceMetric::Euclidean, Depth::Z));
}

/// As `Options::check` says.
#[test]
fn what_has_no_effect_is_not_checked() {
    for semantics in Semantics::ALL {
        for [one_sided, creases] in [[false, false], [true, false], [false, true]] {
            let mut options = Options::default();
            options.semantics = semantics;
            [options.one_sided_windows, options.crease_windows] = [one_sided, creases];
            assert_eq!(options.check(), Ok(()));
            let takes_paper = semantics == Semantics::Paper || one_sided || creases;
            let refused =
                |is_looked_at| if is_looked_at { Err(Error::OptionValue) } else { Ok(()) };

            let mut no_beta = options.clone();
            no_beta.paper.beta = f32::NAN;
            assert_eq!(no_beta.check(), refused(takes_paper), "{no_beta:?}");
            let mut no_size = options.clone();
            no_size.normal_smoothing_size = f32::NAN;
            assert_eq!(no_size.check(), refused(semantics == Semantics::Pcl), "{no_size:?}");
            options.threads = 1025;
            assert_eq!(options.check(), Err(Error::OptionValue));
        }
        let mut simple = Options::default();
        (simple.method, simple.semantics) = (Method::Simple3DGradient, semantics);
        let is_supported = semantics == Semantics::Pcl;
        assert_eq!(simple.check(), if is_supported { Ok(()) } else { Err(Error::Unsupported) });
        simple.border_policy = BorderPolicy::Mirror;
        assert_eq!(simple.check(), Err(Error::Unsupported));
    }
}

#[test]
fn errors_say_what_is_wrong() {
    let words = [
        "NULL",
        "struct_size",
        "width",
        "stride",
        "aligned",
        "overlap",
        "option",
        "together",
        "index",
        "memory",
        "threads",
        "internal",
    ];
    for (error, word) in Error::ALL.into_iter().zip(words) {
        assert!(error.to_string().contains(word), "{error:?}: {error}");
    }
}

#[test]
fn the_best_instruction_set_is_in_use() {
    let best = Isa::ALL.into_iter().rfind(|isa| isa.is_available()).unwrap();
    if std::env::var_os("IINE_ISA").is_none() {
        assert_eq!(Isa::active(), best);
    }
    for isa in Isa::ALL {
        let expected = if isa.is_available() { isa } else { Isa::active() };
        assert_eq!(Estimator::with_isa(Options::default(), isa).isa(), expected);
    }
}
