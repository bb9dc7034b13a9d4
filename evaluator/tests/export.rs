//! Exported plans: what they say, that js/plan.schema.json holds them, and what is refused.
#![allow(clippy::unwrap_used)]

use std::{collections::BTreeSet, fs, path::Path};

use halflight_evaluator::export::{Export, export};
use halflight_frame_graph::{FramePlan, ResourceKind, Work};
use halflight_renderer::{
    parameters::{Settings, Value},
    plan_technique,
};
use halflight_techniques::{TECHNIQUES, technique};
use serde_json::Value as Json;

/// A technique with settings: `ssao radius=0.2`.
fn exported_at(line: &str, size: [u32; 2]) -> Result<Export, String> {
    let (name, settings) = parsed(line);
    export(technique(&name).unwrap(), &settings, size).map_err(|error| error.to_string())
}

fn parsed(line: &str) -> (String, Settings) {
    let mut words = line.split(' ');
    let name = words.next().unwrap().to_owned();
    let setting = |word: &str| {
        let (key, value) = word.split_once('=').unwrap();
        (format!("{name}.{key}"), Value::parse(value))
    };
    let settings = words.map(setting).collect();
    (name, settings)
}

const SIZE: [u32; 2] = [320, 180];

fn exported(line: &str) -> (Export, Json) {
    let export = exported_at(line, SIZE).unwrap();
    let json = serde_json::to_value(&export.document).unwrap();
    (export, json)
}

/// Every technique that needs textures only, and settings that add passes, histories or another rule.
const EXPORTED: [&str; 20] = [
    "bitmask",
    "bitmask finds=occlusion",
    "bitmask resolution=half feedback=0.5 temporal_a=0.9",
    "bitmask sectors=128 denoise=3 radius=2",
    "hierarchical",
    "hierarchical ring=2009 start_resolution=half levels=5",
    "hierarchical bounces=2 bounce_interleaving=on temporal_a=0.9",
    "hierarchical bounces=3 radius=20",
    "hierarchical levels=8 disc_area=texel",
    "gtao",
    "gtao falloff=0.6 radius=2 resolution=half",
    "horizon",
    "ray-march",
    "ray-march finds=occlusion",
    "ssao radius=0.2",
    "ssdo radius=0.2 start_resolution=half",
    "ssdo radius=0.2 weighting=published",
    "hybrid sources=screen radius=0.2 recompute_below=0.1 ambient_occlusion=screen occlusion_radius=0.3",
    "hybrid sources=screen radius=0.2 weighting=pattern temporal_a=0.5",
    "exhaustive",
];

fn schema() -> jsonschema::Validator {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../js/plan.schema.json");
    let schema = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    jsonschema::validator_for(&schema).unwrap()
}

#[test]
fn the_schema_holds_every_plan() {
    let schema = schema();
    for line in EXPORTED {
        let (_, json) = exported(line);
        let errors: Vec<String> =
            schema.iter_errors(&json).map(|error| format!("{}: {error}", error.instance_path())).collect();
        assert!(errors.is_empty(), "{line}: {errors:?}");
    }
    // A schema that holds everything would hold these, too.
    let (_, good) = exported("bitmask");
    type Fault = fn(&mut Json);
    let faults: [Fault; 6] = [
        |plan| plan["version"] = 2.into(),
        |plan| plan["passes"][0]["workgroups"][0]["of"] = "depth".into(),
        |plan| plan["passes"][0]["bindings"][0]["kind"] = "storage_buffer".into(),
        |plan| plan["uniforms"][0]["fields"][0]["from"] = "camera.colour".into(),
        |plan| plan["textures"][0]["format"] = "rgb9e5ufloat".into(),
        |plan| drop(plan["textures"][0].as_object_mut().unwrap().remove("layers")),
    ];
    for fault in faults {
        let mut plan = good.clone();
        fault(&mut plan);
        assert!(!schema.is_valid(&plan));
    }
}

/// What a player computes for another size, by the rules of the plan.
fn side(rule: &Json, size: [u32; 2]) -> u32 {
    let number = |key: &str| rule[key].as_u64().unwrap() as u32;
    if !rule["fixed"].is_null() {
        return number("fixed");
    }
    let pixels = if rule["of"] == "width" { size[0] } else { size[1] };
    number("times") * (pixels.div_ceil(number("divide")) + number("plus")).div_ceil(number("per"))
}

/// Sizes that the exporter does not try.
const OTHER_SIZES: [[u32; 2]; 5] = [[3, 1], [63, 250], [801, 333], [2560, 1441], [5120, 100]];

#[test]
fn rules_hold_for_sizes_that_the_exporter_does_not_try() {
    let mut one_size = BTreeSet::new();
    for line in EXPORTED {
        let (_, json) = exported(line);
        if json["display"]["valid"] == "exported" {
            one_size.insert(line);
            continue;
        }
        let (name, settings) = parsed(line);
        for size in OTHER_SIZES {
            let plan = plan_technique(technique(&name).unwrap(), &settings, size).unwrap();
            check_sizes(line, &json, &plan, size);
            check_numbers(line, &json, &plan, size);
        }
    }
    assert_eq!(Vec::from_iter(one_size), ["exhaustive"], "plans that are valid for one size alone");
}

fn check_sizes(line: &str, json: &Json, plan: &FramePlan, size: [u32; 2]) {
    for texture in json["textures"].as_array().unwrap() {
        let own = plan.resources.iter().find(|resource| texture["name"] == *resource.name).unwrap();
        let (ResourceKind::Texture { size: own, .. } | ResourceKind::Previous { size: own, .. }) = own.kind else {
            panic!("{} is no texture", own.name);
        };
        assert_eq!([0, 1].map(|axis| side(&texture["size"][axis], size)), own, "{line} {size:?} {}", texture["name"]);
    }
    for pass in json["passes"].as_array().unwrap() {
        let own = plan.find(pass["name"].as_str().unwrap()).unwrap();
        let Work::Dispatch { size: invocations, .. } = own.work else { panic!("{} draws", own.name) };
        let group = own.shader.entry_points[0].workgroup_size;
        let workgroups = [0, 1].map(|axis| invocations[axis].div_ceil(group[axis]));
        let found = [0, 1].map(|axis| side(&pass["workgroups"][axis], size));
        assert_eq!(found, workgroups, "{line} {size:?} {}", pass["name"]);
    }
}

fn check_numbers(line: &str, json: &Json, plan: &FramePlan, size: [u32; 2]) {
    for pass in &plan.passes {
        let name = format!("{}.params", pass.name);
        let Some(block) = json["uniforms"].as_array().unwrap().iter().find(|block| block["name"] == *name) else {
            continue;
        };
        for field in block["fields"].as_array().unwrap() {
            let (_, value) = pass.params.iter().find(|(name, _)| field["name"] == *name).unwrap();
            let rule = &field["by_size"];
            let found = if rule.is_null() {
                field["value"].as_f64().unwrap()
            } else {
                let divide = rule["divide"].as_u64().unwrap() as u32;
                let squares: f64 = size.iter().map(|side| f64::from(side.div_ceil(divide)).powi(2)).sum();
                (rule["times_squares"].as_f64().unwrap() * squares).max(rule["least"].as_f64().unwrap())
            };
            let bytes: [u8; 4] = value.bytes().try_into().unwrap();
            let wanted = match field["type"].as_str().unwrap() {
                "f32" => f64::from(f32::from_le_bytes(bytes)),
                _ => f64::from(u32::from_le_bytes(bytes)),
            };
            // A few operations in float32.
            assert!((found - wanted).abs() <= 1e-5 * wanted.abs(), "{line} {size:?} {name} {field}: {wanted}");
        }
    }
}

#[test]
fn settings_that_change_numbers_are_live() {
    let live = |line: &str| -> Vec<String> {
        let (_, json) = exported(line);
        let settings = json["settings"].as_array().unwrap().iter();
        settings.filter(|setting| setting["change"] == "live").map(|s| s["name"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(live("bitmask"), ["radius", "thickness", "thickness_slope"]);
    assert_eq!(live("bitmask temporal_a=0.9"), ["radius", "thickness", "thickness_slope", "temporal_a"]);
    assert_eq!(live("ssdo radius=1"), ["radius", "intensity"]);
    assert_eq!(live("hierarchical"), ["radius"]);
    assert_eq!(live("exhaustive"), [""; 0]);
    // Without one, the plan has other passes.
    let (_, json) = exported("bitmask temporal_a=0.9");
    let setting = |name: &str| json["settings"].as_array().unwrap().iter().find(|s| s["name"] == name).unwrap().clone();
    assert_eq!(setting("temporal_a")["range"]["above"], true);
    assert_eq!(setting("radius")["range"]["above"], false);
    assert_eq!(setting("slices")["change"], "export");
    // No pass reads it in a plan without light.
    let (_, json) = exported("bitmask finds=occlusion");
    let feedback = json["settings"].as_array().unwrap().iter().find(|s| s["name"] == "feedback").unwrap().clone();
    assert_eq!(feedback["change"], "none");
}

#[test]
fn live_settings_follow_the_planner() {
    // (plan, setting, other value, block, field)
    let cases = [
        ("bitmask", "radius", 3.5, "gather.params", "radius"),
        ("bitmask radius=1", "radius", 0.0, "gather.params", "radius"),
        ("hierarchical", "radius", 7.25, "gather_2.params", "disc_area"),
        ("hierarchical radius=7", "radius", 0.0, "gather_1.params", "inner_square"),
        ("bitmask temporal_a=0.9", "temporal_a", 0.77, "temporal.params", "settle_frames"),
    ];
    for (line, setting, other, block, field) in cases {
        let (_, json) = exported(line);
        let block_of =
            |json: &Json| json["uniforms"].as_array().unwrap().iter().find(|b| b["name"] == block).unwrap().clone();
        let field_of = |json: &Json| {
            block_of(json)["fields"].as_array().unwrap().iter().find(|f| f["name"] == field).unwrap().clone()
        };
        let rule = field_of(&json)["by_setting"].clone();
        assert_eq!(rule["setting"], setting, "{line} {block} {field}");
        let found = match (&rule["at_zero"], rule["frames_until"].as_f64()) {
            (Json::Number(number), _) if other == 0.0 => number.as_f64().unwrap(),
            (squares, _) if other == 0.0 => {
                let divide = squares["divide"].as_u64().unwrap() as u32;
                let sum: f64 = SIZE.iter().map(|side| f64::from(side.div_ceil(divide)).powi(2)).sum();
                squares["times_squares"].as_f64().unwrap() * sum
            }
            (_, Some(share)) => (share.ln() / f64::ln(other)).ceil(),
            _ => {
                rule["power"]["times"].as_f64().unwrap()
                    * f64::powi(other, rule["power"]["power"].as_i64().unwrap() as i32)
            }
        };
        let (_, changed) =
            exported(&format!("{} {setting}={other}", line.replace(" radius=7", "").replace(" radius=1", "")));
        let wanted = field_of(&changed)["value"].as_f64().unwrap();
        assert!((found - wanted).abs() <= 1e-5 * wanted, "{line} {setting}={other} {field}: {found}, not {wanted}");
    }
}

#[test]
fn bindings_and_shaders_agree() {
    for line in EXPORTED {
        let (export, json) = exported(line);
        for (pass, (file, text)) in json["passes"].as_array().unwrap().iter().zip(&export.shaders) {
            assert_eq!(pass["shader"], **file);
            assert!(text.contains(&format!("fn {}(", pass["entry"].as_str().unwrap())), "{line} {file}");
            assert!(!text.contains("package_"), "{line} {file} has names of the linker");
            for binding in pass["bindings"].as_array().unwrap() {
                let place = format!("@group({}) @binding({})", binding["group"], binding["index"]);
                let declared = text.split(&place).nth(1).unwrap_or_else(|| panic!("{line} {file} lacks {place}"));
                let name = binding["name"].as_str().unwrap();
                assert!(declared.split(';').next().unwrap().contains(name), "{line} {file} {place}: {name}");
            }
        }
    }
}

#[test]
fn only_what_a_player_needs_is_exported() {
    let (export, json) = exported("bitmask");
    let names = |key: &str| -> Vec<String> {
        json[key].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap().to_owned()).collect()
    };
    // No final image: an engine adds the light itself.
    assert_eq!(names("passes"), ["pyramid_1", "gather", "denoise_0"]);
    assert_eq!(names("outputs"), ["indirect"]);
    assert_eq!(names("inputs"), ["depth", "normal", "direct"], "no pass reads albedo");
    assert!(!names("textures").contains(&"final".to_owned()));
    assert_eq!(export.shaders.len(), 3);
    let (_, json) = exported("gtao");
    assert_eq!(json["outputs"][0]["name"], "ambient_occlusion");
    let (_, json) = exported("bitmask feedback=0.5 temporal_a=0.9");
    assert_eq!(json["inputs"].as_array().unwrap().len(), 4);
    assert_eq!(json["histories"][1], serde_json::json!({ "now": "history", "before": "history_before" }));
}

#[test]
fn what_needs_the_scene_is_refused_by_one_sentence() {
    // (settings, what the sentence says)
    let cases: [(&str, &[&str]); 9] = [
        ("radiance-cache", &["radiance-cache cannot be exported", "scene.bvh_nodes", "no setting leaves that out"]),
        ("rsm", &["rsm cannot be exported", "its triangles", "no setting leaves that out"]),
        ("hybrid", &["hybrid cannot be exported", "its triangles", "--set hybrid.sources=screen"]),
        ("hybrid radius=1", &["hybrid cannot be exported", "its triangles", "--set hybrid.sources=screen"]),
        ("hierarchical visibility=auto", &["its triangles", "--set hierarchical.visibility=off"]),
        ("hierarchical glossy=on", &["scene.materials", "--set hierarchical.glossy=off"]),
        ("ssao", &["ssao.radius = 0 derives its length from the scene", "give a length"]),
        ("hybrid sources=screen", &["hybrid.radius = 0 derives its length from the scene", "give a length"]),
        ("none", &["none plans no pass", "nothing to export"]),
    ];
    for (line, parts) in cases {
        let error = exported_at(line, SIZE).unwrap_err();
        for part in parts {
            assert!(error.contains(part), "{line}: \"{error}\" does not say \"{part}\"");
        }
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    // What the sentences advise is right.
    for line in ["hybrid sources=screen radius=1", "hierarchical visibility=off", "ssao radius=1"] {
        exported_at(line, SIZE).unwrap();
    }
}

#[test]
fn every_technique_is_exported_or_refused() {
    for technique in TECHNIQUES {
        let tried = EXPORTED.iter().any(|line| parsed(line).0 == technique.name);
        let refused = ["radiance-cache", "rsm", "none"].contains(&technique.name);
        assert!(tried != refused, "{}: add it to EXPORTED or to what is refused", technique.name);
    }
}

#[test]
fn light_that_is_left_out_is_noted() {
    let notes = |line: &str| exported(line).1["notes"].to_string();
    assert!(notes("hierarchical").contains("sky"));
    assert!(!notes("hierarchical sky_rays=0").contains("sky"));
    assert!(!notes("ssdo radius=1").contains("sky"), "it never takes light of the sky");
}
