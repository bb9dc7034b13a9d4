//! Text sizes, spacing and colours of the interface.

use eframe::egui::{Color32, Context, TextStyle, ThemePreference, vec2};

/// Applies the style: targets large enough for fingers, no text smaller than 12 points, high contrast.
pub fn style(ctx: &Context) {
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
