//! `cargo xtask web`: builds the browser demo and serves it, or writes it to a folder.

use std::{
    env,
    path::{Path, PathBuf},
    process::ExitCode,
    thread,
};

use halflight_output::{PrintError, terminal};

const HELP: &str = "\
Builds the browser demo.

Usage: cargo xtask web [--dist DIR] [--port PORT] [--source URL] [--report PATH]

  --dist DIR   Write a folder that any web host can serve under any path, and stop.
  --port PORT  Port of 127.0.0.1 on which to serve. [default: 8080]
  --source URL Address of the sources and documentation, to which the page links.
  --report PATH Folder of a report beside the page, to which it links, for example report/.
";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err((code, sentence)) => {
            // Nothing failed where only the reader of the output went away.
            if code != 0 {
                terminal::note(format_args!("error: {sentence}"));
            }
            ExitCode::from(code)
        }
    }
}

fn unprinted(error: PrintError) -> (u8, String) {
    (error.exit_code(), error.to_string())
}

fn run(arguments: &[String]) -> Result<(), (u8, String)> {
    let (mut dist, mut port, mut source, mut report) = (None, 8080, None, None);
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut value = || rest.next().ok_or_else(|| (2, format!("{argument} needs a value: see --help")));
        match argument.as_str() {
            "-h" | "--help" => {
                return terminal::print(HELP).map_err(unprinted);
            }
            "--dist" => dist = Some(PathBuf::from(value()?)),
            "--port" => {
                let text = value()?;
                port = text.parse().map_err(|_| (2, format!("--port {text} is no port: give 1 to 65535")))?;
            }
            "--source" => source = Some(value()?.clone()),
            "--report" => report = Some(value()?.clone()),
            other => {
                return Err((
                    2,
                    format!(
                        "web takes no {other}: give --dist DIR, --port PORT, --source URL, --report PATH or nothing"
                    ),
                ));
            }
        }
    }
    let folder = dist.clone().unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/web-dist"));
    if dist.is_some() {
        halflight_bundle::claim(&folder).map_err(|error| (2, error.to_string()))?;
    }
    let size =
        halflight_bundle::build(&folder, source.as_deref(), report.as_deref()).map_err(|sentence| (1, sentence))?;
    let megabytes = |bytes: u64| bytes as f64 / 1e6;
    let (raw, gzip) = (megabytes(size.raw), megabytes(size.gzip));
    terminal::print_line(format_args!("{}: {raw:.2} MB, {gzip:.2} MB compressed (gzip)", folder.display()))
        .map_err(unprinted)?;
    if dist.is_none() {
        let address = halflight_bundle::serve(&folder, port).map_err(|sentence| (2, sentence))?;
        terminal::print_line(format_args!("http://{address}/ (stop with Ctrl+C)")).map_err(unprinted)?;
        loop {
            thread::park();
        }
    }
    Ok(())
}
