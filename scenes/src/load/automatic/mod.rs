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
//!
//! Strays far away and a vast ground count for nothing ([`subject`]). A camera that shows too little is replaced by one
//! close to an end of what is long and thin, or in front of the largest triangle.

mod coverage;
mod subject;

use std::f32::consts::TAU;

use glam::{DVec3, Quat, Vec3};

use crate::{Camera, Environment, Light, Scene};

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

/// Least share of the picture that shows a surface.
const SEEN: f32 = 0.01;

/// Adds an automatic camera and an automatic light, each if asked to.
pub(super) fn add(scene: &mut Scene, camera: bool, light: bool) {
    let subject = subject::of(scene);
    let shape = Shape::of(&subject);
    let (found, share) = shape.best_camera(&subject);
    // What hides the subject from the camera is seen, too.
    let hidden = camera && share < SEEN && !matches!(shape, Shape::Empty);
    drop(subject);
    if camera {
        scene.camera = found;
    }
    if hidden {
        let advice = "write a scene file with `[camera]`, `eye` and `target`";
        scene
            .warnings
            .push(format!("the automatic camera sees almost nothing: what it found is thinner than a pixel; {advice}"));
    }
    if light {
        shape.add_light(scene);
    }
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

    /// The camera that shows the scene well, or the first of others that shows enough of it; and the share of the picture
    /// that shows a surface.
    fn best_camera(&self, scene: &Scene) -> (Camera, f32) {
        let usual = self.camera(scene);
        let share = coverage::coverage(scene, &usual);
        let Self::Object { low, high } = self else { return (usual, share) };
        if share >= SEEN {
            return (usual, share);
        }
        let mut best = (usual, share);
        for camera in along(*low, *high).into_iter().chain(in_front_of_largest(scene)) {
            let share = coverage::coverage(scene, &camera);
            // Twice the least share: another size of picture may show less.
            if share >= 2.0 * SEEN {
                return (camera, share);
            }
            if share > best.1 {
                best = (camera, share);
            }
        }
        best
    }

    /// Adds a soft sky, and a sun that lights what [`Self::camera`] shows: high, slightly to the side, behind the camera. In an interior
    /// it is the first of several such directions from which light reaches the centre through an opening. An interior
    /// without an opening gets a point light under its ceiling instead of both, and a warning.
    pub fn add_light(&self, scene: &mut Scene) {
        const IRRADIANCE: [f32; 3] = [10.0, 9.5, 8.5];
        // Its irradiance on open ground is about a sixth of the sun's.
        const SKY: [f32; 3] = [0.4, 0.5, 0.65];
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
        scene.environment = Some(Environment::constant(SKY));
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

/// Cameras close to the lower end of a long, thin box that look along it, the farthest first.
fn along(low: Vec3, high: Vec3) -> Vec<Camera> {
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    let axis = half.max_position();
    let mut direction = Vec3::ZERO;
    direction[axis] = 1.0;
    let thickness = Vec3::select(direction.cmpgt(Vec3::ZERO), Vec3::ZERO, half).max_element();
    // A pillar is looked up to from the front right; a beam from beside and above.
    let aside =
        if axis == 1 { Vec3::new(0.5, 0.0, 1.0) } else { Vec3::new(0.0, 0.5, 0.0) + direction.cross(Vec3::Y).abs() };
    let end = centre - half[axis] * direction;
    [128.0, 64.0, 32.0, 16.0, 8.0, 4.0]
        .map(|k| {
            let eye = end + k * thickness * (aside.normalize() + 0.5 * direction);
            // Towards a part ahead that is not far, so that it crosses the picture.
            let target = end + direction * (2.0 * half[axis]).min(3.0 * k * thickness);
            Camera { eye: eye.to_array(), target: target.to_array(), ..upright(40.0) }
        })
        .into_iter()
        .filter(|camera| camera.eye != camera.target)
        .collect()
}

/// A camera that looks at the triangle of the largest area along its normal.
fn in_front_of_largest(scene: &Scene) -> Option<Camera> {
    let triangles = scene.meshes.iter().flat_map(|mesh| {
        mesh.indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| Vec3::from(mesh.positions[i as usize])))
    });
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a);
    let largest = triangles.max_by(|&a, &b| normal(a).length_squared().total_cmp(&normal(b).length_squared()))?;
    let centre = (largest[0] + largest[1] + largest[2]) / 3.0;
    let towards = normal(largest).try_normalize()?;
    let radius = largest.into_iter().map(|corner| corner.distance(centre)).fold(0.0, f32::max);
    let eye = centre + 2.0 * radius * towards;
    Some(Camera { eye: eye.to_array(), target: centre.to_array(), ..upright(40.0) })
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
