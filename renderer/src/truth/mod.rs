//! Path-traced reference: the same scene, camera, lights and materials as the frame, with a standard error for each
//! output.
//!
//! A [`Tracer`] holds a scene's BVH on a device. A [`Request`] starts a [`Trace`]. The trace advances in short batches
//! ([`Trace::submit`]); [`Trace::pace`] receives the time of the last batch, so that no watchdog interrupts. It is read
//! without blocking ([`Trace::read`]) and ends at a relative error or a number of samples. What it reads is a
//! [`State`], which converts to a [`Truth`] and can restart the trace later.
//!
//! Surfaces are two-sided Lambert reflectors. Their interpolated shading normals face the incoming ray. Alpha-masked
//! parts with an alpha below 0.5 are absent. At each vertex all delta lights are sampled, and one point on an emitter or,
//! if it is uneven, on the sky (next-event estimation). The ray that continues the path may find the same light; the
//! balance heuristic weights both (Veach 1997, Section 9.2.2). Emitters send light from both sides.
//! Paths of a weight below 0.1 end by Russian roulette, which is unbiased.
//! Rays that leave the scene see the environment: it counts as light of that bounce, and as seen on the screen. The sky
//! is part of `direct`. `receive_only` materials receive light and send none to other surfaces. Mirror lobes (Ks, Ns)
//! count in `glossy` only, at the surface that the eye sees.

use halflight_shared_shaders::truth::path_trace;

mod exact;
mod request;
mod state;
mod sums;
mod trace;
mod tracer;

pub use request::{Request, Stop};
pub use state::{Estimate, FEWEST_FINDINGS, State, Truth};
pub use sums::{PART, Sums};
pub use trace::{Progress, Reading, Trace};
pub use tracer::{Tracer, is_lit};

/// Why a reference cannot be traced: one sentence with the fix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct TruthError(pub String);

impl From<crate::scene::BvhError> for TruthError {
    fn from(error: crate::scene::BvhError) -> Self {
        Self(error.to_string())
    }
}

/// The shader, for the hash of a trace's inputs.
pub fn shader_source() -> &'static str {
    path_trace::Features::default().shader().source
}
