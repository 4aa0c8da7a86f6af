//! `include/iine/iine.h` is what the pinned cbindgen makes of the sources: `cargo run -p iine-header` writes it.

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn path() -> PathBuf {
    root().join("include/iine/iine.h")
}

fn generated() -> String {
    let config = cbindgen::Config::from_root_or_default(root());
    let builder = cbindgen::Builder::new().with_crate(root()).with_config(config);
    let mut text = Vec::new();
    builder.generate().expect("bindings").write(&mut text);
    String::from_utf8(text).expect("UTF-8")
}

fn main() {
    std::fs::write(path(), generated()).expect("writable header");
}

#[test]
fn the_checked_in_header_is_the_generated_one() {
    let generated = generated();
    let checked_in = std::fs::read_to_string(path()).unwrap_or_default();
    assert!(checked_in == generated, "run `cargo run -p iine-header`");
    for name in generated.lines().filter_map(|line| line.strip_prefix("#define ")) {
        assert!(name.starts_with("IINE_"), "{name}: macros know no namespaces");
    }
}
