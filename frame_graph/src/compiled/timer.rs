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
    /// As many sets as the passes need: a set has a largest size.
    queries: Vec<wgpu::QuerySet>,
    resolved: wgpu::Buffer,
    pub(super) readable: wgpu::Buffer,
    nanoseconds: f32,
}

/// Passes of one query set.
const PASSES_OF_A_SET: usize = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;

impl Timer {
    /// Timer for this many passes; `None` if the device has no timestamps.
    pub(super) fn new(gpu: &Gpu, passes: usize) -> Option<Self> {
        let nanoseconds = gpu.timestamp_period?;
        if passes == 0 {
            return None;
        }
        let buffer = |label, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: passes as u64 * 16,
                usage,
                mapped_at_creation: false,
            })
        };
        Some(Self {
            queries: (0..passes)
                .step_by(PASSES_OF_A_SET)
                .map(|first| {
                    gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                        label: Some("pass times"),
                        ty: wgpu::QueryType::Timestamp,
                        count: 2 * (passes - first).min(PASSES_OF_A_SET) as u32,
                    })
                })
                .collect(),
            resolved: buffer("timestamps", wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            readable: buffer("timestamps to read", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            nanoseconds,
        })
    }

    /// The query set of a pass, and its first query in it.
    pub(super) fn queries_of(&self, pass: usize) -> (&wgpu::QuerySet, u32) {
        (&self.queries[pass / PASSES_OF_A_SET], 2 * (pass % PASSES_OF_A_SET) as u32)
    }

    /// Copies all times to `readable`.
    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        let passes = self.resolved.size() as usize / 16;
        for (index, queries) in self.queries.iter().enumerate() {
            let first = index * PASSES_OF_A_SET;
            let count = 2 * (passes - first).min(PASSES_OF_A_SET) as u32;
            encoder.resolve_query_set(queries, 0..count, &self.resolved, first as u64 * 16);
        }
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, self.resolved.size());
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
