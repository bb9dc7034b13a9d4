//! A scene on a device: buffers, shadow views, animation, and the facts that plans need.

mod bounds;
mod buffers;
mod bvh;
mod casters;
mod contents;
pub(crate) mod contrast;
mod emitters;
mod environment;
mod facts;
mod focus;
mod motion;
mod numbered_triangles;
pub(crate) mod shadow;
mod shadow_atlas;
mod shadow_views;
mod size;
pub(crate) mod texel_pool;

pub(crate) use buffers::{BVH_ATTRIBUTES, BVH_EMITTERS, BVH_NODES, BVH_TRIANGLES};
pub use buffers::{SceneBuffers, SceneContents, traces_rays, triangles};
pub use bvh::{BvhContents, BvhError, SceneBvh};
pub use contents::{Piece, Pieces};
pub use emitters::EmittingTriangle;
pub use facts::SceneFacts;
pub use focus::{Extent, Sight};
pub use motion::{LIGHTS, OBJECTS, SceneMotion};
pub use shadow::ShadowLayer;
pub use shadow_atlas::ShadowAtlas;
pub use shadow_views::{far_shadow_view, light_of, light_projections, shadow_entries, shadow_view};
pub use size::SceneSize;

use halflight_frame_graph::View;
use halflight_scenes::Camera;

/// The first frame of a camera. `near` is in scene units.
pub fn camera_view(camera: &Camera, display_size: [u32; 2], near: f32) -> View {
    let [width, height] = display_size;
    View::new(camera.view_matrix(), camera.tan_half_fov(width, height), display_size, near)
}
