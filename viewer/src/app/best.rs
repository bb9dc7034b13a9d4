//! "Best for 4 ms": the question, the progress of its search, and what it found.

use eframe::egui::{self, Button, ComboBox, DragValue, ProgressBar, RichText, Ui};
use halflight_renderer::gi::Technique;

use super::Viewer;
use crate::{
    best::{self, BestSearch, Question, Step},
    error::Metric,
    numbers::milliseconds,
    reference::{ALL_BOUNCES, Subject},
    report::BestReport,
    side::SideTime,
    stage::Stage,
    state::Configuration,
    style::SIDE_COLOURS,
    timing::Method,
};

/// Shortest and longest time to ask for, milliseconds.
const BUDGETS: std::ops::RangeInclusive<f64> = 0.1..=1000.0;

/// What the last search found.
struct Found {
    sentence: String,
    /// The answer and its budget, milliseconds.
    answer: Option<(Configuration, f64)>,
}

/// The question and its search.
pub struct Best {
    budget_ms: f64,
    /// Whether only the techniques of the sides are searched.
    own: bool,
    /// A question whose search begins once the picture is at rest.
    asked: Option<Question>,
    running: Option<BestSearch>,
    found: Option<Found>,
}

impl Default for Best {
    fn default() -> Self {
        Self { budget_ms: 4.0, own: false, asked: None, running: None, found: None }
    }
}

impl Best {
    /// Whether a search runs or is about to begin.
    pub fn is_running(&self) -> bool {
        self.running.is_some() || self.asked.is_some()
    }

    /// Ends a search without an answer.
    pub fn stop(&mut self) {
        self.asked = None;
        self.running.take().into_iter().for_each(BestSearch::destroy);
    }

    /// Ends a search and forgets what the last one found: they belong to another scene.
    pub fn forget(&mut self) {
        self.stop();
        self.found = None;
    }

    /// Stops what other work on the device would disturb.
    pub fn interrupt(&mut self) {
        self.running.iter_mut().for_each(BestSearch::interrupt);
    }

    /// Its state for tests and hosts.
    pub fn report(&self) -> BestReport {
        BestReport {
            running: self.is_running(),
            cells: self.running.as_ref().map_or(0, BestSearch::cells),
            so_far: self.running.as_ref().is_some_and(|search| search.so_far().is_some()),
            sentence: self.found.as_ref().map(|found| found.sentence.clone()),
            answered: self.found.as_ref().is_some_and(|found| found.answer.is_some()),
        }
    }

    /// Continues the search on this picture.
    fn step(
        &mut self,
        ctx: &egui::Context,
        gpu: &halflight_frame_graph::Gpu,
        stage: &Stage,
        picture: &Picture,
    ) -> Option<Step> {
        if let Some(search) = self.running.take_if(|search| !search.shows(&picture.subject)) {
            // The view has changed: the same question, asked again.
            self.asked = Some(search.question.clone());
            search.destroy();
        }
        if let Some(question) = self.asked.take() {
            match BestSearch::new(question, stage, picture.subject.clone(), picture.method) {
                Ok(search) => self.running = Some(search),
                Err(reason) => self.found = Some(Found { sentence: best::not_found(&reason), answer: None }),
            }
        }
        let search = self.running.as_mut()?;
        match search.step(ctx, gpu, stage, picture.seed) {
            Ok(Step::Done) => self.finish(),
            Ok(step) => return Some(step),
            Err(reason) => {
                self.stop();
                self.found = Some(Found { sentence: best::not_found(&reason), answer: None });
            }
        }
        Some(Step::Done)
    }

    fn finish(&mut self) {
        let Some(mut search) = self.running.take() else { return };
        let Question { budget_ms, metric, .. } = search.question;
        self.found = Some(match search.answer() {
            Ok(answer) => {
                let settings = answer.point.settings.clone();
                let configuration = Configuration { technique: answer.point.technique.name, settings };
                let sentence = best::found(&answer, budget_ms, metric, search.cells());
                Found { sentence, answer: Some((configuration, budget_ms)) }
            }
            Err(reason) => Found { sentence: best::not_found(&reason), answer: None },
        });
        search.destroy();
    }
}

/// The picture that a search is about.
struct Picture {
    subject: Subject,
    seed: u32,
    method: Method,
}

impl Viewer {
    /// Continues a search; `None` if there is none.
    pub(super) fn step_best(&mut self, ctx: &egui::Context, stage: &Stage, subject: &Subject) -> Option<Step> {
        let subject = Subject { bounces: ALL_BOUNCES, ..subject.clone() };
        let method = self.sides[0].as_ref().map_or(Method::NoTimestamps, |side| side.method);
        let step = self.best.step(ctx, &self.gpu, stage, &Picture { subject, seed: self.state.seed, method })?;
        if let (Step::Done, Some(Found { answer: Some((configuration, _)), .. })) = (step, &self.best.found) {
            self.state.sides[1] = configuration.clone();
            self.state.compare = true;
        }
        Some(step)
    }

    /// The button, the progress of its search, or what it found.
    pub(super) fn best_question(&mut self, ui: &mut Ui) {
        if self.best.is_running() {
            self.best_progress(ui);
            return;
        }
        ui.horizontal_wrapped(|ui| {
            let tip = "Search the settings with the lowest error within this time, and show them as B";
            let ask = ui.button("Best for").on_hover_text(tip);
            self.marks.add("best", ask.rect);
            let budget =
                DragValue::new(&mut self.best.budget_ms).range(BUDGETS).speed(0.05).max_decimals(2).suffix(" ms");
            let budget = ui.add(budget).on_hover_text("Time of the technique, beyond surfaces and direct light");
            self.marks.add("best.ms", budget.rect);
            let names = [
                "of all techniques",
                if self.state.compare { "of the techniques of A and B" } else { "of this technique" },
            ];
            let own =
                ComboBox::from_id_salt("best").selected_text(names[usize::from(self.best.own)]).show_ui(ui, |ui| {
                    for (own, name) in [false, true].into_iter().zip(names) {
                        let choice = ui.selectable_value(&mut self.best.own, own, name);
                        self.marks.add(&format!("best.own.{}", u8::from(own)), choice.rect);
                    }
                });
            self.marks.add("best.own", own.response.on_hover_text("Which techniques are searched").rect);
            if ask.clicked() {
                self.ask_best();
            }
        });
        self.best_found(ui);
    }

    /// Searches the best settings for this time of the technique, milliseconds, as the button does.
    pub fn best_for(&mut self, milliseconds: f64) {
        self.best.budget_ms = milliseconds;
        self.ask_best();
    }

    fn ask_best(&mut self) {
        let sides = self.state.sides.iter().take(if self.state.compare { 2 } else { 1 });
        let mut techniques: Vec<&'static Technique> = sides.map(Configuration::technique).collect();
        techniques.retain(|technique| technique.name != "none");
        techniques.dedup_by_key(|technique| technique.name);
        if !self.best.own {
            techniques.clear();
        }
        // FLIP of hundreds of cells would take minutes.
        let metric = if self.state.metric == Metric::Flip { Metric::Blocks } else { self.state.metric };
        self.best.found = None;
        self.best.asked = Some(Question { budget_ms: self.best.budget_ms, metric, techniques });
        self.ctx.request_repaint();
    }

    fn best_progress(&mut self, ui: &mut Ui) {
        let (mut cancelled, mut taken) = (false, false);
        let budget = self.best.budget_ms;
        let (share, doing, so_far) = match &self.best.running {
            Some(search) => {
                let cells = search.cells();
                let so_far = search.so_far().map(|answer| best::so_far(answer, search.question.metric));
                let doing = format!("{}; {cells} configurations measured", search.doing());
                (search.progress() as f32, doing, so_far)
            }
            None => (0.0, "waits until the picture is at rest".to_owned(), None),
        };
        ui.label(format!("Searching the best for {budget} ms: {doing}."));
        let bar = ui.add(ProgressBar::new(share).desired_height(8.0).fill(SIDE_COLOURS[1]));
        self.marks.add("best.progress", bar.rect);
        let has_answer = so_far.is_some();
        let so_far = so_far.map_or("Nothing that is better than no indirect light yet.".to_owned(), |text| {
            format!("Best so far: {text}.")
        });
        ui.label(RichText::new(so_far).weak());
        ui.horizontal(|ui| {
            let take = ui.add_enabled(has_answer, Button::new("Take the best so far"));
            self.marks.add("best.take", take.rect);
            taken = take.on_hover_text("End the search: only what is taken is still measured").clicked();
            let cancel = ui.button("Cancel");
            self.marks.add("best.cancel", cancel.rect);
            cancelled = cancel.clicked();
        });
        if taken {
            self.best.running.iter_mut().for_each(BestSearch::hurry);
        }
        if cancelled {
            self.best.stop();
        }
    }

    /// What the last search found.
    fn best_found(&mut self, ui: &mut Ui) {
        let Some(found) = &self.best.found else { return };
        let mut text = found.sentence.clone();
        // B is measured on its own, as every side is.
        if let (Some((configuration, budget)), Some(side)) = (&found.answer, &self.sides[1])
            && side.configuration() == configuration
            && let SideTime::Known(ms) = side.time(self.rounds())
            && ms > *budget
        {
            text += &format!(" Measured again, it takes {}: times scatter by this much here.", milliseconds(ms));
        }
        let mut dismissed = false;
        ui.horizontal_top(|ui| {
            dismissed = ui.small_button("x").on_hover_text("Remove this answer").clicked();
            let label = ui.add(egui::Label::new(text).wrap());
            self.marks.add("best.found", label.rect);
        });
        if dismissed {
            self.best.found = None;
        }
    }
}
