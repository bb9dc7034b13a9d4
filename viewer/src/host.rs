//! What surrounds the application: a page or a window, and the device that it opens.

use std::{any::Any, sync::Arc};

use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use halflight_frame_graph::Gpu;

use crate::loading::{Delivery, Source, prepare};

/// What a page or a window does for the application.
pub trait Host {
    /// Shows the state where a user can copy it as a link.
    fn show_address(&mut self, state: &str);
    /// The link that opens this state.
    fn link(&self, state: &str) -> String;
    /// Saves a file for the user. Returns a sentence that says where the file is, or why it could not be saved.
    fn save(&mut self, name: &str, contents: &[u8]) -> String;
    /// Saves a picture as a PNG file: four bytes of sRGB and alpha for each pixel, rows from top to bottom, `width` pixels
    /// wide. Returns a sentence as [`Host::save`] does.
    fn save_picture(&mut self, name: &str, width: u32, pixels: &[u8]) -> String;
    /// Shows the application on the full screen, or ends that. False if the window does it.
    fn toggle_fullscreen(&mut self) -> bool {
        false
    }
    /// What the host knows about the adapter. Used if wgpu reports no name.
    fn adapter(&self) -> Option<String> {
        None
    }
    /// Called once, after the first picture was drawn.
    fn first_picture(&mut self) {}
    /// Whether it shows something else until the first picture, or the first message.
    fn covers_until_first_picture(&self) -> bool {
        false
    }
    /// Whether it can ask the user for files.
    fn can_choose_files(&self) -> bool {
        false
    }
    /// Asks the user for files, and opens them with [`Viewer::open`](crate::Viewer::open) later.
    fn choose_files(&mut self) {}
    /// Reads a source and prepares its scene with [`prepare`]. The work stops when what is returned is
    /// dropped. By default another thread does it; browsers have none, so that a page has to do it elsewhere or blocks.
    fn load(&mut self, source: &Source, delivery: Delivery) -> Box<dyn Any> {
        let source = source.clone();
        let work = move || prepare(source, |part| delivery.part(part));
        #[cfg(not(target_arch = "wasm32"))]
        std::thread::spawn(work);
        #[cfg(target_arch = "wasm32")]
        work();
        // The thread stops at the next part that nobody takes.
        Box::new(())
    }
    /// Whether files on disk can be read by their path.
    fn reads_disk(&self) -> bool {
        false
    }
}

/// How the application's device is opened: with the features and limits that the renderer uses.
pub fn configuration() -> WgpuConfiguration {
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    setup.instance_descriptor.backends = wgpu::Backends::from_env().unwrap_or(wgpu::Backends::PRIMARY);
    setup.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
        label: Some("halflight"),
        required_features: adapter.features() & Gpu::WANTED_FEATURES,
        required_limits: Gpu::wanted_limits(&adapter.limits()),
        ..Default::default()
    });
    WgpuConfiguration { wgpu_setup: WgpuSetup::CreateNew(setup), ..Default::default() }
}
