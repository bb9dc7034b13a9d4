//! `evaluator run`.

use std::path::PathBuf;

use clap::Args;

use halflight_techniques::invocation::{Invocation, parse_size};

use crate::{
    Error,
    experiment::{RunOptions, grid::Grid, run, session::open_adapter},
};

#[derive(Args)]
pub(super) struct RunArgs {
    /// Grid file (.toml): scenes, sizes, and the parameters to sweep.
    #[arg(long, value_name = "FILE")]
    grid: PathBuf,
    /// Scene to run instead of those of the grid; may be given many times.
    #[arg(long = "scene", value_name = "FILE")]
    scenes: Vec<PathBuf>,
    /// Size to run instead of the grid's, pixels.
    #[arg(long, value_parser = parse_size, value_name = "WxH")]
    size: Option<[u32; 2]>,
    /// Report folder; index.html in it opens from disk.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Keep the cells that an earlier run of this grid finished.
    #[arg(long)]
    resume: bool,
    /// Adapter: any, gpu, software, part of a name, or its number in `evaluator list adapters`.
    #[arg(long, default_value = "any")]
    adapter: String,
    /// Run every Nth cell only, beginning with the Ith (from 0), to share a grid among machines.
    #[arg(long, value_name = "I/N", default_value = "0/1", value_parser = parse_shard)]
    shard: (usize, usize),
    /// Direct light that techniques read: rendered (shadow maps) or truth (path-traced) [default: that of the grid file]
    #[arg(long, value_name = "SOURCE", value_parser = ["rendered", "truth"])]
    direct: Option<String>,
    /// Look through every texture of each cell for NaN and infinity, and fail where there is one.
    #[arg(long)]
    check: bool,
}

impl RunArgs {
    /// The command that repeats the whole run: without `--resume`.
    fn invocation(&self) -> Invocation {
        let mut invocation =
            Invocation::evaluator("run").option("grid", self.grid.display()).option("out", self.out.display());
        for scene in &self.scenes {
            invocation = invocation.option("scene", scene.display());
        }
        if let Some(size) = self.size {
            invocation = invocation.size(size);
        }
        let (index, count) = self.shard;
        invocation
            .option_if("direct", self.direct.as_deref())
            .option_unless("adapter", self.adapter.as_str(), "any")
            .option_unless("shard", format!("{index}/{count}"), "0/1".into())
            .flag("check", self.check)
    }
}

fn parse_shard(text: &str) -> Result<(usize, usize), String> {
    let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    numbers
        .filter(|&(i, n): &(usize, usize)| i < n)
        .ok_or_else(|| "write I/N with I from 0 to N - 1, for example 0/4".into())
}

pub(super) fn main(args: &RunArgs) -> Result<(), Error> {
    let mut grid = Grid::read(&args.grid)?;
    if let Some(direct) = &args.direct {
        grid.direct_from_truth = direct == "truth";
    }
    if !args.scenes.is_empty() {
        grid.scenes.clone_from(&args.scenes);
    }
    if let Some(size) = args.size {
        grid.sizes = vec![size];
    }
    let native = open_adapter(&args.adapter)?;
    let options = RunOptions {
        out: &args.out,
        resume: args.resume,
        shard: args.shard,
        command: args.invocation(),
        check: args.check,
    };
    run(&native, &grid, &options)
}
