//! What a camera looks at, in a scene that may be much larger.
//!
//! Shadow maps, reflective shadow maps, voxels and the near plane have a fixed number of texels or a fixed share of a
//! length. Sized by everything, they would fail in a room on a ground of many kilometres. They are sized by the focus:
//! the box of most of what the camera sees and of most of what those surfaces see.

use glam::{Vec3, Vec3A};
use halflight_scenes::{Camera, Scene, bulk};
use obvhs::{
    aabb::Aabb,
    bvh2::Bvh2,
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
    ray::{Ray, RayHit},
    triangle::Triangle,
};
use serde::{Deserialize, Serialize};

use super::bounds::{Bounds, diagonal, intersection, most_of, snapped, union};

/// Rays of a camera, across and down.
const RAYS: [u32; 2] = [32, 18];
/// Hits farther than this multiple of the median distance never matter.
const FARTHEST: f32 = 32.0;
/// Margin on each side for what lies between the rays, as a share of the diagonal.
const MARGIN: f32 = 0.03;
/// The focus counts only in a scene whose diagonal is at least this many times as long. All of a smaller scene is the
/// focus, so that sizes do not depend on the camera.
const MUCH_LARGER: f32 = 4.0;
/// Most cameras of a path that are looked through.
const MOST_CAMERAS: u32 = 16;

/// Distance of near planes, as a share of the diagonal of what is looked at. Reversed depth is precise at all distances,
/// so that a near plane costs nothing: surfaces may be a million times closer than others. It is above the steps of float32
/// at the scene's farthest positions, 1e-7, because corners that the near plane cuts are rounded to them.
const NEAR: f32 = 1e-6;

/// Number of boxes around the focus that get coarser shadow maps.
const FAR_BOXES: usize = 2;
/// Each of them is larger by this factor.
const FAR_FACTOR: f32 = 16.0;

/// The boxes that sizes depend on, world space: of everything over all frames, and of what is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Lower and upper corner of everything.
    pub scene: (Vec3, Vec3),
    /// Lower and upper corner of what is looked at: equal to `scene` unless that is much larger.
    pub focus: (Vec3, Vec3),
}

impl Default for Extent {
    /// A unit cube, for an empty scene.
    fn default() -> Self {
        Self { scene: (Vec3::ZERO, Vec3::ONE), focus: (Vec3::ZERO, Vec3::ONE) }
    }
}

impl Extent {
    /// The boxes for the cameras of a scene: its own, at several frames if it moves, and the extra ones.
    pub fn of(scene: &Scene) -> Self {
        Sight::new(scene).extent(&cameras_of(scene))
    }

    /// Whether what is looked at is a small part of the scene.
    pub fn is_part(&self) -> bool {
        self.focus != self.scene
    }

    /// Whether the shadow maps of directional lights, the far ones too, cover the whole scene.
    pub fn is_covered(&self) -> bool {
        self.around().last().unwrap_or(&self.focus) == &self.scene
    }

    /// Distance of the near planes of cameras and lights, scene units.
    pub(crate) fn near(&self) -> f32 {
        (diagonal(self.focus) * NEAR).max(f32::MIN_POSITIVE * 1e10)
    }

    /// Boxes around the focus, each larger by one factor than the last, until one is the whole scene; at most
    /// [`FAR_BOXES`]. Empty if the focus is the whole scene.
    pub(crate) fn around(&self) -> Vec<Bounds> {
        let (low, high) = self.focus;
        let (centre, half) = (0.5 * (low + high), Vec3::splat(0.5 * (high - low).max_element()));
        let mut boxes = Vec::new();
        let mut factor = 1.0;
        while boxes.last().unwrap_or(&self.focus) != &self.scene && boxes.len() < FAR_BOXES {
            factor *= FAR_FACTOR;
            boxes.push(intersection((centre - factor * half, centre + factor * half), self.scene));
        }
        boxes
    }
}

/// The triangles of a scene in its first frame, for rays on the CPU.
#[derive(Clone, Serialize, Deserialize)]
pub struct Sight {
    #[serde(with = "tree")]
    bvh: Bvh2,
    #[serde(with = "bulk")]
    triangles: Vec<Triangle>,
    /// Bounding box over all frames; `None` for an empty scene.
    bounds: Option<Bounds>,
}

/// A BVH, of which rays need the nodes and the order of the triangles.
mod tree {
    use halflight_scenes::bulk;
    use obvhs::bvh2::{Bvh2, node::Bvh2Node};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Parts {
        #[serde(with = "bulk")]
        nodes: Vec<Bvh2Node>,
        #[serde(with = "bulk")]
        order: Vec<u32>,
        depth: usize,
    }

    pub(super) fn serialize<S: Serializer>(bvh: &Bvh2, serializer: S) -> Result<S::Ok, S::Error> {
        let parts = Parts { nodes: bvh.nodes.clone(), order: bvh.primitive_indices.clone(), depth: bvh.max_depth };
        parts.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Bvh2, D::Error> {
        let Parts { nodes, order, depth } = Parts::deserialize(deserializer)?;
        Ok(Bvh2 { nodes, primitive_indices: order, max_depth: depth, ..Bvh2::default() })
    }
}

/// A hit of a ray: the position, the normal that faces the ray's origin, and the distance from there.
struct Hit {
    position: Vec3A,
    normal: Vec3A,
    distance: f32,
}

impl Sight {
    /// Prepares rays against a scene.
    pub fn new(scene: &Scene) -> Self {
        let objects = scene.pose(0).objects;
        let mut triangles = Vec::with_capacity(scene.triangle_count());
        for mesh in &scene.meshes {
            let matrix = mesh.object.and_then(|object| objects.get(object));
            let corner = |&i: &u32| {
                let position = Vec3::from(mesh.positions[i as usize]);
                Vec3A::from(matrix.map_or(position, |matrix| matrix.transform_point3(position)))
            };
            let all = mesh.indices.as_chunks::<3>().0.iter().map(|corners| corners.each_ref().map(corner));
            triangles.extend(all.filter(|c| c.iter().all(|v| v.is_finite())).map(|[v0, v1, v2]| Triangle {
                v0,
                v1,
                v2,
            }));
        }
        let boxes: Vec<Aabb> = triangles.iter().map(Triangle::aabb).collect();
        let indices = (0..triangles.len() as u32).collect();
        // The fastest build: few rays are cast.
        let bvh = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Minimum,
            &boxes,
            indices,
            SortPrecision::U64,
            0,
        );
        Self { bvh, triangles, bounds: scene.swept_bounds() }
    }

    /// The boxes that matter for these cameras. The focus is all of the scene, unless they look at a much smaller part.
    pub fn extent(&self, cameras: &[Camera]) -> Extent {
        let Some(scene) = self.bounds else { return Extent::default() };
        let rays = 2 * (RAYS[0] * RAYS[1]) as usize;
        let focus = cameras.iter().filter_map(|camera| most_of(&self.seen(camera), rays)).reduce(union);
        let focus = focus.map(|focus| {
            let margin = Vec3::splat(MARGIN * diagonal(focus));
            intersection(snapped((focus.0 - margin, focus.1 + margin)), scene)
        });
        let focus = focus.filter(|&focus| MUCH_LARGER * diagonal(focus) <= diagonal(scene)).unwrap_or(scene);
        Extent { scene, focus }
    }

    /// What a camera sees, and for each such position one that it sees: a direction of the cosine-weighted hemisphere.
    /// Without positions so far away that they never matter.
    fn seen(&self, camera: &Camera) -> Vec<Vec3> {
        let [width, height] = RAYS;
        let [x, y] = camera.tan_half_fov(16, 9);
        let to_world = camera.view_matrix().inverse();
        let first = (0..width * height).filter_map(|i| {
            let at = |index: u32, count: u32| (2 * index + 1) as f32 / count as f32 - 1.0;
            let direction = Vec3::new(at(i % width, width) * x, -at(i / width, height) * y, -1.0);
            let direction = to_world.transform_vector3(direction).normalize_or_zero();
            Some((i, self.first_hit(camera.eye.into(), direction.into())?))
        });
        let first: Vec<(u32, Hit)> = first.collect();
        let mut distances: Vec<f32> = first.iter().map(|(_, hit)| hit.distance).collect();
        distances.sort_by(f32::total_cmp);
        let Some(farthest) = distances.get(distances.len() / 2).map(|median| FARTHEST * median) else {
            return Vec::new();
        };
        let mut seen = Vec::new();
        for (i, hit) in first.iter().filter(|(_, hit)| hit.distance <= farthest) {
            seen.push(hit.position.into());
            // The R2 sequence (Roberts 2018): steps that fill the unit square evenly.
            let [u, v] = [0.754_877_7, 0.569_840_3].map(|step: f64| (0.5 + step * f64::from(*i)).fract() as f32);
            let (sin, cos) = (std::f32::consts::TAU * u).sin_cos();
            let (a, b) = hit.normal.any_orthonormal_pair();
            let way = v.sqrt() * (cos * a + sin * b) + (1.0 - v).sqrt() * hit.normal;
            let second = self.first_hit(hit.position, way).filter(|hit| hit.distance <= farthest);
            seen.extend(second.map(|hit| Vec3::from(hit.position)));
        }
        seen
    }

    fn first_hit(&self, origin: Vec3A, direction: Vec3A) -> Option<Hit> {
        if self.triangles.is_empty() || !(origin.is_finite() && direction.is_finite()) {
            return None;
        }
        // Far from the origin, a ray would hit the surface that it starts from.
        let start = 1e-5 * origin.abs().max_element();
        let mut hit = RayHit::none();
        let triangle = |id: usize| &self.triangles[self.bvh.primitive_indices[id] as usize];
        self.bvh.ray_traverse(Ray::new(origin, direction, start, f32::INFINITY), &mut hit, |ray, id| {
            intersect(triangle(id), ray)
        });
        hit.t.is_finite().then(|| {
            let normal = triangle(hit.primitive_id as usize).compute_normal();
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            Hit { position: origin + hit.t * direction, normal, distance: hit.t }
        })
    }
}

/// Distance at which a ray hits a triangle; infinity if it misses (Möller & Trumbore 1997, without culling). In double
/// precision, because a triangle may be a hundred thousand times as large as what is looked at.
fn intersect(triangle: &Triangle, ray: &Ray) -> f32 {
    let [v0, v1, v2] = [triangle.v0, triangle.v1, triangle.v2].map(|v| v.as_dvec3());
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (ab, ac, from_a) = (v1 - v0, v2 - v0, origin - v0);
    let (p, q) = (direction.cross(ac), from_a.cross(ab));
    let inverse = 1.0 / ab.dot(p);
    let (u, v, distance) = (from_a.dot(p) * inverse, direction.dot(q) * inverse, ac.dot(q) * inverse);
    // A ray in the triangle's plane gives infinities or NaN; both fail these tests.
    let hit = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > f64::from(ray.tmin);
    if hit { distance as f32 } else { f32::INFINITY }
}

/// The cameras that show a scene.
fn cameras_of(scene: &Scene) -> Vec<Camera> {
    let last = scene.moves.camera.iter().map(|key| key.frame).max().unwrap_or(0);
    let frames = (last + 1).min(MOST_CAMERAS);
    let frame = |i: u32| (u64::from(last) * u64::from(i) / u64::from((frames - 1).max(1))) as u32;
    let path = (0..frames).map(|i| scene.pose(frame(i)).camera);
    path.chain(scene.extra_cameras.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_scenes::Mesh;

    /// A quadrilateral from a corner along two sides.
    fn quad(corner: [f32; 3], a: [f32; 3], b: [f32; 3]) -> Mesh {
        let [corner, a, b] = [corner, a, b].map(Vec3::from);
        let positions = [corner, corner + a, corner + a + b, corner + b].map(|v| v.to_array()).to_vec();
        let normals = vec![a.cross(b).normalize_or_zero().to_array(); 4];
        Mesh { positions, normals, uvs: vec![[0.0; 2]; 4], indices: vec![0, 1, 2, 0, 2, 3], ..Mesh::default() }
    }

    /// A room of 4 x 3 x 4 units without front, right wall and ceiling, a hand's breadth above a ground.
    fn room(ground: Option<f32>) -> Scene {
        let mut meshes = vec![
            quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]),
            quad([-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
            quad([-2.0, 0.0, 2.0], [0.0, 0.0, -4.0], [0.0, 3.0, 0.0]),
        ];
        meshes.extend(ground.map(|size| {
            let half = 0.5 * size;
            quad([-half, -0.1, half], [size, 0.0, 0.0], [0.0, 0.0, -size])
        }));
        let camera = Camera { eye: [0.0, 1.3, 4.2], target: [0.0, 1.0, 0.0], ..Camera::default() };
        Scene { meshes, camera, ..Scene::default() }
    }

    #[test]
    fn the_size_of_the_ground_does_not_matter() {
        let [first, others @ ..] = [200.0, 2e3, 4e4, 4e5].map(|size| Extent::of(&room(Some(size))));
        assert!(first.is_part());
        for other in others {
            assert_eq!(other.focus, first.focus);
        }
        // It holds the room, and is of its size.
        let (low, high) = first.focus;
        assert!(low.x <= -2.0 && low.z <= -2.0 && high.y >= 3.0 && high.z >= 2.0, "{low} {high}");
        assert!(diagonal(first.focus) < 3.0 * diagonal(Extent::of(&room(None)).scene), "{low} {high}");
    }

    #[test]
    fn all_of_a_scene_counts_that_is_not_much_larger() {
        for ground in [None, Some(6.0), Some(12.0)] {
            let extent = Extent::of(&room(ground));
            assert!(!extent.is_part(), "{ground:?}");
            assert_eq!(Some(extent.scene), room(ground).bounds());
            assert!(extent.around().is_empty());
        }
    }

    #[test]
    fn every_camera_counts() {
        let mut scene = room(Some(4e4));
        scene.meshes.push(quad([500.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]));
        let alone = Extent::of(&scene).focus;
        scene.extra_cameras = vec![Camera { eye: [502.0, 2.0, 4.0], target: [502.0, 2.0, 0.0], ..Camera::default() }];
        let both = Extent::of(&scene).focus;
        assert_eq!(both.0.min(alone.0), both.0);
        assert!(alone.1.x < 100.0 && both.1.x >= 504.0, "{alone:?} {both:?}");
    }

    #[test]
    fn nothing_seen_is_everything() {
        let mut scene = room(Some(4e4));
        scene.camera.target = [0.0, 100.0, 0.0];
        scene.camera.eye = [0.0, 50.0, 0.0];
        scene.camera.up = [0.0, 0.0, 1.0];
        assert!(!Extent::of(&scene).is_part());
        assert_eq!(Extent::of(&Scene::default()), Extent::default());
    }

    #[test]
    fn boxes_around_grow_to_the_scene() {
        let half = Vec3::splat(5.0);
        let extent = |size: f32| Extent { scene: (Vec3::splat(-size), Vec3::splat(size)), focus: (-half, half) };
        let boxes = |size: f32| extent(size).around();
        let around = |factor: f32| (-factor * half, factor * half);
        assert_eq!(boxes(50.0), [around(10.0)]);
        assert_eq!(boxes(500.0), [around(16.0), around(100.0)]);
        // The largest map is not infinitely coarse: the rest of such a scene has no shadows.
        assert_eq!(boxes(1e6), [around(16.0), around(256.0)]);
        assert!([5.0, 50.0, 500.0].into_iter().all(|size| extent(size).is_covered()) && !extent(1e6).is_covered());
    }
}
