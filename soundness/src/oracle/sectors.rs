//! The gather of the visibility bitmask in float64 on the CPU: with points, planes and angles in 3D where the shader works
//! inside the slice, and with one boolean per sector.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use super::{GBuffer, Pixel, random3, spread2};

/// Settings of the gather, as the technique has them.
#[derive(Clone, Copy, Debug)]
pub struct Gather {
    /// Sectors of equal cosine-weighted solid angle and steps as surfaces; otherwise as published.
    pub radiometric: bool,
    /// Scene units.
    pub radius: f64,
    /// Scene units.
    pub thickness: f64,
    /// Slices.
    pub slices: u32,
    /// Steps on each side.
    pub steps: u32,
    /// Exponential spacing of the steps, otherwise constant.
    pub exponential: bool,
    /// Sectors of a slice.
    pub sectors: u32,
    /// Frame and seed of the random numbers.
    pub frame: u32,
    /// See `frame`.
    pub seed: u32,
}

/// The shader's `SAME_PLANE` (common/slice.wgsl): a receiver in a crease is in front of both planes.
const SAME_PLANE: f64 = 2e-5;

/// Light and ambient visibility of a receiver.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// `indirect`.
    pub light: DVec3,
    /// Ambient visibility, 1 = open.
    pub open: f64,
}

/// Slope under which a surface counts as seen edge-on: `MIN_SLOPE` of planes/planes.wgsl.
const MIN_SLOPE: f64 = -0.02;
/// `NEAREST` of common/slice.wgsl, pixels.
const NEAREST: f64 = 0.05;
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// One side of a slice; screen positions in pixels.
struct Side {
    sign: f64,
    jitter: f64,
    /// Position of the receiver, and the change per pixel of distance.
    own: DVec2,
    step: DVec2,
    reach: f64,
    /// Where exponential steps begin.
    first: f64,
    /// Distance of the previous sample, and one over its depth.
    before: (f64, f64),
}

/// View ray with z = -1 of a position in pixels.
fn ray_of(image: &GBuffer, pixel: DVec2) -> DVec3 {
    let (display, [tx, ty]) = (image.display_size.map(f64::from), image.tan_half_fov);
    DVec3::new((2.0 * pixel.x / display[0] - 1.0) * tx, (1.0 - 2.0 * pixel.y / display[1]) * ty, -1.0)
}

impl Gather {
    /// Light and ambient visibility of the texel of this index; texels are `scale` pixels wide.
    pub fn gather(&self, image: &GBuffer, index: usize, scale: u32) -> Found {
        let receiver = &image.pixels[index];
        if receiver.depth <= 0.0 {
            return Found::default();
        }
        let texel = [index as u32 % image.size[0], index as u32 / image.size[0]];
        let random = spread2(texel, self.frame, 2048, self.seed).map(f64::from);
        let offset = f64::from(random3(texel, self.frame, 2049, self.seed)[0]);
        let mut found = Found { light: DVec3::ZERO, open: 1.0 };
        let to_eye = -receiver.position.normalize();
        let across = DVec3::new(to_eye.z, 0.0, -to_eye.x).normalize();
        let up = to_eye.cross(across);
        for i in 0..self.slices {
            let azimuth = PI / f64::from(self.slices) * (f64::from(i) + random[0]);
            let tangent = azimuth.cos() * across + azimuth.sin() * up;
            let x = receiver.normal.dot(to_eye).max(1e-4);
            let y = receiver.normal.dot(tangent);
            let slice = Slice { to_eye, tangent, length: x.hypot(y), angle: y.atan2(x) };
            let rounding = if self.radiometric { (offset + GOLDEN * f64::from(i)).fract() } else { 0.5 };
            let jitter = (random[1] + GOLDEN * f64::from(i)).fract();
            let mut hidden = vec![false; self.sectors as usize];
            let mut light = DVec3::ZERO;
            let mut sides = [(1.0, jitter), (-1.0, (jitter + 0.5).fract())]
                .map(|(sign, jitter)| self.side(image, receiver, &slice, sign, jitter, scale));
            // The two sides alternate, because the sector in the middle belongs to both.
            for step in 0..self.steps {
                for side in &mut sides {
                    light += self.step(image, receiver, &slice, side, step, rounding, scale, &mut hidden);
                }
            }
            let weight = if self.radiometric { slice.length * slice.whole() } else { 1.0 };
            let share = weight / f64::from(self.slices * self.sectors);
            found.open -= share * hidden.iter().filter(|hidden| **hidden).count() as f64;
            found.light += share * light;
        }
        found
    }

    fn side(&self, image: &GBuffer, receiver: &Pixel, slice: &Slice, sign: f64, jitter: f64, scale: u32) -> Side {
        let display = image.display_size.map(f64::from);
        let pixel_of = |p: DVec3| {
            let [tx, ty] = image.tan_half_fov;
            DVec2::new((p.x / -p.z / tx + 1.0) * 0.5 * display[0], (1.0 - p.y / -p.z / ty) * 0.5 * display[1])
        };
        let own = pixel_of(receiver.position);
        // A point close to the receiver along the tangent gives the slice's direction on the screen.
        let heading = pixel_of(receiver.position + sign * slice.tangent * receiver.depth * 1e-4) - own;
        let step = heading.normalize();
        let reach = self.reach(receiver, slice, own, step, display, &|pixel| ray_of(image, pixel));
        let first = f64::from(scale).min(reach);
        Side { sign, jitter, own, step, reach, first, before: (0.0, 1.0 / receiver.depth) }
    }

    #[allow(clippy::too_many_arguments, reason = "mirrors the shader's function")]
    fn step(
        &self,
        image: &GBuffer,
        receiver: &Pixel,
        slice: &Slice,
        side: &mut Side,
        i: u32,
        rounding: f64,
        scale: u32,
        hidden: &mut [bool],
    ) -> DVec3 {
        let (own, step, sign) = (side.own, side.step, side.sign);
        let ray_of = |pixel: DVec2| ray_of(image, pixel);
        let strides = |part: f64| match self.exponential {
            true => side.first * (side.reach.max(1e-3) / side.first.max(1e-3)).powf(part),
            false => side.reach * part,
        };
        let at = |offset: f64| (f64::from(i) + offset) / f64::from(self.steps);
        let (begin, end) = (if i == 0 { 0.0 } else { strides(at(0.0)) }, strides(at(1.0)));
        let way = strides(at(side.jitter));
        let point = own + way * step;
        let texel = [0, 1].map(|a| ((point[a] / f64::from(scale)) as u32).min(image.size[a] - 1));
        let source = &image.pixels[(texel[1] * image.size[0] + texel[0]) as usize];
        let before = side.before;
        if source.depth <= 0.0 {
            // No surface continues behind the sky.
            side.before = (way, f64::NEG_INFINITY);
            return DVec3::ZERO;
        }
        // One over the depth at which a ray hits the texel's plane, limited to about the texel's own depth.
        let slope = (source.normal.dot(source.position) / source.depth).min(MIN_SLOPE);
        let own_ray = source.position / source.depth;
        let inverse_at = |ray: DVec3| (1.0 + source.normal.dot(ray - own_ray) / slope) / source.depth;
        let middle_of = ray_of(DVec2::new(f64::from(texel[0]) + 0.5, f64::from(texel[1]) + 0.5) * f64::from(scale));
        let own_inverse = inverse_at(middle_of).clamp(0.5 / source.depth, 2.0 / source.depth);
        let inverse = |way: f64| own_inverse + inverse_at(ray_of(own + way * step)) - inverse_at(middle_of);
        let on_plane = |way: f64| ray_of(own + way * step) / inverse(way).clamp(0.5 * own_inverse, 2.0 * own_inverse);
        let faces = inverse(0.0) * receiver.depth < 1.0 + SAME_PLANE;
        side.before = (way, own_inverse);
        let seen = ray_of(own + way * step) / inverse(way);
        let back = ray_of(own + way * step).normalize() * self.thickness;
        let fronts = if self.radiometric {
            // Where the plane lies behind the previous sample, the two meet in between.
            let behind = inverse(before.0) < before.1;
            let met = if behind { begin.min(before.0) } else { begin };
            let first = (if faces { met } else { begin.max(0.5 * way) }).max(NEAREST);
            vec![on_plane(first), on_plane(end)]
        } else {
            vec![seen]
        };
        if (seen - receiver.position).length() > self.radius {
            return DVec3::ZERO;
        }
        let angle = |p: &DVec3| slice.angle_of(sign, *p - receiver.position);
        let order = |a: &DVec3, b: &DVec3| angle(a).total_cmp(&angle(b));
        let nearest = fronts.iter().copied().min_by(order).unwrap_or_default();
        let farthest = fronts.iter().copied().max_by(order).unwrap_or_default();
        let ends = [nearest, farthest + back].map(|p| self.sector(slice, sign, p - receiver.position));
        let first = (ends[0].min(ends[1]) + rounding).floor() as usize;
        let last = (ends[0].max(ends[1]) + rounding).floor() as usize;
        let mut fresh = 0;
        for sector in &mut hidden[first.min(self.sectors as usize)..last.min(self.sectors as usize)] {
            fresh += u32::from(!*sector);
            *sector = true;
        }
        let weight = if self.radiometric {
            f64::from(u8::from(faces))
        } else {
            // Planes store the position at the texel's centre only.
            let toward = middle_of / own_inverse - receiver.position;
            let cosines = receiver.normal.dot(toward).max(0.0) * -source.normal.dot(toward).min(0.0);
            cosines / toward.length_squared().max(1e-30)
        };
        source.radiance * weight * f64::from(fresh)
    }

    /// Distance in pixels to the edge of the screen, or to where no point within the radius projects.
    fn reach(
        &self,
        receiver: &Pixel,
        slice: &Slice,
        own: DVec2,
        step: DVec2,
        display: [f64; 2],
        ray_of: &dyn Fn(DVec2) -> DVec3,
    ) -> f64 {
        let room = [0, 1].map(|a| {
            let room = if step[a] > 0.0 { display[a] - own[a] } else { own[a] };
            room / step[a].abs().max(1e-6)
        });
        let edge = room[0].min(room[1]);
        let sine = self.radius / receiver.position.length();
        if sine >= 1.0 {
            return edge;
        }
        // The angle between the rays grows with the distance: bisection.
        let seen = |way: f64| ray_of(own + way * step).angle_between(-slice.to_eye) <= sine.asin();
        if seen(edge) {
            return edge;
        }
        let (mut low, mut high) = (0.0, edge);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if seen(middle) { low = middle } else { high = middle }
        }
        low
    }

    /// Position of a direction among the sectors.
    fn sector(&self, slice: &Slice, sign: f64, direction: DVec3) -> f64 {
        let h = slice.angle_of(sign, direction).min(sign * slice.angle + FRAC_PI_2);
        let count = f64::from(self.sectors);
        if !self.radiometric {
            return (sign * h - slice.angle + FRAC_PI_2) / PI * count;
        }
        // The cosine-weighted solid angle from one end of the slice to this direction.
        let from_end = slice.arc(sign * h) - slice.arc(slice.angle - FRAC_PI_2);
        from_end / slice.whole() * count
    }
}

struct Slice {
    to_eye: DVec3,
    tangent: DVec3,
    length: f64,
    angle: f64,
}

impl Slice {
    /// Angle from the direction to the eye, 0..pi, on a side.
    fn angle_of(&self, sign: f64, direction: DVec3) -> f64 {
        (sign * direction.dot(self.tangent)).atan2(direction.dot(self.to_eye))
    }

    /// Signed integral of cos(t - angle) |sin t| from 0 to `t`.
    fn arc(&self, t: f64) -> f64 {
        let primitive = |t: f64| 0.25 * (-(2.0 * t - self.angle).cos() + 2.0 * t * self.angle.sin());
        t.signum() * (primitive(t) - primitive(0.0))
    }

    /// The same integral over the whole slice.
    fn whole(&self) -> f64 {
        self.angle.cos() + self.angle * self.angle.sin()
    }
}
