//! A plan as text.

use std::fmt;

use super::{FramePlan, Part, ResourceId, ResourceKind};

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::GBuffer => "G-buffer",
            Self::Direct => "Direct light",
            Self::Technique => "Technique",
        })
    }
}

/// Kind of a resource: `1280x720 R32Float`, `data`, `given`.
impl fmt::Display for ResourceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&match self {
            Self::Texture { size: [w, h], layers: 1, format } | Self::Previous { size: [w, h], format, .. } => {
                format!("{w}x{h} {format:?}")
            }
            Self::Texture { size: [w, h], layers, format } => format!("{w}x{h}x{layers} {format:?}"),
            Self::Data { .. } => "data".into(),
            Self::Buffer { .. } => "buffer".into(),
            Self::External { .. } => "given".into(),
        })
    }
}

/// A number of bytes with three digits, in powers of 1000.
pub fn bytes_in_words(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.2} MB", bytes as f64 / 1e6),
    }
}

impl FramePlan {
    /// Allocated bytes, those of the technique, and how many live at once: `100.29 MB (90.12 MB live at once), of which
    /// the technique 20.1 MB (15.0 MB live at once)`.
    pub fn bytes_in_words(&self) -> String {
        let both = |allocated, live| format!("{} ({} live at once)", bytes_in_words(allocated), bytes_in_words(live));
        let whole = both(self.bytes(), self.live_bytes());
        let technique = both(self.technique_bytes(), self.live_technique_bytes());
        format!("{whole}, of which the technique {technique}")
    }
}

/// Lists passes grouped by the part of the frame, then resources with their bytes, each with its reason.
impl fmt::Display for FramePlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names =
            |ids: &[ResourceId]| ids.iter().map(|id| self.resources[id.0].name.as_str()).collect::<Vec<_>>().join(", ");
        let [w, h] = self.display_size;
        let (memory, passes) = (self.memory(), self.passes.len());
        writeln!(f, "Frame of {w}x{h} pixels: {passes} passes, {}", self.bytes_in_words())?;
        for note in &self.notes {
            writeln!(f, "Note: {note}")?;
        }
        let width = |lengths: &mut dyn Iterator<Item = usize>| lengths.max().unwrap_or_default();
        let name = width(&mut self.passes.iter().map(|pass| pass.name.len()));
        let reason = width(&mut self.passes.iter().map(|pass| pass.reason.len()));
        let mut part = None;
        for (index, (pass, when)) in self.passes.iter().zip(self.schedule()).enumerate() {
            if part.replace(pass.part) != Some(pass.part) {
                writeln!(f, "\n{}", pass.part)?;
            }
            let (reads, writes) = pass.reads_and_writes();
            writeln!(f, "{:>4}  {:<name$}  {:<reason$}  {}", index + 1, pass.name, pass.reason, pass.shader.name)?;
            writeln!(f, "      {:name$}  {} -> {}", "", names(&reads), names(&writes))?;
            writeln!(f, "      {:name$}  {when}{}", "", Self::dispatches_in_words(pass))?;
        }
        writeln!(f, "\nTextures and buffers")?;
        let name = width(&mut self.resources.iter().map(|resource| resource.name.len()));
        let kind = width(&mut self.resources.iter().map(|resource| resource.kind.to_string().len()));
        for (index, resource) in self.resources.iter().enumerate() {
            let bytes = match resource.kind {
                ResourceKind::External { .. } => String::new(),
                _ => bytes_in_words(resource.bytes()),
            };
            write!(f, "      {:<name$}  {:<kind$}  {bytes:>9}  {}", resource.name, resource.kind, resource.reason)?;
            let owner = memory.owner(ResourceId(index));
            if owner.0 != index {
                write!(f, "; in the memory of {}", self.resources[owner.0].name)?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
