//! The view-space voxel grid and its rays in float64 on the CPU. Every column on the way is clipped separately, where the
//! shader steps from one to the next.

use halflight_evaluator::experiment::session::Frames;

use super::{GBuffer, Pixel};

/// Slices of a column.
const SLICES: f64 = 128.0;

/// The grid of one level.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Width of a texel, full-resolution pixels.
    pub scale: u32,
    /// 128 slices a column, slice 0 lowest.
    pub columns: Vec<u128>,
    /// Depth where slice 0 begins, scene units.
    pub begin: f64,
    /// Slices in one octave of depth.
    pub per_octave: f64,
}

impl Grid {
    /// The finest grid, as the raster passes wrote it.
    ///
    /// # Panics
    /// Where the plan has no voxels.
    pub fn read(frames: &Frames, scale: u32) -> Self {
        let read = |name| frames.read_buffer(name).expect("the buffer is read").expect("the plan has voxels");
        let (columns, range) = (read("columns"), read("depth_range"));
        let words: &[[u32; 4]] = bytemuck::cast_slice(&columns);
        let range: &[u32] = bytemuck::cast_slice(&range);
        let (begin, end) = (f64::from(f32::from_bits(!range[0])), f64::from(f32::from_bits(range[1])));
        let column = |words: &[u32; 4]| words.iter().rev().fold(0, |column, &word| column << 32 | u128::from(word));
        Self {
            size: frames.view().display_size.map(|v| v.div_ceil(scale)),
            scale,
            columns: words.iter().map(column).collect(),
            begin,
            // As slices_of_range of common/voxels.wgsl.
            per_octave: SLICES * 0.9999 / (end.log2() - begin.log2()).max(2e-3),
        }
    }

    /// The next coarser grid: OR of the children, or AND.
    pub fn coarser(&self, any: bool) -> Self {
        let size = self.size.map(|v| v.div_ceil(2));
        let child = |x: u32, y: u32| {
            let [x, y] = [x.min(self.size[0] - 1), y.min(self.size[1] - 1)];
            self.columns[(y * self.size[0] + x) as usize]
        };
        let columns = (0..size[0] * size[1]).map(|i| {
            let (x, y) = (2 * (i % size[0]), 2 * (i / size[0]));
            let children = [child(x, y), child(x + 1, y), child(x, y + 1), child(x + 1, y + 1)];
            children.into_iter().reduce(|a, b| if any { a | b } else { a & b }).unwrap_or(0)
        });
        Self { size, scale: 2 * self.scale, columns: columns.collect(), ..self.clone() }
    }

    /// Fraction of the voxels that are set.
    pub fn filled(&self) -> f64 {
        self.columns.iter().map(|c| f64::from(c.count_ones())).sum::<f64>() / (SLICES * self.columns.len() as f64)
    }

    /// Whether the grid occludes `source` from `receiver`, with every voxel border moved outwards by `slack` (texels, slices).
    /// Where the answers for a small slack and its negative differ, rounding may decide.
    pub fn hides(&self, surfels: &GBuffer, receiver: &Pixel, source: &Pixel, slack: f64) -> bool {
        let texel_of = |pixel: &Pixel| -> [f64; 2] {
            let sign = [1.0, -1.0];
            std::array::from_fn(|axis| {
                let ndc = sign[axis] * pixel.position[axis] / pixel.depth / surfels.tan_half_fov[axis];
                (ndc + 1.0) / 2.0 * f64::from(surfels.display_size[axis]) / f64::from(self.scale)
            })
        };
        let (from, to) = (texel_of(receiver), texel_of(source));
        let toward = source.position - receiver.position;
        // A voxel is as wide as a texel at its depth and as deep as a slice along the view ray. From this fraction of the ray
        // on, the ray is higher above the end's plane than a voxel is wide, so that no voxel contains points of both.
        let clear = |end: &Pixel, other: &Pixel, height: f64| {
            let column = |axis: usize| {
                2.0 * f64::from(self.scale) * surfels.tan_half_fov[axis] / f64::from(surfels.display_size[axis])
            };
            let slant = |pixel: &Pixel| end.normal.dot(pixel.position / pixel.depth).abs();
            let slice = (1.0 / self.per_octave).exp2() - 1.0;
            let width =
                end.normal.x.abs() * column(0) + end.normal.y.abs() * column(1) + slant(end).max(slant(other)) * slice;
            let gain = height - width * (other.depth - end.depth);
            if gain > 0.0 { width * end.depth / gain } else { 2.0 }
        };
        let fractions = [
            clear(receiver, source, receiver.normal.dot(toward)),
            1.0 - clear(source, receiver, -source.normal.dot(toward)),
        ];
        let inverse = |position: f64| 1.0 / receiver.depth + position * (1.0 / source.depth - 1.0 / receiver.depth);
        let positions = fractions.map(|t| t * source.depth / (receiver.depth + t * (source.depth - receiver.depth)));
        let slice = |position: f64| -(inverse(position) * self.begin).log2() * self.per_octave;
        let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-9);
        let (begin, end) = (positions[0] - slack / length, positions[1] + slack / length);
        let span = |axis: usize, positions: [f64; 2]| {
            let [a, b] = positions.map(|s| from[axis] + s * (to[axis] - from[axis]));
            let largest = f64::from(self.size[axis] - 1);
            [a.min(b) - 1.0, a.max(b) + 1.0].map(|v| v.floor().clamp(0.0, largest) as u32)
        };
        if fractions[0] >= fractions[1] && slack <= 0.0 || begin >= end {
            return false;
        }
        let [columns, rows] = [span(0, [begin, end]), span(1, [begin, end])];
        for y in rows[0]..=rows[1] {
            for x in columns[0]..=columns[1] {
                // The part of the ray inside the column.
                let (mut enter, mut exit) = (begin, end);
                for (axis, low) in [f64::from(x), f64::from(y)].into_iter().enumerate() {
                    let (low, high) = (low - slack, low + 1.0 + slack);
                    let way = to[axis] - from[axis];
                    if way.abs() < 1e-12 {
                        if from[axis] < low || from[axis] > high {
                            exit = enter;
                        }
                        continue;
                    }
                    let [a, b] = [low, high].map(|border| (border - from[axis]) / way);
                    enter = enter.max(a.min(b));
                    exit = exit.min(a.max(b));
                }
                if enter >= exit {
                    continue;
                }
                let [a, b] = [enter, exit].map(slice);
                let [first, last] =
                    [a.min(b) - slack, a.max(b) + slack].map(|v| v.clamp(0.0, SLICES - 1.0).floor() as u32);
                let mask = (u128::MAX << first) & (u128::MAX >> (127 - last));
                if first <= last && self.columns[(y * self.size[0] + x) as usize] & mask != 0 {
                    return true;
                }
            }
        }
        false
    }
}
