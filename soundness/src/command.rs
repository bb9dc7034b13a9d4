//! The command line.

use std::{io::Write, path::PathBuf, process::ExitCode, time::Instant};

use clap::Parser;
use halflight_evaluator::{
    Error,
    experiment::{COMMIT, session::open_adapter},
    report::document::markdown,
};
use halflight_native::{AdapterChoice, files::write_whole};
use halflight_output::{OutputFolder, PrintError, terminal};

use crate::{
    faults, fuzz, mutations, random,
    suite::{Options, Suite},
    table::Table,
};

/// Runs every technique through extremes, invariances and faults, and prints which rows hold and by how much.
#[derive(Parser)]
#[command(name = "cargo xtask stability", version)]
struct Arguments {
    /// Technique to test; may be given many times. [default: all of them]
    #[arg(long = "technique", value_name = "NAME")]
    techniques: Vec<String>,
    /// A few settings per row instead of all pairs of values: seconds instead of minutes.
    #[arg(long)]
    quick: bool,
    /// Only rows whose group or name contains this text; may be given many times.
    #[arg(long = "row", value_name = "TEXT")]
    rows: Vec<String>,
    /// Folder for the page, the Markdown and the CSV table.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Also run this many random scenes, cameras, sizes and settings.
    #[arg(long, value_name = "COUNT")]
    random: Option<usize>,
    /// Also read this many damaged models, materials, skies, scenes, grids and presets.
    #[arg(long, value_name = "COUNT")]
    fuzz: Option<u64>,
    /// Seed of --random and --fuzz.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Run only --random and --fuzz, without the rows.
    #[arg(long)]
    only_random: bool,
    /// Test the suite instead: put deliberate bugs into the shaders, one after another, and print which rows turn red.
    #[arg(long)]
    mutations: bool,
    /// Adapter: any, gpu, software, or part of a name.
    #[arg(long, default_value = "any")]
    adapter: String,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command line. Returns the exit code of the process: 0 done, 1 failed, 2 bad input.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match if arguments.mutations { run_mutations(&arguments) } else { run(&arguments) } {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if !matches!(error, Error::Print(PrintError::Closed)) {
                terminal::note(format_args!("error: {error}"));
            }
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Error> {
    let native = open_adapter(&arguments.adapter)?;
    let start = Instant::now();
    let options =
        Options { techniques: arguments.techniques.clone(), quick: arguments.quick, rows: arguments.rows.clone() };
    let mut table = if arguments.only_random { Table::default() } else { Suite::run(&native, &options)? };
    if wants_faults(arguments) {
        let own = std::env::current_exe().map_err(|e| Error::Failed(format!("cannot find this program: {e}")))?;
        let folder = std::env::temp_dir().join(format!("halflight-faults-{}", std::process::id()));
        table.checks.extend(faults::run(&own, &folder, &arguments.adapter)?);
    }
    let adapter = AdapterChoice::from(arguments.adapter.as_str());
    let folder = arguments.out.as_deref();
    if let Some(count) = arguments.random {
        table.checks.push(random::run(&adapter, count, arguments.seed, folder)?.check());
    }
    if let Some(count) = arguments.fuzz {
        table.checks.push(fuzz::run(count, arguments.seed, folder)?.check());
    }
    let covered = |(name, count, parameters): &(String, usize, usize)| {
        format!("{name} {count} settings of {parameters} parameters")
    };
    let facts = [
        ("Command", std::env::args().skip(1).fold("cargo xtask stability".to_owned(), |all, word| all + " " + &word)),
        ("Adapter", format!("{} ({} {})", native.info.name, native.info.driver, native.info.driver_info)),
        ("Commit", COMMIT.to_owned()),
        ("Settings", table.covered.iter().map(covered).collect::<Vec<_>>().join("; ")),
        ("Time", format!("{:.0} s", start.elapsed().as_secs_f64())),
    ];
    if let Some(folder) = &arguments.out {
        table.write(folder, &facts)?;
        terminal::note(format_args!("report: {}", folder.join("index.html").display()));
    }
    if arguments.json {
        print_json(&table.checks)?;
    } else {
        terminal::print(&table)?;
    }
    match table.unexplained().count() {
        0 => Ok(()),
        count => Err(Error::Failed(format!("{count} checks are red and not explained"))),
    }
}

fn print_json(value: &impl serde::Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Error::Failed(e.to_string()))?;
    Ok(terminal::print_line(text)?)
}

fn wants_faults(arguments: &Arguments) -> bool {
    let named = || arguments.rows.iter().any(|row| faults::GROUP.contains(row.as_str()));
    !arguments.quick && !arguments.only_random && (arguments.rows.is_empty() || named())
}

fn run_mutations(arguments: &Arguments) -> Result<(), Error> {
    let all = mutations::run(&AdapterChoice::from(arguments.adapter.as_str()), |_| true, arguments.quick)?;
    let text = markdown::table(&mutations::table(&all), 2);
    if let Some(folder) = &arguments.out {
        let path = OutputFolder::open(folder).claim("mutations.md")?;
        write_whole(&path, |file| file.write_all(text.as_bytes()))
            .map_err(|e: std::io::Error| Error::unwritable(&path, e))?;
    }
    if arguments.json {
        print_json(&all)?;
    } else {
        terminal::print(&text)?;
    }
    match all.iter().filter(|caught| caught.is_missed()).count() {
        0 => Ok(()),
        count => Err(Error::Failed(format!("{count} of {} bugs are not caught", all.len()))),
    }
}
