//! Shaders as people read them: linked into one file, with the names of their sources, and a head that says what the pass
//! does and binds.

use std::collections::{BTreeMap, BTreeSet};

use halflight_frame_graph::{FramePlan, Pass};
use halflight_renderer::gi::Technique;
use halflight_shared_shaders::SOURCES;

use super::{
    comments::{SourceFile, commented},
    names::{path_of, words},
};

/// The text of the shader file of a pass.
pub(super) fn text(technique: &Technique, plan: &FramePlan, pass: &Pass) -> String {
    let mut head = format!("// Halflight, technique {}: pass {}\n// {}.\n", technique.name, pass.name, pass.reason);
    for (name, id) in &pass.bindings {
        let resource = &plan.resources[id.0];
        if resource.name == *name {
            head += &format!("//   {name}: {}\n", resource.reason);
        } else {
            head += &format!("//   {name} is {}: {}\n", resource.name, resource.reason);
        }
    }
    let files: BTreeMap<&str, SourceFile> =
        SOURCES.iter().map(|(name, text)| (*name, SourceFile::read(text))).collect();
    let own = pass.shader.file();
    if let Some(file) = files.get(own).filter(|file| !file.head.is_empty()) {
        head += "//\n";
        file.head.iter().for_each(|line| head += &format!("{line}\n"));
    }
    head + "\n" + &with_short_names(&commented(pass.shader.source, own, &files), pass.shader.source)
}

/// Replaces the linker's names in a text by the last part of their path, or by two parts where that would be another name
/// of the code, too.
fn with_short_names(text: &str, code: &str) -> String {
    let all: BTreeSet<&str> = words(code).collect();
    let imported: Vec<(&str, Vec<&str>)> = all.iter().filter_map(|&name| Some((name, path_of(name)?))).collect();
    let short = |path: &[&str], parts: usize| path[path.len().saturating_sub(parts)..].join("_");
    let mut names: BTreeMap<&str, String> = BTreeMap::new();
    for (name, path) in &imported {
        let is_free = |candidate: &String| {
            let twins = imported.iter().filter(|(_, other)| short(other, 1) == *candidate).count();
            !all.contains(candidate.as_str()) && twins <= 1
        };
        let candidates = (1..=path.len()).map(|parts| short(path, parts));
        let chosen = candidates.into_iter().find(|name| is_free(name) && !names.values().any(|other| other == name));
        names.insert(name, chosen.unwrap_or_else(|| (*name).to_owned()));
    }
    words(text).map(|word| names.get(word).map_or(word, String::as_str)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_names_never_meet_others() {
        let source = "const package_a_x: f32 = 1.0; const package_b_x: f32 = 2.0; const package_a_free = 3; \
                      const package_b_taken = 4; fn f() { let taken = package_a_x + package_b_x + package_b_taken; }";
        let text = with_short_names(&format!("// free\n{source}"), source);
        let wanted = "// free\nconst a_x: f32 = 1.0; const b_x: f32 = 2.0; const free = 3; \
                      const b_taken = 4; fn f() { let taken = a_x + b_x + b_taken; }";
        assert_eq!(text, wanted);
    }
}
