//! `evaluator run`.

use std::path::PathBuf;

use clap::Args;

use halflight_techniques::invocation::{Invocation, parse_size};

use super::parse_shard;
use crate::{
    Error,
    experiment::{RunOptions, grid::Grid, run, session::open_adapter, shard::Shard},
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
    /// Measure part I of N only (I from 0), to share a grid among machines: `evaluator merge` joins the folders. `auto`
    /// takes the part from the Slurm array or the Kubernetes Indexed Job that this runs in.
    #[arg(long, value_name = "I/N|auto", default_value = "0/1")]
    shard: String,
    /// Number of parts for --shard auto, where the scheduler does not say it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    shards: Option<u32>,
    /// Direct light that techniques read: rendered (shadow maps) or truth (path-traced) [default: that of the grid file]
    #[arg(long, value_name = "SOURCE", value_parser = ["rendered", "truth"])]
    direct: Option<String>,
    /// Look through every texture of each cell for NaN and infinity, and fail where there is one.
    #[arg(long)]
    check: bool,
}

impl RunArgs {
    /// The command that repeats the whole run: without `--resume`.
    fn invocation(&self, shard: Shard) -> Invocation {
        let mut invocation =
            Invocation::evaluator("run").option("grid", self.grid.display()).option("out", self.out.display());
        for scene in &self.scenes {
            invocation = invocation.option("scene", scene.display());
        }
        if let Some(size) = self.size {
            invocation = invocation.size(size);
        }
        invocation
            .option_if("direct", self.direct.as_deref())
            .option_unless("adapter", self.adapter.as_str(), "any")
            .option_if("shard", (!shard.is_all()).then_some(shard))
            .flag("check", self.check)
    }
}

pub(super) fn main(args: &RunArgs) -> Result<(), Error> {
    let shard = parse_shard(&args.shard, args.shards)?;
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
    let options =
        RunOptions { out: &args.out, resume: args.resume, shard, command: args.invocation(shard), check: args.check };
    run(&native, &grid, &options)
}
