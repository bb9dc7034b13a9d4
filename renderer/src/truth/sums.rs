//! Sums of a reference over many samples, added part by part.

use super::{
    Request, State, Truth, TruthError,
    exact::ExactSums,
    request::Layout,
    state::{PrimarySurface, truth_of},
};

/// Samples of a part. The device adds the samples of a part in float32, one by one; parts are added exactly. So a
/// reference is the same however its parts are spread over computers, and its sums do not lose digits as they grow.
pub const PART: u32 = 64;

/// Sums over a range of samples that starts with a part. They can be stored ([`Sums::to_bytes`]), continued and merged
/// ([`Sums::merge`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Sums {
    /// First sample, a multiple of [`PART`].
    first: u32,
    /// Samples of whole parts.
    whole: u32,
    /// Samples at which an interrupted trace was to judge its error next; 0 where it was not interrupted.
    planned: u32,
    scale: f32,
    surfaces: Vec<PrimarySurface>,
    sums: ExactSums,
    /// The last part while it is not whole.
    last: Option<State>,
}

const MAGIC: [u8; 8] = *b"HLSUMS01";

impl Sums {
    /// Sums of no samples yet, of a range that starts with this one: a multiple of [`PART`].
    pub fn new(first: u32) -> Self {
        Self {
            first: first - first % PART,
            whole: 0,
            planned: 0,
            scale: 1.0,
            surfaces: Vec::new(),
            sums: ExactSums::default(),
            last: None,
        }
    }

    /// First sample of the range.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Samples per pixel.
    pub fn samples(&self) -> u32 {
        self.whole + self.last.as_ref().map_or(0, State::samples)
    }

    /// Whether the surfaces that the camera sees are known: from the first part on, even from one without samples.
    pub fn has_surfaces(&self) -> bool {
        !self.surfaces.is_empty()
    }

    /// Samples at which an interrupted trace was to judge its error next; 0 where it was not interrupted. A trace that
    /// goes on to there ends with the same samples as one that was never interrupted.
    pub fn planned(&self) -> u32 {
        self.planned
    }

    /// Sets [`Sums::planned`].
    pub fn plan(&mut self, samples: u32) {
        self.planned = samples;
    }

    /// The last part where it is not whole, to continue it.
    pub fn unfinished(&self) -> Option<&State> {
        self.last.as_ref()
    }

    /// First sample of the part that comes next or is not whole.
    pub fn next_part(&self) -> u32 {
        self.first + self.whole
    }

    /// Adds a part, or puts it in the place of the same one with fewer samples.
    pub fn add(&mut self, part: State) {
        if part.samples < PART {
            (self.scale, self.surfaces) = (part.scale, part.surfaces.clone());
            self.last = Some(part);
            return;
        }
        if self.sums.len() == 0 {
            self.sums = ExactSums::new(part.sums.len());
        }
        let words = (part.sums.len() / part.surfaces.len().max(1)).max(1);
        for index in 0..part.sums.len() {
            self.sums.add(index, part.sum(index, words));
        }
        self.whole += part.samples;
        (self.scale, self.surfaces, self.last) = (part.scale, part.surfaces, None);
    }

    /// Adds the sums of the samples that follow these.
    ///
    /// # Errors
    /// If a sample would be missing or count twice, or if the sums are of another scene or adapter.
    pub fn merge(&mut self, next: Sums) -> Result<(), TruthError> {
        let (end, first) = (self.first + self.samples(), next.first);
        if end != first {
            let what = if end < first { "are missing" } else { "are there twice" };
            return Err(TruthError(format!("samples {} to {} {what}", end.min(first), end.max(first) - 1)));
        }
        let bits = |surfaces: &[PrimarySurface]| bytemuck::cast_slice::<_, u8>(surfaces).to_vec();
        if self.last.is_some() || self.scale != next.scale || bits(&self.surfaces) != bits(&next.surfaces) {
            return Err(TruthError(
                "the surfaces that the camera sees differ: another scene, camera or adapter".into(),
            ));
        }
        if self.sums.len() == 0 {
            self.sums = next.sums;
        } else if next.sums.len() > 0 {
            self.sums.add_all(&next.sums);
        }
        (self.whole, self.last) = (self.whole + next.whole, next.last);
        Ok(())
    }

    /// The images. `request` is that of the trace.
    pub fn truth(&self, request: &Request) -> Truth {
        let words = Layout::new(request).words as usize;
        let of_last = |index: usize| self.last.as_ref().map_or(0.0, |last| last.sum(index, words));
        let whole = self.sums.rounded();
        let sum = |index: usize| whole.get(index).copied().unwrap_or(0.0) + of_last(index);
        truth_of(request, self.samples(), self.scale, &self.surfaces, sum)
    }

    /// The sums in bytes, little-endian. They do not contain the request: store them with it.
    pub fn to_bytes(&self) -> Vec<u8> {
        let last = self.last.as_ref();
        let counts = [
            self.first,
            self.whole,
            self.planned,
            self.scale.to_bits(),
            self.surfaces.len() as u32,
            self.sums.len() as u32,
            last.map_or(0, State::samples),
            0,
        ];
        [
            &MAGIC,
            bytemuck::cast_slice(&counts),
            bytemuck::cast_slice(&self.surfaces),
            &self.sums.to_bytes(),
            bytemuck::cast_slice(last.map_or(&[], |last| last.sums.as_slice())),
        ]
        .concat()
    }

    /// Parses sums.
    ///
    /// # Errors
    /// If the bytes are not sums of this request.
    pub fn from_bytes(bytes: &[u8], request: &Request) -> Result<Self, TruthError> {
        let pixels = request.size[0] as usize * request.size[1] as usize;
        let words = pixels * Layout::new(request).words as usize;
        let read = || {
            let (counts, rest) = bytes.strip_prefix(&MAGIC)?.split_at_checked(32)?;
            let [first, whole, planned, scale, of_surfaces, of_sums, of_last, _]: [u32; 8] =
                bytemuck::pod_read_unaligned(counts);
            let fits = |count: u32, wanted: usize| count as usize == wanted || count == 0;
            (fits(of_surfaces, pixels) && fits(of_sums, words)).then_some(())?;
            (of_surfaces > 0 || whole + of_last == 0).then_some(())?;
            (whole.is_multiple_of(PART)
                && first.is_multiple_of(PART)
                && of_last < PART
                && (of_sums > 0) == (whole > 0))
                .then_some(())?;
            let (surfaces, rest) = rest.split_at_checked(of_surfaces as usize * size_of::<PrimarySurface>())?;
            let surfaces: Vec<PrimarySurface> = bytemuck::pod_collect_to_vec(surfaces);
            let (sums, rest) = ExactSums::from_bytes(rest, of_sums as usize)?;
            let scale = f32::from_bits(scale);
            (rest.len() == if of_last > 0 { words * 4 } else { 0 }).then_some(())?;
            let last = (of_last > 0).then(|| State {
                samples: of_last,
                scale,
                surfaces: surfaces.clone(),
                sums: bytemuck::pod_collect_to_vec(rest),
            });
            Some(Self { first, whole, planned, scale, surfaces, sums, last })
        };
        read().ok_or_else(|| TruthError("stored truth is damaged or belongs to another request; delete it".into()))
    }
}
