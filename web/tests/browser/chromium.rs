//! A headless Chromium, spoken to through its DevTools protocol.

use std::{
    env, fs,
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, stream::MaybeTlsStream};

/// What makes Debian's Chromium run WebGPU, canvas included, on SwiftShader. With any of the graphics switches left out
/// the device is lost at the first canvas.
const SWITCHES: [&str; 19] = [
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-gpu-watchdog",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
    // A page in the background would be slowed down; this one is never in front.
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
    "--disable-background-timer-throttling",
    "--hide-scrollbars",
    "--mute-audio",
    "--remote-debugging-port=0",
];

/// Names under which a system may have it: those of `xtask/src/setup.rs`.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// Time after which a call or a condition has failed.
const PATIENCE: Duration = Duration::from_secs(60);

/// Folders of this process, numbered.
static COUNT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);

/// A browser with one page.
pub struct Page {
    child: Child,
    profile: PathBuf,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    session: String,
    next: u64,
    /// Addresses that the page asked for.
    pub requests: Vec<String>,
    /// What the page's console and exceptions said.
    pub console: Vec<String>,
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = fs::remove_dir_all(&self.profile);
    }
}

fn find() -> PathBuf {
    if let Some(path) = env::var_os("HALFLIGHT_CHROMIUM") {
        return path.into();
    }
    let path = env::var_os("PATH").unwrap_or_default();
    let found = NAMES.iter().flat_map(|name| env::split_paths(&path).map(move |folder| folder.join(name)));
    found.into_iter().find(|path| path.is_file()).expect(
        "no Chromium on the PATH: `cargo xtask test` installs it on Debian and Ubuntu as root; elsewhere install it or \
         set HALFLIGHT_CHROMIUM to its path",
    )
}

impl Page {
    /// Starts a browser with an empty page of this size in CSS pixels, each `scale` device pixels wide.
    pub fn open(size: [u32; 2], scale: f64) -> Self {
        let number = COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let profile = env::temp_dir().join(format!("halflight-browser-{}-{number}", std::process::id()));
        let _ = fs::remove_dir_all(&profile);
        let child = Command::new(find())
            .args(SWITCHES)
            .arg(format!("--user-data-dir={}", profile.display()))
            // As the browser's zoom and dense screens do; an emulated scale would not reach the canvas.
            .arg(format!("--force-device-scale-factor={scale}"))
            .arg("about:blank")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("Chromium starts");
        let file = profile.join("DevToolsActivePort");
        let start = Instant::now();
        let (port, path) = loop {
            let text = fs::read_to_string(&file).unwrap_or_default();
            if let Some((port, path)) = text.split_once('\n').filter(|(_, path)| !path.is_empty()) {
                break (port.to_owned(), path.trim().to_owned());
            }
            assert!(start.elapsed() < PATIENCE, "Chromium opens no DevTools port");
            thread::sleep(Duration::from_millis(50));
        };
        let (socket, _) = tungstenite::connect(format!("ws://127.0.0.1:{port}{path}")).expect("DevTools answers");
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(PATIENCE)).expect("a socket with a timeout");
        }
        let (requests, console) = (Vec::new(), Vec::new());
        let mut page = Self { child, profile, socket, session: String::new(), next: 0, requests, console };
        let target = page.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        page.session = page.call("Target.attachToTarget", attach)["sessionId"].as_str().expect("a session").to_owned();
        for domain in ["Page", "Runtime", "Network", "Log"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        // A scale of 0 leaves the browser's own.
        let metrics = json!({ "width": size[0], "height": size[1], "deviceScaleFactor": 0, "mobile": false });
        page.call("Emulation.setDeviceMetricsOverride", metrics);
        page
    }

    /// Calls a method of the protocol.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let id = self.next;
        let mut message = json!({ "id": id, "method": method, "params": params });
        if !self.session.is_empty() {
            message["sessionId"] = self.session.clone().into();
        }
        self.socket.send(Message::text(message.to_string())).expect("Chromium listens");
        loop {
            let message = self.socket.read().unwrap_or_else(|e| panic!("{method}: Chromium does not answer ({e})"));
            let Message::Text(text) = message else { continue };
            let mut message: Value = serde_json::from_str(&text).expect("the protocol is JSON");
            if message["id"] == id {
                assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                return message["result"].take();
            }
            self.hear(&message);
        }
    }

    fn hear(&mut self, event: &Value) {
        let params = &event["params"];
        match event["method"].as_str() {
            Some("Network.requestWillBeSent") => {
                self.requests.extend(params["request"]["url"].as_str().map(str::to_owned));
            }
            Some("Runtime.consoleAPICalled") => self.console.push(params["args"].to_string()),
            Some("Runtime.exceptionThrown") => self.console.push(params["exceptionDetails"].to_string()),
            Some("Log.entryAdded") => self.console.push(params["entry"]["text"].to_string()),
            _ => {}
        }
    }

    /// Opens an address.
    pub fn go(&mut self, url: &str) {
        let answer = self.call("Page.navigate", json!({ "url": url }));
        assert!(answer["errorText"].is_null(), "{url}: {answer}");
    }

    /// The value of an expression; promises are waited for.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let params = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut answer = self.call("Runtime.evaluate", params);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].take()
    }

    /// What the viewer knows of itself; null before it runs.
    pub fn report(&mut self) -> Value {
        let text = self.evaluate("window.halflight ? window.halflight.report() : ''");
        serde_json::from_str(text.as_str().unwrap_or_default()).unwrap_or(Value::Null)
    }

    /// Waits until a report is as wanted, and returns it.
    pub fn wait(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let report = self.report();
            if !report.is_null() && wanted(&report) {
                return report;
            }
            if start.elapsed() > PATIENCE {
                let text = self.evaluate("document.getElementById('message').hidden || document.body.innerText");
                panic!("{what} never came; page {text}, console {:?}, report {report}", self.console);
            }
            thread::sleep(Duration::from_millis(30));
        }
    }

    /// Waits until an expression is true.
    pub fn wait_for(&mut self, expression: &str) {
        let start = Instant::now();
        while self.evaluate(expression) != true {
            assert!(start.elapsed() < PATIENCE, "never true: {expression}; console {:?}", self.console);
            thread::sleep(Duration::from_millis(30));
        }
    }

    /// Drags from one place to another in a few steps, CSS pixels.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        let mouse = |kind: &str, [x, y]: [f64; 2], buttons: u32| json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", mouse("mouseMoved", from, 0));
        self.call("Input.dispatchMouseEvent", mouse("mousePressed", from, 1));
        for step in 1..=5 {
            let at = [0, 1].map(|i| from[i] + (to[i] - from[i]) * f64::from(step) / 5.0);
            self.call("Input.dispatchMouseEvent", mouse("mouseMoved", at, 1));
            // The viewer reads the pointer once a frame.
            thread::sleep(Duration::from_millis(40));
        }
        self.call("Input.dispatchMouseEvent", mouse("mouseReleased", to, 0));
    }

    /// Clicks.
    pub fn click(&mut self, at: [f64; 2]) {
        self.drag(at, at);
    }

    /// Presses a key by its DOM name, for example `Tab`.
    pub fn key(&mut self, name: &str, code: u32) {
        for kind in ["keyDown", "keyUp"] {
            let key = json!({ "type": kind, "key": name, "code": name, "windowsVirtualKeyCode": code });
            self.call("Input.dispatchKeyEvent", key);
            thread::sleep(Duration::from_millis(40));
        }
    }

    /// Drops files, each a name and its text, onto the canvas.
    pub fn drop_files(&mut self, files: &[(&str, &str)]) {
        let list = json!(files);
        self.evaluate(&format!(
            "{{ const transfer = new DataTransfer();
               for (const [name, text] of {list}) transfer.items.add(new File([text], name));
               const canvas = document.getElementById('view');
               for (const kind of ['dragenter', 'dragover', 'drop'])
                 canvas.dispatchEvent(new DragEvent(kind, {{ dataTransfer: transfer, bubbles: true, cancelable: true }}));
               true }}"
        ));
    }

    /// A screenshot, kept under this name, decoded.
    pub fn screenshot(&mut self, folder: &Path, name: &str) -> image::RgbImage {
        let answer = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes = decode_base64(answer["data"].as_str().expect("a picture"));
        fs::create_dir_all(folder).expect("a folder for screenshots");
        fs::write(folder.join(format!("{name}.png")), &bytes).expect("a place for screenshots");
        image::load_from_memory(&bytes).expect("a PNG").to_rgb8()
    }
}

/// Bytes of base64 text (RFC 4648), as the protocol sends pictures.
pub fn decode_base64(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => Some(c - b'A'),
        b'a'..=b'z' => Some(c - b'a' + 26),
        b'0'..=b'9' => Some(c - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let digits: Vec<u32> = text.bytes().filter_map(digit).map(u32::from).collect();
    digits
        .chunks(4)
        .flat_map(|four| {
            let word = four.iter().enumerate().fold(0, |word, (i, digit)| word | digit << (18 - 6 * i));
            word.to_be_bytes()[1..four.len()].to_vec()
        })
        .collect()
}
