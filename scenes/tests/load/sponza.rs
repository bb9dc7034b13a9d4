//! The Sponza model, which the repository does not contain. To run the test:
//!
//!     HALFLIGHT_SPONZA=path/to/sponza.obj cargo test -p halflight-scenes -- --ignored sponza
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]

use std::path::Path;

use glam::Vec3;
use halflight_scenes::{DiskFiles, Light, SceneNeeds, load_scene};

#[test]
#[ignore = "needs the Sponza model: set HALFLIGHT_SPONZA to its OBJ file"]
fn sponza_loads_completely() {
    let path = std::env::var_os("HALFLIGHT_SPONZA").expect("HALFLIGHT_SPONZA is the path of sponza.obj");
    let path = Path::new(&path);
    let scene = load_scene(&DiskFiles, path).expect("Sponza is valid");
    assert_eq!(scene.name, "sponza");
    // One of its 262,267 triangles has zero area.
    assert_eq!(scene.triangle_count(), 262_266);
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].ends_with("sponza.obj: 1 face of zero area was dropped"), "{:?}", scene.warnings);
    assert_eq!((scene.meshes.len(), scene.materials.len(), scene.textures.len()), (25, 25, 27));
    let needs = SceneNeeds::of(&scene);
    let facts = (needs.alpha_tested, needs.textured, needs.emitters, needs.glossy, needs.lights);
    assert_eq!(facts, (true, true, false, false, 1));
    for texture in &scene.textures {
        assert_eq!(texture.rgba.len(), 4 * texture.width as usize * texture.height as usize);
        assert!(!texture.name.starts_with("replacement"), "{}", texture.name);
    }
    for mesh in &scene.meshes {
        assert!(mesh.positions.len() == mesh.normals.len() && mesh.positions.len() == mesh.uvs.len());
        // The tolerance within which the reader keeps a normal unchanged.
        assert!(mesh.normals.iter().all(|&n| (Vec3::from(n).length() - 1.0).abs() < 1e-6));
        assert!(mesh.uvs.iter().flatten().all(|x| x.is_finite()));
    }
    // The camera is inside the nave, looks along it, and sees sunlight.
    let [eye, target] = [scene.camera.eye, scene.camera.target].map(Vec3::from);
    let (low, high) = scene.bounds().expect("not empty");
    assert!(eye.cmpgt(low).all() && eye.cmplt(high).all(), "{eye}");
    assert!((target - eye).normalize().x.abs() > 0.95, "{eye} {target}");
    assert!(matches!(scene.lights[..], [Light::Directional { .. }]), "{:?}", scene.lights);
}
