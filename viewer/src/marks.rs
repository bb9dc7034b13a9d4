//! Positions of controls on the screen, so that tests can click them.

use std::collections::BTreeMap;

use eframe::egui::Rect;

/// Rectangles of the controls of one pass of the interface, by name.
#[derive(Default)]
pub struct Marks(BTreeMap<String, Rect>);

impl Marks {
    /// Records where a control is.
    pub fn add(&mut self, name: &str, rect: Rect) {
        self.0.insert(name.to_owned(), rect);
    }

    /// Removes all marks, at the start of a pass.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Left, top, width and height of each control, points.
    pub fn rectangles(&self) -> BTreeMap<String, [f32; 4]> {
        let numbers = |rect: &Rect| [rect.left(), rect.top(), rect.width(), rect.height()];
        self.0.iter().map(|(name, rect)| (name.clone(), numbers(rect))).collect()
    }
}
