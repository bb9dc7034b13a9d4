//! Float64 implementations of the gathers on the CPU, for small images, from the G-buffer that the device wrote.

use glam::DVec3;

use halflight_evaluator::experiment::session::Frames;

pub mod pairs;
pub mod sectors;
pub mod voxels;

/// The surface in a pixel.
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

/// A view and the surface in each of its pixels.
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

/// The four words of each surfel, with the radiance of its plane if it has none of its own.
fn surfel_words(frames: &Frames, scale: u32) -> Vec<[u32; 4]> {
    let read = |name: &str| frames.read_bytes(name).expect("the texture is read").expect("the level exists");
    let name = format!("surfels_{scale}");
    let bytes = read(&name);
    let narrow = frames.texture(&name).is_some_and(|texture| texture.format() == wgpu::TextureFormat::Rg32Uint);
    if !narrow {
        return bytemuck::cast_slice(&bytes).to_vec();
    }
    let (surfels, planes) = (bytemuck::cast_slice::<_, [u32; 2]>(&bytes), read("planes"));
    let planes: &[[u32; 4]] = bytemuck::cast_slice(&planes);
    let both = surfels.iter().zip(planes);
    both.map(|(&[depth, normal], plane)| [depth, normal, plane[3], plane[1] & 63 | (plane[2] & 63) << 6]).collect()
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

    /// Reads the surfels of squares of `scale` pixels as the pixels of a smaller image. The layout is that of
    /// common/surfel.wgsl; if the surfels have no radiance, it is that of the planes (common/plane.wgsl).
    ///
    /// # Panics
    /// Where the plan has no such level.
    pub fn read_surfels(frames: &Frames, scale: u32) -> Self {
        let view = frames.view();
        let tan_half_fov = view.tan_half_fov.map(f64::from);
        let display = view.display_size.map(f64::from);
        let size = view.display_size.map(|v| v.div_ceil(scale));
        let words = surfel_words(frames, scale);
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

    /// Equation 2: surface area behind `area` pixels, square scene units.
    pub fn surface_area(&self, pixel: &Pixel, area: f64) -> f64 {
        self.area_factor() * area * pixel.depth.powi(3) / slant(pixel)
    }

    /// `indirect` of a receiver per unit of radiance of one source that covers `area` pixels: Equation 4, or 3.
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

    /// The sum over every pixel, for every pixel.
    pub fn exhaustive(&self, point_to_disc: bool) -> Vec<DVec3> {
        self.pixels.iter().map(|receiver| self.gather(receiver, point_to_disc)).collect()
    }

    /// The sum over every pixel, for one receiver.
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

    /// An unbiased estimate of [`GBuffer::gather`] for the pixel of this index, faster than the sum over every pixel:
    /// `samples` points on the screen with a density uniform in the logarithm of the distance to the receiver, because
    /// contributions fall with the squared distance.
    pub fn estimate(&self, index: usize, samples: u32, point_to_disc: bool) -> DVec3 {
        let receiver = &self.pixels[index];
        let [width, height] = self.size.map(f64::from);
        let (x, y) = ((index as u32 % self.size[0]) as f64 + 0.5, (index as u32 / self.size[0]) as f64 + 0.5);
        // Closer points lie in the receiver's own pixel, which contributes nothing.
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

/// Random numbers that are the same in every run (64-bit linear congruential generator, upper bits).
#[derive(Clone, Copy, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        // Two steps, because the first numbers of consecutive seeds are similar.
        for _ in 0..2 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            self.0 ^= self.0 >> 29;
        }
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The bound on Equation 2 at grazing angles, MIN_COS_BETA of form_factor.wgsl. It is part of the definition of the sum.
const MIN_COS_BETA: f64 = 0.02;

fn slant(pixel: &Pixel) -> f64 {
    (-pixel.normal.dot(pixel.position)).max(MIN_COS_BETA * pixel.depth)
}

/// The gather of one level with the samples of `gather.wgsl`, each one's light in float64. Sample positions are computed
/// in float32 in the shader's order of operations, so that both read the same texels except for a few that round
/// differently.
#[derive(Clone, Copy, Debug)]
pub struct GatherTwin {
    /// Width of a texel, full-resolution pixels.
    pub scale: f32,
    /// Square of the ring's inner radius, texels.
    pub inner_square: f32,
    /// Square of its outer radius.
    pub outer_square: f32,
    /// Screen area of the disc of one sample, full-resolution pixels.
    pub disc_area: f64,
    /// Number of discs per sample.
    pub discs: f64,
    /// Stream of random numbers.
    pub stream: u32,
    /// Samples.
    pub samples: u32,
    /// Equation 4, otherwise 3.
    pub point_to_disc: bool,
    /// Number of the frame.
    pub frame: u32,
    /// The user's seed.
    pub seed: u32,
}

impl GatherTwin {
    /// Light that the texel of this index gathers from its ring.
    pub fn light(&self, surfels: &GBuffer, index: usize) -> DVec3 {
        const TURN: [f32; 2] = [-0.737_368_9, 0.675_490_3];
        let receiver = &surfels.pixels[index];
        if receiver.depth <= 0.0 {
            return DVec3::ZERO;
        }
        let width = surfels.size[0];
        let texel = [index as u32 % width, index as u32 / width];
        let random = spread2(texel, self.frame, self.stream, self.seed);
        let extent = surfels.display_size.map(|v| v as f32 / self.scale);
        let centre = texel.map(|v| v as f32 + 0.5);
        let step = (self.outer_square - self.inner_square) / self.samples as f32;
        let mut square = self.inner_square + step * random[0];
        let angle = std::f32::consts::TAU * random[1];
        let mut direction = [angle.cos(), angle.sin()];
        let mut sum = DVec3::ZERO;
        for _ in 0..self.samples {
            let radius = square.sqrt();
            let point: [f32; 2] = std::array::from_fn(|axis| centre[axis] + radius * direction[axis]);
            square += step;
            let [x, y] = direction;
            direction = [x * TURN[0] - y * TURN[1], x * TURN[1] + y * TURN[0]];
            // Nothing is gathered from outside of the screen.
            if (0..2).any(|axis| point[axis] <= 0.0 || point[axis] >= extent[axis]) {
                continue;
            }
            let source = &surfels.pixels[(point[1] as u32 * width + point[0] as u32) as usize];
            if source.depth > 0.0 {
                sum += source.radiance * surfels.form_factor(receiver, source, self.disc_area, self.point_to_disc);
            }
        }
        sum * self.discs
    }
}

/// `spread2` of common/math.wgsl, for independent frames.
fn spread2(pixel: [u32; 2], frame: u32, stream: u32, seed: u32) -> [f32; 2] {
    let start = random3([0, 0], frame, stream, seed);
    let [x, y] = pixel.map(|v| v as f32);
    let number = |a: f32, b: f32, start: f32| (start + (a * x + b * y)).fract();
    [number(0.754_877_7, 0.569_840_3, start[0]), number(0.569_840_3, 0.245_122_33, start[1])]
}

/// `random3` of common/math.wgsl.
fn random3(pixel: [u32; 2], frame: u32, stream: u32, seed: u32) -> [f32; 3] {
    let words = pcg3d([pixel[0] | pixel[1] << 16, frame, stream ^ seed.wrapping_mul(0x9E37_79B9)]);
    words.map(|word| (word >> 8) as f32 * 5.960_464_5e-8)
}

/// `pcg3d` of common/math.wgsl (Jarzynski & Olano 2020).
fn pcg3d(value: [u32; 3]) -> [u32; 3] {
    let mut v = value.map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mix = |v: &mut [u32; 3]| {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[2]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
    };
    mix(&mut v);
    v = v.map(|v| v ^ v >> 16);
    mix(&mut v);
    v
}
