//! Messages to the user, one a line: what happened, and what to do.

use eframe::egui::{Color32, Label, RichText, ScrollArea, Ui};
use web_time::{Duration, Instant};

use crate::{marks::Marks, style::square};

/// Most messages that are kept.
const MOST: usize = 6;
/// Time after which a note goes away by itself.
pub const NOTE: Duration = Duration::from_secs(8);
/// Height of the messages before they scroll, points.
const HEIGHT: f32 = 96.0;

/// How serious a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Something was done.
    Note,
    /// Something is not as in the file or link.
    Warning,
    /// Something could not be done.
    Failure,
}

impl Severity {
    fn colour(self) -> Color32 {
        match self {
            Self::Note => Color32::from_gray(170),
            Self::Warning => Color32::from_rgb(245, 196, 81),
            Self::Failure => Color32::from_rgb(255, 125, 115),
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Note => "Note",
            Self::Warning => "Warning",
            Self::Failure => "Failure",
        }
    }
}

struct Message {
    severity: Severity,
    text: String,
    since: Instant,
}

/// The messages, oldest first.
#[derive(Default)]
pub struct Messages(Vec<Message>);

impl Messages {
    /// Adds a message; an equal one moves to the end. The least serious of too many is dropped.
    pub fn add(&mut self, severity: Severity, text: impl Into<String>) {
        let text = text.into();
        self.0.retain(|message| message.text != text);
        self.0.push(Message { severity, text, since: Instant::now() });
        if self.0.len() > MOST
            && let Some(least) = (0..self.0.len()).min_by_key(|&index| self.0[index].severity)
        {
            self.0.remove(least);
        }
    }

    /// Removes all messages.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Removes old notes. Returns the time after which the next one is old.
    pub fn tidy(&mut self) -> Option<Duration> {
        self.0.retain(|message| message.severity != Severity::Note || message.since.elapsed() < NOTE);
        let notes = self.0.iter().filter(|message| message.severity == Severity::Note);
        notes.map(|message| NOTE.saturating_sub(message.since.elapsed())).min()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Their texts.
    pub fn texts(&self) -> Vec<String> {
        self.0.iter().map(|message| message.text.clone()).collect()
    }

    /// Draws one a line, each with a button that removes it.
    pub fn show(&mut self, ui: &mut Ui, marks: &mut Marks) {
        let mut dismissed = None;
        ScrollArea::vertical().max_height(HEIGHT).auto_shrink([false, true]).show(ui, |ui| {
            for (index, message) in self.0.iter().enumerate() {
                ui.horizontal_top(|ui| {
                    let close = ui.small_button("x").on_hover_text("Remove this message");
                    if index == 0 {
                        marks.add("dismiss", close.rect);
                    }
                    if close.clicked() {
                        dismissed = Some(index);
                    }
                    ui.vertical(|ui| {
                        ui.add_space(7.0);
                        square(ui, message.severity.colour());
                    });
                    let text = format!("{}: {}", message.severity.word(), message.text);
                    let text = RichText::new(text).color(message.severity.colour());
                    ui.add(Label::new(text).wrap());
                });
            }
        });
        if let Some(index) = dismissed {
            self.0.remove(index);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_outlast_notes() {
        let mut messages = Messages::default();
        messages.add(Severity::Failure, "broken");
        for number in 0..2 * MOST {
            messages.add(Severity::Note, format!("note {number}"));
            messages.add(Severity::Note, "again");
        }
        let texts = messages.texts();
        assert_eq!((texts.len(), texts[0].as_str(), texts[MOST - 1].as_str()), (MOST, "broken", "again"));
        assert_eq!(texts.iter().filter(|text| *text == "again").count(), 1);
        assert!(messages.tidy().is_some_and(|left| left <= NOTE));
        messages.clear();
        assert!(messages.is_empty() && messages.tidy().is_none());
    }
}
