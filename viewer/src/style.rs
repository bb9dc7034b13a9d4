//! Text sizes, spacing and colours of the interface.

use std::sync::Arc;

use eframe::egui::{
    Color32, Context, FontData, FontDefinitions, FontFamily, Rect, RichText, Sense, TextStyle, ThemePreference, Ui,
    vec2,
};

/// Colours of A (blue) and B (orange): for letters, points and lines. Distinct with common forms of colour blindness.
pub const SIDE_COLOURS: [Color32; 2] = [Color32::from_rgb(96, 165, 250), Color32::from_rgb(251, 158, 74)];

/// Names of the sides.
pub const SIDE_NAMES: [&str; 2] = ["A", "B"];

/// A small square in this colour, as in a legend. Not a character, because fonts may lack it.
pub fn square(ui: &mut Ui, colour: Color32) -> Rect {
    let (rect, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
    ui.painter().rect_filled(rect, 2.0, colour);
    rect
}

/// The letter of a side in its colour.
pub fn letter(side: usize) -> RichText {
    RichText::new(SIDE_NAMES[side]).color(SIDE_COLOURS[side]).strong()
}

/// Ubuntu Light without its hinting: see build.rs.
const TEXT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/text.ttf"));

/// One font for everything: its figures have one width, so columns of numbers need no other one.
fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::empty();
    for (name, bytes) in [
        ("text", TEXT),
        // Symbols of egui's own controls.
        ("icons", epaint_default_fonts::EGUI_ICONS),
    ] {
        fonts.font_data.insert(name.to_owned(), Arc::new(FontData::from_static(bytes)));
        for family in [FontFamily::Proportional, FontFamily::Monospace] {
            fonts.families.entry(family).or_default().push(name.to_owned());
        }
    }
    fonts
}

/// Applies the style: targets large enough for fingers, no text smaller than 12 points, high contrast.
pub fn style(ctx: &Context) {
    ctx.set_fonts(fonts());
    ctx.set_theme(ThemePreference::Dark);
    // On a slow device a frame can take longer than a click, which still has to count as one.
    ctx.options_mut(|options| options.input_options.max_click_duration = 10.0);
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = vec2(8.0, 6.0);
        style.spacing.interact_size.y = 24.0;
        style.spacing.slider_width = 96.0;
        style.spacing.combo_width = 110.0;
        // Contrast of at least 7 : 1 for text and 6 : 1 for secondary text on the panels.
        style.visuals.widgets.noninteractive.fg_stroke.color = Color32::from_gray(208);
        style.visuals.weak_text_color = Some(Color32::from_gray(164));
        for (kind, size) in [
            (TextStyle::Small, 12.0),
            (TextStyle::Body, 14.0),
            (TextStyle::Button, 14.0),
            (TextStyle::Monospace, 13.0),
            (TextStyle::Heading, 19.0),
        ] {
            style.text_styles.entry(kind).and_modify(|font| font.size = size);
        }
    });
}

#[cfg(test)]
mod tests {
    use eframe::egui::FontId;

    use super::*;

    #[test]
    fn figures_have_one_width_and_all_characters_exist() {
        let ctx = Context::default();
        style(&ctx);
        ctx.run_ui(Default::default(), |_| {}).textures_delta.clear();
        ctx.fonts_mut(|fonts| {
            for size in [12.0, 13.0, 14.0, 27.0] {
                let font = FontId::proportional(size);
                let width = fonts.glyph_width(&font, '0');
                assert!(('1'..='9').all(|figure| fonts.glyph_width(&font, figure) == width), "{size}");
                for character in "…–×°²µ%|_".chars() {
                    assert!(fonts.has_glyph(&font, character), "the font lacks {character}");
                }
            }
        });
    }
}
