//! The next thing to try, for somebody who sees the page for the first time.

/// What the user has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hints {
    /// Moved the divider.
    pub divider: bool,
    /// Moved the camera.
    pub camera: bool,
    /// Played the animation or moved the light.
    pub play: bool,
    /// Changed a technique or one of its settings.
    pub settings: bool,
    /// Asked for no more hints.
    pub off: bool,
}

impl Hints {
    /// What to try next; `None` after everything. `compare`: whether there is a divider. `moves`: what moves when playing.
    pub fn next(&self, compare: bool, moves: Option<&str>) -> Option<String> {
        if self.off {
            return None;
        }
        if compare && !self.divider {
            return Some("Drag the divider: A is on its left, B on its right.".into());
        }
        if !self.camera {
            return Some("Drag the picture to look around. Scroll or pinch to zoom.".into());
        }
        if let (Some(what), false) = (moves, self.play) {
            return Some(format!("Press Play: {what}, and the light follows."));
        }
        (!self.settings).then(|| "Choose another technique, and compare its time and error.".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_hint_goes_away_when_it_was_followed() {
        let mut hints = Hints::default();
        let mut seen = Vec::new();
        for step in 0..4 {
            seen.push(hints.next(true, Some("the sun moves")).expect("a hint"));
            match step {
                0 => hints.divider = true,
                1 => hints.camera = true,
                2 => hints.play = true,
                _ => hints.settings = true,
            }
        }
        assert!(seen[2].contains("the sun moves"));
        seen.dedup();
        assert_eq!((seen.len(), hints.next(true, None)), (4, None));
        // Nothing that is not there is suggested.
        assert!(Hints::default().next(false, None).is_some_and(|hint| hint.contains("look around")));
        let moved = Hints { camera: true, ..Hints::default() };
        assert!(moved.next(false, None).is_some_and(|hint| hint.contains("technique")));
        assert_eq!(Hints { off: true, ..Hints::default() }.next(true, None), None);
    }
}
