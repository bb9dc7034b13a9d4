//! `evaluator merge`.

use std::path::PathBuf;

use clap::Args;
use halflight_techniques::invocation::Invocation;

use halflight_native::cache::Cache;
use halflight_output::terminal;

use super::is_exr;
use crate::{
    Error,
    merge::{
        merge,
        reference::{ENDING, merge_references},
    },
};

#[derive(Args)]
pub(super) struct MergeArgs {
    /// Report folders of one grid, measured in parts (`evaluator run --shard`), or .truth files of one reference, traced
    /// in parts (`evaluator truth --shard`).
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Report folder; index.html in it opens from disk. Where cells are missing, missing.toml in it is their grid. For a
    /// reference, its image: .exr holds every channel, .png the tone-mapped image.
    #[arg(long, value_name = "DIR|FILE")]
    out: PathBuf,
    /// Fail (exit code 1) where cells are missing. The report of the others is written all the same.
    #[arg(long)]
    complete: bool,
}

impl MergeArgs {
    fn invocation(&self) -> Invocation {
        let named =
            self.folders.iter().fold(Invocation::evaluator("merge"), |all, folder| all.argument(folder.display()));
        named.option("out", self.out.display()).flag("complete", self.complete)
    }
}

pub(super) fn main(args: &MergeArgs) -> Result<(), Error> {
    let is_reference = |path: &PathBuf| path.extension().is_some_and(|ending| ending == ENDING);
    if args.folders.iter().any(is_reference) {
        if let Some(other) = args.folders.iter().find(|path| !is_reference(path)) {
            return Err(Error::BadInput(format!(
                "{} is no .truth file as the others are: merge references and folders apart",
                other.display()
            )));
        }
        is_exr(&args.out)?;
        let truth = merge_references(&args.folders, &args.out, &Cache::standard(), &args.invocation().to_string())?;
        terminal::note(format_args!(
            "{} samples a pixel from {} parts in {}; they are in the cache, too",
            truth.samples,
            args.folders.len(),
            args.out.display()
        ));
        return Ok(());
    }
    let merged = merge(&args.folders, &args.out, args.invocation().to_string())?;
    if args.complete && merged.missing() > 0 {
        return Err(Error::Failed(format!(
            "{} of {} cells are missing in {}: measure the grid missing.toml there, and merge again",
            merged.missing(),
            merged.cells,
            args.out.display()
        )));
    }
    Ok(())
}
