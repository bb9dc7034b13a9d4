//! Path-traced truth: the same scene, camera, lights and materials as the frame, with a standard error for each output.
//!
//! A [`Tracer`] holds a scene's BVH on a device. A [`Request`] starts a [`Trace`], which is advanced in short batches
//! ([`Trace::submit`], told by [`Trace::pace`] how long the last one took, so that no watchdog steps in), read without
//! blocking ([`Trace::read`]) and ends at a relative error or a number of samples. What it read is a [`State`]: it
//! turns into a [`Truth`], and it restarts the trace later where it stopped.
//!
//! Surfaces are two-sided Lambert reflectors with interpolated shading normals, turned towards the incoming ray; parts
//! of cut-outs with an alpha under 0.5 are absent; delta lights are sampled by next-event estimation, all of them at
//! each vertex; emission counts wherever a path meets it, on both sides. Paths whose weight is under 0.1 are ended at
//! random and their survivors weighted up (Russian roulette: unbiased). Rays that leave the scene see its environment:
//! it counts as light of the bounce that saw it, and as seen on the screen; the sky is part of `direct`. Materials that
//! are `receive_only` show what they receive and send nothing to other surfaces. Mirror lobes (Ks, Ns) count in `glossy`
//! alone, at the surface that the eye sees.

use halflight_shared_shaders::truth::path_trace;

mod bvh;
mod request;
mod state;
mod trace;
mod tracer;

pub use request::{Request, Stop};
pub use state::{Estimate, State, Truth};
pub use trace::{Progress, Reading, Trace};
pub use tracer::Tracer;

/// Why no truth can be had: one sentence with the mend.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct TruthError(pub String);

/// The linked shader, for the hash of a trace's inputs.
pub fn shader_source() -> &'static str {
    path_trace::Features::default().shader().source
}
