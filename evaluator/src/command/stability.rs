//! `evaluator stability`.

use std::path::PathBuf;

use clap::Args;

use crate::{
    Error,
    session::open_adapter,
    stability::{Options, Suite},
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
    /// Adapter: any, gpu, software, or part of a name.
    #[arg(long, default_value = "any")]
    adapter: String,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn main(args: &StabilityArgs) -> Result<(), Error> {
    let native = open_adapter(&args.adapter)?;
    let start = std::time::Instant::now();
    let options = Options { techniques: args.techniques.clone(), quick: args.quick, rows: args.rows.clone() };
    let table = Suite::run(&native, &options)?;
    let covered = |(name, count, parameters): &(String, usize, usize)| {
        format!("{name} {count} settings of {parameters} parameters")
    };
    let facts = [
        ("Command", std::env::args().skip(1).fold("evaluator".to_owned(), |all, word| all + " " + &word)),
        ("Adapter", format!("{} ({} {})", native.info.name, native.info.driver, native.info.driver_info)),
        ("Commit", crate::run::COMMIT.to_owned()),
        ("Settings", table.covered.iter().map(covered).collect::<Vec<_>>().join("; ")),
        ("Time", format!("{:.0} s", start.elapsed().as_secs_f64())),
    ];
    if let Some(folder) = &args.out {
        table.write(folder, &facts)?;
        eprintln!("report: {}", folder.join("index.html").display());
    }
    if args.json {
        println!("{}", serde_json::to_string_pretty(&table.checks).map_err(|e| Error::Failed(e.to_string()))?);
    } else {
        print!("{table}");
    }
    match table.unexplained().count() {
        0 => Ok(()),
        count => Err(Error::Failed(format!("{count} checks are red and not explained"))),
    }
}
