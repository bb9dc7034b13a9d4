//! The viewer in a desktop window: `halflight [STATE]`, where STATE is the part of a link after the #.

use std::{
    env,
    process::ExitCode,
    sync::{Arc, Mutex, PoisonError},
};

use eframe::egui::{self, ViewportBuilder, ViewportCommand};
use halflight_native::files::write_new;
use halflight_output::{PrintError, terminal};
use halflight_viewer::{Host, Viewer, configuration};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

const HELP: &str = "\
The Halflight viewer in a desktop window.

Usage: halflight [STATE]

  STATE  What to show: the part of a link after the #, for example \"scene=atrium&size=1280x720\"
";

/// Number of lost devices after which the window is no longer reopened.
const MOST_LOSSES: u32 = 3;

/// The window around the viewer.
struct Window {
    /// The current state, to reopen the window with it after a lost device.
    address: Arc<Mutex<String>>,
}

impl Host for Window {
    fn show_address(&mut self, state: &str) {
        state.clone_into(&mut self.address.lock().unwrap_or_else(PoisonError::into_inner));
    }

    fn link(&self, state: &str) -> String {
        format!("halflight \"{state}\"")
    }

    fn save(&mut self, name: &str, contents: &[u8]) -> String {
        let folder = env::current_dir().unwrap_or_default();
        match write_new(&folder, name, contents) {
            Ok(name) => format!("{name} is saved in {}", folder.display()),
            Err(error) => {
                format!("{name} cannot be written to {} ({error}); start halflight in another folder", folder.display())
            }
        }
    }

    fn save_picture(&mut self, name: &str, width: u32, pixels: &[u8]) -> String {
        match png(width, pixels) {
            Ok(file) => self.save(name, &file),
            Err(error) => format!("{name} was not saved: {error}"),
        }
    }

    fn reads_disk(&self) -> bool {
        true
    }
}

/// A PNG file of these pixels.
fn png(width: u32, pixels: &[u8]) -> Result<Vec<u8>, image::ImageError> {
    let mut file = Vec::new();
    let height = (pixels.len() / 4) as u32 / width.max(1);
    PngEncoder::new(&mut file).write_image(pixels, width, height, ExtendedColorType::Rgba8)?;
    Ok(file)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let address = match arguments.as_slice() {
        [flag] if ["-h", "--help"].contains(&flag.as_str()) => {
            return match terminal::print(HELP) {
                Ok(()) | Err(PrintError::Closed) => ExitCode::SUCCESS,
                Err(error) => {
                    terminal::note(format_args!("error: {error}"));
                    ExitCode::from(error.exit_code())
                }
            };
        }
        [] => String::new(),
        [state] => state.trim_start_matches('#').to_owned(),
        [_, extra, ..] => {
            terminal::note(format_args!(
                "error: unexpected argument {extra}: give one state, in quotes because it contains &"
            ));
            return ExitCode::from(2);
        }
    };
    let address = Arc::new(Mutex::new(address));
    for _ in 0..=MOST_LOSSES {
        match open(&address) {
            Ok(true) => terminal::note("the graphics device was lost; reopening the window"),
            Ok(false) => return ExitCode::SUCCESS,
            Err(error) => {
                terminal::note(format_args!(
                    "error: {error}: check that there is a display and a Vulkan, Metal or DirectX 12 driver"
                ));
                return ExitCode::FAILURE;
            }
        }
    }
    terminal::note("error: the graphics device was lost several times: use a smaller size or fewer samples");
    ExitCode::FAILURE
}

/// Opens the window and returns when it is closed: true if the device was lost.
fn open(address: &Arc<Mutex<String>>) -> eframe::Result<bool> {
    let viewport =
        ViewportBuilder::default().with_title("Halflight").with_inner_size([1280.0, 760.0]).with_drag_and_drop(true);
    let options = eframe::NativeOptions { viewport, wgpu_options: configuration(), ..Default::default() };
    let lost = Arc::new(Mutex::new(false));
    let (set_lost, address) = (lost.clone(), address.clone());
    eframe::run_native(
        "halflight",
        options,
        Box::new(move |context| {
            let start = address.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let ctx: egui::Context = context.egui_ctx.clone();
            let viewer = Viewer::new(context, Box::new(Window { address }), &start, move |reason| {
                terminal::note(reason);
                *set_lost.lock().unwrap_or_else(PoisonError::into_inner) = true;
                ctx.send_viewport_cmd(ViewportCommand::Close);
            })?;
            Ok(Box::new(viewer))
        }),
    )?;
    let lost = *lost.lock().unwrap_or_else(PoisonError::into_inner);
    Ok(lost)
}
