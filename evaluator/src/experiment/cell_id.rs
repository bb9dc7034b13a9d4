//! The name of a cell, whatever grid it stands in.

use std::fmt;

use halflight_native::cache::KeyInputs;

use super::{grid::Cell, moving::Moving};
use crate::format;

/// A cell by its content: scene, size, technique, settings, motion and frame, 16 hexadecimal digits. It is the same in every grid, on
/// every computer and under every path of the scene file, so a grid that grows keeps its finished cells and their shards.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CellId(String);

impl CellId {
    /// The name of a cell of the scene with this hash, at this size.
    pub fn new(scene_hash: &str, size: [u32; 2], cell: &Cell) -> Self {
        let mut inputs = KeyInputs::default();
        inputs.add_text(scene_hash).add(&size).add_text(cell.technique.name);
        inputs.add_text(&format::settings(&cell.settings));
        // Only where they are set, so that other cells keep the names that they had before.
        if cell.moving != Moving::Nothing {
            inputs.add_text(&format!("moving={}", cell.moving));
        }
        if let Some(frame) = cell.at_frame {
            inputs.add_text(&format!("at_frame={frame}"));
        }
        Self(inputs.key().as_str().chars().take(16).collect())
    }

    /// The digits.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The digits as a number.
    pub fn number(&self) -> u64 {
        Self::number_of(&self.0)
    }

    /// The digits of a name as a number; 0 for any other text.
    pub fn number_of(text: &str) -> u64 {
        u64::from_str_radix(text, 16).unwrap_or_default()
    }
}

impl fmt::Display for CellId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::{collections::BTreeSet, path::Path};

    use super::*;
    use crate::experiment::grid::Grid;

    fn ids(samples: &str, scene_hash: &str, size: [u32; 2]) -> Vec<CellId> {
        let text = format!(
            "scenes = ['a']\nsize = ['8x8']\n[[sweep]]\ntechnique = 'hierarchical'\n\
             grid = {{ samples = [{samples}], levels = [3, 4, 5] }}"
        );
        let grid = Grid::parse(Path::new("g.toml"), &text).unwrap();
        grid.cells().map(|cell| CellId::new(scene_hash, size, &cell)).collect()
    }

    #[test]
    fn frames_and_motion_are_in_the_name() {
        let ids = |keys: &str| -> Vec<CellId> {
            let text = format!("scenes = ['a']\nsize = ['8x8']\n[[sweep]]\ntechnique = 'radiance-cache'\n{keys}");
            let grid = Grid::parse(Path::new("g.toml"), &text).unwrap();
            grid.cells().map(|cell| CellId::new("s", [8, 8], &cell)).collect()
        };
        let plain = ids("");
        assert_eq!(plain, ids("moving = ['nothing']"));
        let all: BTreeSet<CellId> =
            ids("at_frames = [1, 8]\nmoving = ['nothing', 'camera', 'lights']").into_iter().chain(plain).collect();
        assert_eq!(all.len(), 7);
    }

    #[test]
    fn a_cell_keeps_its_name_when_its_grid_grows() {
        let small: BTreeSet<CellId> = ids("16, 64", "s", [8, 8]).into_iter().collect();
        let grown: BTreeSet<CellId> = ids("8, 16, 32, 64", "s", [8, 8]).into_iter().collect();
        assert_eq!((small.len(), grown.len()), (6, 12));
        assert!(small.is_subset(&grown));
        for other in [ids("16, 64", "another scene", [8, 8]), ids("16, 64", "s", [8, 9])] {
            assert!(other.iter().all(|id| !small.contains(id) && id.as_str().len() == 16));
        }
    }
}
