//! `cargo xtask web`: builds the browser demo and serves it, or writes it to a folder.

use std::{
    env,
    path::{Path, PathBuf},
    process::ExitCode,
    thread,
};

const HELP: &str = "\
Builds the browser demo.

Usage: cargo xtask web [--dist DIR] [--port PORT]

  --dist DIR   Write a folder that any web host can serve under any path, and stop.
  --port PORT  Port of 127.0.0.1 on which to serve. [default: 8080]
";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err((code, sentence)) => {
            eprintln!("error: {sentence}");
            ExitCode::from(code)
        }
    }
}

fn run(arguments: &[String]) -> Result<(), (u8, String)> {
    let (mut dist, mut port) = (None, 8080);
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut value = || rest.next().ok_or_else(|| (2, format!("{argument} needs a value: see --help")));
        match argument.as_str() {
            "-h" | "--help" => {
                print!("{HELP}");
                return Ok(());
            }
            "--dist" => dist = Some(PathBuf::from(value()?)),
            "--port" => {
                let text = value()?;
                port = text.parse().map_err(|_| (2, format!("--port {text} is no port: give 1 to 65535")))?;
            }
            other => return Err((2, format!("web takes no {other}: give --dist DIR, --port PORT or nothing"))),
        }
    }
    let folder = dist.clone().unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/web-dist"));
    let size = halflight_bundle::build(&folder).map_err(|sentence| (1, sentence))?;
    let megabytes = |bytes: u64| bytes as f64 / 1e6;
    println!("{}: {:.2} MB, {:.2} MB compressed (gzip)", folder.display(), megabytes(size.raw), megabytes(size.gzip));
    if dist.is_none() {
        let address = halflight_bundle::serve(&folder, port).map_err(|sentence| (2, sentence))?;
        println!("http://{address}/ (stop with Ctrl+C)");
        loop {
            thread::park();
        }
    }
    Ok(())
}
