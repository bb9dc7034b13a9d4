//! A plan as a picture: passes as boxes from top to bottom, resources as threads from the pass that writes
//! them to the last one that reads them. A thread's length is the time that its memory is needed.

use std::fmt::Write as _;

use halflight_frame_graph::{FramePlan, Part, Pass, Resource, ResourceId, ResourceKind, bytes_in_words};

use crate::report::document::escape;

const STYLE: &str = include_str!("plan_graph.css");

/// Everything in pixels of the picture.
const MARGIN: usize = 24;
const TOP: usize = 76;
const ROW: usize = 54;
const BOX_HEIGHT: usize = 40;
/// From a thread to its label, and from the label to the next thread.
const GAP: usize = 9;
/// Between lanes that no label keeps apart.
const LANE: usize = 34;
/// Room for the heading.
const MIN_WIDTH: usize = 720;

/// A resource as a thread.
struct Thread<'a> {
    resource: &'a Resource,
    /// Rows of the first and the last pass that touch it.
    rows: [usize; 2],
    /// Colour: that of the part that writes it.
    class: &'static str,
    /// Column; two threads share one where the first has ended before the second begins.
    lane: usize,
}

impl Thread<'_> {
    fn label(&self) -> [String; 3] {
        let kind = self.resource.kind.to_string();
        let size = kind.split(' ').next().unwrap_or_default().replace('x', "×");
        let bytes = match self.resource.kind {
            ResourceKind::External { .. } => String::new(),
            _ => bytes_in_words(self.resource.bytes()),
        };
        [self.resource.name.clone(), size, bytes]
    }

    /// Width of its label; letters are as wide as in the widest of the usual sans-serif fonts.
    fn width(&self) -> usize {
        let [name, others @ ..] = self.label();
        let others = others.iter().map(|line| line.chars().count() * 7).max().unwrap_or_default();
        (name.len() * 15 / 2).max(others)
    }
}

/// Draws a plan.
pub fn svg(plan: &FramePlan) -> String {
    let touched: Vec<_> = plan.passes.iter().map(Pass::reads_and_writes).collect();
    let threads = threads(plan, &touched);
    let box_width = 32 + plan.passes.iter().map(|pass| pass.reason.len() * 11 / 2).max().unwrap_or_default();
    let x = lane_positions(&threads, 2 * MARGIN + box_width);
    let right = threads.iter().map(|thread| x[thread.lane] + GAP + thread.width()).max().unwrap_or_default();
    let width = right.max(MIN_WIDTH) + MARGIN;
    let height = TOP + ROW * plan.passes.len() + MARGIN;
    let line = |row: usize| TOP + ROW * row + BOX_HEIGHT / 2;
    let mut svg = heading(plan, width, height);
    for thread in &threads {
        let [from, to] = thread.rows.map(line);
        let x = x[thread.lane];
        push(&mut svg, format_args!(r#"<path class="thread {}" d="M{x} {from}V{to}"/>"#, thread.class));
    }
    for (row, (pass, (reads, writes))) in plan.passes.iter().zip(&touched).enumerate() {
        let y = line(row);
        let at = |id: &ResourceId| thread_of(&threads, plan, *id).map_or(0, |thread| x[thread.lane]);
        let end = reads.iter().chain(writes).map(at).max().unwrap_or_default();
        push(&mut svg, format_args!(r#"<path class="row" d="M{} {y}H{end}"/>"#, MARGIN + box_width));
        for (ids, kind) in [(reads, "read"), (writes, "write")] {
            for id in ids {
                let Some(thread) = thread_of(&threads, plan, *id) else { continue };
                let title = escape(&format!("{} {}s {}", pass.name, kind, thread.resource.name));
                let class = thread.class;
                push(
                    &mut svg,
                    format_args!(
                        r#"<circle class="{kind} {class}" cx="{}" cy="{y}" r="4.5"><title>{title}</title></circle>"#,
                        at(id)
                    ),
                );
            }
        }
        pass_box(&mut svg, pass, TOP + ROW * row, box_width);
    }
    for thread in &threads {
        thread_label(&mut svg, thread, x[thread.lane] + GAP, line(thread.rows[0]));
    }
    svg + "</svg>\n"
}

fn push(svg: &mut String, element: std::fmt::Arguments) {
    // Writing to a string cannot fail.
    let _ = svg.write_fmt(element);
    svg.push('\n');
}

fn class(part: Part) -> &'static str {
    match part {
        Part::GBuffer => "gbuffer",
        Part::Direct => "direct",
        Part::Technique => "technique",
    }
}

fn thread_of<'a>(threads: &'a [Thread<'a>], plan: &FramePlan, id: ResourceId) -> Option<&'a Thread<'a>> {
    let resource = &plan.resources[id.0];
    threads.iter().find(|thread| thread.resource.name == resource.name)
}

/// The threads, each in the leftmost lane that is free when it begins; of those that begin together the
/// longest is leftmost.
fn threads<'a>(plan: &'a FramePlan, touched: &[(Vec<ResourceId>, Vec<ResourceId>)]) -> Vec<Thread<'a>> {
    let mut threads: Vec<_> = (0..plan.resources.len())
        .map(ResourceId)
        .filter_map(|id| {
            let mut rows =
                (0..touched.len()).filter(|&row| touched[row].0.contains(&id) || touched[row].1.contains(&id));
            let first = rows.next()?;
            let writer = touched.iter().position(|(_, writes)| writes.contains(&id));
            let class = writer.map_or("given", |row| class(plan.passes[row].part));
            let rows = [first, rows.next_back().unwrap_or(first)];
            Some(Thread { resource: &plan.resources[id.0], rows, class, lane: 0 })
        })
        .collect();
    threads.sort_by_key(|thread| (thread.rows[0], std::cmp::Reverse(thread.rows[1])));
    let mut ends: Vec<usize> = Vec::new();
    for thread in &mut threads {
        thread.lane = ends.iter().position(|&end| end < thread.rows[0]).unwrap_or(ends.len());
        ends.resize(ends.len().max(thread.lane + 1), 0);
        ends[thread.lane] = thread.rows[1];
    }
    threads
}

/// Where the lanes are: as close as the labels between them allow. A label may run on below lanes that
/// are empty in its row.
fn lane_positions(threads: &[Thread], first: usize) -> Vec<usize> {
    let lanes = threads.iter().map(|thread| thread.lane + 1).max().unwrap_or_default();
    let mut x: Vec<usize> = Vec::new();
    for lane in 0..lanes {
        let in_use = |row: usize| threads.iter().any(|t| t.lane == lane && (t.rows[0]..=t.rows[1]).contains(&row));
        let labels = threads.iter().filter(|t| t.lane < lane && in_use(t.rows[0]));
        let clear = labels.map(|t| x[t.lane] + t.width() + 2 * GAP).max().unwrap_or_default();
        x.push(x.last().map_or(first, |last| last + LANE).max(clear));
    }
    x
}

fn heading(plan: &FramePlan, width: usize, height: usize) -> String {
    let [w, h] = plan.display_size;
    let title = format!("Frame of {w}×{h} pixels: {} passes, {}", plan.passes.len(), plan.bytes_in_words());
    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" class="plan" role="img" viewBox="0 0 {width} {height}" width="{width}" height="{height}" style="max-width:100%;height:auto">
<style>{STYLE}</style>
<rect class="paper" width="{width}" height="{height}"/>
<text class="title" x="{MARGIN}" y="30">{title}</text>
"#
    );
    let mut x = MARGIN;
    for part in [Part::GBuffer, Part::Direct, Part::Technique] {
        let (class, text) = (class(part), part.to_string());
        push(&mut svg, format_args!(r#"<rect class="bar {class}" x="{x}" y="44" width="12" height="12" rx="2"/>"#));
        push(&mut svg, format_args!(r#"<text class="soft" x="{}" y="54">{text}</text>"#, x + 18));
        x += 7 * text.len() + 34;
    }
    for (kind, text) in [("write", "written"), ("read", "read, and kept in memory until the last reading")] {
        push(&mut svg, format_args!(r#"<circle class="{kind} given" cx="{}" cy="50" r="4.5"/>"#, x + 6));
        push(&mut svg, format_args!(r#"<text class="soft" x="{}" y="54">{text}</text>"#, x + 16));
        x += 7 * text.len() + 32;
    }
    svg
}

fn pass_box(svg: &mut String, pass: &Pass, y: usize, width: usize) {
    let height = BOX_HEIGHT;
    let title = escape(&format!("{} ({}): {}", pass.name, pass.shader.name, pass.reason));
    let class = class(pass.part);
    push(svg, format_args!("<g><title>{title}</title>"));
    push(svg, format_args!(r#"<rect class="box" x="{MARGIN}" y="{y}" width="{width}" height="{height}" rx="4"/>"#));
    push(svg, format_args!(r#"<rect class="bar {class}" x="{MARGIN}" y="{y}" width="5" height="{height}" rx="2"/>"#));
    let x = MARGIN + 16;
    push(svg, format_args!(r#"<text class="name" x="{x}" y="{}">{}</text>"#, y + 17, escape(&pass.name)));
    push(svg, format_args!(r#"<text class="soft" x="{x}" y="{}">{}</text></g>"#, y + 32, escape(&pass.reason)));
}

fn thread_label(svg: &mut String, thread: &Thread, x: usize, y: usize) {
    let title = escape(&format!("{} ({}): {}", thread.resource.name, thread.resource.kind, thread.resource.reason));
    let [name, size, bytes] = thread.label().map(|line| escape(&line));
    push(svg, format_args!("<g><title>{title}</title>"));
    push(svg, format_args!(r#"<text class="label" x="{x}" y="{}">{name}</text>"#, y + 13));
    push(svg, format_args!(r#"<text class="small" x="{x}" y="{}">{size}</text>"#, y + 24));
    push(svg, format_args!(r#"<text class="small" x="{x}" y="{}">{bytes}</text></g>"#, y + 35));
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use halflight_renderer::plan_technique;
    use halflight_techniques::technique;

    use super::*;

    #[test]
    fn threads_and_labels_keep_clear_of_each_other() {
        let plan = plan_technique(technique("hierarchical").unwrap(), &Default::default(), [1280, 720]).unwrap();
        let touched: Vec<_> = plan.passes.iter().map(Pass::reads_and_writes).collect();
        let threads = threads(&plan, &touched);
        assert_eq!(threads.len(), plan.resources.len());
        let x = lane_positions(&threads, 0);
        for (index, a) in threads.iter().enumerate() {
            for b in &threads[index + 1..] {
                let apart = a.rows[1] < b.rows[0] || b.rows[1] < a.rows[0];
                assert!(a.lane != b.lane || apart, "{} and {} share a lane", a.resource.name, b.resource.name);
            }
            for b in threads.iter().filter(|b| b.lane > a.lane && (b.rows[0]..=b.rows[1]).contains(&a.rows[0])) {
                assert!(x[a.lane] + GAP + a.width() < x[b.lane], "{} runs into {}", a.resource.name, b.resource.name);
            }
        }
        let svg = svg(&plan);
        assert!(plan.passes.iter().all(|pass| svg.contains(&format!(">{}</text>", escape(&pass.name)))));
        assert!(plan.passes.iter().all(|pass| svg.contains(&escape(&pass.reason))));
    }
}
