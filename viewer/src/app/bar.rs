//! The bar at the top: scene, size, view, comparison, playing, undo, link.

use eframe::egui::{Button, ComboBox, RichText, Slider, Ui};
use halflight_scenes::bundled::NAMES;
use web_time::{Duration, Instant};

use super::Viewer;
use crate::{
    address,
    messages::Severity,
    playing::{Playing, rotated},
    show::showable,
    state::{DROPPED, LightChange, OUTPUTS, SIZES, View},
    words,
};

/// Time for which the button says that the link was copied.
const COPIED: Duration = Duration::from_secs(2);

impl Viewer {
    pub(super) fn bar(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            self.scene_choice(ui);
            self.view_choice(ui);
            let compare = ui.toggle_value(&mut self.state.compare, "A | B").on_hover_text("Compare two configurations");
            self.marks.add("compare", compare.rect);
            self.play_controls(ui);
            // A tiny page has these above its controls.
            if !self.is_tiny() {
                self.bar_rest(ui);
            }
            let mut shown = self.controls_shown();
            let toggle = ui.toggle_value(&mut shown, "Controls").on_hover_text("Show or hide the controls: P");
            self.marks.add("controls", toggle.rect);
            if toggle.clicked() {
                self.controls_shown = Some(shown);
            }
            let help = ui.selectable_label(self.help, "?").on_hover_text("Help: mouse, touch and keys");
            self.marks.add("help", help.rect);
            self.help ^= help.clicked();
        });
    }

    /// Undo, size, files, link and full screen.
    pub(super) fn bar_rest(&mut self, ui: &mut Ui) {
        let undo = Button::new("Undo");
        let undo = ui.add_enabled(self.undo.has_undo(&self.state), undo).on_hover_text("Ctrl+Z");
        self.marks.add("undo", undo.rect);
        if undo.clicked() {
            self.undo_step();
        }
        let redo = Button::new("Redo");
        if ui.add_enabled(self.undo.has_redo(&self.state), redo).on_hover_text("Ctrl+Shift+Z").clicked() {
            self.redo_step();
        }
        let label = |[w, h]: [u32; 2]| format!("{w} x {h}");
        let size = ComboBox::from_id_salt("size").selected_text(label(self.state.size)).show_ui(ui, |ui| {
            let fit = self.fitting_size(ui.pixels_per_point());
            ui.selectable_value(&mut self.state.size, fit, format!("fit: {}", label(fit)))
                .on_hover_text("One pixel of the picture for each pixel of the screen");
            for size in SIZES {
                ui.selectable_value(&mut self.state.size, size, label(size));
            }
            ui.separator();
            ui.checkbox(&mut self.state.antialiasing, "Antialiasing")
                .on_hover_text("Averages pictures over parts of a pixel while everything is still");
            ui.checkbox(&mut self.motion.allowed, "Smaller while it moves")
                .on_hover_text("Keeps 30 frames a second. Times and errors are always those of the whole picture.");
        });
        self.marks.add("size", size.response.on_hover_text("Size of the picture, pixels").rect);
        if self.host.can_choose_files() {
            let open =
                ui.button("Open…").on_hover_text("Open a scene, an environment map or a preset; or drop it here");
            self.marks.add("open", open.rect);
            if open.clicked() {
                self.host.choose_files();
            }
        }
        let copied = self.copied.is_some_and(|at| at.elapsed() < COPIED);
        let link = ui.button(if copied { "Link copied" } else { "Copy link" });
        self.marks.add("link", link.rect);
        if link.on_hover_text("Copy a link that opens this view").clicked() {
            ui.copy_text(self.host.link(&address::write(&self.state)));
            self.copied = Some(Instant::now());
            if self.state.scene == DROPPED {
                let sentence = "the link does not contain your files: send them along";
                self.messages.add(Severity::Warning, sentence);
            }
        }
        if copied {
            ui.request_repaint_after(COPIED);
        }
        self.save_menu(ui);
        let full = ui.button("Full screen").on_hover_text("Shift+F");
        self.marks.add("fullscreen", full.rect);
        if full.clicked() {
            self.toggle_fullscreen(ui);
        }
    }

    fn scene_choice(&mut self, ui: &mut Ui) {
        let mut chosen = self.state.scene.clone();
        let own = self.loads.own.as_ref().map(|own| own.name.clone());
        let title = |name: &str| match &own {
            Some(own) if name == DROPPED => format!("{own} (yours)"),
            _ => words::scene(name),
        };
        let scene = ComboBox::from_id_salt("scene").selected_text(title(&chosen)).width(150.0).height(480.0).show_ui(
            ui,
            |ui| {
                for name in NAMES {
                    let choice = ui.selectable_value(&mut chosen, (*name).to_owned(), title(name));
                    choice.on_hover_text(format!("key: {name}"));
                }
                if own.is_some() {
                    ui.selectable_value(&mut chosen, DROPPED.to_owned(), title(DROPPED));
                }
            },
        );
        let response = scene.response.on_hover_text("Scene; drop a model with its materials to open your own");
        self.marks.add("scene", response.rect);
        if chosen != self.state.scene {
            self.state.open(&chosen);
            self.home = None;
        }
    }

    fn view_choice(&mut self, ui: &mut Ui) {
        let view = &mut self.state.view;
        let textures: Vec<String> =
            self.sides[0].iter().flat_map(|side| showable(side.plan())).map(str::to_owned).collect();
        let response = ComboBox::from_id_salt("view")
            .selected_text(words::view(view.name()))
            .width(130.0)
            .height(420.0)
            .show_ui(ui, |ui| {
                let outputs = OUTPUTS.map(|(name, what)| (View::Output(name), what));
                let compared = [
                    (View::Reference, "the path-traced picture"),
                    (View::Error, "the relative error of albedo * indirect against the reference"),
                ];
                for (choice, what) in outputs.into_iter().chain(compared) {
                    let tip = format!("{what}\n\nkey: {}", choice.name());
                    let title = words::view(choice.name());
                    ui.selectable_value(view, choice, title).on_hover_text(tip);
                }
                ui.separator();
                ui.label(RichText::new("Textures of the frame").weak());
                for name in &textures {
                    ui.selectable_value(view, View::Texture(name.clone()), name);
                }
            })
            .response
            .on_hover_text("What the picture shows");
        self.marks.add("view", response.rect);
    }

    fn play_controls(&mut self, ui: &mut Ui) {
        let mut playing = self.playing.is_some();
        let last = self.stage.as_ref().filter(|stage| stage.is_animated()).map(|stage| stage.scene.moves.last_frame());
        let lit = self.stage.as_ref().is_some_and(|stage| !stage.original_lights.is_empty());
        let title = if playing { "Stop" } else { "Play" };
        let play = ui
            .add_enabled(last.is_some() || lit, Button::selectable(playing, title))
            .on_hover_text(match last {
                Some(_) => "Play the animation of the scene",
                None => "Rotate the first light, to see the picture under changing light",
            })
            .on_disabled_hover_text("This scene has no animation and no lights: choose another one, such as motion");
        playing ^= play.clicked();
        self.marks.add("play", play.rect);
        if let Some(last) = last {
            let mut frame = self.frame().min(last);
            let slider = ui.add(Slider::new(&mut frame, 0..=last).text("frame"));
            self.marks.add("frame", slider.rect);
            if slider.changed() {
                (self.state.frame, self.playing, playing) = (frame, None, false);
            }
        }
        if playing != self.playing.is_some() {
            self.play(playing);
        }
    }

    fn play(&mut self, on: bool) {
        let Some(stage) = &self.stage else { return };
        if on {
            self.playing = Some(Playing::start(self.state.frame));
            return;
        }
        // The state keeps the frame, or the light's rotation, at which playing stopped.
        let Some(playing) = self.playing.take() else { return };
        if stage.is_animated() {
            self.state.frame = playing.frame.min(stage.scene.moves.last_frame());
        } else if let Some(light) = stage.original_lights.first() {
            let own = self.state.lights.iter().find(|(at, _)| *at == 0);
            let mut change = own.map_or(LightChange::none(light), |(_, change)| *change);
            let rotated = rotated(&change.apply(light), playing.angle, stage.centre());
            (change.position, change.direction) = (rotated.position, rotated.direction);
            self.state.change_light(0, light, change);
        }
    }

    pub(super) fn undo_step(&mut self) {
        if let Some(earlier) = self.undo.undo(&self.state) {
            self.state = earlier.clone();
        }
    }

    pub(super) fn redo_step(&mut self) {
        if let Some(later) = self.undo.redo(&self.state) {
            self.state = later.clone();
        }
    }
}
