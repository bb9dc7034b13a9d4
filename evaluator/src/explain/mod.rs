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
use halflight_native::{NativeGpu, cache::Cache, images::Rgb, truth::TruthSource};
use halflight_renderer::{
    gi::{Reach, Technique, rsm::has_reflective_shadow_maps},
    parameters::{Kind, Settings, Value},
    plan_technique_of_scene,
    scene::SceneFacts,
    truth::{Estimate, Request as TruthRequest, Stop},
};
use halflight_scenes::Scene;
use halflight_techniques::{radiance_cache::RadianceCache, technique};
use serde::Serialize;

use crate::{
    Error,
    experiment::session::{Frames, Request, Session},
    format::number,
    progress::Progress,
};

mod advice;
pub mod chain;
mod output;

use chain::{Link, Moments, State, Uncertain, moments, picture};

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
/// Bounces of the reference where a technique takes all of them.
const ALL_BOUNCES: u32 = 12;

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
        let mut states = vec![State::Exact(shown.clone())];
        let mut links = Vec::new();
        let mut last = 0;
        let mut push = |states: &mut Vec<State>, name, state| {
            states.push(state);
            links.push(Link::between(name, last, states.len() - 1));
            last = states.len() - 1;
        };
        if !options.direct_from_truth {
            push(&mut states, "direct light", State::Exact(run.image(options.technique, &options.settings, false, 0)?));
        }
        push(&mut states, if in_world { UNTRACED } else { "noise" }, run.converged(&options.settings, Senders::All)?);
        // The reference of the whole image; of its first bounce where that is all.
        let mut whole = None;
        let settings = &bounces.first;
        if bounces.number > 1 {
            let all = states.len() - 1;
            states.push(State::Groups(traced.all));
            states.push(State::Groups(traced.truth.clone()));
            states.push(run.converged(settings, Senders::All)?);
            whole = Some(all + 1);
            last = all + 3;
            links.push(Link { name: FURTHER, terms: vec![(all, 1.0), (last, -1.0), (all + 1, -1.0), (all + 2, 1.0)] });
        }
        let mut push = |states: &mut Vec<State>, links: &mut Vec<Link>, name, state| {
            states.push(state);
            links.push(Link::between(name, last, states.len() - 1));
            last = states.len() - 1;
        };
        let plan = plan_technique_of_scene(&session.facts, options.technique, settings, options.size);
        let other_views = has_reflective_shadow_maps(&plan.map_err(bad)?);
        let visible = without_visibility(options.technique, settings).filter(|_| !other_views);
        let open = visible.as_ref().map(|settings| run.converged(settings, Senders::All)).transpose()?;
        if in_world {
            push(&mut states, &mut links, INTERPOLATION, run.converged(&with_fine_records(settings)?, Senders::All)?);
            push(&mut states, &mut links, REST, State::Groups(traced.truth.clone()));
        } else if other_views && session.facts.emitters.is_empty() {
            let all = states.len() - 1;
            states.push(run.converged(settings, Senders::Seen)?);
            states.push(State::Groups(traced.on_screen));
            states.push(State::Groups(traced.truth.clone()));
            let (shown, on_screen) = (all + 1, all + 2);
            last = all + 3;
            links.push(Link::between(SHOWN, shown, on_screen));
            let terms = vec![(all, 1.0), (shown, -1.0), (last, -1.0), (on_screen, 1.0)];
            links.push(Link { name: ELSEWHERE, terms });
        } else if other_views {
            push(&mut states, &mut links, EVERYWHERE, State::Groups(traced.truth.clone()));
        } else {
            let exhaustive = run.image(technique("exhaustive").map_err(bad)?, &Settings::new(), false, 0)?;
            push(&mut states, &mut links, "estimator and hierarchy", State::Exact(exhaustive));
            push(&mut states, &mut links, "missing visibility", State::Groups(traced.on_screen));
            push(&mut states, &mut links, "off-screen and hidden light", State::Groups(traced.truth.clone()));
        }
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

/// How many bounces the image has.
struct Bounces {
    /// Their number, that of the reference.
    number: u32,
    /// The settings with one bounce.
    first: Settings,
}

impl Bounces {
    fn of(technique: &Technique, settings: &Settings) -> Result<Self, Error> {
        let key = format!("{}.bounces", technique.name);
        let complete = (technique.complete)(settings).map_err(bad)?;
        let number = match complete.get(&key) {
            // All of them.
            Some(Value::Int(0)) => ALL_BOUNCES,
            Some(Value::Int(number)) => u32::try_from(*number).map_err(bad)?,
            _ => 1,
        };
        let mut first = settings.clone();
        if number > 1 {
            first.insert(key, Value::Int(1));
        }
        Ok(Self { number, first })
    }
}

/// Whether a technique finds all light in the world and builds on the frames before.
fn keeps_light_in_world(session: &Session, options: &Options) -> Result<bool, Error> {
    let sources = (options.technique.sources)(&options.settings).map_err(bad)?;
    let everywhere = [sources.lamps, sources.emitters, sources.sky].iter().all(|reach| *reach == Reach::Scene);
    let plan = plan_technique_of_scene(&session.facts, options.technique, &options.settings, options.size);
    let plan = plan.map_err(bad)?;
    Ok(everywhere && plan.has_history() && !has_reflective_shadow_maps(&plan))
}

/// The settings of the radiance cache with the narrowest records, and as many more rays as there are more records.
fn with_fine_records(settings: &Settings) -> Result<Settings, Error> {
    let now = RadianceCache::from_settings(settings).map_err(bad)?;
    let range = |name: &str| {
        let declared = RadianceCache::parameters().into_iter().find(|parameter| parameter.name == name);
        declared.map_or((0.0, f64::INFINITY), |parameter| match parameter.kind {
            Kind::Int(low, high) => (low as f64, high as f64),
            Kind::Float(low, high) => (low, high),
            Kind::Choice(_) => (0.0, f64::INFINITY),
        })
    };
    let spacing = range("spacing").0 as f32;
    let more = f64::from((now.spacing / spacing).powi(2)) * f64::from(now.rays);
    let fine = RadianceCache { spacing, rays: more.min(range("rays").1) as u32, ..now };
    Ok(fine.to_settings())
}

/// What the path tracer says.
struct TracedGroups {
    albedo: Vec<Rgb>,
    direct: Vec<Rgb>,
    mask: Vec<bool>,
    /// `albedo * light`, by group: of the first bounce what the screen shows and all of it, and of all bounces.
    on_screen: Vec<Vec<Rgb>>,
    truth: Vec<Vec<Rgb>>,
    all: Vec<Vec<Rgb>>,
}

fn trace(native: &NativeGpu, scene: &Scene, options: &Options, bounces: u32) -> Result<TracedGroups, Error> {
    let source = TruthSource::new(&native.gpu, scene, options.cache.clone());
    let stop = Stop { error_block: 8, ..Stop::at_samples(options.samples_per_pixel.div_ceil(GROUPS).max(1)) };
    let progress = Progress::new(&format!("reference of {}", scene.name), 100 * u64::from(GROUPS));
    let mut groups: Option<TracedGroups> = None;
    for group in 0..GROUPS {
        let seed = options.seed.wrapping_add(1 + group);
        let request = TruthRequest {
            bounce1: true,
            on_screen: true,
            bounces,
            seed,
            ..TruthRequest::new(scene.camera, options.size)
        };
        let done = |part: f32| {
            let percent = 100 * u64::from(group) + (100.0 * part) as u64;
            progress.set(percent, &format!("group {} of {GROUPS}", group + 1));
        };
        let traced = source.trace(&request, stop, &mut |now| done(now.fraction)).map_err(bad)?.truth;
        let lit = |light: Option<&Estimate<Rgb>>| match light {
            Some(light) => reflected(&traced.albedo, &light.mean),
            None => vec![[0.0; 3]; traced.albedo.len()],
        };
        let (on_screen, all) = (lit(traced.on_screen.as_ref()), lit(traced.bounce1.as_ref()));
        let groups = groups.get_or_insert_with(|| TracedGroups {
            mask: traced.depth.iter().map(|&depth| depth > 0.0).collect(),
            albedo: traced.albedo.clone(),
            direct: traced.direct.clone(),
            on_screen: Vec::new(),
            truth: Vec::new(),
            all: Vec::new(),
        });
        groups.on_screen.push(on_screen);
        groups.truth.push(all);
        groups.all.push(lit(traced.indirect.as_ref()));
    }
    progress
        .finish(&format!("reference of {}: {GROUPS} groups of {} samples a pixel", scene.name, stop.samples_per_pixel));
    groups.ok_or_else(|| Error::Failed("nothing was traced: run again".into()))
}

fn reflected(albedo: &[Rgb], light: &[Rgb]) -> Vec<Rgb> {
    albedo.iter().zip(light).map(|(a, l)| std::array::from_fn(|c| a[c] * l[c])).collect()
}

/// Which surfaces of the lights' views send light on.
#[derive(Clone, Copy, PartialEq)]
enum Senders {
    All,
    /// Those that the camera sees.
    Seen,
}

/// Runs the technique and its relatives.
struct Run<'a> {
    session: &'a Session<'a>,
    options: &'a Options,
    albedo: &'a [Rgb],
    direct: &'a [Rgb],
    /// Whether the technique keeps light in the world: frames follow each other.
    in_world: bool,
}

impl Run<'_> {
    fn frames(
        &self,
        technique: &'static Technique,
        settings: &Settings,
        rendered: bool,
        seed: u32,
        senders: Senders,
    ) -> Result<Frames<'_>, Error> {
        let request = Request {
            technique,
            settings: settings.clone(),
            size: self.options.size,
            seed,
            direct: (!rendered).then_some(self.direct),
        };
        let facts = SceneFacts { only_seen_surfaces_send: senders == Senders::Seen, ..self.session.facts.clone() };
        self.session.frames_of(&facts, &request)
    }

    /// `albedo * indirect` of one frame. `rendered` says where its direct light comes from; `other` is added to the seed.
    fn image(
        &self,
        technique: &'static Technique,
        settings: &Settings,
        rendered: bool,
        other: u32,
    ) -> Result<Vec<Rgb>, Error> {
        let seed = self.options.seed.wrapping_add(other);
        let mut frames = self.frames(technique, settings, rendered, seed, Senders::All)?;
        let count = if self.in_world { self.options.frame.max(1) } else { 1 };
        for frame in 0..count {
            frames.run(frame)?;
        }
        self.read(&frames)
    }

    fn read(&self, frames: &Frames) -> Result<Vec<Rgb>, Error> {
        let light = frames.read_rgb("indirect")?;
        // The reference's albedo for all, so that it cancels in every difference.
        Ok(light.map_or_else(|| vec![[0.0; 3]; self.albedo.len()], |light| reflected(self.albedo, &light)))
    }

    /// The mean over many frames, by group; a technique without random samples needs one frame.
    fn converged(&self, settings: &Settings, senders: Senders) -> Result<State, Error> {
        let technique = self.options.technique;
        // What a technique with other views finds differs from seed to seed.
        if senders == Senders::All {
            let [one, other] = [1, 2].map(|seed| self.image(technique, settings, false, seed));
            let one = one?;
            if one == other? {
                return Ok(State::Exact(one));
            }
        }
        if self.in_world {
            return self.settled(settings);
        }
        let each = self.options.frames.div_ceil(GROUPS).max(1);
        let progress = Progress::new("converged image", u64::from(each * GROUPS));
        let mut groups = Vec::new();
        for group in 0..GROUPS {
            let seed = self.options.seed.wrapping_add(1 + group);
            let mut frames = self.frames(technique, settings, false, seed, senders)?;
            let mut sum = vec![[0.0f64; 3]; self.albedo.len()];
            for frame in 0..each {
                // Numbers that no other group has: frames and seeds meet in one hash.
                frames.run(1 + group * each + frame)?;
                let image = self.read(&frames)?;
                sum.iter_mut().flatten().zip(image.iter().flatten()).for_each(|(s, &v)| *s += f64::from(v));
                progress.set(u64::from(group * each + frame + 1), technique.name);
            }
            groups.push(sum.iter().map(|s| s.map(|v| (v / f64::from(each)) as f32)).collect());
        }
        progress.finish(&format!("converged image: {} frames", each * GROUPS));
        Ok(State::Groups(groups))
    }

    /// The image after many frames of a technique that keeps light, by group.
    fn settled(&self, settings: &Settings) -> Result<State, Error> {
        let count = self.options.frames.max(1);
        let progress = Progress::new("converged image", u64::from(count * GROUPS));
        let mut groups = Vec::new();
        for group in 0..GROUPS {
            let seed = self.options.seed.wrapping_add(1 + group);
            let mut frames = self.frames(self.options.technique, settings, false, seed, Senders::All)?;
            for frame in 0..count {
                frames.run(frame)?;
                progress.set(u64::from(group * count + frame + 1), self.options.technique.name);
            }
            groups.push(self.read(&frames)?);
        }
        progress.finish(&format!("converged image: frame {count} of {GROUPS} seeds"));
        Ok(State::Groups(groups))
    }
}
