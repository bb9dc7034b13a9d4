//! Looking closely: the values of the pixel under the pointer, and turning the camera to what is there.

use eframe::egui::{self, Color32, Grid, Rect, RichText, Stroke, TextureId, Ui, pos2, vec2};
use glam::{Vec2, Vec3, Vec4};
use halflight_metrics::Rgb;
use halflight_scenes::Camera;

use super::Viewer;
use crate::{error::Metric, readback::TextureReading, style::letter};

/// Pixels of the picture across the magnifier.
const PIXELS: f32 = 11.0;
/// Width of the magnifier, points.
const WIDTH: f32 = 110.0;

/// The point that a pixel shows, world space. `at`: its position, 0..1 from the left and from the top; `depth`: planar depth.
pub fn world_point(camera: &Camera, [width, height]: [u32; 2], at: [f32; 2], depth: f32) -> Vec3 {
    let tan = Vec2::from(camera.tan_half_fov(width, height));
    let ray = Vec2::new(2.0 * at[0] - 1.0, 1.0 - 2.0 * at[1]) * tan;
    let view = Vec4::new(ray.x * depth, ray.y * depth, -depth, 1.0);
    (camera.view_matrix().inverse() * view).truncate()
}

/// Difference of a value and its reference, in percent of the reference's largest channel; `None` where that is 0.
fn relative_difference(value: Rgb, reference: Rgb) -> Option<f32> {
    let largest = reference.iter().copied().fold(0.0, f32::max);
    let difference =
        (0..3).map(|c| value[c] - reference[c]).fold(0.0, |a: f32, b| if b.abs() > a.abs() { b } else { a });
    (largest > 0.0).then(|| 100.0 * difference / largest)
}

fn numbers(value: Rgb) -> String {
    value.map(|v| format!("{v:.4}")).join("  ")
}

impl Viewer {
    /// The pixel under the pointer.
    fn pixel(&self) -> Option<[u32; 2]> {
        let [x, y] = self.pointer?;
        let [width, height] = self.state.size;
        Some([((x * width as f32) as u32).min(width - 1), ((y * height as f32) as u32).min(height - 1)])
    }

    /// Shows what is under the pointer: the picture enlarged, `albedo * indirect`, its reference and the difference.
    pub(super) fn inspect(&mut self, ui: &mut Ui, rect: Rect, textures: &[Option<TextureId>; 2]) {
        let (Some(pixel), Some(pointer)) = (self.pixel(), self.pointer) else { return };
        let at = rect.min + rect.size() * vec2(pointer[0], pointer[1]);
        // On the side of the pointer that has more room.
        let (right, down) = (at.x < rect.center().x, at.y < rect.center().y);
        let pivot = match (right, down) {
            (true, true) => egui::Align2::LEFT_TOP,
            (true, false) => egui::Align2::LEFT_BOTTOM,
            (false, true) => egui::Align2::RIGHT_TOP,
            (false, false) => egui::Align2::RIGHT_BOTTOM,
        };
        let offset = vec2(if right { 20.0 } else { -20.0 }, if down { 20.0 } else { -20.0 });
        let area =
            egui::Area::new(ui.scope_id().with("inspector")).fixed_pos(at + offset).pivot(pivot).interactable(false);
        let shown = area.show(ui.ctx(), |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                let on_b = self.state.compare && textures[1].is_some() && pointer[0] > self.state.divider;
                let texture = textures[usize::from(on_b)].or(textures[0]);
                let (area, _) = ui.allocate_exact_size(vec2(WIDTH, WIDTH), egui::Sense::hover());
                if let Some(texture) = texture {
                    let [w, h] = self.state.size.map(|v| v as f32);
                    let centre = pos2((pixel[0] as f32 + 0.5) / w, (pixel[1] as f32 + 0.5) / h);
                    let uv = Rect::from_center_size(centre, vec2(PIXELS / w, PIXELS / h));
                    ui.painter().image(texture, area, uv, Color32::WHITE);
                    let one = Rect::from_center_size(area.center(), vec2(WIDTH, WIDTH) / PIXELS);
                    ui.painter().rect_stroke(one, 0.0, Stroke::new(1.0, Color32::WHITE), egui::StrokeKind::Outside);
                }
                ui.label(
                    RichText::new(format!("pixel {}, {}; albedo * indirect", pixel[0], pixel[1])).weak().size(12.0),
                );
                self.inspected_values(ui, pixel);
            });
        });
        self.marks.add("inspector", shown.response.rect);
    }

    fn inspected_values(&self, ui: &mut Ui, [x, y]: [u32; 2]) {
        let Some(reference) = &self.reference.found else {
            ui.label(RichText::new("The reference is not traced yet.").weak().size(12.0));
            return;
        };
        let Some((wanted, albedo)) = reference.pixel([x, y]) else {
            ui.label("no surface");
            return;
        };
        let index = (y * self.state.size[0] + x) as usize;
        Grid::new("inspected").num_columns(3).show(ui, |ui| {
            for side in 0..if self.state.compare { 2 } else { 1 } {
                let light = self.sides[side].as_ref().and_then(|side| side.light.as_ref()?.get(index).copied());
                ui.label(letter(side));
                match light.map(|light| [light[0] * albedo[0], light[1] * albedo[1], light[2] * albedo[2]]) {
                    Some(value) => {
                        ui.label(RichText::new(numbers(value)).monospace());
                        // Of a noisy reference it would be noise.
                        let known =
                            self.sides[side].as_ref().is_some_and(|side| side.errors.get(Metric::Pixels).is_some());
                        let difference = relative_difference(value, wanted).filter(|_| known);
                        ui.label(difference.map_or(String::new(), |percent| format!("{percent:+.0} %")));
                    }
                    None => drop(ui.label("…")),
                }
                ui.end_row();
            }
            ui.label("reference");
            ui.label(RichText::new(numbers(wanted)).monospace());
            ui.label(RichText::new(format!("{} samples", reference.samples)).weak().size(12.0));
            ui.end_row();
        });
    }

    /// Starts to read the depth under the pointer, to look at what is there.
    pub(super) fn start_focus(&mut self) {
        let (Some(at), Some(side)) = (self.pointer, self.sides[0].as_ref().filter(|side| side.is_drawn())) else {
            return;
        };
        if let Some(depth) = side.output("depth") {
            self.focusing = Some((at, self.camera(), TextureReading::new(&self.gpu, depth)));
        }
    }

    /// Turns the camera to what was under the pointer, once its depth is read; true while it is read.
    pub(super) fn finish_focus(&mut self) -> bool {
        let Some((at, camera, reading)) = &self.focusing else { return false };
        let Some(texels) = reading.take() else { return true };
        let [width, height] = self.state.size;
        let index = |at: f32, size: u32| ((at * size as f32) as usize).min(size as usize - 1);
        let texel = texels.get(index(at[1], height) * width as usize + index(at[0], width));
        // The sky has no depth.
        if let Some(depth) = texel.map(|texel| texel[0]).filter(|depth| depth.is_finite() && *depth > 0.0) {
            let target = world_point(camera, [width, height], *at, depth).to_array();
            self.state.camera = Some(Camera { target, ..*camera });
        }
        self.focusing = None;
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_found_again_in_the_picture() {
        let camera = Camera { eye: [1.0, 2.0, 5.0], target: [0.0, 1.0, 0.0], ..Camera::default() };
        // The centre lies on the line from eye to target.
        let distance = Vec3::from(camera.eye).distance(camera.target.into());
        assert!(world_point(&camera, [320, 180], [0.5, 0.5], distance).distance(camera.target.into()) < 1e-5);
        for at in [[0.1, 0.2], [0.9, 0.5], [0.5, 0.99]] {
            let point = world_point(&camera, [320, 180], at, 3.0);
            let view = camera.view_matrix().transform_point3(point);
            let tan = camera.tan_half_fov(320, 180);
            let found = [0.5 + 0.5 * view.x / 3.0 / tan[0], 0.5 - 0.5 * view.y / 3.0 / tan[1]];
            assert!((view.z + 3.0).abs() < 1e-5 && (0..2).all(|i| (found[i] - at[i]).abs() < 1e-5), "{at:?} {found:?}");
        }
    }

    #[test]
    fn differences_are_relative_to_the_reference() {
        assert_eq!(relative_difference([0.5, 0.1, 0.0], [1.0, 0.1, 0.0]), Some(-50.0));
        assert_eq!(relative_difference([0.0; 3], [0.0; 3]), None);
    }
}
