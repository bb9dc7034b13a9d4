//! Equation 3 against Equation 4 (Soler et al. 2009, Figure 5): the light of both and of the reference as pictures under one
//! exposure, and along one line through all three.

use std::path::Path;

use halflight_metrics::{Metric, MetricId};
use halflight_native::images::{Image, Rgb, auto_exposure, luminance, write_png};

use super::document::chart::{Axis, Line, Plot, Point, Series, Spacing};
use super::document::table::{Cell, Column, Table, TableRow};
use super::grouping::Group;
use super::plots::Named;
use crate::Error;
use crate::format::number;
use crate::measurement::{Measurement, plain};

/// `preset` of the rows that the figure belongs to.
pub(super) const PRESET: &str = "soler2009_fig5";

/// The figure.
pub struct Slice {
    /// Title and path of each picture: reference, Equation 3, Equation 4.
    pub pictures: [(String, String); 3],
    /// Width and height of the pictures, pixels.
    pub size: [u32; 2],
    /// The line: a row of pixels, from the top.
    pub line: usize,
    /// Light along the line.
    pub plot: Named,
    /// Error of both in the whole image and along the line.
    pub table: Table,
    /// What is shown, and how the line was chosen.
    pub caption: String,
}

/// Makes the figure from the image files of the group's rows and writes its pictures; None for another preset or until
/// both equations have a row.
///
/// # Errors
/// If an image file cannot be read or a picture cannot be written.
pub fn slice(group: &Group, folder: &Path) -> Result<Option<Slice>, Error> {
    let row = |form_factor: &str| {
        let is =
            |row: &Measurement| row.parameters.get("hierarchical.form_factor").is_some_and(|v| plain(v) == form_factor);
        group.rows.iter().find(|(_, row)| row.preset == PRESET && is(row)).copied()
    };
    let (Some(eq3), Some(eq4)) = (row("eq3"), row("eq4")) else { return Ok(None) };
    let files = (eq3.1.image("truth_exr"), eq3.1.image("exr"), eq4.1.image("exr"));
    let (Some(truth_file), Some(eq3_file), Some(eq4_file)) = files else { return Ok(None) };

    let truth = Image::read(&folder.join(truth_file))?;
    let light = |image: &Image, file: &str| {
        let missing = || Error::unreadable(&folder.join(file), "it has no indirect light");
        image.rgb("indirect").ok_or_else(missing)
    };
    let files = [truth_file, eq3_file, eq4_file];
    let mut images = vec![light(&truth, truth_file)?];
    for file in &files[1..] {
        images.push(light(&Image::read(&folder.join(file))?, file)?);
    }
    let exposure = auto_exposure(&images[0], truth.surface_mask().as_deref());
    let mut pictures =
        ["path-traced reference", "Equation 3", "Equation 4"].map(|title| (title.to_owned(), String::new()));
    for ((file, pixels), (_, picture)) in files.iter().zip(&images).zip(&mut pictures) {
        *picture = file.replace(".exr", "_incident.png");
        write_png(&folder.join(&*picture), truth.width, pixels, exposure)?;
    }

    let width = truth.width as usize;
    let line = roughest_line(&images[1], &images[0], width);
    let along = |image: &[Rgb]| -> Vec<f64> {
        image[line * width..][..width].iter().map(|&pixel| f64::from(luminance(pixel))).collect()
    };
    let lights: [Vec<f64>; 3] = std::array::from_fn(|i| along(&images[i]));
    let highest = |light: &[f64]| light.iter().copied().fold(0.0, f64::max);
    // A spike may be a hundred times the light around it, and would flatten all else.
    let limit = 1.3 * highest(&lights[0]).max(highest(&lights[2]));
    let cut = if highest(&lights[1]) > limit {
        format!(" Equation 3 reaches {} and is cut at {}.", number(highest(&lights[1]), 3), number(limit, 3))
    } else {
        String::new()
    };
    let caption = format!(
        "Indirect light alone, albedo left out, under one exposure. The line is pixel row {line}, of all rows the one \
         where Equation 3 departs most from the reference (root mean square).{cut}"
    );
    let plot = Named { file: "slice".into(), choice: "", drawing: plot(&lights, line, limit).draw() };
    let table = table(&[eq3, eq4], &lights);
    Ok(Some(Slice { pictures, size: [truth.width, truth.height], line, plot, table, caption }))
}

/// The row of pixels whose luminance departs most from the reference's, root mean square.
fn roughest_line(image: &[Rgb], truth: &[Rgb], width: usize) -> usize {
    let error = |(image, truth): (&[Rgb], &[Rgb])| -> f64 {
        let errors = image.iter().zip(truth).map(|(&a, &b)| f64::from(luminance(a) - luminance(b)));
        errors.map(|error| error * error).sum()
    };
    let rows = image.chunks(width).zip(truth.chunks(width)).map(error);
    rows.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(row, _)| row)
}

fn plot([truth, eq3, eq4]: &[Vec<f64>; 3], line: usize, limit: f64) -> Plot {
    let series = |name: &str, colour: Option<usize>, light: &[f64]| Series {
        name: name.into(),
        colour,
        marker: None,
        line: Some(Line::Solid),
        points: light
            .iter()
            .enumerate()
            .map(|(x, &y)| Point { x: x as f64, y: y.min(limit), label: String::new(), row: None })
            .collect(),
    };
    let axis = |label: &str| Axis { label: label.into(), spacing: Spacing::Linear, ticks: vec![] };
    Plot {
        title: format!("Indirect light along pixel row {line}"),
        x: axis("pixel"),
        y: axis("luminance of indirect light, radiance"),
        series: vec![
            series("Equation 3", Some(0), eq3),
            series("reference", None, truth),
            series("Equation 4", Some(1), eq4),
        ],
    }
}

fn table(rows: &[(usize, &Measurement); 2], [truth, eq3, eq4]: &[Vec<f64>; 3]) -> Table {
    let shown: [&Metric; 6] = [
        MetricId::FinalFlip,
        MetricId::IndirectRelMse,
        MetricId::IndirectRmse,
        MetricId::IndirectBias,
        MetricId::IndirectP999Abs,
        MetricId::NoiseStd,
    ]
    .map(MetricId::metric);
    let errors = rows.map(|(_, row)| row.errors);
    let mut columns = vec![Column::numeric("#", "", "row of results.csv"), Column::text("form factor")];
    columns.extend(shown.map(|metric| Column::numeric(metric.title, metric.unit, metric.meaning)));
    columns.extend([
        Column::numeric("RMSE of the line", "radiance", "of the luminance of indirect light, albedo left out"),
        Column::numeric("its highest value", "× reference's", "over the highest value of the reference on the line"),
    ]);
    let highest = |light: &[f64]| light.iter().copied().fold(0.0, f64::max);
    let rows = rows.iter().zip([("Equation 3", eq3), ("Equation 4", eq4)]).map(|(&(index, row), (name, light))| {
        let squares: f64 = light.iter().zip(truth).map(|(a, b)| (a - b) * (a - b)).sum();
        let mut cells = vec![Cell::row(index), Cell::text(name)];
        cells.extend(shown.map(|metric| Cell::number(row.errors.get(metric.id), metric.digits)));
        cells.push(Cell::number(Some((squares / truth.len().max(1) as f64).sqrt()), 3));
        cells.push(Cell::number(Some(highest(light) / highest(truth)), 3));
        TableRow { row: Some(index), cells }
    });
    let rows = rows.collect();
    let mut caption = "Over the whole image, and along the line of the figure.".to_owned();
    let [three, four] = errors;
    let (bias, flip) = (MetricId::IndirectBias, MetricId::FinalFlip);
    let is_darker = four.get(bias) < three.get(bias) && four.get(bias) < Some(0.0);
    if three.get(flip) < four.get(flip) && is_darker {
        caption += " FLIP puts Equation 3 ahead, because the image of Equation 4 is darker as a whole: a disc of all that a \
                    sample stands for, as published, loses light with few samples (disc_area = texel does not).";
    }
    let title = "Equation 3 against Equation 4".into();
    Table { title, caption, columns, rows }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::grouping::groups;
    use halflight_native::images::Precision;
    use serde_json::json;

    #[test]
    fn the_figure_finds_its_line_and_its_spike() {
        let folder = std::env::temp_dir().join(format!("halflight-slice-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("images")).expect("a folder for temporary files");
        // A flat grey of 0.5 in 4x3 pixels; Equation 3 has a spike of 50 in row 2, and a small error in row 0.
        let write = |name: &str, change: &dyn Fn(&mut Vec<Rgb>)| {
            let mut pixels = vec![[0.5; 3]; 12];
            change(&mut pixels);
            let mut image = Image::new(4, 3);
            image.set_rgb("indirect", &pixels);
            let path = format!("images/{name}.exr");
            image.write_exr(&folder.join(&path), Precision::Half).expect("the folder is there");
            path
        };
        let truth = write("truth", &|_| ());
        let cell = |form_factor: &str, exr: String| Measurement {
            preset: PRESET.into(),
            parameters: json!({"hierarchical.form_factor": form_factor}).as_object().cloned().unwrap_or_default(),
            images: json!({"exr": exr, "truth_exr": truth}).as_object().cloned().unwrap_or_default(),
            ..Measurement::default()
        };
        let spiked = |pixels: &mut Vec<Rgb>| {
            pixels[9] = [50.0; 3];
            pixels[1] = [0.7; 3];
        };
        let rows = [cell("eq3", write("a", &spiked)), cell("eq4", write("b", &|pixels| pixels[9] = [0.6; 3]))];
        let groups = groups(&rows);
        let figure = slice(&groups[0], &folder).expect("the files are there").expect("both rows are there");
        assert_eq!(figure.line, 2);
        assert_eq!(figure.size, [4, 3]);
        assert!(figure.caption.contains("reaches 50.0 and is cut at 0.780"), "{}", figure.caption);
        let last: Vec<&str> =
            figure.table.rows.iter().map(|row| row.cells[row.cells.len() - 1].text.as_str()).collect();
        assert_eq!(last, ["100", "1.20"]);
        assert!(figure.pictures.iter().all(|(_, path)| folder.join(path).is_file()));
        // One row alone, or another preset, makes no figure; a lost file is reported.
        let mut other = rows.clone();
        other[0].preset.clear();
        assert!(slice(&super::super::groups(&other)[0], &folder).expect("nothing is read").is_none());
        std::fs::remove_file(folder.join("images/b.exr")).expect("it was written above");
        let error = slice(&groups[0], &folder).err().expect("a lost file is an error").to_string();
        assert!(error.contains("b.exr"), "{error}");
        std::fs::remove_dir_all(folder).expect("it was made above");
    }
}
