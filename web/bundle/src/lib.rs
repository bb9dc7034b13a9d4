//! The browser demo as a folder of files: the viewer compiled for wasm32 and bound to JavaScript, and its page. Nothing
//! but cargo is needed, because wasm-bindgen is used as a library.

use std::{
    env,
    fs::{self, File},
    io::{self, BufRead, BufReader, Write},
    net::{Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::Arc,
    thread,
};

use flate2::{Compression, write::GzEncoder};
use halflight_output::{FolderError, OutputFolder};

/// Files of the page itself.
const PAGE: [&str; 10] = [
    "index.html",
    "page.css",
    "page.js",
    "worker.js",
    "icon.svg",
    "opening.jpg",
    "setup-cornell.jpg",
    "setup-court.jpg",
    "setup-room.jpg",
    "setup-screen.jpg",
];

/// The line of index.html with the link to the sources.
const SOURCE: &str = "<a id=\"source\" href=\"{source}\">Source and docs</a>";

/// The line of index.html with the link to a report.
const REPORT: &str = "<a id=\"report\" href=\"{report}\">Report</a>";

/// Files that wasm-bindgen writes.
const BOUND: [&str; 2] = ["halflight_web.js", "halflight_web_bg.wasm"];

/// Bytes of a folder, as they lie and as a server sends them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// As they lie.
    pub raw: u64,
    /// Compressed with gzip, each file by itself.
    pub gzip: u64,
}

/// Checks that the files of the demo can be written to a folder, and reserves them.
///
/// # Errors
/// Where the folder holds files of these names that this program did not write.
pub fn claim(dist: &Path) -> Result<(), FolderError> {
    let folder = OutputFolder::open(dist);
    PAGE.iter().chain(&BOUND).try_for_each(|name| folder.claim(name).map(drop))
}

/// Builds the demo into a folder; files of the same names are replaced. The page links to `source`, the address of the
/// sources and documentation, or to that of Cargo.toml (`repository`), and to `report`, a folder beside it. Without an address
/// there is no link.
///
/// # Errors
/// One sentence: what failed, and the fix.
pub fn build(dist: &Path, source: Option<&str>, report: Option<&str>) -> Result<Size, String> {
    let links = [link(source.unwrap_or(env!("CARGO_PKG_REPOSITORY")))?, report_link(report)?];
    let wasm = compile()?;
    let failed = |what: &str, error: &dyn std::fmt::Display| format!("{what} {}: {error}", dist.display());
    fs::create_dir_all(dist).map_err(|e| failed("cannot make the folder", &e))?;
    let mut bindgen = wasm_bindgen_cli_support::Bindgen::new();
    bindgen.input_path(&wasm).typescript(false).remove_name_section(true).remove_producers_section(true);
    let bound = bindgen.web(true).and_then(|bindgen| bindgen.generate(dist));
    bound.map_err(|e| failed("wasm-bindgen cannot write to", &format!("{e:#}")))?;
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../page");
    for name in PAGE {
        let copied = if name == "index.html" {
            let text = fs::read_to_string(page.join(name))
                .map(|text| text.replace(SOURCE, &links[0]).replace(REPORT, &links[1]));
            text.and_then(|text| fs::write(dist.join(name), text))
        } else {
            fs::copy(page.join(name), dist.join(name)).map(drop)
        };
        copied.map_err(|e| failed("cannot copy the page to", &e))?;
    }
    size(dist).map_err(|e| failed("cannot read", &e))
}

/// The link to the sources as HTML; empty without an address.
fn link(source: &str) -> Result<String, String> {
    let is_address = source.starts_with("https://") || source.starts_with("http://");
    match source {
        "" => Ok(String::new()),
        _ if is_address && !source.contains(['"', '<', '>', '&', ' ']) => Ok(SOURCE.replace("{source}", source)),
        _ => Err(format!("{source} is no address of the sources: give one that starts with https://")),
    }
}

/// The link to a report as HTML; empty without one.
fn report_link(report: Option<&str>) -> Result<String, String> {
    let letters = |c: char| c.is_ascii_alphanumeric() || ['-', '_', '/', '.'].contains(&c);
    match report {
        None => Ok(String::new()),
        Some(path) if path.starts_with(|c: char| c.is_ascii_alphanumeric()) && path.chars().all(letters) => {
            Ok(REPORT.replace("{report}", path))
        }
        Some(path) => {
            Err(format!("{path} is no folder beside the page: give a relative path of plain letters, as report/"))
        }
    }
}

/// Compiles the viewer for browsers; returns the path of the module.
fn compile() -> Result<PathBuf, String> {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command
        .args(["build", "--profile", "web", "--target", "wasm32-unknown-unknown", "--package", "halflight-web"])
        .args(["--message-format", "json-render-diagnostics"])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."))
        // Not the flags of a caller, for example of its linter: they would compile everything again. Every browser with WebGPU
        // has these instructions. Without them, the code that draws text is several times as large.
        .env("RUSTFLAGS", "-C target-feature=+simd128")
        .stdout(Stdio::piped());
    let mut child =
        command.spawn().map_err(|e| format!("cargo does not start ({e}): install Rust from https://rustup.rs"))?;
    let mut module = None;
    for line in child.stdout.take().into_iter().flat_map(|out| BufReader::new(out).lines()).map_while(Result::ok) {
        // Artifacts are named by absolute paths between quotes.
        if let Some(path) = line.split('"').find(|part| part.ends_with("halflight_web.wasm")) {
            module = Some(PathBuf::from(path.replace("\\\\", "\\")));
        }
    }
    let status = child.wait().map_err(|e| format!("cargo cannot be waited for ({e}): run again"))?;
    if !status.success() {
        return Err(
            "the viewer does not compile for browsers: fix what cargo printed; where it lacks the target, run \
                    rustup target add wasm32-unknown-unknown"
                .into(),
        );
    }
    module.ok_or_else(|| "cargo named no halflight_web.wasm: run again".into())
}

/// Bytes of the files of a folder.
fn size(folder: &Path) -> io::Result<Size> {
    let mut size = Size::default();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_file() {
            let bytes = fs::read(path)?;
            let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
            encoder.write_all(&bytes)?;
            size.raw += bytes.len() as u64;
            size.gzip += encoder.finish()?.len() as u64;
        }
    }
    Ok(size)
}

/// Serves a folder on this computer alone, in the background; returns its address. Port 0 takes any free one.
///
/// # Errors
/// Where the port is taken.
pub fn serve(folder: &Path, port: u16) -> Result<SocketAddr, String> {
    let server = tiny_http::Server::http((Ipv4Addr::LOCALHOST, port))
        .map_err(|e| format!("port {port} of 127.0.0.1 cannot be opened ({e}): give another with --port"))?;
    let address = server.server_addr().to_ip().ok_or("the server has no address: run again")?;
    let (server, folder) = (Arc::new(server), folder.to_path_buf());
    // A browser asks for several files at once.
    for _ in 0..4 {
        let (server, folder) = (server.clone(), folder.clone());
        thread::spawn(move || {
            while let Ok(request) = server.recv() {
                // A browser that went away needs no answer.
                let _ = answer(request, &folder);
            }
        });
    }
    Ok(address)
}

fn answer(request: tiny_http::Request, folder: &Path) -> io::Result<()> {
    let path = request.url().split(['?', '#']).next().unwrap_or_default().trim_start_matches('/').to_owned();
    let path = if path.is_empty() || path.ends_with('/') { format!("{path}index.html") } else { path };
    // The folder is flat, so that a name without separators cannot lead out of it.
    let file = (!path.contains(['/', '\\']) && !path.starts_with('.')).then(|| File::open(folder.join(&path)));
    let Some(Ok(file)) = file else {
        return request.respond(tiny_http::Response::from_string("no such file").with_status_code(404));
    };
    let kind = match path.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript",
        Some("css") => "text/css",
        Some("wasm") => "application/wasm",
        Some("svg") => "image/svg+xml",
        Some("jpg") => "image/jpeg",
        _ => "application/octet-stream",
    };
    let mut response = tiny_http::Response::from_file(file);
    for (name, value) in [("Content-Type", kind), ("Cache-Control", "no-cache")] {
        if let Ok(header) = tiny_http::Header::from_bytes(name, value) {
            response.add_header(header);
        }
    }
    request.respond(response)
}

#[cfg(test)]
mod tests {
    use std::{io::Read, net::TcpStream};

    use super::*;

    #[test]
    fn the_page_links_to_its_sources_if_their_address_is_known() {
        let page = include_str!("../../page/index.html");
        assert!(page.contains(SOURCE));
        assert_eq!(link(""), Ok(String::new()));
        assert!(link("https://example.org/a").is_ok_and(|link| link.contains("href=\"https://example.org/a\"")));
        for wrong in ["example.org", "javascript:alert(1)", "https://example.org/\"onclick"] {
            assert!(link(wrong).is_err_and(|error| error.contains("https://")), "{wrong}");
        }
    }

    #[test]
    fn the_page_links_to_a_report_beside_it() {
        assert!(include_str!("../../page/index.html").contains(REPORT));
        assert_eq!(report_link(None), Ok(String::new()));
        assert_eq!(report_link(Some("report/")), Ok("<a id=\"report\" href=\"report/\">Report</a>".into()));
        for wrong in ["/report", "https://example.org", "a\"b", ""] {
            assert!(report_link(Some(wrong)).is_err_and(|error| error.contains("relative path")), "{wrong}");
        }
    }

    #[test]
    fn the_page_opens_under_any_path() {
        for text in [include_str!("../../page/index.html"), include_str!("../../page/page.css")] {
            for from_root in ["href=\"/", "src=\"/", "url(/", "url(\"/"] {
                assert!(!text.contains(from_root), "{from_root}");
            }
        }
    }

    #[test]
    fn every_file_that_the_page_names_is_bundled() {
        let page = include_str!("../../page/index.html");
        let names = page.split(['"']).filter(|part| part.ends_with(".jpg") || part.ends_with(".svg"));
        let names: Vec<&str> = names.collect();
        assert!(names.len() > 5, "{names:?}");
        assert!(names.iter().all(|name| PAGE.contains(name)), "{names:?}");
    }

    #[test]
    fn a_folder_is_served_and_nothing_beside_it() {
        let folder = env::temp_dir().join(format!("halflight-bundle-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for the test");
        fs::write(folder.join("index.html"), "<p>page").expect("a file for the test");
        let address = serve(&folder, 0).expect("a free port");
        let ask = |path: &str| {
            let mut stream = TcpStream::connect(address).expect("the server answers");
            write!(stream, "GET {path} HTTP/1.0\r\n\r\n").expect("sent");
            let mut text = String::new();
            stream.read_to_string(&mut text).expect("text");
            text
        };
        assert!(ask("/").contains("text/html") && ask("/?a=b").ends_with("<p>page"));
        for path in ["/none.html", "/../Cargo.toml", "/.hidden", "/%2e%2e/Cargo.toml"] {
            assert!(ask(path).contains("404"), "{path}");
        }
        assert!(size(&folder).expect("readable").raw == 7);
        fs::remove_dir_all(&folder).expect("the test's own folder");
    }
}
