//! Steps back and forth through the states that somebody made.

use crate::state::State;

/// Steps that are kept.
const MOST: usize = 200;

/// The states before and after the current one.
#[derive(Debug)]
pub struct Undo {
    committed: State,
    before: Vec<State>,
    after: Vec<State>,
}

impl Undo {
    /// Nothing to undo yet.
    pub fn new(state: &State) -> Self {
        Self { committed: state.clone(), before: Vec::new(), after: Vec::new() }
    }

    /// Makes a step of what changed since the last call. Call it when no change is under way, so that dragging a
    /// slider is one step.
    pub fn commit(&mut self, state: &State) {
        if *state != self.committed {
            self.before.push(std::mem::replace(&mut self.committed, state.clone()));
            if self.before.len() > MOST {
                self.before.remove(0);
            }
            self.after.clear();
        }
    }

    /// Goes one step back; false where there is none.
    pub fn undo(&mut self, state: &mut State) -> bool {
        self.commit(state);
        let Some(earlier) = self.before.pop() else { return false };
        self.after.push(std::mem::replace(&mut self.committed, earlier));
        state.clone_from(&self.committed);
        true
    }

    /// Goes one step forth again; false where there is none.
    pub fn redo(&mut self, state: &mut State) -> bool {
        let Some(later) = self.after.pop() else { return false };
        self.before.push(std::mem::replace(&mut self.committed, later));
        state.clone_from(&self.committed);
        true
    }

    /// Whether there is a step back and a step forth.
    pub fn can(&self) -> [bool; 2] {
        [!self.before.is_empty(), !self.after.is_empty()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_go_back_and_forth() {
        let mut state = State::default();
        let mut undo = Undo::new(&state);
        let seeds = |undo: &mut Undo, state: &mut State| {
            for seed in [1, 2] {
                state.seed = seed;
                undo.commit(state);
                undo.commit(state);
            }
        };
        seeds(&mut undo, &mut state);
        assert_eq!(undo.can(), [true, false]);
        // A change that is not committed yet is a step of its own.
        state.seed = 3;
        for wanted in [2, 1, 0] {
            assert!(undo.undo(&mut state));
            assert_eq!(state.seed, wanted);
        }
        assert!(!undo.undo(&mut state));
        assert!(undo.redo(&mut state) && undo.redo(&mut state));
        assert_eq!(state.seed, 2);
        // A new change forgets what was undone.
        state.seed = 9;
        undo.commit(&state);
        assert!(!undo.redo(&mut state));
    }
}
