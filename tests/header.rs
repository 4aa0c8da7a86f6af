//! `include/iine/iine.h` is what the pinned cbindgen makes of the sources. `IINE_BLESS=1` rewrites it.

use std::path::Path;

#[test]
fn the_checked_in_header_is_the_generated_one() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("include/iine/iine.h");
    let config = cbindgen::Config::from_root_or_default(root);
    let mut text = Vec::new();
    cbindgen::Builder::new()
        .with_crate(root)
        .with_config(config)
        .generate()
        .expect("bindings")
        .write(&mut text);
    let generated = String::from_utf8(text).expect("UTF-8");
    if std::env::var_os("IINE_BLESS").is_some() {
        std::fs::write(&path, &generated).expect("writable header");
    }
    let checked_in = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(checked_in == generated, "run `IINE_BLESS=1 cargo test --test header`");
    for name in generated.lines().filter_map(|line| line.strip_prefix("#define ")) {
        assert!(name.starts_with("IINE_"), "{name}: macros know no namespaces");
    }
}
