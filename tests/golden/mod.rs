//! Comparison with the snapshots of this folder, for several test programs.

/// Compares a text with the snapshot of this name in `tests/golden`.
pub fn assert_snapshot(name: &str, text: &str) {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.set_snapshot_path("../golden");
    settings.bind(|| insta::assert_snapshot!(name, text));
}
