//! The structure that ARCHITECTURE.md describes: which crate may import which, and no circle of imports between files.
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]
#![allow(clippy::unwrap_used)]

#[path = "architecture/imports.rs"]
mod imports;

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

/// Every crate of the workspace with the crates that it may import, without `halflight-`. Imports run up this list: a crate
/// stands below those that it imports.
const CRATES: &[(&str, &[&str])] = &[
    ("output", &[]),
    ("metrics", &[]),
    ("scenes", &[]),
    ("shader-compiler", &[]),
    ("shared-shaders", &["shader-compiler"]),
    ("frame-graph", &["shared-shaders"]),
    ("renderer", &["metrics", "scenes", "shared-shaders", "frame-graph"]),
    ("techniques", &["scenes", "shared-shaders", "frame-graph", "renderer"]),
    ("recommend", &["metrics", "scenes", "frame-graph", "renderer", "techniques"]),
    // The compiler only behind the feature `hot-reload`.
    (
        "viewer",
        &[
            "metrics",
            "scenes",
            "shader-compiler",
            "shared-shaders",
            "frame-graph",
            "renderer",
            "techniques",
            "recommend",
        ],
    ),
    // The viewer only behind the feature `window`.
    ("native", &["output", "metrics", "scenes", "frame-graph", "renderer", "viewer"]),
    (
        "evaluator",
        &[
            "output",
            "metrics",
            "scenes",
            "shared-shaders",
            "frame-graph",
            "renderer",
            "techniques",
            "recommend",
            "native",
        ],
    ),
    (
        "soundness",
        &[
            "output",
            "metrics",
            "scenes",
            "shader-compiler",
            "shared-shaders",
            "frame-graph",
            "renderer",
            "techniques",
            "recommend",
            "native",
            "evaluator",
        ],
    ),
    ("bundle", &["output"]),
    ("web", &["viewer"]),
    (
        "tests",
        &[
            "metrics",
            "scenes",
            "shared-shaders",
            "frame-graph",
            "renderer",
            "techniques",
            "recommend",
            "native",
            "evaluator",
            "soundness",
        ],
    ),
    ("xtask", &["output"]),
];

/// Circles of imports that are known, by crate and the first of its files. The list only ever shrinks.
const KNOWN_CIRCLES: &[(&str, &str)] = &[];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// The members of the workspace as `cargo metadata` describes them.
fn members() -> Vec<Value> {
    let output = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

fn short(name: &Value) -> Option<String> {
    name.as_str().unwrap().strip_prefix("halflight-").map(str::to_owned)
}

/// Crates of the workspace that a member imports, outside of its tests and examples.
fn imported(member: &Value) -> BTreeSet<String> {
    let all = member["dependencies"].as_array().unwrap().iter();
    all.filter(|dependency| dependency["kind"] != "dev").filter_map(|dependency| short(&dependency["name"])).collect()
}

#[test]
fn crates_import_only_what_they_may() {
    let members: BTreeMap<String, Value> = members().into_iter().map(|m| (short(&m["name"]).unwrap(), m)).collect();
    let listed: BTreeSet<&str> = CRATES.iter().map(|(name, _)| *name).collect();
    let present: BTreeSet<&str> = members.keys().map(String::as_str).collect();
    assert_eq!(present, listed, "the crates of the workspace and those of the list");
    let mut above = BTreeSet::new();
    for (name, allowed) in CRATES {
        for import in imported(&members[*name]) {
            assert!(allowed.contains(&import.as_str()), "{name} imports {import}: CRATES does not allow that");
        }
        for import in *allowed {
            assert!(above.contains(import), "{name} may import {import}, which stands below it");
        }
        above.insert(name);
    }
}

#[test]
fn no_imports_run_in_a_circle() {
    let mut found = Vec::new();
    for member in members() {
        let name = short(&member["name"]).unwrap();
        let targets = member["targets"].as_array().unwrap().iter();
        let product = |target: &&Value| {
            let kinds = target["kind"].as_array().unwrap();
            kinds.iter().any(|kind| ["lib", "cdylib", "bin"].contains(&kind.as_str().unwrap()))
        };
        for target in targets.filter(product) {
            let path = PathBuf::from(target["src_path"].as_str().unwrap());
            let graph = imports::graph(&path);
            for circle in imports::circles(&graph) {
                let imports = imports::within(&graph, &circle);
                found.push((name.clone(), circle, imports));
            }
        }
    }
    let known = |name: &str, circle: &[String]| {
        KNOWN_CIRCLES.iter().any(|(krate, first)| *krate == name && *first == circle[0])
    };
    let mut new = String::new();
    for (name, circle, imports) in &found {
        let text = format!("{name}: {}\n    {}\n", circle.join(" <-> "), imports.join("\n    "));
        println!("{text}");
        if !known(name, circle) {
            new += &text;
        }
    }
    assert!(new.is_empty(), "modules that import one another in a circle:\n{new}");
    for (krate, first) in KNOWN_CIRCLES {
        let there = found.iter().any(|(name, circle, _)| name == krate && circle[0] == *first);
        assert!(there, "the circle of {krate}: {first} is gone, take it out of KNOWN_CIRCLES");
    }
}

#[test]
fn circles_are_found() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("circles");
    let _ = fs::remove_dir_all(&folder);
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    write("lib.rs", "mod a; mod b; mod c { pub use super::a::A; } mod d; mod e;");
    // A circle through a `use` and a path in a function; a module and its child may import one another.
    write("a.rs", "mod child; use crate::{b::{B, Other}, c}; pub struct A(child::Child);");
    write("a/child.rs", "use super::A; pub struct Child(Box<A>);");
    write("b.rs", "pub fn f() { let _ = format!(\"{:?}\", crate::a::A::new()); }");
    // No circle: one way only, and a test that looks back.
    write("d/mod.rs", "use super::e::E; #[cfg(test)] mod tests { use crate::d; }");
    write("e.rs", "pub struct E; #[cfg(test)] mod tests { use crate::d::D; }");
    let graph = imports::graph(&folder.join("lib.rs"));
    assert!(graph["a"].contains("b") && graph["a::child"].contains("a") && graph["d"].contains("e"), "{graph:?}");
    assert_eq!(imports::circles(&graph), [["a", "b"]]);
    // A circle through the child of a module.
    write("a/child.rs", "use crate::d::e;");
    write("a.rs", "mod child;");
    write("e.rs", "use crate::a;");
    let graph = imports::graph(&folder.join("lib.rs"));
    assert_eq!(imports::circles(&graph), [["a", "d", "e"]]);
}
