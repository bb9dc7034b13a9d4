//! Folders of made-up cells, as many machines would leave them, to measure what merging them takes:
//! `cargo run -p halflight-evaluator --example many_cells -- FOLDER 10000 8`, then `evaluator merge FOLDER/part-* --out DIR`.

use std::{error::Error, fs, path::Path};

use halflight_evaluator::{
    experiment::{
        cell_id::CellId,
        cell_log::{CELLS, Record},
        grid::Grid,
        manifest::{MANIFEST, Manifest, SceneContent},
    },
    measurement::{Measurement, Timing},
    report::Pictures,
};
use halflight_metrics::{METRICS, MetricId};
use halflight_native::images::{Image, Rgb};
use halflight_output::{OutputFolder, terminal};
use halflight_techniques::invocation::Invocation;
use serde_json::{Map, json};

const SIZE: [u32; 2] = [16, 9];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("name a folder")?;
    let mut number = |what: &str| -> Result<u64, Box<dyn Error>> { Ok(arguments.next().ok_or(what)?.parse()?) };
    let (cells, parts) = (number("give the number of cells")?, number("give the number of folders")?);
    let list = |count: u64| (1..=count).map(|value| value.to_string()).collect::<Vec<_>>().join(", ");
    let text = format!(
        "scenes = ['made-up']\nsize = ['{}x{}']\n[[sweep]]\ntechnique = 'hierarchical'\n[sweep.grid]\n\
         start_resolution = ['full', 'half', 'quarter']\nvisibility = ['off', 'auto']\nlevels = [{}]\nsamples = [{}]",
        SIZE[0],
        SIZE[1],
        list(8),
        list(cells.div_ceil(48))
    );
    let grid = Grid::parse(Path::new("many.toml"), &text)?;
    let manifest = Manifest {
        commit: "made-up".into(),
        shaders: "made-up".into(),
        grid: grid.to_toml(),
        scenes: vec![SceneContent { name: "made-up".into(), hash: "0".into() }],
        contexts: vec!["made-up".into()],
        command: "cargo run --example many_cells".into(),
        warnings: vec![],
    };
    let folders: Vec<OutputFolder> =
        (0..parts).map(|part| OutputFolder::open(Path::new(&folder).join(format!("part-{part}")))).collect();
    let mut lines = vec![Vec::new(); folders.len()];
    for (index, cell) in grid.cells().enumerate() {
        let id = CellId::new("0", SIZE, &cell);
        let part = (id.number() % parts) as usize;
        let x = index as f64 / cells as f64;
        let pictures = Pictures { folder: &folders[part], width: SIZE[0], mask: None };
        let pixels: Vec<Rgb> =
            (0..SIZE[0] * SIZE[1]).map(|pixel| [x as f32, pixel as f32 / 144.0, (index % 7) as f32 / 7.0]).collect();
        let picture = |kind: &str| pictures.radiance(&format!("made-up_{id}_{kind}"), &pixels, 1.0);
        let images = Map::from_iter([
            ("final".to_owned(), picture("final")?),
            ("indirect".to_owned(), picture("indirect")?),
            ("error".to_owned(), picture("error")?),
            ("exr".to_owned(), {
                let mut image = Image::new(SIZE[0], SIZE[1]);
                image.set_rgb("", &pixels);
                pictures.exr(&format!("made-up_{id}"), &image)?
            }),
        ]);
        // Time grows with the samples, errors fall with them, with a spread of their own.
        let hash = (id.number() % 1000) as f64 / 1000.0;
        let time = 0.5 + 20.0 * x + 3.0 * hash;
        let mut row = Measurement {
            scene: "made-up".into(),
            camera: "default".into(),
            width: SIZE[0],
            height: SIZE[1],
            technique: cell.technique.name.into(),
            parameters: cell.settings.iter().map(|(key, value)| (key.clone(), json!(value))).collect(),
            pass_ms: (0..12).map(|pass| (format!("gather_{pass}"), json!(time / 12.0))).collect(),
            memory_bytes: 1 << 20,
            frame_bytes: 1 << 22,
            adapter: "made-up GPU".into(),
            machine: format!("node-{part}"),
            commit: manifest.commit.clone(),
            command: Invocation::render("made-up", cell.technique.name, &cell.settings, SIZE).to_string(),
            images,
            ..Measurement::default()
        };
        for (rank, metric) in METRICS.iter().enumerate() {
            row.errors.set(metric.id, Some((0.01 + hash / (1.0 + 9.0 * x)) * (rank + 1) as f64));
        }
        // One reference for all.
        row.errors.set(MetricId::TruthRelError, Some(0.01));
        if let Some(timing) = Timing::of(&[time, time * 1.01, time * 1.02]) {
            row.set_time(&timing);
        }
        let record = Record { cell: id.to_string(), context: "made-up".into(), references: vec![], row };
        lines[part].extend(serde_json::to_vec(&record)?);
        lines[part].push(b'\n');
    }
    for (folder, lines) in folders.iter().zip(lines) {
        manifest.write(&folder.claim(MANIFEST)?)?;
        fs::write(folder.claim(CELLS)?, lines)?;
    }
    terminal::print_line(format_args!("{} cells of {SIZE:?} in {parts} folders", grid.len()))?;
    Ok(())
}
