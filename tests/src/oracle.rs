//! The gather of small images once more, in double precision on the CPU, from the same G-buffer.

use glam::DVec3;
use halflight_evaluator::session::Frames;

/// What a full-resolution pixel shows.
#[derive(Clone, Copy, Debug)]
pub struct Pixel {
    /// Planar depth; 0 where there is no surface.
    pub depth: f64,
    /// View-space position.
    pub position: DVec3,
    /// View-space normal as stored.
    pub normal: DVec3,
    /// Direct light.
    pub radiance: DVec3,
}

/// A view and what each of its pixels shows.
#[derive(Clone, Debug)]
pub struct GBuffer {
    /// Width and height of this image.
    pub size: [u32; 2],
    /// Width and height of the display, pixels.
    pub display_size: [u32; 2],
    /// Tangents of half the field of view.
    pub tan_half_fov: [f64; 2],
    /// Rows from top to bottom.
    pub pixels: Vec<Pixel>,
}

impl GBuffer {
    /// Reads the textures that the device wrote in the last frame.
    ///
    /// # Panics
    /// Where the plan has no G-buffer.
    pub fn read(frames: &Frames) -> Self {
        let view = frames.view();
        let output = |name| frames.read(name).expect("the output is read").expect("the output exists");
        let [width, height] = view.display_size;
        let tan_half_fov = view.tan_half_fov.map(f64::from);
        let vector = |v: [f32; 4]| DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]));
        let (depth, normal, direct) = (output("depth"), output("normal"), output("direct"));
        let pixels = (0..width * height).map(|i| {
            let (x, y) = (f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
            let i = i as usize;
            let depth = f64::from(depth[i][0]);
            let ndc = [2.0 * x / f64::from(width) - 1.0, 1.0 - 2.0 * y / f64::from(height)];
            let position = DVec3::new(ndc[0] * tan_half_fov[0], ndc[1] * tan_half_fov[1], -1.0) * depth;
            Pixel { depth, position, normal: vector(normal[i]), radiance: vector(direct[i]) }
        });
        Self { size: view.display_size, display_size: view.display_size, tan_half_fov, pixels: pixels.collect() }
    }

    /// Reads the surfels of squares of `scale` pixels as if they were pixels of a smaller image; the
    /// layout is that of common/surfel.wgsl.
    ///
    /// # Panics
    /// Where the plan has no such level.
    pub fn read_surfels(frames: &Frames, scale: u32) -> Self {
        let view = frames.view();
        let tan_half_fov = view.tan_half_fov.map(f64::from);
        let display = view.display_size.map(f64::from);
        let size = view.display_size.map(|v| v.div_ceil(scale));
        let bytes =
            frames.read_bytes(&format!("surfels_{scale}")).expect("the surfels are read").expect("the level exists");
        let words: &[[u32; 4]] = bytemuck::cast_slice(&bytes);
        let pixels = words.iter().enumerate().map(|(i, words)| {
            let texel = [i as u32 % size[0], i as u32 / size[0]];
            let offset = [words[3] >> 12 & 511, words[3] >> 21 & 511];
            let [x, y]: [f64; 2] =
                std::array::from_fn(|a| (f64::from(texel[a] * scale + offset[a]) + 0.5) / display[a] * 2.0 - 1.0);
            let depth = f64::from(f32::from_bits(words[0]));
            let snorm = |word: u32| (f64::from(word as u16 as i16) / 32767.0).max(-1.0);
            let (u, v) = (snorm(words[1]), snorm(words[1] >> 16));
            let z = 1.0 - u.abs() - v.abs();
            let fold = (-z).max(0.0);
            let normal = DVec3::new(u - fold.copysign(u), v - fold.copysign(v), z).normalize();
            let exponent = f64::from(words[3] >> 4 & 255) - 127.0;
            let mantissas = [words[2] & 4095, words[2] >> 12 & 4095, words[2] >> 24 | (words[3] & 15) << 8];
            let radiance = DVec3::from(mantissas.map(f64::from)) * exponent.exp2();
            let position = DVec3::new(x * tan_half_fov[0], -y * tan_half_fov[1], -1.0) * depth;
            let lit = words[3] & 0xff0 != 0;
            Pixel { depth, position, normal, radiance: if lit { radiance } else { DVec3::ZERO } }
        });
        Self { size, tan_half_fov, pixels: pixels.collect(), display_size: view.display_size }
    }

    /// K of Equation 2: 4 tan(fh/2) tan(fv/2) / (W H).
    pub fn area_factor(&self) -> f64 {
        let [w, h] = self.display_size.map(f64::from);
        4.0 * self.tan_half_fov[0] * self.tan_half_fov[1] / (w * h)
    }

    /// Equation 2: surface that `area` pixels see, in square scene units.
    pub fn surface_area(&self, pixel: &Pixel, area: f64) -> f64 {
        self.area_factor() * area * pixel.depth.powi(3) / slant(pixel)
    }

    /// What one source, seen through `area` pixels, adds to `indirect` of a receiver for each unit
    /// of radiance: Equation 4, or 3.
    pub fn form_factor(&self, receiver: &Pixel, source: &Pixel, area: f64, point_to_disc: bool) -> f64 {
        let toward = source.position - receiver.position;
        let square = toward.length_squared();
        let receiver_cosine = receiver.normal.dot(toward);
        let source_cosine = -source.normal.dot(toward);
        if receiver_cosine <= 0.0 || source_cosine <= 0.0 {
            return 0.0;
        }
        let distance = square.sqrt();
        let disc_square = source_cosine / distance * self.surface_area(source, area) / std::f64::consts::PI;
        receiver_cosine / distance * disc_square / (square + if point_to_disc { disc_square } else { 0.0 })
    }

    /// Every pixel sums over every pixel.
    pub fn exhaustive(&self, point_to_disc: bool) -> Vec<DVec3> {
        self.pixels.iter().map(|receiver| self.gather(receiver, point_to_disc)).collect()
    }

    /// One receiver's sum over every pixel.
    pub fn gather(&self, receiver: &Pixel, point_to_disc: bool) -> DVec3 {
        let lit = |source: &&Pixel| source.depth > 0.0 && source.radiance.max_element() > 0.0;
        if receiver.depth <= 0.0 {
            return DVec3::ZERO;
        }
        self.pixels
            .iter()
            .filter(lit)
            .map(|source| source.radiance * self.form_factor(receiver, source, 1.0, point_to_disc))
            .sum()
    }

    /// An unbiased estimate of [`GBuffer::gather`] for the pixel of this index, where the sum over
    /// every pixel would take too long: `samples` points of the screen, denser towards the receiver
    /// (uniform in the logarithm of the distance, as contributions fall with its square).
    pub fn estimate(&self, index: usize, samples: u32, point_to_disc: bool) -> DVec3 {
        let receiver = &self.pixels[index];
        let [width, height] = self.size.map(f64::from);
        let (x, y) = ((index as u32 % self.size[0]) as f64 + 0.5, (index as u32 / self.size[0]) as f64 + 0.5);
        // Closer points lie in the receiver's own pixel, which sends itself nothing.
        let (nearest, span) = (0.5, (width.hypot(height) / 0.5).ln());
        let mut random = Random(index as u64);
        let (shift, turn) = (random.unit(), random.unit());
        let mut sum = DVec3::ZERO;
        for i in 0..samples {
            let radius = nearest * (span * (f64::from(i) + shift) / f64::from(samples)).exp();
            let angle = std::f64::consts::TAU * (f64::from(i) * 0.618_033_988_749_895 + turn).fract();
            let (x, y) = (x + radius * angle.cos(), y + radius * angle.sin());
            if receiver.depth > 0.0 && x >= 0.0 && y >= 0.0 && x < width && y < height {
                let source = &self.pixels[y as usize * self.size[0] as usize + x as usize];
                if source.depth > 0.0 {
                    let factor = self.form_factor(receiver, source, 1.0, point_to_disc);
                    sum += source.radiance * factor * (std::f64::consts::TAU * radius * radius * span);
                }
            }
        }
        sum / f64::from(samples)
    }
}

/// Chance that is the same in every run (64-bit linear congruential, upper bits).
#[derive(Clone, Copy, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        // Two steps, because neighbouring seeds start with neighbouring numbers.
        for _ in 0..2 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            self.0 ^= self.0 >> 29;
        }
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The shader's bound on Equation 2 at grazing angles, MIN_COS_BETA of form_factor.wgsl: it defines
/// the sum that is meant, so the twin has it too.
const MIN_COS_BETA: f64 = 0.02;

fn slant(pixel: &Pixel) -> f64 {
    (-pixel.normal.dot(pixel.position)).max(MIN_COS_BETA * pixel.depth)
}
