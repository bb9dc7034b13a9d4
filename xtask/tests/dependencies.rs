//! Licences and sources of all dependencies against deny.toml, without cargo-deny. Advisories need its database and are
//! checked in CI.
#![allow(clippy::unwrap_used)]

use std::{env, fs, path::Path, process::Command};

use serde_json::Value;
use spdx::{Expression, ParseMode};

/// All packages of this platform: name, licence, source.
fn packages() -> Vec<(String, String, Option<String>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let output = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        // Without a network, packages of other platforms may be missing.
        .args(["metadata", "--locked", "--format-version", "1", "--filter-platform", &host()])
        .current_dir(root)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let package = |p: &Value| (text(&p["name"]).unwrap(), text(&p["license"]).unwrap_or_default(), text(&p["source"]));
    metadata["packages"].as_array().unwrap().iter().map(package).collect()
}

/// The platform of the installed toolchain.
fn host() -> String {
    let output = Command::new("rustc").arg("-vV").output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().find_map(|line| line.strip_prefix("host: ")).unwrap().to_owned()
}

fn rules() -> toml::Table {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../deny.toml")).unwrap().parse().unwrap()
}

fn words<'a>(rules: &'a toml::Table, section: &str, key: &str) -> Vec<&'a str> {
    rules[section][key].as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect()
}

/// Whether a licence expression can be met with these licences.
fn is_allowed(expression: &str, allowed: &[&str]) -> bool {
    let expression = Expression::parse_mode(expression, ParseMode::LAX);
    expression.is_ok_and(|expression| expression.evaluate(|wanted| allowed.contains(&wanted.to_string().as_str())))
}

#[test]
fn licences_are_allowed() {
    let rules = rules();
    let allowed = words(&rules, "licenses", "allow");
    for (name, licence, _) in packages() {
        assert!(is_allowed(&licence, &allowed), "{name} has the licence {licence:?}, which deny.toml does not allow");
    }
    for (expression, expected) in [
        ("MIT", true),
        ("MIT/Apache-2.0", true),
        ("GPL-3.0-only", false),
        ("MIT AND GPL-3.0-only", false),
        ("Apache-2.0 OR GPL-2.0-only", true),
        ("(MIT OR GPL-2.0-only) AND OFL-1.1", true),
        ("Apache-2.0 WITH LLVM-exception", true),
        ("", false),
    ] {
        assert_eq!(is_allowed(expression, &allowed), expected, "{expression}");
    }
}

#[test]
fn dependencies_come_from_the_registry() {
    let rules = rules();
    let allowed = words(&rules, "sources", "allow-registry");
    for (name, _, source) in packages() {
        match source {
            None => assert!(name.starts_with("halflight-"), "{name} is a folder outside of the workspace"),
            Some(source) => {
                let registry = source.strip_prefix("registry+");
                assert!(registry.is_some_and(|url| allowed.contains(&url)), "{name} comes from {source}");
            }
        }
    }
}
