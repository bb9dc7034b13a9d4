//! `evaluator explain`: splits the error of a technique into its sources.
//!
//! The image is compared with the path-traced reference through a chain of images. Each link of the chain is the
//! difference of two neighbours and has one cause:
//!
//! ```text
//! the image            ->  with exact direct light     direct light: shadow maps
//! N samples            ->  converged                   noise
//! converged            ->  exhaustive screen sum       estimator and hierarchy
//! exhaustive sum       ->  on-screen reference         missing visibility
//! on-screen reference  ->  reference of one bounce     off-screen and hidden light
//! ```
//!
//! A technique with reflective shadow maps finds light that the exhaustive screen sum does not, so the last three links
//! do not apply to it. They are replaced by two links, for light from the screen and for light from elsewhere: the
//! technique runs once more with shadow maps in which only surfaces that the camera sees send light, and that image is
//! compared with the on-screen reference. In a scene with emitters the two links are one, because points on emitters
//! have no shadow map.
//!
//! A technique that keeps light in the world from frame to frame (the radiance cache) does not read the screen, so the last
//! three links do not apply to it either. The image is that of [`Options::frame`], and the links are
//!
//! ```text
//! frame N              ->  frame of the converged image           rays not yet traced
//! converged            ->  records two pixels wide                interpolation
//! records of 2 pixels  ->  reference of one bounce                what is left
//! ```
//!
//! With more than one bounce, the link "further bounces" compares what these add to the image with what they add to the
//! reference; the links after it are those of the first bounce.
//!
//! All images are linear `albedo * indirect`. Where the technique tests visibility, its link to the exhaustive sum is
//! measured with visibility off; the change that its visibility test makes belongs to the visibility link.

use std::path::Path;

use halflight_metrics::mean;
use halflight_native::{NativeGpu, cache::Cache, images::Rgb};
use halflight_renderer::{
    gi::{Technique, rsm::has_reflective_shadow_maps},
    parameters::{Settings, Value},
    plan_technique_of_scene,
};
use halflight_scenes::Scene;
use halflight_techniques::technique;
use serde::Serialize;

use crate::{Error, experiment::session::Session, format::number};

mod advice;
pub mod chain;
mod output;
mod run;

use chain::{Link, Moments, State, Uncertain, moments, picture};
use run::{Bounces, Run, Senders, keeps_light_in_world, trace, with_fine_records};

/// What to explain, and how well.
#[derive(Clone, Debug)]
pub struct Options {
    /// The technique.
    pub technique: &'static Technique,
    /// Its settings; those that are missing take their defaults.
    pub settings: Settings,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Seed of the image that is explained.
    pub seed: u32,
    /// The frame that is explained, counted from 1, of a technique that keeps light in the world. Others are explained by
    /// their first frame.
    pub frame: u32,
    /// Frames of other seeds that stand for the converged image. Of a technique that keeps light in the world, the number
    /// of frames after which it counts as converged.
    pub frames: u32,
    /// Samples a pixel of the reference.
    pub samples_per_pixel: u32,
    /// Where traced samples are cached; `None` traces them again.
    pub cache: Option<Cache>,
    /// Feed path-traced direct light to the technique, as the papers do: then there is no link of direct light.
    pub direct_from_truth: bool,
}

/// Groups of independent estimates: enough for a standard error (known to a quarter of itself), few enough that each
/// holds several frames.
const GROUPS: u32 = 8;

/// The last links of a technique that also knows what the lights see: from surfaces on the screen, and from others.
const SHOWN: &str = "light from the screen";
const ELSEWHERE: &str = "light from off the screen";
/// Both, in a scene with emitters.
const EVERYWHERE: &str = "light on and off the screen";

/// What further bounces add.
const FURTHER: &str = "further bounces";
/// The links of a technique that keeps light in the world.
const UNTRACED: &str = "rays not yet traced";
const INTERPOLATION: &str = "interpolation";
const REST: &str = "what is left";

/// States and links while the chain is made.
struct Chain {
    states: Vec<State>,
    links: Vec<Link>,
    /// The end of the chain, index into `states`.
    last: usize,
}

impl Chain {
    fn from(state: State) -> Self {
        Self { states: vec![state], links: Vec::new(), last: 0 }
    }

    /// A state beside the chain; its index.
    fn add(&mut self, state: State) -> usize {
        self.states.push(state);
        self.states.len() - 1
    }

    fn link(&mut self, name: &'static str, terms: Vec<(usize, f64)>) {
        self.links.push(Link { name, terms });
    }

    /// The next state, and the link to it.
    fn push(&mut self, name: &'static str, state: State) {
        let next = self.add(state);
        self.link(name, vec![(self.last, 1.0), (next, -1.0)]);
        self.last = next;
    }
}

/// Where an error comes from.
pub struct Explanation {
    /// The links, in the order of the chain.
    pub links: Vec<Link>,
    /// Means and products, radiance.
    pub moments: Moments,
    /// Products weighted as in relMSE, 1 / (t^2 + 0.01 m^2): `square` is the image's relMSE, free of the reference's noise.
    pub relative: Moments,
    /// Mean of the reference, radiance: errors are stated relative to it.
    pub truth_mean: f64,
    /// One sentence on what would help.
    pub advice: String,
    size: [u32; 2],
    pictures: Vec<Vec<Rgb>>,
    shown: Vec<Rgb>,
    truth: Vec<Rgb>,
    mask: Vec<bool>,
}

/// A link as a row of the table and of explain.json.
#[derive(Debug, Serialize)]
pub struct LinkRow {
    /// Name.
    pub link: &'static str,
    /// Mean of the signed error, radiance; the links' sum is the bias.
    pub bias: Uncertain,
    /// Mean square of the link alone, radiance squared.
    pub square: Uncertain,
    /// Twice its products with all other links: what they cancel of each other or add.
    pub cross: Uncertain,
    /// Its share of the mean square error: square and half of the cross terms over the whole.
    pub share: Uncertain,
    /// The same share of relMSE.
    pub relative_share: Uncertain,
}

impl Explanation {
    /// Measures every link.
    ///
    /// # Errors
    /// A setting out of range, or a device that was lost.
    pub fn measure(native: &NativeGpu, scene: &Scene, options: &Options) -> Result<Self, Error> {
        let session = Session::new(native, scene);
        let bounces = Bounces::of(options.technique, &options.settings)?;
        let traced = trace(native, scene, options, bounces.number)?;
        let albedo = &traced.albedo;
        let in_world = keeps_light_in_world(&session, options)?;
        let run = Run { session: &session, options, albedo, direct: &traced.direct, in_world };
        let shown = run.image(options.technique, &options.settings, !options.direct_from_truth, 0)?;
        let mut chain = Chain::from(State::Exact(shown.clone()));
        if !options.direct_from_truth {
            let exact = run.image(options.technique, &options.settings, false, 0)?;
            chain.push("direct light", State::Exact(exact));
        }
        chain.push(if in_world { UNTRACED } else { "noise" }, run.converged(&options.settings, Senders::All)?);
        // The reference of the whole image; that of its first bounce where there are no others.
        let mut whole = None;
        let settings = &bounces.first;
        if bounces.number > 1 {
            let all = chain.last;
            let (reference, first) =
                (chain.add(State::Groups(traced.all)), chain.add(State::Groups(traced.truth.clone())));
            chain.last = chain.add(run.converged(settings, Senders::All)?);
            whole = Some(reference);
            chain.link(FURTHER, vec![(all, 1.0), (chain.last, -1.0), (reference, -1.0), (first, 1.0)]);
        }
        let plan = plan_technique_of_scene(&session.facts, options.technique, settings, options.size);
        let other_views = has_reflective_shadow_maps(&plan.map_err(bad)?);
        let visible = without_visibility(options.technique, settings).filter(|_| !other_views);
        let open = visible.as_ref().map(|settings| run.converged(settings, Senders::All)).transpose()?;
        if in_world {
            chain.push(INTERPOLATION, run.converged(&with_fine_records(settings)?, Senders::All)?);
            chain.push(REST, State::Groups(traced.truth));
        } else if other_views && session.facts.emitters.is_empty() {
            let all = chain.last;
            let shown = chain.add(run.converged(settings, Senders::Seen)?);
            let on_screen = chain.add(State::Groups(traced.on_screen));
            chain.last = chain.add(State::Groups(traced.truth));
            chain.link(SHOWN, vec![(shown, 1.0), (on_screen, -1.0)]);
            chain.link(ELSEWHERE, vec![(all, 1.0), (shown, -1.0), (chain.last, -1.0), (on_screen, 1.0)]);
        } else if other_views {
            chain.push(EVERYWHERE, State::Groups(traced.truth));
        } else {
            let exhaustive = run.image(technique("exhaustive").map_err(bad)?, &Settings::new(), false, 0)?;
            chain.push("estimator and hierarchy", State::Exact(exhaustive));
            chain.push("missing visibility", State::Groups(traced.on_screen));
            chain.push("off-screen and hidden light", State::Groups(traced.truth));
        }
        let Chain { mut states, mut links, last } = chain;
        if let Some(open) = open {
            // From the technique's own visibility to none belongs to the visibility link.
            states.push(open);
            let (open, at) = (states.len() - 1, links.len() - 3);
            let converged = links[at].terms[0].0;
            links[at].terms[0].0 = open;
            links[at + 1].terms.extend([(converged, 1.0), (open, -1.0)]);
        }
        let pixels = shown.len();
        let groups = GROUPS as usize;
        let truth =
            picture(&states, &Link { name: "truth", terms: vec![(whole.unwrap_or(last), 1.0)] }, groups, pixels);
        let mask = traced.mask;
        let truth_mean = mean(&truth, Some(&mask));
        let floor = 0.01 * truth_mean * truth_mean;
        let relative = |pixel: usize, channel: usize| {
            let weight = 1.0 / (f64::from(truth[pixel][channel]).powi(2) + floor);
            if weight.is_finite() { weight } else { 0.0 }
        };
        let plain = moments(&states, &links, groups, &mask, &|_, _| 1.0);
        let relative = moments(&states, &links, groups, &mask, &relative);
        Ok(Self {
            advice: advice::advice(options.technique, &options.settings, &links, &plain),
            pictures: links.iter().map(|link| picture(&states, link, groups, pixels)).collect(),
            links,
            moments: plain,
            relative,
            truth_mean,
            size: options.size,
            shown,
            truth,
            mask,
        })
    }

    /// The table.
    pub fn rows(&self) -> Vec<LinkRow> {
        let row = |(index, link): (usize, &Link)| LinkRow {
            link: link.name,
            bias: self.moments.means[index],
            square: self.moments.products[index][index],
            cross: self.moments.crosses[index],
            share: self.moments.shares[index],
            relative_share: self.relative.shares[index],
        };
        self.links.iter().enumerate().map(row).collect()
    }

    /// Checks that the files of an explanation can be written to a folder, and reserves them.
    ///
    /// # Errors
    /// If the folder holds files of these names that the program did not write, or cannot be written.
    pub fn claim(folder: &Path) -> Result<(), Error> {
        output::claim(folder)
    }

    /// Writes the folder: index.html, explain.md, explain.json, plots/links.svg and one picture a link.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path, facts: &[(&'static str, String)]) -> Result<(), Error> {
        output::write(self, folder, facts)
    }
}

/// What a terminal shows.
impl std::fmt::Display for Explanation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let m = self.truth_mean;
        let cell = |v: Uncertain, factor: f64| {
            format!("{} ± {}", number(factor * v.value, 3), number(factor * v.standard_error, 2))
        };
        let mut line = |cells: [String; 5]| {
            let [name, bias, square, cross, share] = cells;
            writeln!(f, "{name:<28} {bias:>18} {square:>18} {cross:>18} {share:>16}")
        };
        line(["link", "bias", "square", "cross terms", "share"].map(String::from))?;
        line(["", "% of mean", "% of mean^2", "% of mean^2", "% of MSE"].map(String::from))?;
        for row in self.rows() {
            line([
                row.link.to_owned(),
                cell(row.bias, 100.0 / m),
                cell(row.square, 100.0 / (m * m)),
                cell(row.cross, 100.0 / (m * m)),
                cell(row.share, 100.0),
            ])?;
        }
        let all = [cell(self.moments.mean, 100.0 / m), cell(self.moments.square, 100.0 / (m * m))];
        line(["all".into(), all[0].clone(), all[1].clone(), String::new(), "100".into()])?;
        writeln!(f, "relMSE {}\n\n{}", cell(self.relative.square, 1.0), self.advice)
    }
}

fn bad(error: impl std::fmt::Display) -> Error {
    Error::BadInput(error.to_string())
}

/// The settings with visibility off; `None` where the technique tests none.
fn without_visibility(technique: &Technique, settings: &Settings) -> Option<Settings> {
    let complete = (technique.complete)(settings).ok()?;
    let off = Value::parse("off");
    let tested =
        |(key, value): &(&String, &Value)| key.ends_with("visibility") && **value != off && tests(&complete, key);
    let keys: Vec<_> = complete.iter().filter(tested).map(|(key, _)| key.clone()).collect();
    (!keys.is_empty()).then(|| {
        let mut settings = settings.clone();
        settings.extend(keys.into_iter().map(|key| (key, off.clone())));
        settings
    })
}

/// Whether a parameter that ends in `visibility` takes effect: that of light from the lights' views needs those as sources.
fn tests(complete: &Settings, key: &str) -> bool {
    let sources = key.strip_suffix("light_visibility").map(|technique| format!("{technique}sources"));
    sources.is_none_or(|sources| complete.get(&sources) != Some(&Value::parse("screen")))
}
