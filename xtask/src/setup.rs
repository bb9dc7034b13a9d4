//! Finds what this computer lacks and installs it, or prints what to install.

use std::{
    env,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::{Stop, cargo, run};

/// Rust's name for browsers.
pub const WASM: &str = "wasm32-unknown-unknown";

/// A need that the operating system provides.
struct Need {
    what: &'static str,
    found: fn() -> bool,
    /// Packages of Debian and Ubuntu that provide it.
    packages: &'static [&'static str],
}

const NEEDS: [Need; 2] = [
    Need {
        what: "a Vulkan driver (that of your GPU, or Mesa's software driver)",
        found: vulkan,
        packages: &["libvulkan1", "mesa-vulkan-drivers"],
    },
    Need { what: "a C++ compiler (the FLIP metric is a C++ library)", found: cpp_compiler, packages: &["g++"] },
];

/// Needed by tests only.
const TEST_NEEDS: [Need; 1] = [Need {
    what: "Chromium or Chrome (the tests of the browser demo run in it)",
    found: browser,
    packages: &["chromium"],
}];

/// Needed by the tests of the JavaScript package.
const NODE_NEEDS: [Need; 1] = [Need {
    what: "Node.js with npm (the tests of the JavaScript package run in it)",
    found: node,
    packages: &["nodejs", "npm"],
}];

/// Needed by the test on a cluster of its own.
const CLUSTER_NEEDS: [Need; 1] = [Need {
    what: "Slurm with munge (the test runs it on this computer)",
    found: slurm,
    packages: &["munge", "slurmctld", "slurmd", "slurm-client"],
}];

/// Names under which the browser tests look for Chromium: those of `web/tests/browser/chromium.rs`.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// Installs what building and running the evaluator needs.
pub fn system() -> Result<(), Stop> {
    provide(&NEEDS)
}

/// Installs what the tests need in addition.
pub fn for_tests() -> Result<(), Stop> {
    provide(&TEST_NEEDS)
}

/// Installs Slurm, for a test that starts and stops it as root.
pub fn for_cluster() -> Result<(), Stop> {
    if !is_root() {
        return Err(Stop::bad_input(
            "the test starts Slurm's daemons, which run as root: run it as root, in a container",
        ));
    }
    provide(&CLUSTER_NEEDS)
}

/// Installs Node.js where packages can be installed. Returns whether it is there.
pub fn for_node_tests() -> Result<bool, Stop> {
    if can_install() {
        provide(&NODE_NEEDS)?;
    }
    Ok(node())
}

/// Whether missing packages are installed: on Debian and Ubuntu, as root.
fn can_install() -> bool {
    is_root() && Path::new("/usr/bin/apt-get").exists()
}

fn provide(needs: &[Need]) -> Result<(), Stop> {
    let missing = || needs.iter().filter(|need| !(need.found)());
    let packages: Vec<&str> = missing().flat_map(|need| need.packages).copied().collect();
    if !packages.is_empty() && can_install() {
        let apt_get = |arguments: &[&str]| {
            let mut command = Command::new("apt-get");
            command.args(arguments).args(["--quiet", "--yes"]).env("DEBIAN_FRONTEND", "noninteractive");
            run(&mut command, &format!("install {} by hand, then run again", packages.join(" ")))
        };
        apt_get(&["update"])?;
        apt_get(&[&["install", "--no-install-recommends"], packages.as_slice()].concat())?;
    }
    match missing().map(|need| need.what).collect::<Vec<_>>() {
        what if what.is_empty() => Ok(()),
        what => Err(Stop::bad_input(format!(
            "this computer lacks {}: install it (on Debian or Ubuntu: apt-get install {}), then run again",
            what.join(" and "),
            packages.join(" ")
        ))),
    }
}

/// Installs the components of the Rust toolchain that only the checks use.
pub fn rust() -> Result<(), Stop> {
    let has = |tool| succeeds(cargo(&[tool, "--version"]));
    for (component, tool) in [("rustfmt", "fmt"), ("clippy", "clippy")] {
        if !has(tool) {
            rustup(["component", "add", component])?;
        }
    }
    wasm()
}

/// Installs Rust's standard library for browsers.
pub fn wasm() -> Result<(), Stop> {
    let libraries = Command::new("rustc").args(["--print", "target-libdir", "--target", WASM]).output();
    let installed = |out: Vec<u8>| Path::new(String::from_utf8_lossy(&out).trim()).is_dir();
    if !libraries.is_ok_and(|output| output.status.success() && installed(output.stdout)) {
        rustup(["target", "add", WASM])?;
    }
    Ok(())
}

fn rustup(arguments: [&str; 3]) -> Result<(), Stop> {
    let fix = format!("install {} for your Rust toolchain (https://rustup.rs), then run again", arguments[2]);
    run(Command::new("rustup").args(arguments), &fix).map_err(|Stop { sentence, .. }| Stop::bad_input(sentence))
}

fn succeeds(mut command: Command) -> bool {
    command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

/// Whether the tests will find a browser.
fn browser() -> bool {
    if let Some(path) = environment("HALFLIGHT_CHROMIUM") {
        return path.is_file();
    }
    let path = env::var_os("PATH").unwrap_or_default();
    BROWSERS.iter().any(|name| env::split_paths(&path).any(|folder| folder.join(name).is_file()))
}

fn node() -> bool {
    ["node", "npm"].iter().all(|name| {
        let mut program = Command::new(name);
        program.arg("--version");
        succeeds(program)
    })
}

fn slurm() -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    let is_there = |name: &&str| env::split_paths(&path).any(|folder| folder.join(name).is_file());
    ["munged", "slurmctld", "slurmd", "sbatch"].iter().all(is_there)
}

fn cpp_compiler() -> bool {
    let mut compiler = Command::new(env::var_os("CXX").unwrap_or_else(|| "c++".into()));
    compiler.arg("--version");
    // On Windows the build finds the compiler that rustc links with.
    cfg!(windows) || succeeds(compiler)
}

/// Whether this process is root's: files under /proc/self belong to its user.
#[cfg(unix)]
fn is_root() -> bool {
    use std::os::unix::fs::MetadataExt;
    fs::metadata("/proc/self").is_ok_and(|folder| folder.uid() == 0)
}

#[cfg(not(unix))]
fn is_root() -> bool {
    false
}

/// Whether Vulkan's loader opens and has a driver to load. Other systems than Linux provide Metal or DirectX 12.
fn vulkan() -> bool {
    !cfg!(target_os = "linux") || (loader_opens() && has_driver(&environment))
}

#[cfg(target_os = "linux")]
fn loader_opens() -> bool {
    use std::ffi::{c_char, c_int, c_void};
    unsafe extern "C" {
        fn dlopen(name: *const c_char, mode: c_int) -> *mut c_void;
    }
    const RTLD_LAZY: c_int = 1;
    // SAFETY: the name ends with a zero byte. The loader stays open: its initialisers run once, as in any program that uses
    // Vulkan.
    !unsafe { dlopen(c"libvulkan.so.1".as_ptr(), RTLD_LAZY) }.is_null()
}

#[cfg(not(target_os = "linux"))]
fn loader_opens() -> bool {
    true
}

fn environment(name: &str) -> Option<PathBuf> {
    env::var_os(name).map(PathBuf::from)
}

/// Whether a driver's manifest is in a folder that the loader searches.
fn has_driver(variable: &dyn Fn(&str) -> Option<PathBuf>) -> bool {
    let folder_has_manifest = |folder: PathBuf| {
        let entries = fs::read_dir(folder.join("vulkan/icd.d")).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).any(|path| path.extension() == Some(OsStr::new("json")))
    };
    let home = variable("XDG_DATA_HOME").or_else(|| Some(variable("HOME")?.join(".local/share")));
    let system = variable("XDG_DATA_DIRS").unwrap_or_else(|| "/usr/local/share:/usr/share".into());
    ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].iter().any(|name| variable(name).is_some())
        || env::split_paths(&system)
            .chain(["/etc".into(), "/run/opengl-driver/share".into()])
            .chain(home)
            .any(folder_has_manifest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_is_found_by_its_manifest() {
        let folder = env::temp_dir().join(format!("halflight-xtask-{}", std::process::id()));
        let icd = folder.join("vulkan/icd.d");
        fs::create_dir_all(&icd).expect("a folder for the test");
        // /etc is searched regardless of the variables.
        let elsewhere = has_driver(&|name| (name == "XDG_DATA_DIRS").then(|| "/nonexistent".into()));
        let here = |name: &str| match name {
            "XDG_DATA_DIRS" => Some("/nonexistent".into()),
            "XDG_DATA_HOME" => Some(folder.clone()),
            _ => None,
        };
        fs::write(icd.join("README.txt"), "").expect("a file for the test");
        assert_eq!(has_driver(&here), elsewhere, "a file that is no manifest is no driver");
        fs::write(icd.join("lvp_icd.x86_64.json"), "{}").expect("a file for the test");
        assert!(has_driver(&here));
        fs::remove_dir_all(&folder).expect("the test's own folder");
    }
}
