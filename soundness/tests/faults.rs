//! Faults from outside: killed runs, a full disk, files that vanish, a lost device.
#![allow(clippy::unwrap_used)]
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]

use std::path::Path;

use halflight_soundness::faults;

#[test]
fn finished_cells_outlive_every_fault() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("faults");
    let adapter = std::env::var("HALFLIGHT_ADAPTER").unwrap_or_else(|_| "any".into());
    let checks = faults::run(Path::new(env!("CARGO_BIN_EXE_soundness")), &folder, &adapter).unwrap();
    for check in &checks {
        println!("{}: {}", check.row, check.detail);
    }
    let red: Vec<_> = checks.iter().filter(|check| check.is_red()).map(|check| (&check.row, &check.detail)).collect();
    assert!(red.is_empty(), "{red:#?}");
    assert_eq!(checks.len(), 5);
}
