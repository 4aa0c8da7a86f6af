//! The C API as its users have it: `tests/c_api.c`, compiled with every warning an error, as C99 with the shared and with
//! the static library and as C++ with the shared one, and run; and `tests/c_threads.c`, which loads the shared one.

use std::path::{Path, PathBuf};
use std::process::Command;

/// What a program that links `libiine.a` must link too; `cmake/iine-targets.cmake` has the same list.
const STATIC_LIBRARIES: [&str; 6] = ["-lutil", "-lrt", "-lpthread", "-lm", "-ldl", "-lc"];

/// The libraries that cargo built for this very test.
fn library(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("this test's path");
    test.with_file_name(name)
}

/// The processor in the name of this test's platform.
fn processor() -> &'static str {
    match std::env::consts::ARCH {
        "x86" => "i686",
        other => other,
    }
}

fn compiler() -> cc::Tool {
    let target = format!("{}-unknown-linux-gnu", processor());
    let host = "x86_64-unknown-linux-gnu";
    let host = if Path::new("/lib64/ld-linux-x86-64.so.2").exists() { host } else { &target };
    cc::Build::new().cargo_metadata(false).opt_level(1).target(&target).host(host).get_compiler()
}

/// Cargo's runner for this test's platform, if there is one.
fn runner() -> String {
    let runner = format!("CARGO_TARGET_{}_UNKNOWN_LINUX_GNU_RUNNER", processor());
    std::env::var(runner.to_uppercase()).unwrap_or_default()
}

/// Runs a program built for this test's platform, through a runner if that is one.
fn run(runner: &str, program: &Path, arguments: &[PathBuf], library_dir: &Path) {
    let mut words = runner.split_whitespace().map(PathBuf::from).chain([program.to_owned()]);
    let mut command = Command::new(words.next().expect("at least the program"));
    check(command.args(words).args(arguments).env("LD_LIBRARY_PATH", library_dir));
}

fn check(command: &mut Command) {
    let output = command.output().expect("a command that starts");
    assert!(
        output.status.success(),
        "{:?} {:?}: {}\n{}{}",
        command.get_program(),
        command.get_args().collect::<Vec<_>>(),
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

/// A program's directory.
fn directory(name: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&directory).expect("a directory for the program");
    directory
}

/// Compiles one of the tests' programs as `language`, links it as `link` says, and gives its path.
fn compile(
    source: &str,
    directory: &Path,
    language: &[&str],
    link: impl FnOnce(&mut Command, &Path),
) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = directory.join("program");
    let mut command = compiler().to_command();
    if processor() == "i686" {
        command.args(["-msse2", "-mfpmath=sse"]); // floats round to floats, as everywhere else
    }
    command
        .args(language)
        .args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"])
        .arg(root.join("include"))
        .arg(root.join("tests").join(source))
        .args(["-x", "none", "-o"])
        .arg(&program);
    link(&mut command, directory);
    check(&mut command);
    program
}

/// Compiles `tests/c_api.c` as `language`, links it as `link` says, and runs it.
fn compile_and_run(name: &str, language: &[&str], link: impl FnOnce(&mut Command, &Path)) {
    let directory = directory(name);
    run(&runner(), &compile("c_api.c", &directory, language, link), &[], &directory);
}

/// Links the shared library under the name that its SONAME asks the loader for.
fn shared(command: &mut Command, directory: &Path) {
    let version = env!("CARGO_PKG_VERSION").split('.').collect::<Vec<_>>();
    let abi = if version[0] == "0" { format!("0.{}", version[1]) } else { version[0].to_owned() };
    let so = directory.join(format!("libiine.so.{abi}"));
    std::fs::copy(library("libiine.so"), &so).expect("the shared library");
    command.arg(so).arg("-lm");
}

const C99: [&str; 3] = ["-std=c99", "-x", "c"];
const CPP: [&str; 3] = ["-std=c++14", "-x", "c++"];

#[test]
fn c99_with_the_shared_library() {
    compile_and_run("c99-shared", &C99, shared);
}

#[test]
fn c99_with_the_static_library() {
    compile_and_run("c99-static", &C99, |command, _| {
        command.arg(library("libiine.a")).args(STATIC_LIBRARIES);
    });
}

#[test]
fn cpp_with_the_shared_library() {
    compile_and_run("cpp-shared", &CPP, shared);
}

/// Compiles `tests/c_threads.c`, and runs it.
fn run_threads(name: &str, runner: &str) {
    let directory = directory(name);
    let program = compile("c_threads.c", &directory, &C99, |command, _| {
        command.args(["-ldl", "-lpthread"]);
    });
    run(runner, &program, &[library("libiine.so")], &directory);
}

#[test]
fn threads_where_the_library_is_unloaded_or_the_process_forked() {
    run_threads("threads", &runner());
}

/// Users look for defects of their programs so; there is no vDSO then.
#[test]
fn threads_under_valgrind() {
    // It runs this machine's programs only.
    if !runner().is_empty() {
        println!("skipped: threads_under_valgrind: another machine's programs");
        return;
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("skipped: threads_under_valgrind: no valgrind");
        return;
    }
    run_threads("threads-valgrind", "valgrind --quiet --error-exitcode=9");
}
