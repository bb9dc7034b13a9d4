//! `evaluator render`.

use std::path::PathBuf;

use clap::Args;
use halflight_native::{
    images::{Precision, auto_exposure, write_png},
    scene_hash::scene_hash,
};
use halflight_output::terminal;
use halflight_renderer::parameters::Settings;
use halflight_renderer::truth::{Request as TruthRequest, Stop};
use halflight_techniques::invocation::{Invocation, parse_size};

use super::{SceneArgs, TechniqueArgs, is_exr, print_warnings};
use crate::{
    Error,
    experiment::{
        COMMIT, check_textures,
        grid::MOST_FRAMES,
        moving::Moving,
        reference,
        session::{Request, Session, open_adapter, open_scene_keeping},
    },
    format,
};

#[derive(Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Image size, pixels.
    #[arg(long, default_value = "1280x720", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// Where to write: .exr holds every channel, .png the tone-mapped image.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Layer that a PNG shows: final, direct, indirect, albedo.
    #[arg(long, default_value = "final")]
    layer: String,
    /// Exposure of a PNG [default: found from the image]
    #[arg(long)]
    exposure: Option<f32>,
    /// Hold a scene that moves as it is at this frame, in all frames.
    #[arg(long, value_name = "FRAME")]
    pose: Option<u32>,
    /// Direct light that the technique reads: rendered (shadow maps) or truth (path-traced).
    #[arg(long, value_name = "SOURCE", default_value = "rendered", value_parser = ["rendered", "truth"])]
    direct: String,
    /// Adapter: any, gpu, software, part of a name, or its number in `evaluator list adapters`.
    #[arg(long, default_value = "any")]
    adapter: String,
    /// Seed of every random number.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Number of the frame to show: animation is at this frame, and a temporal filter has seen up to 256 frames before it.
    #[arg(long, default_value_t = 0)]
    frame: u32,
    /// What moves before the frame that is shown, in a scene that is held: nothing, the camera, which arrives in that frame, or
    /// the lights, which turn 120 frames before frames are counted.
    #[arg(long, value_enum, default_value_t)]
    moving: Moving,
    /// Check every texture for NaN and infinity, and fail where there is one.
    #[arg(long)]
    check: bool,
}

/// Frames before the last that a temporal filter sees. After as many, an old image weighs less than 1/256 for every
/// `temporal_a` up to 0.978. A filter with a larger one averages over these frames.
const FILTERED: u32 = 256;

impl RenderArgs {
    /// The command that renders the same image, with the settings of a preset written out.
    fn invocation(&self, technique: &str, settings: &Settings) -> Invocation {
        Invocation::render(self.scene.scene.display(), technique, settings, self.size)
            .option("seed", self.seed)
            .option_unless("frame", self.frame, 0)
            .option_unless("moving", self.moving.to_string(), Moving::Nothing.to_string())
            .option_if("pose", self.pose)
            .option_unless("direct", self.direct.as_str(), "rendered")
            .option_unless("layer", self.layer.as_str(), "final")
            .option_if("exposure", self.exposure)
            .option_unless("adapter", self.adapter.as_str(), "any")
            .flag("check", self.check)
            .option("out", self.out.display())
    }
}

pub(super) fn render(args: &RenderArgs) -> Result<(), Error> {
    let (technique, settings) = args.technique.resolve()?;
    let exr = is_exr(&args.out)?;
    let scene = open_scene_keeping(&args.scene.scene, &args.out)?;
    print_warnings(&scene.warnings);
    let scene = match args.pose {
        Some(frame) => scene.posed(frame),
        None => scene,
    };
    if args.moving != Moving::Nothing && !scene.moves.is_empty() {
        return Err(Error::BadInput(format!(
            "--moving {} moves a static scene, and {} is animated: hold it with --pose FRAME",
            args.moving, scene.name
        )));
    }
    if args.moving != Moving::Nothing && args.frame >= MOST_FRAMES {
        return Err(Error::BadInput(format!(
            "--frame {} is too far for --moving {}, which runs all frames before: give 0 to {}",
            args.frame,
            args.moving,
            MOST_FRAMES - 1
        )));
    }
    let (scene, before) = args.moving.apply(scene, args.frame.saturating_add(1));
    let last = before.saturating_add(args.frame);
    let native = open_adapter(&args.adapter)?;
    let session = Session::new(&native, &scene);
    let session = if args.check { session.keep_all() } else { session };
    let traced = match args.direct.as_str() {
        "truth" => {
            if !scene.moves.is_empty() {
                return Err(Error::BadInput(
                    "--direct truth is the light of one frame: hold the scene with --pose FRAME without --moving, or \
                     leave --direct out"
                        .into(),
                ));
            }
            Some(reference::trace(&native, &scene, &TruthRequest::new(scene.camera, args.size), Stop::default())?.truth)
        }
        _ => None,
    };
    let direct = traced.as_ref().map(|reference| reference.direct.as_slice());
    let command = args.invocation(technique.name, &settings).to_string();
    let settings_line = format::settings(&settings);
    let mut frames = session.frames(&Request { technique, settings, size: args.size, seed: args.seed, direct })?;
    frames.plan().notes.iter().for_each(|note| terminal::note(format_args!("note: {note}")));
    // The first frame also compiles the pipelines; the last one is the one whose times count.
    frames.run(0)?;
    // Only a filter over frames needs those before the last.
    let first = match (frames.plan().has_history(), args.moving) {
        (false, _) => last,
        (true, Moving::Nothing) => last.saturating_sub(FILTERED),
        (true, _) => 0,
    };
    if first > 0 && first < last {
        terminal::note(format_args!(
            "note: the temporal filter has seen the {FILTERED} frames before frame {}, not all of them",
            args.frame
        ));
    }
    let mut time = frames.run(first)?;
    for frame in first..last {
        time = frames.run(frame + 1)?;
    }
    let mut lines: String =
        time.passes.iter().map(|pass| format!("{:<16} {:>9.3} ms\n", pass.name, pass.milliseconds)).collect();
    lines += &format!("{:<16} {:>9.3} ms (wall), {}\n", "frame", time.wall_milliseconds, native.info.name);
    if args.check {
        check_textures(&[&frames])?;
        lines += "no NaN and no infinity in any texture\n";
    }
    let mut image = frames.image()?;
    if exr {
        let facts = [
            ("command", command),
            ("scene", scene.name.clone()),
            ("scene_hash", scene_hash(&scene).to_string()),
            ("technique", technique.name.to_owned()),
            ("settings", settings_line),
            ("camera", format!("{:?}", scene.pose(last).camera)),
            ("frame", args.frame.to_string()),
            ("seed", args.seed.to_string()),
            ("adapter", native.info.name.clone()),
            ("commit", COMMIT.to_owned()),
            ("warnings", scene.warnings.iter().chain(&frames.plan().notes).cloned().collect::<Vec<_>>().join("; ")),
        ];
        image.metadata.extend(facts.map(|(key, value)| (key.to_owned(), value)));
        image.write_exr(&args.out, Precision::Full)?;
    } else {
        let layer = if args.layer == "final" { "" } else { &args.layer };
        let pixels = image.rgb(layer).ok_or_else(|| {
            Error::BadInput(format!(
                "--layer {} is no layer of this image: choose final, direct, indirect or albedo",
                args.layer
            ))
        })?;
        let exposure = args.exposure.unwrap_or_else(|| auto_exposure(&pixels, image.surface_mask().as_deref()));
        write_png(&args.out, args.size[0], &pixels, exposure)?;
    }
    // Printed last: a reader that goes away costs no image.
    Ok(terminal::print(lines)?)
}
