//! `evaluator stability`.

use std::{io::Write, path::PathBuf};

use clap::Args;
use halflight_native::{AdapterChoice, files::write_whole};
use halflight_output::{OutputFolder, terminal};

use super::print_json;
use crate::{
    Error,
    experiment::session::open_adapter,
    stability::{Options, Suite, Table, faults, fuzz, mutations, random},
};

#[derive(Args)]
pub(super) struct StabilityArgs {
    /// Technique to look at; may be given many times. All of them unless told.
    #[arg(long = "technique", value_name = "NAME")]
    techniques: Vec<String>,
    /// A few settings a row instead of all pairs of values: seconds instead of minutes.
    #[arg(long)]
    quick: bool,
    /// Only rows whose group or name holds this text; may be given many times.
    #[arg(long = "row", value_name = "TEXT")]
    rows: Vec<String>,
    /// Folder for the page, the Markdown and the CSV table.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run this many random scenes, cameras, sizes and settings as well.
    #[arg(long, value_name = "COUNT")]
    random: Option<usize>,
    /// Read this many damaged models, materials, scenes, grids and presets as well.
    #[arg(long, value_name = "COUNT")]
    fuzz: Option<u64>,
    /// Seed of what is random.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Only what is random: leave the rows out.
    #[arg(long)]
    only_random: bool,
    /// Prove the suite instead: put deliberate bugs into the shaders, one after another, and say which rows turn red.
    #[arg(long)]
    mutations: bool,
    /// Adapter: any, gpu, software, or part of a name.
    #[arg(long, default_value = "any")]
    adapter: String,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn main(args: &StabilityArgs) -> Result<(), Error> {
    if args.mutations {
        return prove(args);
    }
    let native = open_adapter(&args.adapter)?;
    let start = std::time::Instant::now();
    let options = Options { techniques: args.techniques.clone(), quick: args.quick, rows: args.rows.clone() };
    let mut table = if args.only_random { Table::default() } else { Suite::run(&native, &options)? };
    if !args.quick
        && !args.only_random
        && (args.rows.is_empty() || args.rows.iter().any(|row| "faults".contains(row.as_str())))
    {
        let own = std::env::current_exe().map_err(|e| Error::Failed(format!("this program cannot be found: {e}")))?;
        let place = std::env::temp_dir().join(format!("halflight-faults-{}", std::process::id()));
        table.checks.extend(faults::run(&own, &place, &args.adapter)?);
    }
    let adapter = AdapterChoice::from(args.adapter.as_str());
    let folder = args.out.as_deref();
    let chance = args.random.map(|count| random::run(&adapter, count, args.seed, folder)).transpose()?;
    let damaged = args.fuzz.map(|count| fuzz::run(count, args.seed, folder)).transpose()?;
    table.add_chance(chance.as_ref(), damaged.as_ref());
    let covered = |(name, count, parameters): &(String, usize, usize)| {
        format!("{name} {count} settings of {parameters} parameters")
    };
    let facts = [
        ("Command", std::env::args().skip(1).fold("evaluator".to_owned(), |all, word| all + " " + &word)),
        ("Adapter", format!("{} ({} {})", native.info.name, native.info.driver, native.info.driver_info)),
        ("Commit", crate::experiment::COMMIT.to_owned()),
        ("Settings", table.covered.iter().map(covered).collect::<Vec<_>>().join("; ")),
        ("Time", format!("{:.0} s", start.elapsed().as_secs_f64())),
    ];
    if let Some(folder) = &args.out {
        table.write(folder, &facts)?;
        terminal::note(format_args!("report: {}", folder.join("index.html").display()));
    }
    if args.json {
        print_json(&table.checks)?;
    } else {
        terminal::print(&table)?;
    }
    match table.unexplained().count() {
        0 => Ok(()),
        count => Err(Error::Failed(format!("{count} checks are red and not explained"))),
    }
}

fn prove(args: &StabilityArgs) -> Result<(), Error> {
    let all = mutations::run(&AdapterChoice::from(args.adapter.as_str()), |_| true, args.quick)?;
    let text = crate::report::document::markdown::table(&mutations::table(&all), 2);
    if let Some(folder) = &args.out {
        let path = OutputFolder::open(folder).claim("mutations.md")?;
        write_whole(&path, |file| file.write_all(text.as_bytes()))
            .map_err(|e: std::io::Error| Error::unwritable(&path, e))?;
    }
    if args.json {
        print_json(&all)?;
    } else {
        terminal::print(&text)?;
    }
    match all.iter().filter(|caught| caught.is_missed()).count() {
        0 => Ok(()),
        count => Err(Error::Failed(format!("{count} of {} bugs are not caught", all.len()))),
    }
}
