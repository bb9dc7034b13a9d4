//! Undo steps: egui's undoer, with a step as soon as a change is complete.

use eframe::egui::util::undoer::{Settings, Undoer};

use crate::state::State;

/// The states before and after the current one.
pub type Undo = Undoer<State>;

/// An undoer whose first step is this state.
pub fn undo_from(state: &State) -> Undo {
    let mut undo = Undo::with_settings(Settings { max_undos: 200, ..Settings::default() });
    undo.add_undo(state);
    undo
}

/// Adds an undo step if the state has changed since the last one. Call it when no change is in progress, so that
/// dragging a slider is one step.
pub fn commit(undo: &mut Undo, state: &State) {
    // The first call drops redo steps after a change. The second adds the step at once instead of after a delay.
    undo.feed_state(0.0, state);
    undo.add_undo(state);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_go_back_and_forth() {
        let with_seed = |seed| State { seed, ..State::default() };
        let mut undo = undo_from(&with_seed(0));
        for seed in [1, 1, 2, 2] {
            commit(&mut undo, &with_seed(seed));
        }
        assert!(undo.has_undo(&with_seed(2)) && !undo.has_redo(&with_seed(2)));
        // A change that is not committed yet is a step of its own.
        for (current, earlier) in [(3, 2), (2, 1), (1, 0)] {
            assert_eq!(undo.undo(&with_seed(current)), Some(&with_seed(earlier)));
        }
        assert_eq!(undo.undo(&with_seed(0)), None);
        for (current, later) in [(0, 1), (1, 2), (2, 3)] {
            assert_eq!(undo.redo(&with_seed(current)), Some(&with_seed(later)));
        }
        // A new change removes the redo steps.
        assert_eq!(undo.undo(&with_seed(3)), Some(&with_seed(2)));
        commit(&mut undo, &with_seed(9));
        assert_eq!(undo.redo(&with_seed(9)), None);
    }
}
