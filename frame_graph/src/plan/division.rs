//! How a long dispatch is divided into several, so that no watchdog ends the program.
//!
//! A pass declares the work of one invocation ([`PassBuilder::costs`](super::PassBuilder::costs)), and its shader has a
//! uniform block `division` (`common/division.wgsl`). The unit of work is about one fetch of a texel with the arithmetic
//! around it. Each dispatch of the pass covers a rectangle of whole workgroups and does at most as much work as
//! [`Gpu::work_at_once`](crate::Gpu::work_at_once). The work of a pass that declares nothing does not depend on settings.

use super::{FramePlan, Pass, Work};

/// Work of one dispatch on a GPU and in a browser: a quarter of a second on an integrated GPU with two billion fetches a
/// second, an eighth of what watchdogs allow (2 s in Windows). At 64 slices of 256 steps it is still 16,000 pixels, enough
/// to fill a GPU.
pub const WORK_ON_GPU: u64 = 1 << 29;

/// Work of one dispatch on a software adapter: less than 0.1 s on two processor cores.
pub const WORK_ON_PROCESSOR: u64 = 1 << 20;

/// Name of the uniform block of shaders whose dispatches can be divided.
pub(crate) const DIVISION: &str = "division";

/// A rectangle of workgroups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// First workgroup along x and y.
    pub(crate) first: [u32; 2],
    /// Workgroups along x and y.
    pub(crate) count: [u32; 2],
    /// Its work.
    pub(crate) work: u64,
}

impl Part {
    /// The uniform block `Division` of `common/division.wgsl`.
    pub(crate) fn block(&self, workgroup_size: [u32; 3]) -> [u32; 4] {
        let [x, y] = self.first;
        [x, y, x * workgroup_size[0], y * workgroup_size[1]]
    }
}

/// Divides `count` workgroups into parts of equal size with at most `most` of them, but at least one.
fn lengths(count: u32, most: u64) -> impl Iterator<Item = (u32, u32)> {
    let parts = u64::from(count).div_ceil(most.max(1)).max(1);
    let each = u64::from(count).div_ceil(parts).max(1) as u32;
    (0..count.max(1)).step_by(each as usize).map(move |first| (first, each.min(count - first)))
}

/// Divides a grid of workgroups into rows, or if a row is too long, into parts of rows.
fn parts(workgroups: [u32; 2], work: u64, at_once: u64) -> Vec<Part> {
    let [width, height] = workgroups;
    let most = at_once / work.max(1);
    let rows = most / u64::from(width.max(1));
    let columns = if rows == 0 { most } else { width.into() };
    let part = |(x, across): (u32, u32), (y, down): (u32, u32)| Part {
        first: [x, y],
        count: [across, down],
        work: work.saturating_mul(u64::from(across) * u64::from(down)),
    };
    lengths(height, rows).flat_map(|down| lengths(width, columns).map(move |across| part(across, down))).collect()
}

impl Pass {
    /// Its dispatches if none may do more work than `at_once`; empty for a pass that draws.
    pub(crate) fn parts(&self, at_once: u64) -> Vec<Part> {
        let Work::Dispatch { entry, size } = &self.work else { return Vec::new() };
        let Some(entry) = self.shader.entry_point(entry) else { return Vec::new() };
        let group = entry.workgroup_size.map(|side| side.max(1));
        let workgroups = [size[0].div_ceil(group[0]), size[1].div_ceil(group[1])];
        let work = self.cost.saturating_mul(group.iter().copied().map(u64::from).product());
        let divides = self.shader.bindings().any(|binding| binding.name == DIVISION);
        parts(workgroups, work, if divides { at_once } else { u64::MAX })
    }

    /// Number of its dispatches if none may do more work than `at_once`; 0 for a pass that draws. A single workgroup is
    /// never divided.
    pub fn dispatches(&self, at_once: u64) -> usize {
        self.parts(at_once).len()
    }
}

impl FramePlan {
    /// The number of dispatches of a pass in words; empty if it has one everywhere.
    pub(super) fn dispatches_in_words(pass: &Pass) -> String {
        let [gpu, processor] = [WORK_ON_GPU, WORK_ON_PROCESSOR].map(|at_once| pass.dispatches(at_once));
        let counted = |count: usize| if count == 1 { "1 dispatch".into() } else { format!("{count} dispatches") };
        match processor {
            0 | 1 => String::new(),
            _ => format!("; {} on a GPU, {processor} on a software adapter", counted(gpu)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that parts cover every workgroup once, and returns them.
    fn covering(workgroups: [u32; 2], work: u64, at_once: u64) -> Vec<Part> {
        let parts = parts(workgroups, work, at_once);
        let mut times = vec![0; (workgroups[0] * workgroups[1]) as usize];
        for part in &parts {
            assert!(part.work <= at_once.max(work), "{part:?}");
            for y in 0..part.count[1] {
                for x in 0..part.count[0] {
                    times[((part.first[1] + y) * workgroups[0] + part.first[0] + x) as usize] += 1;
                }
            }
        }
        assert!(times.iter().all(|&times| times == 1), "{workgroups:?} {work} {at_once}");
        parts
    }

    #[test]
    fn parts_cover_every_workgroup_once() {
        for workgroups in [[1, 1], [160, 90], [1440, 10], [7, 13], [1, 100]] {
            for work in [1, 64, 1000, 1 << 21] {
                for at_once in [1, 100, 1 << 12, 1 << 20, u64::MAX] {
                    covering(workgroups, work, at_once);
                }
            }
        }
    }

    #[test]
    fn short_dispatches_are_not_divided() {
        assert_eq!(covering([160, 90], 64, 160 * 90 * 64).len(), 1);
        assert_eq!(covering([160, 90], 64, 160 * 90 * 64 - 1).len(), 2, "two halves, not a whole and a rest");
        assert_eq!(covering([160, 90], 64, 160 * 64)[1], Part { first: [0, 1], count: [160, 1], work: 160 * 64 });
        // A row is too long.
        assert_eq!(covering([160, 90], 64, 159 * 64).len(), 180);
        assert_eq!(covering([160, 90], 64, 1).len(), 160 * 90);
    }
}
