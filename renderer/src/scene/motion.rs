//! Updates of an animated scene before each frame.

use std::sync::Arc;

use glam::Mat4;
use halflight_frame_graph::{CompiledGraph, Continuity, Gpu, Handle, View};
use halflight_scenes::Scene;

use super::{
    Extent, SceneFacts,
    buffers::{Object, SceneBuffers, lights},
    bvh::MovingBvh,
    shadow::{far_shadow_layers, shadow_layers},
    shadow_views,
};

/// Where objects are.
pub const OBJECTS: Handle = Handle::only("scene.objects");
/// Direction, position and intensity of the lights.
pub const LIGHTS: Handle = Handle::only("scene.lights");

/// The animated parts of an uploaded scene.
pub struct SceneMotion<'a> {
    scene: &'a Scene,
    extent: Extent,
    objects: Option<wgpu::Buffer>,
    lights: Option<wgpu::Buffer>,
    bvh: Option<Arc<MovingBvh>>,
}

impl<'a> SceneMotion<'a> {
    /// The animated parts of this scene; `None` if nothing is animated. `facts` are those of the plan, for which
    /// [`SceneBuffers::prepare`] was called.
    pub fn new(scene: &'a Scene, buffers: &SceneBuffers, facts: &SceneFacts) -> Option<Self> {
        let moves = &scene.moves;
        (!moves.is_empty()).then(|| Self {
            scene,
            extent: facts.extent,
            objects: buffers.objects.clone(),
            lights: (!moves.lights.is_empty()).then(|| buffers.lights.clone()),
            bvh: buffers.moving_bvh(),
        })
    }

    /// Sets `view` to the scene's camera at `view.frame`, and its continuity: a cut, a change, or nothing changed since
    /// the previous frame.
    pub fn place(&self, view: &mut View) {
        let pose = self.scene.pose(view.frame);
        view.world_to_view = pose.camera.view_matrix();
        let still = view.frame > 0 && pose == self.scene.pose(view.frame - 1);
        view.continuity = match (pose.cut, still) {
            (true, _) => Continuity::Cut,
            (_, true) => Continuity::Static,
            _ => Continuity::Changing,
        };
    }

    /// Writes the matrices of objects and lights and the triangles of objects at `view.frame`, for the graph that records this view next. Returns what
    /// differs from the last frame of that graph.
    ///
    /// The buffer of objects also has their motion since the previous frame. It may differ where no object has moved.
    /// Only passes that depend on the previous frame read it, and these run in every frame.
    pub fn write(&self, gpu: &Gpu, graph: &CompiledGraph, view: &View) -> Vec<Handle> {
        let pose = self.scene.pose(view.frame);
        let last = graph.last_view().map(|last| self.scene.pose(last.frame));
        let mut changed = Vec::new();
        if last.as_ref().is_none_or(|last| last.objects != pose.objects) {
            changed.push(OBJECTS);
        }
        if last.as_ref().is_none_or(|last| last.lights != pose.lights) {
            changed.push(LIGHTS);
        }
        if let Some(buffer) = &self.objects {
            // Without a valid previous frame any pose is correct.
            let before = graph.last_view().filter(|before| view.continues(before)).unwrap_or(*view);
            let then = self.scene.pose(before.frame);
            let still = [Mat4::IDENTITY; 2];
            let pairs = [still].into_iter().chain(pose.objects.iter().zip(&then.objects).map(|(&a, &b)| [a, b]));
            let objects: Vec<Object> = pairs
                .map(|[now, then]| Object { to_world: now, view_to_previous: view.way_back(&before, &now, &then) })
                .collect();
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&objects));
        }
        if let Some(bvh) = &self.bvh {
            bvh.pose(gpu, self.scene, &pose.objects);
        }
        let Some(buffer) = &self.lights else { return changed };
        gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&lights(&pose.lights)));
        let layers = shadow_layers(&pose.lights, &self.extent, self.scene);
        let far = far_shadow_layers(&pose.lights, &self.extent, self.scene);
        graph.write_changed(gpu, |handle| shadow_views::contents(handle, &layers, &far));
        changed
    }
}
