//! A headless Chromium, controlled through the DevTools protocol.

use std::{
    env, fs,
    io::ErrorKind,
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use tungstenite::{HandshakeError, Message, WebSocket};

use crate::patience::Patience;

/// Switches with which Debian's Chromium runs WebGPU and its canvas on SwiftShader. Without any one of the graphics
/// switches the device is lost at the first canvas.
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
    // Chromium throttles pages in the background; a headless page is never in the foreground.
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
    "--disable-background-timer-throttling",
    "--hide-scrollbars",
    "--mute-audio",
    "--remote-debugging-port=0",
];

/// Names of the program: those of `xtask/src/setup.rs`.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// Time between two looks at the browser's processor time.
const TICK: Duration = Duration::from_secs(1);

/// Time within which Chromium's own process answers a trivial question. It needs about a millisecond of processor time.
const ALIVE: Duration = Duration::from_secs(120);

/// Time within which a starting Chromium writes another file into its profile.
const STARTING: Duration = Duration::from_secs(60);

/// Shortest and longest time between two polls of a condition. The time grows while nothing changes, so that polling
/// does not keep an idle browser busy.
const POLL: [Duration; 2] = [Duration::from_millis(30), Duration::from_millis(500)];

/// Number of profiles of this process.
static COUNT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);

/// A browser with one page.
pub struct Page {
    child: Child,
    profile: PathBuf,
    socket: WebSocket<TcpStream>,
    session: String,
    next: u64,
    /// Addresses that the page requested.
    pub requests: Vec<String>,
    /// Messages of the console and exceptions.
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
        "Chromium is not on the PATH: `cargo xtask test` installs it on Debian and Ubuntu as root; elsewhere install it \
         or set HALFLIGHT_CHROMIUM to its path",
    )
}

impl Page {
    /// Starts a browser with an empty page of this size in CSS pixels, each `scale` device pixels wide.
    pub fn open(size: [u32; 2], scale: f64) -> Self {
        let number = COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let profile = env::temp_dir().join(format!("halflight-browser-{}-{number}", std::process::id()));
        let _ = fs::remove_dir_all(&profile);
        let mut child = Command::new(find())
            .args(SWITCHES)
            .arg(format!("--user-data-dir={}", profile.display()))
            // The same as the browser's zoom and high-density screens; an emulated scale does not reach the canvas.
            .arg(format!("--force-device-scale-factor={scale}"))
            .arg("about:blank")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("Chromium starts");
        let file = profile.join("DevToolsActivePort");
        let (mut written, mut grown) = (0, Instant::now());
        let (port, path) = loop {
            let text = fs::read_to_string(&file).unwrap_or_default();
            if let Some((port, path)) = text.split_once('\n').filter(|(_, path)| !path.is_empty()) {
                break (port.to_owned(), path.trim().to_owned());
            }
            let ended = child.try_wait().expect("the state of a child");
            assert!(ended.is_none(), "Chromium ended while it started: {ended:?}");
            let now = files_under(&profile);
            if now != written {
                (written, grown) = (now, Instant::now());
            }
            assert!(grown.elapsed() < STARTING, "Chromium does not start: it opens no DevTools port");
            thread::sleep(POLL[0]);
        };
        let socket = connect(&port, &path);
        let (requests, console) = (Vec::new(), Vec::new());
        let mut page = Self { child, profile, socket, session: String::new(), next: 0, requests, console };
        let target = page.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        page.session = page.call("Target.attachToTarget", attach)["sessionId"].as_str().expect("a session").to_owned();
        for domain in ["Page", "Runtime", "Network", "Log"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        page.resize(size);
        page
    }

    /// Sends a call of a method, to the page's session if there is one, and returns its number.
    fn send(&mut self, session: &str, method: &str, params: &Value) -> u64 {
        self.next += 1;
        let mut message = json!({ "id": self.next, "method": method, "params": params });
        if !session.is_empty() {
            message["sessionId"] = session.into();
        }
        self.socket.send(Message::text(message.to_string())).expect("Chromium accepts messages");
        self.next
    }

    /// The next message; `None` if there is none within a tick.
    fn receive(&mut self) -> Option<Value> {
        match self.socket.read() {
            Ok(Message::Text(text)) => Some(serde_json::from_str(&text).expect("the protocol is JSON")),
            Ok(_) => None,
            Err(tungstenite::Error::Io(error)) if is_timeout(&error) => None,
            Err(error) => panic!("Chromium ended the connection ({error})"),
        }
    }

    /// Calls a method of the protocol in the page. Waits for its result while the browser works.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        let id = self.send(&self.session.clone(), method, &params);
        let mut patience = Patience::new();
        let mut asked = Instant::now();
        // The number of a pending question for the processor time.
        let mut question = None;
        loop {
            let message = self.receive();
            match (message, question) {
                (Some(mut message), _) if message["id"] == id => {
                    assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                    return message["result"].take();
                }
                (Some(message), Some(number)) if message["id"] == number => {
                    question = None;
                    if let Err(reason) = patience.check(processor_time(&message["result"]), Instant::now()) {
                        panic!("{method} {params} has no result: {reason}; console {:?}", self.console);
                    }
                }
                (Some(message), _) => self.hear(&message),
                (None, _) => {}
            }
            if question.is_none() && asked.elapsed() > TICK {
                // The browser's process answers this, also while the page is blocked.
                question = Some(self.send("", "SystemInfo.getProcessInfo", &json!({})));
                asked = Instant::now();
            }
            assert!(asked.elapsed() < ALIVE, "{method}: Chromium does not answer");
        }
    }

    /// Processor time that all processes of the browser have used, seconds.
    fn processor_time(&mut self) -> f64 {
        let id = self.send("", "SystemInfo.getProcessInfo", &json!({}));
        let asked = Instant::now();
        loop {
            match self.receive() {
                Some(message) if message["id"] == id => return processor_time(&message["result"]),
                Some(message) => self.hear(&message),
                None => assert!(asked.elapsed() < ALIVE, "Chromium does not answer"),
            }
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

    /// The value of an expression, or of its promise.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let params = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut answer = self.call("Runtime.evaluate", params);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].take()
    }

    /// Ends the browser's GPU process, as a crash of the driver does: every device of the page is lost.
    pub fn crash_gpu_process(&mut self) {
        self.send("", "Browser.crashGpuProcess", &json!({}));
    }

    /// The report of the viewer, with marks relative to the page instead of the canvas; null before it runs.
    pub fn report(&mut self) -> Value {
        let text = self.evaluate(
            "(() => {
               if (!window.halflight?.report()) return '';
               const report = JSON.parse(window.halflight.report());
               const { left, top } = document.getElementById('view').getBoundingClientRect();
               for (const mark of Object.values(report.marks)) { mark[0] += left; mark[1] += top; }
               return JSON.stringify(report);
             })()",
        );
        serde_json::from_str(text.as_str().unwrap_or_default()).unwrap_or(Value::Null)
    }

    /// Changes the size of the page, CSS pixels.
    pub fn resize(&mut self, [width, height]: [u32; 2]) {
        // A scale of 0 leaves the browser's own.
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 0, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
    }

    /// Waits until a report is as wanted, and returns it. Fails when the browser stops working or works for too long.
    pub fn wait(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        self.poll(what, Self::report, |report| !report.is_null() && wanted(report))
    }

    /// Waits until an expression is true. Fails when the browser stops working or works for too long.
    pub fn wait_for(&mut self, expression: &str) {
        self.poll(expression, |page| page.evaluate(expression), |value| *value == true);
    }

    /// Polls until a value is as wanted, and returns it.
    fn poll(&mut self, what: &str, value: impl Fn(&mut Self) -> Value, wanted: impl Fn(&Value) -> bool) -> Value {
        let (mut patience, mut looked) = (Patience::new(), Instant::now());
        let (mut last, mut pause) = (Value::Null, POLL[0]);
        loop {
            let now = value(self);
            if wanted(&now) {
                return now;
            }
            if now == last {
                pause = (pause * 2).min(POLL[1]);
            } else {
                patience.progress();
                (last, pause) = (now, POLL[0]);
            }
            if looked.elapsed() > TICK {
                looked = Instant::now();
                let used = self.processor_time();
                if let Err(reason) = patience.check(used, looked) {
                    let text = self.evaluate("document.getElementById('message')?.hidden || document.body?.innerText");
                    panic!("waiting for {what}: {reason}; page {text}, console {:?}, last value {last}", self.console);
                }
            }
            thread::sleep(pause);
        }
    }

    /// Waits until the page has painted a frame after everything sent so far: the viewer reads its input once per frame.
    pub fn frame(&mut self) {
        // The first callback may belong to a frame that had already begun.
        self.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))");
    }

    /// Sends an event of the mouse, CSS pixels.
    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], buttons: u32) {
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Drags from one position to another in a few steps, CSS pixels.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.mouse("mouseMoved", from, 0);
        self.frame();
        self.mouse("mousePressed", from, 1);
        self.frame();
        for step in 1..=5 {
            self.mouse("mouseMoved", [0, 1].map(|i| from[i] + (to[i] - from[i]) * f64::from(step) / 5.0), 1);
        }
        self.frame();
        self.mouse("mouseReleased", to, 0);
        self.frame();
    }

    /// Clicks, CSS pixels. No frame is waited for between press and release: a press of several seconds is not a click.
    pub fn click(&mut self, at: [f64; 2]) {
        self.mouse("mouseMoved", at, 0);
        self.frame();
        self.mouse("mousePressed", at, 1);
        self.mouse("mouseReleased", at, 0);
        self.frame();
    }

    /// Presses a key by its DOM name, for example `Tab`.
    pub fn key(&mut self, name: &str, code: u32) {
        for kind in ["keyDown", "keyUp"] {
            let key = json!({ "type": kind, "key": name, "code": name, "windowsVirtualKeyCode": code });
            self.call("Input.dispatchKeyEvent", key);
            self.frame();
        }
    }

    /// Moves the pointer, CSS pixels.
    pub fn point(&mut self, at: [f64; 2]) {
        self.mouse("mouseMoved", at, 0);
        self.frame();
    }

    /// Clicks without waiting for a frame.
    pub fn click_quickly(&mut self, at: [f64; 2]) {
        self.mouse("mouseMoved", at, 0);
        self.mouse("mousePressed", at, 1);
        self.mouse("mouseReleased", at, 0);
    }

    /// Drags without waiting for a frame.
    pub fn drag_quickly(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.mouse("mouseMoved", from, 0);
        self.mouse("mousePressed", from, 1);
        self.mouse("mouseMoved", to, 1);
        self.mouse("mouseReleased", to, 0);
    }

    /// Presses a key by its DOM name without waiting for a frame.
    pub fn key_quickly(&mut self, name: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": name, "code": name }));
        }
    }

    /// Drops files onto the canvas, each a name and its text.
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

    /// Takes a screenshot and saves it under this name.
    pub fn screenshot(&mut self, folder: &Path, name: &str) -> image::RgbImage {
        let answer = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes = base64(answer["data"].as_str().expect("a picture"));
        fs::create_dir_all(folder).expect("a folder for screenshots");
        fs::write(folder.join(format!("{name}.png")), &bytes).expect("a screenshot can be saved");
        image::load_from_memory(&bytes).expect("a PNG").to_rgb8()
    }
}

/// Number and size of the files under a folder, added up: it changes while files are written.
fn files_under(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let size = |entry: fs::DirEntry| match entry.metadata() {
        Ok(file) if file.is_dir() => files_under(&entry.path()),
        Ok(file) => 1 + file.len(),
        Err(_) => 0,
    };
    entries.map(size).sum()
}

/// Opens the connection to the DevTools of a browser.
fn connect(port: &str, path: &str) -> WebSocket<TcpStream> {
    let stream = TcpStream::connect(format!("127.0.0.1:{port}")).expect("DevTools accepts connections");
    stream.set_read_timeout(Some(TICK)).expect("a socket with a timeout");
    let start = Instant::now();
    let mut handshake = tungstenite::client(format!("ws://127.0.0.1:{port}{path}"), stream);
    loop {
        match handshake {
            Ok((socket, _)) => return socket,
            Err(HandshakeError::Interrupted(unfinished)) if start.elapsed() < ALIVE => {
                handshake = unfinished.handshake()
            }
            Err(error) => panic!("DevTools does not answer ({error})"),
        }
    }
}

fn is_timeout(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}

/// The sum of an answer to `SystemInfo.getProcessInfo`, seconds.
fn processor_time(answer: &Value) -> f64 {
    let processes = answer["processInfo"].as_array().map(Vec::as_slice).unwrap_or_default();
    processes.iter().filter_map(|process| process["cpuTime"].as_f64()).sum()
}

/// Bytes of base64 text, as the protocol sends pictures.
pub fn base64(text: &str) -> Vec<u8> {
    data_encoding::BASE64.decode(text.as_bytes()).expect("valid base64")
}
