//! Reads and prepares a scene, on another thread or in a browser's worker.

use halflight_renderer::scene::{BvhContents, BvhError, Piece, SceneContents, Sight};
use halflight_scenes::{Mesh, Scene, SceneNeeds, Texture};
use serde::{Deserialize, Serialize};

use super::Source;

/// A part of a scene on its way to the viewer. Parts are small enough to be unpacked between two frames.
#[derive(Serialize, Deserialize)]
pub enum Part {
    /// What was read: the scene, if there is one, without its meshes and textures, which follow.
    Read(Option<Box<Scene>>, Found),
    /// The next mesh.
    Mesh(Mesh),
    /// The next texture.
    Texture(Texture),
    /// What the scene needs, and the sizes of its buffers. Their contents follow.
    Prepared(Box<Prepared>),
    /// Contents of a buffer of the scene, or of its BVH.
    Piece(Piece),
    /// All contents of the buffers were sent, and with the triangles of the scene for rays of cameras it can be drawn.
    Drawable(Box<Sight>),
    /// The sizes of the BVH, whose contents follow, or why there is none.
    Bvh(Box<Result<BvhContents, BvhError>>),
    /// There is nothing more.
    End,
    /// Why the source cannot be read.
    Failed(String),
}

/// What was read beside a scene.
#[derive(Serialize, Deserialize)]
pub struct Found {
    /// Presets by their names, as TOML.
    pub presets: Vec<(String, String)>,
    /// What was not used, a sentence each.
    pub warnings: Vec<String>,
    /// Whether its environment map lights another source.
    pub is_lit: bool,
}

/// What takes long to find out about a scene.
#[derive(Serialize, Deserialize)]
pub struct Prepared {
    pub needs: SceneNeeds,
    pub contents: SceneContents,
}

/// Reads a source and prepares its scene. `deliver` takes the parts in their order, and returns false where nobody wants them
/// any more.
pub fn prepare(source: Source, mut deliver: impl FnMut(Part) -> bool) {
    // The last part needs nobody.
    let _ = prepare_parts(source, &mut deliver);
}

/// `None` if nobody wants the parts any more.
fn prepare_parts(source: Source, deliver: &mut dyn FnMut(Part) -> bool) -> Option<()> {
    let mut send = |part| deliver(part).then_some(());
    let opened = match source.read() {
        Ok(opened) => opened,
        Err(error) => return send(Part::Failed(error.to_string())),
    };
    let presets = opened.presets.into_iter().map(|(name, preset)| (name, preset.to_toml())).collect();
    let found = Found { presets, warnings: opened.warnings, is_lit: opened.is_lit };
    let Some(scene) = opened.scene else {
        send(Part::Read(None, found))?;
        return send(Part::End);
    };
    let small = Scene {
        name: scene.name.clone(),
        models: scene.models.clone(),
        materials: scene.materials.clone(),
        lights: scene.lights.clone(),
        camera: scene.camera,
        extra_cameras: scene.extra_cameras.clone(),
        environment: scene.environment.clone(),
        origin: scene.origin,
        moves: scene.moves.clone(),
        meshes: Vec::new(),
        textures: Vec::new(),
        warnings: Vec::new(),
    };
    send(Part::Read(Some(Box::new(small)), found))?;
    scene.meshes.iter().try_for_each(|mesh| send(Part::Mesh(mesh.clone())))?;
    scene.textures.iter().try_for_each(|texture| send(Part::Texture(texture.clone())))?;
    let (contents, pieces) = SceneContents::of(&scene);
    send(Part::Prepared(Box::new(Prepared { needs: SceneNeeds::of(&scene), contents })))?;
    pieces.iter().try_for_each(|piece| send(Part::Piece(piece)))?;
    drop(pieces);
    send(Part::Drawable(Box::new(Sight::new(&scene))))?;
    match BvhContents::of(&scene) {
        Ok((bvh, pieces)) => {
            send(Part::Bvh(Box::new(Ok(bvh))))?;
            pieces.iter().try_for_each(|piece| send(Part::Piece(piece)))?;
        }
        Err(error) => send(Part::Bvh(Box::new(Err(error))))?,
    }
    send(Part::End)
}
