//! Times of the passes of a frame.

use serde::Serialize;

use crate::{
    Gpu,
    plan::{FramePlan, Part},
};

/// Time of one pass in one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassTime {
    /// Name of the pass.
    pub name: String,
    /// Part of the frame.
    pub part: Part,
    /// Milliseconds on the device.
    pub milliseconds: f64,
}

/// Timestamps around every pass of a frame.
pub(super) struct Timer {
    pub(super) queries: wgpu::QuerySet,
    pub(super) resolved: wgpu::Buffer,
    pub(super) readable: wgpu::Buffer,
    nanoseconds: f32,
}

impl Timer {
    /// Timer for this many passes; `None` if the device has no timestamps, or not so many.
    pub(super) fn new(gpu: &Gpu, passes: usize) -> Option<Self> {
        let nanoseconds = gpu.timestamp_period?;
        let count = 2 * u32::try_from(passes).ok().filter(|&n| n > 0 && 2 * n <= wgpu::QUERY_SET_MAX_QUERIES)?;
        let buffer = |label, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: u64::from(count) * 8,
                usage,
                mapped_at_creation: false,
            })
        };
        Some(Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: buffer("timestamps", wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            readable: buffer("timestamps to read", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            nanoseconds,
        })
    }

    /// Times from the bytes of `readable` after a frame of this plan.
    pub(super) fn pass_times(&self, plan: &FramePlan, bytes: &[u8]) -> Vec<PassTime> {
        let ticks: &[[u64; 2]] = bytemuck::cast_slice(bytes);
        plan.passes
            .iter()
            .zip(ticks)
            .map(|(pass, [begin, end])| PassTime {
                name: pass.name.clone(),
                part: pass.part,
                // Without this, a clock that was reset in between would give a huge number.
                milliseconds: end.saturating_sub(*begin) as f64 * f64::from(self.nanoseconds) * 1e-6,
            })
            .collect()
    }
}
