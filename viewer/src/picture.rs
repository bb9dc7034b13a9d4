//! The picture: one or two sides with a divider, and camera control by pointer, touch and keys.

use eframe::egui::{self, Color32, CursorIcon, EventFilter, Key, Rect, Sense, Stroke, TextureId, Vec2, pos2, vec2};
use halflight_scenes::Camera;

use crate::{
    camera,
    show::{ERROR_COLOURS, ERROR_FULL_SCALE},
};

/// Width of the strip in which the divider can be dragged, points: a fingertip.
const DIVIDER_CATCH: f32 = 28.0;
/// Speed of flying, diagonals of what is looked at per second.
const FLY_SPEED: f32 = 0.12;
/// Speed of orbiting by arrow keys, picture heights per second.
const KEY_TURN: f32 = 0.25;

/// Width of a picture below which a caption without a letter would hide too much of it, points.
const SMALL: f32 = 300.0;

/// Width below which a caption has only the letter of its side, points.
const NARROWEST: f32 = 110.0;

/// Duration that a short key press counts as, seconds.
const PRESS: f32 = 0.05;

/// A line at the bottom of a side.
#[derive(Clone, Debug, Default)]
pub struct Caption {
    /// Letter of the side and its colour, if two are compared.
    pub letter: Option<(&'static str, Color32)>,
    /// Its text; empty for no caption.
    pub text: String,
}

/// What was drawn where, and what the pointer did.
pub struct Place {
    /// The picture.
    pub rect: Rect,
    /// The divider.
    pub divider: Option<Rect>,
    /// The pointer above the picture, 0..1 from the left and from the top.
    pub pointer: Option<[f32; 2]>,
    /// Whether the picture was double-clicked.
    pub double_clicked: bool,
}

/// What the picture shows.
pub struct Shown<'a> {
    /// Textures of the sides; B only when two are compared.
    pub textures: [Option<TextureId>; 2],
    /// Width over height.
    pub aspect: f32,
    /// Captions of the sides, at the bottom.
    pub captions: [Caption; 2],
    /// Text in the centre if there is no picture.
    pub placeholder: Option<&'a str>,
}

/// Draws the picture into the available space and moves camera and divider by pointer, touch and keys.
pub fn picture(
    ui: &mut egui::Ui,
    shown: &Shown,
    compare: bool,
    divider: &mut f32,
    view: &mut Camera,
    diagonal: f32,
) -> Place {
    let space = ui.available_rect_before_wrap();
    let width = space.width().min(space.height() * shown.aspect).max(1.0);
    let rect = Rect::from_center_size(space.center(), vec2(width, width / shown.aspect));
    let id = ui.scope_id().with("picture");
    let response = ui.interact(rect, id, Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Picture"));
    if response.clicked() || response.drag_started() {
        response.request_focus();
    }
    let handle = compare.then(|| {
        let x = rect.left() + rect.width() * *divider;
        let strip = Rect::from_center_size(pos2(x, rect.center().y), vec2(DIVIDER_CATCH, rect.height()));
        let handle = ui.interact(strip, id.with("divider"), Sense::click_and_drag());
        handle.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Divider between A and B"));
        if let (true, Some(pointer)) = (handle.dragged(), handle.interact_pointer_pos()) {
            *divider = ((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        }
        if handle.has_focus() {
            let keep = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(handle.id, keep));
            let step = ui.input(|i| {
                f32::from(u8::from(i.key_down(Key::ArrowRight))) - f32::from(u8::from(i.key_down(Key::ArrowLeft)))
            });
            *divider = (*divider + step * 0.01).clamp(0.0, 1.0);
        }
        if handle.hovered() || handle.dragged() {
            ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        handle
    });
    move_camera(ui, &response, view, diagonal);

    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.rect_filled(rect, 0.0, Color32::BLACK);
    let x = if compare { *divider } else { 1.0 };
    for (texture, [left, right]) in shown.textures.iter().zip([[0.0, x], [x, 1.0]]) {
        if let Some(texture) = texture.filter(|_| right > left) {
            let part = Rect::from_min_max(
                pos2(rect.left() + rect.width() * left, rect.top()),
                pos2(rect.left() + rect.width() * right, rect.bottom()),
            );
            painter.image(texture, part, Rect::from_min_max(pos2(left, 0.0), pos2(right, 1.0)), Color32::WHITE);
        }
    }
    if let Some(sentence) = shown.placeholder {
        let text = egui::RichText::new(sentence).color(Color32::from_gray(220)).size(15.0);
        let area = rect.shrink2(vec2(rect.width() * 0.1, rect.height() * 0.35));
        ui.put(area, egui::Label::new(text).wrap().halign(egui::Align::Center));
    }
    if response.has_focus() {
        painter.rect_stroke(rect.shrink(1.0), 0.0, ui.visuals().selection.stroke, egui::StrokeKind::Inside);
    }
    if let Some(handle) = &handle {
        let centre = handle.rect.center().x;
        let stroke = if handle.has_focus() { ui.visuals().selection.stroke } else { Stroke::new(2.0, Color32::WHITE) };
        painter.vline(centre, rect.y_range(), Stroke::new(4.0, Color32::from_black_alpha(140)));
        painter.vline(centre, rect.y_range(), stroke);
        let knob = pos2(centre, rect.center().y);
        painter.circle(knob, 11.0, Color32::from_gray(40), stroke);
        for side in [-1.0, 1.0] {
            painter.arrow(knob + vec2(side * 2.0, 0.0), vec2(side * 5.0, 0.0), Stroke::new(1.5, Color32::WHITE));
        }
    }
    caption(ui, rect, &shown.captions[0], egui::Align2::LEFT_BOTTOM);
    if compare {
        caption(ui, rect, &shown.captions[1], egui::Align2::RIGHT_BOTTOM);
    }
    let fraction = |at: egui::Pos2| [(at.x - rect.left()) / rect.width(), (at.y - rect.top()) / rect.height()];
    let pointer = ui.input(|i| i.pointer.latest_pos()).filter(|&at| rect.contains(at)).map(fraction);
    Place { rect, divider: handle.map(|handle| handle.rect), pointer, double_clicked: response.double_clicked() }
}

fn caption(ui: &egui::Ui, rect: Rect, caption: &Caption, corner: egui::Align2) {
    if caption.text.is_empty() {
        return;
    }
    let painter = ui.painter().with_clip_rect(rect);
    if caption.letter.is_none() && rect.width() < SMALL {
        return;
    }
    // At most half of the picture, so that two captions do not overlap.
    let most = (rect.width() * 0.5 - 24.0).max(40.0);
    let font = egui::TextStyle::Body.resolve(ui.style());
    let mut job = egui::text::LayoutJob::default();
    job.wrap.max_width = most;
    if let Some((letter, colour)) = caption.letter {
        job.append(&format!("{letter}  "), 0.0, egui::TextFormat::simple(font.clone(), colour));
    }
    // A small picture has room for the letters alone.
    if most >= NARROWEST || caption.letter.is_none() {
        job.append(&caption.text, 0.0, egui::TextFormat::simple(font, Color32::WHITE));
    }
    let galley = painter.layout_job(job);
    let area = corner.align_size_within_rect(galley.size() + vec2(12.0, 8.0), rect.shrink(6.0));
    painter.rect_filled(area, 3.0, Color32::from_black_alpha(170));
    painter.galley(area.min + vec2(6.0, 4.0), galley, Color32::WHITE);
}

/// Draws the colour scale of the error map into a corner of the picture.
pub fn error_scale(ui: &egui::Ui, rect: Rect) {
    let bar = Rect::from_min_size(rect.min + vec2(10.0, 10.0), vec2(120.0, 10.0));
    let painter = ui.painter();
    let mut mesh = egui::Mesh::default();
    for (index, colour) in ERROR_COLOURS.iter().enumerate() {
        let [r, g, b] = colour.map(|v| (v * 255.0).round() as u8);
        let x = bar.left() + bar.width() * index as f32 / (ERROR_COLOURS.len() - 1) as f32;
        for y in [bar.top(), bar.bottom()] {
            mesh.colored_vertex(pos2(x, y), Color32::from_rgb(r, g, b));
        }
        if index > 0 {
            let first = 2 * index as u32 - 2;
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first + 1, first + 2, first + 3);
        }
    }
    let background = bar.expand2(vec2(6.0, 6.0)).with_max_y(bar.bottom() + 22.0);
    painter.rect_filled(background, 3.0, Color32::from_black_alpha(170));
    painter.add(mesh);
    let font = egui::FontId::proportional(12.0);
    for (x, text, align) in [
        (bar.left(), "0 %".to_owned(), egui::Align2::LEFT_TOP),
        (bar.right(), format!("{:.0} %", 100.0 * ERROR_FULL_SCALE), egui::Align2::RIGHT_TOP),
    ] {
        painter.text(pos2(x, bar.bottom() + 3.0), align, text, font.clone(), Color32::WHITE);
    }
}

fn move_camera(ui: &egui::Ui, response: &egui::Response, view: &mut Camera, diagonal: f32) {
    let height = response.rect.height().max(1.0);
    let part = |drag: Vec2| [drag.x / height, drag.y / height];
    let touch = ui.input(egui::InputState::multi_touch);
    if let Some(touch) = touch.filter(|touch| response.rect.contains(touch.center_pos)) {
        camera::zoom(view, touch.zoom_delta);
        camera::pan(view, part(touch.translation_delta));
    } else if response.dragged_by(egui::PointerButton::Secondary) {
        camera::look(view, part(response.drag_delta()));
    } else if response.dragged_by(egui::PointerButton::Middle)
        || (response.dragged() && ui.input(|i| i.modifiers.shift))
    {
        camera::pan(view, part(response.drag_delta()));
    } else if response.dragged() && response.drag_delta() != Vec2::ZERO {
        camera::orbit(view, part(response.drag_delta()));
    }
    if response.contains_pointer() {
        let [scroll, pinch] = ui.input(|i| [i.smooth_scroll_delta().y, i.zoom_delta()]);
        if scroll != 0.0 || pinch != 1.0 {
            camera::zoom(view, pinch * (scroll * 0.002).exp());
        }
    }
    if !response.has_focus() {
        return;
    }
    let keep = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, keep));
    // A key that was pressed and released between two passes counts as a short press.
    let duration = |ui: &egui::Ui, keys: &[Key]| {
        ui.input(|i| {
            let held = keys.iter().any(|key| i.key_down(*key));
            let presses: usize = keys.iter().map(|key| i.num_presses(*key)).sum();
            if held { i.stable_dt.min(0.1) } else { presses as f32 * PRESS }
        })
    };
    let axis = |plus: &[Key], minus: &[Key]| duration(ui, plus) - duration(ui, minus);
    let turn = [axis(&[Key::ArrowLeft], &[Key::ArrowRight]), axis(&[Key::ArrowUp], &[Key::ArrowDown])];
    let step = [axis(&[Key::D], &[Key::A]), axis(&[Key::E], &[Key::Q]), axis(&[Key::W], &[Key::S])];
    let closer = axis(&[Key::Plus, Key::Equals], &[Key::Minus]);
    if turn != [0.0; 2] {
        camera::orbit(view, turn.map(|v| v * KEY_TURN));
    }
    if step != [0.0; 3] {
        camera::fly(view, step.map(|v| v * FLY_SPEED * diagonal));
    }
    if closer != 0.0 {
        camera::zoom(view, closer.exp());
    }
    if turn != [0.0; 2] || step != [0.0; 3] || closer != 0.0 {
        ui.request_repaint();
    }
}
