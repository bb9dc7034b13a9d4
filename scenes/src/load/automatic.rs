//! A camera and a light for scenes without them.
//!
//! 24 nearly horizontal rays distinguish three kinds of scene. They start at the centroid of the surfaces or at the
//! centre of the bounding box, whichever gives more hits on front faces (surfaces whose normal faces the ray's origin).
//! The centroid may be inside an object in a room; the centre may be above a court with a tower.
//! - *Interior*: at least three quarters of the rays hit front faces and at most a tenth escape (a room or a court, with
//!   inward-facing walls all around). The camera is inside at one end and looks along the longest horizontal axis.
//! - *Open box*: at least half of the rays hit front faces, and a ray along a horizontal axis escapes (a Cornell box).
//!   The camera looks in through the opening along that axis.
//! - *Object*: everything else. The camera looks at it from the front right, slightly from above.

use std::f32::consts::TAU;

use glam::{DVec3, Quat, Vec3};

use crate::{Camera, Light, Scene};

/// The first hit of a ray.
#[derive(Clone, Copy)]
struct Hit {
    distance: f32,
    /// Whether the shading normal faces the origin of the ray.
    facing: bool,
}

/// The kind of a scene.
pub(super) enum Shape {
    /// The scene has no vertices.
    Empty,
    Interior(Interior),
    OpenBox {
        low: Vec3,
        high: Vec3,
        outwards: Vec3,
    },
    Object {
        low: Vec3,
        high: Vec3,
    },
}

/// The inside of a room or court.
pub(super) struct Interior {
    /// Above the centre of the floor, at eye height.
    middle: Vec3,
    /// Unit vector along the longest horizontal axis, in viewing direction.
    forward: Vec3,
    /// Free distance from `middle` against and along `forward`.
    behind: f32,
    ahead: f32,
    /// Half the height of the bounding box above the floor.
    height: f32,
}

impl Shape {
    /// Classifies a scene.
    pub fn of(scene: &Scene) -> Self {
        const RAYS: usize = 24;
        let Some((low, high)) = scene.bounds() else { return Self::Empty };
        let size = high - low;
        // Eight azimuths at three elevations, off the axes so that no ray runs along an edge.
        let around = (0..RAYS).map(|i| {
            let (azimuth, rise) = (TAU * (i % 8) as f32 / 8.0 + 0.2, (i / 8) as f32 * 0.2 - 0.2);
            Vec3::new(azimuth.cos(), rise, azimuth.sin()).normalize()
        });
        let axes = [Vec3::Z, Vec3::X, Vec3::NEG_X, Vec3::NEG_Z];
        let rays: Vec<_> = around.chain([Vec3::NEG_Y]).chain(axes).collect();
        let facing = |hits: &[Option<Hit>]| hits[..RAYS].iter().flatten().filter(|hit| hit.facing).count();
        let probe = |point: Vec3| (point, first_hits(scene, point, &rays));
        let (at_centroid, at_centre) = (probe(centroid(scene)), probe(0.5 * (low + high)));
        let (centre, hits) = if facing(&at_centroid.1) >= facing(&at_centre.1) { at_centroid } else { at_centre };
        let (facing, escaped) = (facing(&hits), hits[..RAYS].iter().filter(|hit| hit.is_none()).count());
        if 4 * facing < 3 * RAYS || 10 * escaped > RAYS {
            let open = axes.iter().zip(&hits[RAYS + 1..]).find(|(_, hit)| hit.is_none());
            return match open {
                Some((&outwards, _)) if 2 * facing >= RAYS => Self::OpenBox { low, high, outwards },
                _ => Self::Object { low, high },
            };
        }
        let floor = hits[RAYS].map_or(low.y, |hit| centre.y - hit.distance);
        // A fifth of the height: eye level in a room, the first storey in a court.
        let height = 0.5 * (high.y - floor);
        let middle = centre.with_y(floor + 0.4 * height);
        let (axis, half) = if size.x >= size.z { (Vec3::X, 0.5 * size.x) } else { (Vec3::Z, 0.5 * size.z) };
        let ends = first_hits(scene, middle, &[axis, -axis]);
        let [plus, minus] = [0, 1].map(|i| ends[i].map_or(half, |hit: Hit| hit.distance));
        let (forward, ahead, behind) = if plus > minus { (-axis, minus, plus) } else { (axis, plus, minus) };
        Self::Interior(Interior { middle, forward, behind, ahead, height })
    }

    /// A camera that shows the scene well; the default camera for a scene without vertices.
    pub fn camera(&self, scene: &Scene) -> Camera {
        match self {
            Self::Empty => Camera::default(),
            Self::Interior(room) => room.camera(scene),
            Self::OpenBox { low, high, outwards } => fitted(*low, *high, *outwards),
            Self::Object { low, high } => fitted(*low, *high, Vec3::new(0.55, 0.4, 1.0)),
        }
    }

    /// Adds a sun that lights what [`Self::camera`] shows: high, slightly to the side, behind the camera. In an interior
    /// it is the first of several such directions from which light reaches the centre through an opening. An interior
    /// without an opening gets a point light under its ceiling instead, and a warning.
    pub fn add_light(&self, scene: &mut Scene) {
        const IRRADIANCE: [f32; 3] = [10.0, 9.5, 8.5];
        let direction = match self {
            Self::Empty => return,
            Self::OpenBox { outwards, .. } => travels(-outwards, 25.0, 40.0),
            Self::Object { .. } => travels(Vec3::new(-0.55, 0.0, -1.0).normalize(), -35.0, 50.0),
            Self::Interior(room) => match room.sun(scene) {
                Ok(direction) => direction,
                Err(ceiling) => {
                    let reach = 0.5 * (room.ahead + room.behind);
                    let position = (room.middle + Vec3::Y * (0.8 * ceiling)).to_array();
                    // At the distance `reach` its irradiance is a third of the sun's.
                    let intensity = IRRADIANCE.map(|e| e / 3.0 * reach * reach);
                    scene.lights.push(Light::Point { position, intensity });
                    let warning = "the scene is closed, so no sunlight can enter; it gets a point light instead";
                    scene.warnings.push(warning.into());
                    return;
                }
            },
        };
        scene.lights.push(Light::Directional { direction: direction.to_array(), irradiance: IRRADIANCE });
    }
}

impl Interior {
    /// At one end, as far back as the view stays unobstructed: of four positions behind the centre, the one with the
    /// largest geometric mean of the visible distances. It looks slightly upwards at the far end.
    fn camera(&self, scene: &Scene) -> Camera {
        let target = self.middle + self.forward * self.ahead + Vec3::Y * (0.2 * self.height);
        let at = |share: f32| {
            let eye = self.middle - self.forward * (share * self.behind);
            Camera { eye: eye.to_array(), target: target.to_array(), ..upright(60.0) }
        };
        let free_view = |camera: &Camera| -> f32 {
            let ([x, y], to_world) = (camera.tan_half_fov(16, 9), camera.view_matrix().inverse());
            let grid = (0..21).map(|i| ((i % 7) as f32 / 3.0 - 1.0, (i / 7) as f32 - 1.0));
            let rays: Vec<_> = grid
                .map(|(u, v)| to_world.transform_vector3(Vec3::new(0.9 * u * x, 0.9 * v * y, -1.0)).normalize())
                .collect();
            // A ray that escapes counts as one that reaches the far end.
            let far = self.behind + self.ahead;
            let hits = first_hits(scene, camera.eye.into(), &rays);
            hits.iter().map(|hit| hit.map_or(far, |hit| hit.distance.min(far)).ln()).sum()
        };
        let candidates = [0.9, 0.75, 0.6, 0.45].map(at).map(|camera| (free_view(&camera), camera));
        candidates.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or_else(|| at(0.9), |(_, camera)| camera)
    }

    /// The direction of travel of sunlight that reaches the centre, or the height of the ceiling above the centre if no
    /// direction does.
    fn sun(&self, scene: &Scene) -> Result<Vec3, f32> {
        let azimuths = [20.0, -20.0, 160.0, -160.0, 60.0, -60.0, 120.0, -120.0];
        let directions: Vec<_> = [72.0, 55.0, 85.0, 40.0, 25.0]
            .into_iter()
            .flat_map(|elevation| azimuths.map(|azimuth| travels(self.forward, azimuth, elevation)))
            .collect();
        let mut rays: Vec<_> = directions.iter().map(|&direction| -direction).collect();
        rays.push(Vec3::Y);
        let hits = first_hits(scene, self.middle, &rays);
        let free = directions.iter().zip(&hits).find(|(_, hit)| hit.is_none());
        let ceiling = hits.last().copied().flatten().map_or(self.height, |hit| hit.distance);
        free.map(|(&direction, _)| direction).ok_or(ceiling)
    }
}

/// Direction of travel of light from this elevation, rotated by the azimuth about +y from the horizontal `ahead`.
fn travels(ahead: Vec3, azimuth_degrees: f32, elevation_degrees: f32) -> Vec3 {
    let (sin, cos) = elevation_degrees.to_radians().sin_cos();
    Quat::from_rotation_y(azimuth_degrees.to_radians()) * ahead * cos - Vec3::Y * sin
}

fn upright(vertical_fov_degrees: f32) -> Camera {
    Camera { vertical_fov_degrees, up: [0.0, 1.0, 0.0], ..Camera::default() }
}

/// A camera that looks at the box from `direction`, at the smallest distance at which all corners are inside a square
/// image with a margin of 5 %.
fn fitted(low: Vec3, high: Vec3, direction: Vec3) -> Camera {
    let camera = upright(40.0);
    let [_, tangent] = camera.tan_half_fov(1, 1);
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    let back = direction.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let needed = |corner: Vec3| corner.dot(back) + 1.05 * corner.dot(right).abs().max(corner.dot(up).abs()) / tangent;
    let signs = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0);
    let distance = signs.map(|sign| needed(sign * half)).fold(f32::MIN_POSITIVE, f32::max);
    Camera { eye: (centre + back * distance).to_array(), target: centre.to_array(), ..camera }
}

/// Area-weighted centroid of all triangles.
fn centroid(scene: &Scene) -> Vec3 {
    let triangles = scene.meshes.iter().flat_map(|mesh| {
        let corner = |&i: &u32| Vec3::from(mesh.positions[i as usize]).as_dvec3();
        mesh.indices.as_chunks::<3>().0.iter().map(move |triangle| triangle.each_ref().map(corner))
    });
    let (sum, area) = triangles.fold((DVec3::ZERO, 0.0), |(sum, total), [a, b, c]| {
        let area = (b - a).cross(c - a).length();
        (sum + area * (a + b + c) / 3.0, total + area)
    });
    (sum / area).as_vec3()
}

/// The first hit of each ray from `origin` (Möller and Trumbore 1997, without culling).
fn first_hits(scene: &Scene, origin: Vec3, rays: &[Vec3]) -> Vec<Option<Hit>> {
    let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
    for mesh in &scene.meshes {
        for &triangle in mesh.indices.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|i| Vec3::from(mesh.positions[i as usize]));
            let (ab, ac, from_a) = (b - a, c - a, origin - a);
            let q = from_a.cross(ab);
            for (hit, &ray) in hits.iter_mut().zip(rays) {
                let p = ray.cross(ac);
                let inverse = 1.0 / ab.dot(p);
                let (u, v, distance) = (from_a.dot(p) * inverse, ray.dot(q) * inverse, ac.dot(q) * inverse);
                // A ray in the triangle's plane gives infinities or NaN; both fail these tests.
                if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 && hit.is_none_or(|h| distance < h.distance) {
                    let normal: Vec3 = triangle.iter().map(|&i| Vec3::from(mesh.normals[i as usize])).sum();
                    *hit = Some(Hit { distance, facing: normal.dot(ray) < 0.0 });
                }
            }
        }
    }
    hits
}
