//! Saving the picture: PNG as it is shown, or EXR with linear radiance.

use eframe::egui::Ui;
use exr::image::{Encoding, Image, SpecificChannels};
use exr::prelude::WritableImage;

use super::{Solo, Viewer};
use crate::{
    messages::Severity,
    readback::TextureReading,
    state::{State, View},
    style::SIDE_NAMES,
};

/// A picture that is read back to be saved.
pub struct Saving {
    /// Name of the file, without its ending.
    name: String,
    size: [u32; 2],
    contents: Contents,
}

enum Contents {
    /// Display colours of the sides, B only where it is shown, and the divider.
    Shown { sides: [Option<TextureReading>; 2], divider: f32 },
    /// Linear values of one side.
    Linear(TextureReading),
}

/// Display colours of two sides as they are seen: A left of the divider, B right of it.
fn divided(a: Vec<u8>, b: Option<&[u8]>, width: u32, divider: f32) -> Vec<u8> {
    let Some(b) = b else { return a };
    let first = 4 * (divider * width as f32).round() as usize;
    let row = 4 * width as usize;
    let mut pixels = a;
    for (line, other) in pixels.chunks_exact_mut(row).zip(b.chunks_exact(row)) {
        line[first.min(row)..].copy_from_slice(&other[first.min(row)..]);
    }
    pixels
}

/// An OpenEXR file with the channels R, G and B, float32.
///
/// # Errors
/// What the library says of it.
fn exr_file([width, height]: [u32; 2], pixels: &[[f32; 4]]) -> Result<Vec<u8>, String> {
    let channels = SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
        let [r, g, b, _] = pixels[at.1 * width as usize + at.0];
        (r, g, b)
    });
    let mut image = Image::from_channels((width as usize, height as usize), channels);
    image.layer_data.encoding = Encoding::FAST_LOSSLESS;
    let mut file = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut file).map_err(|error| error.to_string())?;
    Ok(file.into_inner())
}

/// Name of a picture's file, without its ending.
fn file_name(state: &State, view: &View, sides: &[usize]) -> String {
    let mut name = format!("halflight-{}", state.scene);
    if *view == View::Reference {
        return name + "-reference";
    }
    if *view != View::Output("final") {
        name += &format!("-{}", view.name());
    }
    for &side in sides {
        name += &format!("-{}", state.sides[side].technique);
    }
    name
}

impl Viewer {
    /// The sides that are shown.
    fn shown_sides(&self) -> Vec<usize> {
        match self.solo {
            Some(Solo::B) => vec![1],
            Some(Solo::A | Solo::Reference) => vec![0],
            None if self.state.compare => vec![0, 1],
            None => vec![0],
        }
    }

    /// The menu of what can be saved.
    pub(super) fn save_menu(&mut self, ui: &mut Ui) {
        let menu = ui.menu_button("Save", |ui| {
            let png = ui.button("Picture, PNG").on_hover_text("As it is shown, at its own size");
            self.marks.add("save.png", png.rect);
            if png.clicked() {
                self.save_shown();
                ui.close();
            }
            for side in self.shown_sides() {
                let letter = if self.state.compare { SIDE_NAMES[side] } else { "the picture" };
                let tip = "Linear values without exposure, float32: radiance, or what the view shows";
                let exr = ui.button(format!("Values of {letter}, EXR")).on_hover_text(tip);
                self.marks.add(&format!("save.exr.{side}"), exr.rect);
                if exr.clicked() {
                    self.save_linear(side);
                    ui.close();
                }
            }
        });
        self.marks.add("save", menu.response.rect);
    }

    fn save_shown(&mut self) {
        let shown = self.shown_sides();
        let read =
            |side: usize| self.sides[side].as_ref()?.display().map(|texture| TextureReading::new(&self.gpu, texture));
        let divider = if self.view() == View::Reference { 1.0 } else { self.state.divider };
        let sides = match shown.as_slice() {
            [one] => [read(*one), None],
            _ => [read(0), read(1)],
        };
        if sides[0].is_none() {
            self.messages.add(Severity::Warning, "there is no picture to save yet: wait until it is drawn");
            return;
        }
        let name = file_name(&self.state, &self.view(), &shown);
        self.saving = Some(Saving { name, size: self.state.size, contents: Contents::Shown { sides, divider } });
    }

    fn save_linear(&mut self, side: usize) {
        let view = self.view();
        let reference = self.reference.found.as_ref().map(|found| &found.textures.picture);
        let texture = match &view {
            View::Reference => reference,
            View::Output(name) => self.sides[side].as_ref().and_then(|side| side.output(name)),
            // A map of errors and single steps have no linear picture.
            View::Error | View::Texture(_) => self.sides[side].as_ref().and_then(|side| side.output("final")),
        };
        let Some(texture) = texture else {
            self.messages.add(Severity::Warning, "this view has no values to save: choose the view \"Picture\"");
            return;
        };
        let contents = Contents::Linear(TextureReading::new(&self.gpu, texture));
        let view = if matches!(view, View::Error | View::Texture(_)) { View::Output("final") } else { view };
        self.saving = Some(Saving { name: file_name(&self.state, &view, &[side]), size: self.state.size, contents });
    }

    /// Saves the picture once it is read; true while it is read.
    pub(super) fn finish_saving(&mut self) -> bool {
        let Some(saving) = &mut self.saving else { return false };
        let (name, size) = (&saving.name, saving.size);
        let message = match &mut saving.contents {
            Contents::Linear(reading) => {
                let Some(pixels) = reading.take() else { return true };
                match exr_file(size, &pixels) {
                    Ok(file) => self.host.save(&format!("{name}.exr"), &file),
                    Err(error) => format!("{name}.exr was not saved: {error}"),
                }
            }
            Contents::Shown { sides, divider } => {
                let [a, b] = sides;
                if !a.iter().chain(b.iter()).all(TextureReading::is_ready) {
                    return true;
                }
                let [a, b] = [a, b].map(|reading| reading.as_ref().and_then(TextureReading::take_bytes));
                let pixels = divided(a.unwrap_or_default(), b.as_deref(), size[0], *divider);
                self.host.save_picture(&format!("{name}.png"), size[0], &pixels)
            }
        };
        self.messages.add(Severity::Note, message);
        self.saving = None;
        false
    }
}

#[cfg(test)]
mod tests {
    use exr::prelude::{ReadChannels, ReadLayers};

    use super::*;

    #[test]
    fn a_divided_picture_has_a_left_and_b_right() {
        let (a, b) = (vec![1; 4 * 4 * 2], vec![2; 4 * 4 * 2]);
        let both = divided(a.clone(), Some(&b), 4, 0.25);
        let row = [1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2];
        assert_eq!(both, [row, row].concat());
        assert_eq!(divided(a.clone(), None, 4, 0.25), a);
        assert_eq!([0.0, 1.0].map(|divider| divided(a.clone(), Some(&b), 4, divider)), [b, a]);
    }

    #[test]
    fn an_exr_file_keeps_linear_values() {
        let pixels: Vec<[f32; 4]> = (0..6).map(|i| [i as f32, 1e-7, 7e4 * i as f32, 1.0]).collect();
        let file = exr_file([3, 2], &pixels).expect("a file");
        let read = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(std::io::Cursor::new(file))
            .expect("an image");
        assert_eq!((read.layer_data.size.0, read.layer_data.size.1), (3, 2));
        for channel in read.layer_data.channel_data.list {
            let index = ["R", "G", "B"].iter().position(|name| channel.name == **name).expect("a colour");
            let found: Vec<f32> = channel.sample_data.values_as_f32().collect();
            assert_eq!(found, pixels.iter().map(|pixel| pixel[index]).collect::<Vec<_>>());
        }
    }

    #[test]
    fn files_are_named_by_what_they_show() {
        let state = State { scene: "atrium".into(), ..State::default() };
        assert_eq!(file_name(&state, &View::Output("final"), &[0]), "halflight-atrium-hierarchical");
        assert_eq!(
            file_name(&state, &View::Output("depth"), &[0, 1]),
            "halflight-atrium-depth-hierarchical-hierarchical"
        );
        assert_eq!(file_name(&state, &View::Reference, &[0]), "halflight-atrium-reference");
    }
}
