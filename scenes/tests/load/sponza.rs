//! The real Sponza, where the folder `shared` lies beside the repository.
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]

use std::path::Path;

use glam::Vec3;
use halflight_scenes::{DiskFiles, Light, SceneNeeds, load_scene};

#[test]
fn sponza_loads_whole() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes/sponza/sponza.obj");
    if !path.exists() {
        println!("{} is absent: the real Sponza is not tested", path.display());
        return;
    }
    let scene = load_scene(&DiskFiles, &path).expect("Sponza is good");
    assert_eq!(scene.name, "sponza");
    // Of its 262,267 triangles one has no area.
    assert_eq!(scene.triangle_count(), 262_266);
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].ends_with("sponza.obj: 1 face of zero area was dropped"), "{:?}", scene.warnings);
    assert_eq!((scene.meshes.len(), scene.materials.len(), scene.textures.len()), (25, 25, 27));
    let needs = SceneNeeds::of(&scene);
    let facts = (needs.alpha_tested, needs.textured, needs.emitters, needs.glossy, needs.directional_lights);
    assert_eq!(facts, (true, true, false, false, 1));
    for texture in &scene.textures {
        assert_eq!(texture.rgba.len(), 4 * texture.width as usize * texture.height as usize);
        assert!(!texture.name.starts_with("stand-in"), "{}", texture.name);
    }
    for mesh in &scene.meshes {
        assert!(mesh.positions.len() == mesh.normals.len() && mesh.positions.len() == mesh.uvs.len());
        // A normal may be as far from unit length as the reader leaves it alone.
        assert!(mesh.normals.iter().all(|&n| (Vec3::from(n).length() - 1.0).abs() < 1e-6));
        assert!(mesh.uvs.iter().flatten().all(|x| x.is_finite()));
    }
    // Inside the nave, looking along it, in the sun.
    let [eye, target] = [scene.camera.eye, scene.camera.target].map(Vec3::from);
    let (low, high) = scene.bounds().expect("not empty");
    assert!(eye.cmpgt(low).all() && eye.cmplt(high).all(), "{eye}");
    assert!((target - eye).normalize().x.abs() > 0.95, "{eye} {target}");
    assert!(matches!(scene.lights[..], [Light::Directional { .. }]), "{:?}", scene.lights);
}
