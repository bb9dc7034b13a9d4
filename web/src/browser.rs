//! Functions for the page's script.

use std::{any::Any, cell::RefCell};

use halflight_viewer::{
    Host, Viewer, configuration,
    loading::{Delivery, Part, Source, pack, pack_source, prepare, unpack_source},
};
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// Offers a file for download. Defined by the page.
    #[wasm_bindgen(js_name = halflightSave)]
    fn save(name: &str, contents: &[u8]);
    /// Offers a picture for download as PNG: four bytes a pixel. Defined by the page.
    #[wasm_bindgen(js_name = halflightSavePicture)]
    fn save_picture(name: &str, width: u32, pixels: &[u8]);
    /// Shows the viewer on the full screen, or ends that. Defined by the page.
    #[wasm_bindgen(js_name = halflightFullscreen)]
    fn toggle_fullscreen();
    /// Asks the user for files. Defined by the page.
    #[wasm_bindgen(js_name = halflightChoose)]
    fn choose();
    /// Starts a worker that calls [`load`] with this source. `receive` gets each of its messages, and a text if the worker
    /// fails. Returns a function that stops it. Defined by the page.
    #[wasm_bindgen(js_name = halflightLoad)]
    fn start_worker(source: js_sys::Uint8Array, receive: JsValue) -> js_sys::Function;
    /// Called when the device is lost. Defined by the page.
    #[wasm_bindgen(js_name = halflightLost)]
    fn device_lost(reason: &str);
}

thread_local! {
    static RUNNER: RefCell<Option<eframe::WebRunner>> = const { RefCell::new(None) };
    /// Files that were chosen together, until they are opened.
    static CHOSEN: RefCell<Vec<(String, Vec<u8>)>> = const { RefCell::new(Vec::new()) };
}

/// The page around the viewer.
struct Page;

/// A worker that loads a scene, until this is dropped.
struct Worker {
    stop: js_sys::Function,
}

impl Drop for Worker {
    fn drop(&mut self) {
        // It has nothing to say.
        let _ = self.stop.call0(&JsValue::NULL);
    }
}

impl Host for Page {
    fn show_address(&mut self, state: &str) {
        let Some(window) = web_sys::window() else { return };
        // A fragment is never sent to a server and works under any path of any host.
        if let Ok(history) = window.history() {
            let _ = history.replace_state_with_url(&JsValue::NULL, "", Some(&format!("#{state}")));
        }
    }

    fn link(&self, state: &str) -> String {
        let address = web_sys::window().and_then(|window| window.location().href().ok()).unwrap_or_default();
        let page = address.split('#').next().unwrap_or_default();
        format!("{page}#{state}")
    }

    fn save(&mut self, name: &str, contents: &[u8]) -> String {
        save(name, contents);
        format!("{name} was downloaded")
    }

    fn save_picture(&mut self, name: &str, width: u32, pixels: &[u8]) -> String {
        save_picture(name, width, pixels);
        format!("{name} was downloaded")
    }

    fn toggle_fullscreen(&mut self) -> bool {
        toggle_fullscreen();
        true
    }

    fn adapter(&self) -> Option<String> {
        let window = web_sys::window()?;
        js_sys::Reflect::get(&window, &"halflightAdapter".into()).ok()?.as_string()
    }

    fn can_choose_files(&self) -> bool {
        true
    }

    fn choose_files(&mut self) {
        choose();
    }

    fn covers_until_first_picture(&self) -> bool {
        true
    }

    fn load(&mut self, source: &Source, delivery: Delivery) -> Box<dyn Any> {
        let receive = Closure::<dyn FnMut(JsValue)>::new(move |message: JsValue| match message.dyn_into() {
            Ok(bytes) => {
                delivery.packed(&js_sys::Uint8Array::to_vec(&bytes));
            }
            Err(text) => delivery.failed(text.as_string().unwrap_or_default()),
        });
        let source = js_sys::Uint8Array::from(pack_source(source).as_slice());
        Box::new(Worker { stop: start_worker(source, receive.into_js_value()) })
    }

    fn first_picture(&mut self) {
        let Some(window) = web_sys::window() else { return };
        let now = window.performance().map_or(f64::NAN, |performance| performance.now());
        let _ = js_sys::Reflect::set(&window, &"halflightFirstPicture".into(), &now.into());
    }
}

/// Opens the viewer on a canvas with the state of this address. An open viewer is closed first.
///
/// # Errors
/// The browser's message if there is no device.
#[wasm_bindgen]
pub async fn start(canvas: web_sys::HtmlCanvasElement, address: String) -> Result<(), JsValue> {
    if let Some(old) = RUNNER.take() {
        old.destroy();
    }
    let runner = eframe::WebRunner::new();
    // Dithering hides steps in smooth gradients, of which the interface has none.
    let options = eframe::WebOptions { wgpu_options: configuration(), dithering: false, ..Default::default() };
    let create = Box::new(move |context: &eframe::CreationContext<'_>| {
        let viewer = Viewer::new(context, Box::new(Page), &address, |reason| device_lost(&reason))?;
        Ok(Box::new(viewer) as Box<dyn eframe::App>)
    });
    runner.start(canvas, options, create).await?;
    RUNNER.set(Some(runner));
    Ok(())
}

/// Calls a function with the open viewer; `None` if it is closed or has panicked.
fn with<T>(call: impl FnOnce(&mut Viewer) -> T) -> Option<T> {
    let runner = RUNNER.with_borrow(Clone::clone)?;
    let mut viewer = runner.app_mut::<Viewer>()?;
    Some(call(&mut viewer))
}

/// The state of the open viewer as JSON; empty if it is closed.
#[wasm_bindgen]
pub fn report() -> String {
    with(|viewer| viewer.report_json()).unwrap_or_default()
}

/// Opens the state of a link.
#[wasm_bindgen]
pub fn go_to(address: &str) {
    with(|viewer| viewer.go_to(address));
}

/// Searches the best settings for this time of the technique, milliseconds, as the button does.
#[wasm_bindgen]
pub fn best_for(milliseconds: f64) {
    with(|viewer| viewer.best_for(milliseconds));
}

/// Reads a source and prepares its scene, in a worker. `send` gets the parts as bytes.
#[wasm_bindgen]
pub fn load(source: &[u8], send: &js_sys::Function) {
    let send = |bytes: Vec<u8>| send.call1(&JsValue::NULL, &js_sys::Uint8Array::from(bytes.as_slice())).is_ok();
    match unpack_source(source) {
        Ok(source) => prepare(source, |part| send(pack(&part))),
        Err(sentence) => {
            send(pack(&Part::Failed(sentence)));
        }
    }
}

/// Adds a file to those that [`open_files`] opens.
#[wasm_bindgen]
pub fn add_file(name: String, bytes: Vec<u8>) {
    CHOSEN.with_borrow_mut(|files| files.push((name, bytes)));
}

/// Opens the added files as if they had been dropped together.
#[wasm_bindgen]
pub fn open_files() {
    let files = CHOSEN.take();
    with(|viewer| viewer.open(files));
}

/// An output of side A, for example `indirect`: four numbers per pixel, rows from top to bottom; empty if there is no
/// such output.
#[wasm_bindgen]
pub async fn read_output(name: String) -> Vec<f32> {
    let Some(reading) = with(|viewer| viewer.read_output(&name)).flatten() else { return Vec::new() };
    loop {
        if let Some(texels) = reading.take() {
            return texels.into_iter().flatten().collect();
        }
        pause().await;
    }
}

/// Returns control to the browser for a moment.
async fn pause() {
    let promise = js_sys::Promise::new(&mut |resolve, _| {
        if let Some(window) = web_sys::window() {
            let _ = window.set_timeout_with_callback_and_timeout_and_arguments_0(&resolve, 5);
        }
    });
    let _ = wasm_bindgen_futures::JsFuture::from(promise).await;
}
