//! Facts about a scene, collected once after loading, that decide what a frame must contain.

use serde::{Deserialize, Serialize};

use crate::data::{Mesh, Scene};

/// What a scene requires of a frame. A plan contains a pass, a texture or a shader variant only if one of these facts
/// or a setting requires it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneNeeds {
    /// Number of triangles.
    pub triangles: usize,
    /// Some material has an alpha mask.
    pub alpha_tested: bool,
    /// Some material has a diffuse texture.
    pub textured: bool,
    /// Some material emits light.
    pub emitters: bool,
    /// Some material has a specular part.
    pub glossy: bool,
    /// Some material is translucent.
    pub translucent: bool,
    /// Number of solid meshes ([`Scene::is_solid`]).
    pub watertight_meshes: usize,
    /// Number of other meshes.
    pub open_meshes: usize,
    /// Number of meshes with an alpha mask.
    pub alpha_masked_meshes: usize,
    /// Number of lights of every kind.
    pub lights: usize,
    /// There is light from outside the geometry.
    pub environment: bool,
    /// Number of animated objects.
    pub moving_objects: usize,
    /// Some light is animated.
    pub moving_lights: bool,
    /// Some surface receives indirect light and sends none.
    pub receive_only: bool,
}

impl SceneNeeds {
    /// Collects the facts. Materials that no mesh uses are ignored.
    pub fn of(scene: &Scene) -> Self {
        let drawn = || scene.meshes.iter().filter(|m| !m.indices.is_empty());
        let used = || drawn().filter_map(|m| scene.materials.get(m.material));
        let is_masked = |m: &&Mesh| scene.materials.get(m.material).is_some_and(|m| m.alpha_texture.is_some());
        let watertight = drawn().filter(|mesh| scene.is_solid(mesh)).count();
        Self {
            triangles: scene.triangle_count(),
            alpha_tested: used().any(|m| m.alpha_texture.is_some()),
            textured: used().any(|m| m.albedo_texture.is_some()),
            emitters: used().any(|m| m.emission != [0.0; 3]),
            glossy: used().any(|m| m.specular != [0.0; 3]),
            translucent: used().any(|m| m.translucency != [0.0; 3]),
            watertight_meshes: watertight,
            open_meshes: drawn().count() - watertight,
            alpha_masked_meshes: drawn().filter(is_masked).count(),
            lights: scene.lights.len(),
            environment: scene.environment.is_some(),
            moving_objects: if drawn().any(|m| m.object.is_some()) { scene.moves.objects.len() } else { 0 },
            moving_lights: !scene.moves.lights.is_empty(),
            receive_only: used().any(|m| m.receive_only),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{Environment, Light, Material};

    /// Two triangles of a plain material; a second material that no mesh uses; a third on an empty mesh.
    fn scene(used: Material, other: Material) -> Scene {
        let mesh = |material, indices| Mesh { material, indices, positions: vec![[0.0; 3]], ..Mesh::default() };
        Scene {
            meshes: vec![mesh(0, vec![0; 6]), mesh(2, vec![])],
            materials: vec![used, other.clone(), other],
            ..Scene::default()
        }
    }

    #[test]
    fn a_plain_scene_needs_nothing() {
        let plain = SceneNeeds { triangles: 2, open_meshes: 1, ..SceneNeeds::default() };
        assert_eq!(SceneNeeds::of(&scene(Material::default(), Material::default())), plain);
        assert_eq!(SceneNeeds::of(&Scene::default()), SceneNeeds::default());
        // A material index out of range is ignored.
        let lost = Scene { materials: vec![], ..scene(Material::default(), Material::default()) };
        assert_eq!(SceneNeeds::of(&lost), plain);
    }

    #[test]
    fn only_materials_in_use_count() {
        let plain = SceneNeeds { triangles: 2, open_meshes: 1, ..SceneNeeds::default() };
        let default = Material::default;
        for (special, needs) in [
            (
                Material { alpha_texture: Some(0), ..default() },
                SceneNeeds { alpha_tested: true, alpha_masked_meshes: 1, ..plain.clone() },
            ),
            (Material { albedo_texture: Some(0), ..default() }, SceneNeeds { textured: true, ..plain.clone() }),
            (Material { emission: [0.0, 0.0, 0.1], ..default() }, SceneNeeds { emitters: true, ..plain.clone() }),
            (Material { specular: [0.0, 0.1, 0.0], ..default() }, SceneNeeds { glossy: true, ..plain.clone() }),
            (Material { receive_only: true, ..default() }, SceneNeeds { receive_only: true, ..plain.clone() }),
            (
                Material { translucency: [0.0, 0.1, 0.0], ..default() },
                SceneNeeds { translucent: true, ..plain.clone() },
            ),
            (Material { absorption: [1.0; 3], ..default() }, plain.clone()),
            (Material { phong_exponent: 10.0, ..default() }, plain.clone()),
        ] {
            assert_eq!(SceneNeeds::of(&scene(special.clone(), default())), needs);
            assert_eq!(SceneNeeds::of(&scene(default(), special)), plain, "unused");
        }
    }

    #[test]
    fn lights_of_every_kind_count() {
        let (position, direction, intensity) = ([0.0; 3], [0.0, -1.0, 0.0], [1.0; 3]);
        let sun = Light::Directional { direction, irradiance: intensity };
        let point = Light::Point { position, intensity };
        let spot = Light::Spot {
            position,
            direction,
            intensity,
            half_angle_degrees: 40.0,
            full_intensity_half_angle_degrees: 30.0,
        };
        let lit = Scene {
            lights: vec![spot, sun, spot, point, spot, point],
            environment: Some(Environment::constant([1.0; 3])),
            ..Scene::default()
        };
        let needs = SceneNeeds { lights: 6, environment: true, ..SceneNeeds::default() };
        assert_eq!(SceneNeeds::of(&lit), needs);
    }
}
