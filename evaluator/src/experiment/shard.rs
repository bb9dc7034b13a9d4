//! Which part of the work a process does, where a scheduler starts many.

use std::{fmt, ops::Range};

use super::cell_id::CellId;

/// Part `index` of `count`, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u32,
    count: u32,
}

impl Default for Shard {
    fn default() -> Self {
        Self::ALL
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl Shard {
    /// All of the work.
    pub const ALL: Self = Self { index: 0, count: 1 };

    /// Parses `I/N`, or for `auto` takes part and number of parts from what the scheduler set in the environment:
    /// `SLURM_ARRAY_TASK_ID` and `SLURM_ARRAY_TASK_COUNT` of a Slurm array, or `JOB_COMPLETION_INDEX` of a Kubernetes
    /// Indexed Job. `parts` is the number of parts where the scheduler does not say it, or runs some parts only.
    ///
    /// # Errors
    /// One sentence with the fix, for `--shard` and `--shards`.
    pub fn parse(text: &str, parts: Option<u32>, environment: &dyn Fn(&str) -> Option<String>) -> Result<Self, String> {
        if text == "auto" {
            return Self::of_scheduler(parts, environment);
        }
        if parts.is_some() {
            return Err(format!("--shards goes with --shard auto only: leave it out, --shard {text} says the number"));
        }
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        numbers.filter(|&(i, n): &(u32, u32)| i < n).map(|(index, count)| Self { index, count }).ok_or_else(|| {
            format!("--shard {text} is no part: write I/N with I from 0 to N - 1, for example 0/4, or auto")
        })
    }

    fn of_scheduler(parts: Option<u32>, environment: &dyn Fn(&str) -> Option<String>) -> Result<Self, String> {
        let number = |name: &str| {
            let text = environment(name).filter(|text| !text.is_empty());
            let parse = |text: String| {
                text.parse::<u32>().map_err(|_| format!("{name} is {text}, which is no number: set it to the part"))
            };
            text.map(parse).transpose()
        };
        if let Some(index) = number("SLURM_ARRAY_TASK_ID")? {
            let array = || {
                let names = ["SLURM_ARRAY_TASK_COUNT", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX"];
                let [count, least, most] = names.map(number);
                Ok::<_, String>((count?, least?.unwrap_or(0), most?))
            };
            let count = match (parts, array()?) {
                (Some(parts), _) => parts,
                // A part of an array, such as --array=2 to repeat one task, would be taken for the whole.
                (None, (Some(count), 0, most)) if most.is_none_or(|most| most + 1 == count) => count,
                (None, (Some(count), least, most)) => {
                    let most = most.unwrap_or(least + count);
                    return Err(format!(
                        "the Slurm array has {count} tasks from {least} to {most}, which are not all parts from 0: submit \
                         it with --array=0-{}, or give --shards N to run some of N parts",
                        count.saturating_sub(1)
                    ));
                }
                (None, (None, ..)) => {
                    return Err("SLURM_ARRAY_TASK_COUNT is not set: give the number of parts by --shards N".into());
                }
            };
            return Self::checked("SLURM_ARRAY_TASK_ID", index, count);
        }
        if let Some(index) = number("JOB_COMPLETION_INDEX")? {
            let count = parts.ok_or(
                "JOB_COMPLETION_INDEX does not say how many parts there are: give the completions of the job by --shards N",
            )?;
            return Self::checked("JOB_COMPLETION_INDEX", index, count);
        }
        Err("--shard auto finds neither SLURM_ARRAY_TASK_ID nor JOB_COMPLETION_INDEX in the environment: run it in a Slurm \
             array or a Kubernetes Indexed Job, or write --shard I/N"
            .into())
    }

    fn checked(name: &str, index: u32, count: u32) -> Result<Self, String> {
        if index < count {
            Ok(Self { index, count })
        } else {
            Err(format!("{name} is {index}, and {count} parts are numbered from 0: number the tasks from 0 to N - 1"))
        }
    }

    /// Whether it is all of the work.
    pub fn is_all(&self) -> bool {
        self.count == 1
    }

    /// Whether a cell belongs to this part: by its name alone, so that it stays there when its grid grows.
    pub fn holds(&self, cell: &CellId) -> bool {
        cell.number() % u64::from(self.count) == u64::from(self.index)
    }

    /// This part of a row of `total` things: parts differ by one at most and cover all.
    pub fn range(&self, total: u32) -> Range<u32> {
        let end = |index: u32| (u64::from(index) * u64::from(total) / u64::from(self.count)) as u32;
        end(self.index)..end(self.index + 1)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::collections::BTreeMap;

    use super::*;

    fn auto(parts: Option<u32>, variables: &[(&str, &str)]) -> Result<String, String> {
        let variables: BTreeMap<_, _> = variables.iter().copied().collect();
        let environment = |name: &str| variables.get(name).map(|&value| value.to_owned());
        Shard::parse("auto", parts, &environment).map(|shard| shard.to_string())
    }

    #[test]
    fn a_part_is_written_or_found() {
        let none = |_: &str| None;
        assert_eq!(Shard::parse("2/5", None, &none).unwrap().to_string(), "2/5");
        for text in ["5/5", "1", "-1/4", "a/b", "0/0", ""] {
            assert!(Shard::parse(text, None, &none).unwrap_err().contains("I/N"), "{text}");
        }
        assert!(Shard::parse("0/2", Some(2), &none).unwrap_err().contains("--shards goes with --shard auto"));

        let slurm = |id, count, least, most| {
            [
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_COUNT", count),
                ("SLURM_ARRAY_TASK_MIN", least),
                ("SLURM_ARRAY_TASK_MAX", most),
            ]
        };
        assert_eq!(auto(None, &slurm("3", "4", "0", "3")), Ok("3/4".into()));
        // One task of four that is repeated alone.
        assert!(auto(None, &slurm("2", "1", "2", "2")).unwrap_err().contains("--shards N"));
        assert_eq!(auto(Some(4), &slurm("2", "1", "2", "2")), Ok("2/4".into()));
        assert!(auto(None, &slurm("4", "4", "1", "4")).unwrap_err().contains("--array=0-3"));
        assert!(auto(Some(4), &slurm("4", "1", "4", "4")).unwrap_err().contains("numbered from 0"));
        assert!(auto(None, &slurm("x", "4", "0", "3")).unwrap_err().contains("SLURM_ARRAY_TASK_ID is x"));

        assert_eq!(auto(Some(8), &[("JOB_COMPLETION_INDEX", "7")]), Ok("7/8".into()));
        assert!(auto(None, &[("JOB_COMPLETION_INDEX", "7")]).unwrap_err().contains("--shards N"));
        assert!(auto(Some(7), &[("JOB_COMPLETION_INDEX", "7")]).unwrap_err().contains("numbered from 0"));
        let neither = auto(Some(4), &[]).unwrap_err();
        assert!(neither.contains("SLURM_ARRAY_TASK_ID") && neither.contains("JOB_COMPLETION_INDEX"), "{neither}");
    }

    #[test]
    fn ranges_cover_all_and_differ_by_one() {
        for (total, count) in [(10, 4), (3, 5), (64, 4), (0, 2)] {
            let ranges: Vec<_> = (0..count).map(|index| Shard { index, count }.range(total)).collect();
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert_eq!((ranges[0].start, ranges[count as usize - 1].end), (0, total));
            let lengths = || ranges.iter().map(|range| range.end - range.start);
            assert!(lengths().max().unwrap() - lengths().min().unwrap() <= 1);
        }
    }
}
