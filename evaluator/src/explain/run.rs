//! The images of the chain: what the technique shows with some settings, and what the path tracer says.

use halflight_native::{NativeGpu, images::Rgb, truth::TruthSource};
use halflight_renderer::{
    gi::{Reach, Technique, rsm::has_reflective_shadow_maps},
    parameters::{Kind, Settings, Value},
    plan_technique_of_scene,
    scene::SceneFacts,
    truth::{Estimate, Request as TruthRequest, Stop},
};
use halflight_scenes::Scene;
use halflight_techniques::radiance_cache::RadianceCache;

use super::{GROUPS, Options, bad, chain::State};
use crate::{
    Error,
    experiment::{
        reference::ALL_BOUNCES,
        session::{Frames, Request, Session},
    },
    progress::Progress,
};

/// How many bounces the image has.
pub(super) struct Bounces {
    /// Their number, that of the reference.
    pub(super) number: u32,
    /// The settings with one bounce.
    pub(super) first: Settings,
}

impl Bounces {
    pub(super) fn of(technique: &Technique, settings: &Settings) -> Result<Self, Error> {
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
pub(super) fn keeps_light_in_world(session: &Session, options: &Options) -> Result<bool, Error> {
    let sources = (options.technique.sources)(&options.settings).map_err(bad)?;
    let everywhere = [sources.lamps, sources.emitters, sources.sky].iter().all(|reach| *reach == Reach::Scene);
    let plan = plan_technique_of_scene(&session.facts, options.technique, &options.settings, options.size);
    let plan = plan.map_err(bad)?;
    Ok(everywhere && plan.has_history() && !has_reflective_shadow_maps(&plan))
}

/// The settings of the radiance cache with the narrowest records, and as many more rays as there are more records.
pub(super) fn with_fine_records(settings: &Settings) -> Result<Settings, Error> {
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
pub(super) struct TracedGroups {
    pub(super) albedo: Vec<Rgb>,
    pub(super) direct: Vec<Rgb>,
    pub(super) mask: Vec<bool>,
    /// `albedo * light`, by group: of the first bounce what the screen shows and all of it, and of all bounces.
    pub(super) on_screen: Vec<Vec<Rgb>>,
    pub(super) truth: Vec<Vec<Rgb>>,
    pub(super) all: Vec<Vec<Rgb>>,
}

pub(super) fn trace(native: &NativeGpu, scene: &Scene, options: &Options, bounces: u32) -> Result<TracedGroups, Error> {
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
pub(super) enum Senders {
    All,
    /// Those that the camera sees.
    Seen,
}

/// Runs the technique and its relatives.
pub(super) struct Run<'a> {
    pub(super) session: &'a Session<'a>,
    pub(super) options: &'a Options,
    pub(super) albedo: &'a [Rgb],
    pub(super) direct: &'a [Rgb],
    /// Whether the technique keeps light in the world: frames follow each other.
    pub(super) in_world: bool,
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
    pub(super) fn image(
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
    pub(super) fn converged(&self, settings: &Settings, senders: Senders) -> Result<State, Error> {
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
