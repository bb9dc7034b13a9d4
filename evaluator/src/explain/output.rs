//! The folder of an explanation.

use std::{fmt::Write as _, io::Write as _, path::Path};

use halflight_metrics::percentile;
use halflight_native::{
    files::write_whole,
    images::{Rgb, auto_exposure, luminance, write_png, write_png_srgb8},
};
use halflight_output::OutputFolder;

use super::{Explanation, LinkRow, Uncertain};
use crate::{
    Error,
    format::number,
    report::document::{
        chart::{Bars, Drawing, Segment},
        markdown, simple_page,
        table::{Cell, Column, Table, TableRow},
    },
};

/// Files of every explanation; beside them there is a picture for each link.
const FILES: [&str; 6] =
    ["index.html", "explain.md", "explain.json", "plots/links.svg", "images/image.png", "images/truth.png"];

pub(super) fn claim(folder: &Path) -> Result<(), Error> {
    let folder = OutputFolder::open(folder);
    FILES.iter().try_for_each(|name| folder.claim(name).map(drop))?;
    Ok(())
}

pub(super) fn write(explanation: &Explanation, folder: &Path, facts: &[(&'static str, String)]) -> Result<(), Error> {
    let folder = OutputFolder::open(folder);
    let text = |name: &str, text: &str| {
        let path = folder.claim(name)?;
        write_whole(&path, |file| file.write_all(text.as_bytes()))
            .map_err(|error: std::io::Error| Error::unwritable(&path, error))
    };
    let Explanation { mask, size: [width, _], .. } = explanation;
    let exposure = auto_exposure(&explanation.truth, Some(mask));
    let picture = |name: &str, pixels: &[Rgb]| {
        let path = format!("images/{name}.png");
        write_png(&folder.claim(&path)?, *width, pixels, exposure).map(|()| path).map_err(Error::from)
    };
    let mut pictures = vec![
        ("the image".to_owned(), picture("image", &explanation.shown)?),
        ("path-traced reference".to_owned(), picture("truth", &explanation.truth)?),
    ];
    let scale = full_scale(explanation);
    for (link, pixels) in explanation.links.iter().zip(&explanation.pictures) {
        let path = format!("images/{}.png", link.name.replace(' ', "_"));
        write_png_srgb8(&folder.claim(&path)?, *width, &signed_map(pixels, scale, mask))?;
        pictures.push((link.name.to_owned(), path));
    }
    let rows = explanation.rows();
    let tables = [links_table(explanation, &rows), products_table(explanation)];
    let bars = bars(explanation, &rows);
    text("plots/links.svg", &bars.file())?;
    text("explain.json", &(json(explanation, &rows, facts)? + "\n"))?;
    let scale_note = format!(
        "Links as pictures: red is too bright, blue too dark, the strongest colour {} times the reference's mean.",
        number(f64::from(scale) / explanation.truth_mean, 2)
    );
    let mut markdown = format!("# Where the error comes from\n\n{}.\n\n", sentence(&explanation.advice));
    for (name, value) in facts {
        // Writing to a String cannot fail.
        let _ = writeln!(markdown, "- {name}: {value}");
    }
    markdown += "\n![Links](plots/links.svg)\n\n";
    tables.iter().for_each(|table| markdown += &markdown::table(table, 2));
    let _ = writeln!(markdown, "{scale_note}\n");
    pictures.iter().for_each(|(name, path)| {
        let _ = writeln!(markdown, "![{name}]({path})");
    });
    text("explain.md", &markdown)?;
    let page = simple_page::SimplePage {
        title: "Where the error comes from",
        summary: &format!("{}.", sentence(&explanation.advice)),
        facts,
        chart: &bars,
        tables: &tables,
        pictures_note: &scale_note,
        pictures: &pictures,
    };
    text("index.html", &page.html())
}

/// With a capital letter.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

/// One bar a link: its root mean square alone, in percent of the reference's mean.
fn bars(explanation: &Explanation, rows: &[LinkRow]) -> Drawing {
    let root = |row: &LinkRow| 100.0 * row.square.value.max(0.0).sqrt() / explanation.truth_mean;
    let segment = |index: usize| Segment { name: String::new(), colour: index, shade: 0 };
    let bar = |(index, row): (usize, &LinkRow)| {
        let mut values = vec![0.0; rows.len()];
        values[index] = root(row);
        (row.link.to_owned(), values)
    };
    Bars {
        title: "Size of each link on its own".into(),
        unit: "root mean square, % of the reference's mean".into(),
        segments: (0..rows.len()).map(segment).collect(),
        bars: rows.iter().enumerate().map(bar).collect(),
    }
    .draw()
}

fn plus_minus(value: Uncertain, factor: f64) -> Cell {
    let text = format!("{} ± {}", number(factor * value.value, 3), number(factor * value.standard_error, 2));
    Cell { text, value: Some(factor * value.value), best: false }
}

fn links_table(explanation: &Explanation, rows: &[LinkRow]) -> Table {
    let m = explanation.truth_mean;
    let (mean, square) = (100.0 / m, 100.0 / (m * m));
    let mut body: Vec<TableRow> = rows
        .iter()
        .map(|row| TableRow {
            row: None,
            cells: vec![
                Cell::text(row.link),
                plus_minus(row.bias, mean),
                plus_minus(row.square, square),
                plus_minus(row.cross, square),
                plus_minus(row.share, 100.0),
                plus_minus(row.relative_share, 100.0),
            ],
        })
        .collect();
    let Explanation { moments, relative, .. } = explanation;
    let all = Uncertain { value: 1.0, standard_error: 0.0 };
    body.push(TableRow {
        row: None,
        cells: vec![
            Cell::text("all"),
            plus_minus(moments.mean, mean),
            plus_minus(moments.square, square),
            Cell::text(""),
            plus_minus(all, 100.0),
            Cell::text(format!("100 (relMSE {})", number(relative.square.value, 3))),
        ],
    });
    Table {
        title: "Links".into(),
        caption:
            "Signed errors add up. Squares add up with the cross terms: what two links cancel or add of each other, \
                  counted half with either one in the shares. Each number with its standard error."
                .into(),
        columns: vec![
            Column::text("link"),
            Column::numeric("bias", "% of the reference's mean", "mean of the signed error"),
            Column::numeric("square", "% of the squared mean", "mean square of the link alone"),
            Column::numeric("cross terms", "% of the squared mean", "twice its products with all other links"),
            Column::numeric("share", "% of the squared error", "square and half of the cross terms"),
            Column::numeric("share of relMSE", "%", "the same, each pixel relative to its reference"),
        ],
        rows: body,
    }
}

fn products_table(explanation: &Explanation) -> Table {
    let factor = 100.0 / explanation.truth_mean.powi(2);
    let names = || explanation.links.iter().map(|link| link.name);
    let rows = explanation.moments.products.iter().zip(names()).map(|(row, name)| TableRow {
        row: None,
        cells: [Cell::text(name)].into_iter().chain(row.iter().map(|&v| plus_minus(v, factor))).collect(),
    });
    Table {
        title: "Products of links".into(),
        caption: "Mean product of two links: squares on the diagonal; a negative one means that two errors cancel."
            .into(),
        columns: [Column::text("link")]
            .into_iter()
            .chain(names().map(|name| Column::numeric(name, "% of the squared mean", "")))
            .collect(),
        rows: rows.collect(),
    }
}

fn json(explanation: &Explanation, rows: &[LinkRow], facts: &[(&'static str, String)]) -> Result<String, Error> {
    let facts: serde_json::Map<String, serde_json::Value> =
        facts.iter().map(|(name, value)| ((*name).to_owned(), value.clone().into())).collect();
    let Explanation { moments, relative, truth_mean, advice, .. } = explanation;
    let value = serde_json::json!({
        "facts": facts, "advice": advice, "truth_mean": truth_mean, "links": rows,
        "bias": moments.mean, "mean_square_error": moments.square, "rel_mse": relative.square,
        "products": moments.products,
    });
    serde_json::to_string_pretty(&value).map_err(|e| Error::Failed(e.to_string()))
}

/// The radiance that has the strongest colour: all but a hundredth of the pixels of all links lie within it.
fn full_scale(explanation: &Explanation) -> f32 {
    let counted = explanation.pictures.iter().flat_map(|picture| {
        picture
            .iter()
            .zip(&explanation.mask)
            .filter(|(_, mask)| **mask)
            .map(|(pixel, _)| f64::from(luminance(*pixel)).abs())
    });
    percentile(&mut counted.collect::<Vec<_>>(), 0.99).max(1e-30) as f32
}

/// Blue over white to red, the ends of ColorBrewer's RdBu (Brewer 2003), readable with common colour blindness; pixels
/// that do not count are grey.
fn signed_map(pixels: &[Rgb], scale: f32, mask: &[bool]) -> Vec<[u8; 3]> {
    const DARK: [f32; 3] = [33.0, 102.0, 172.0];
    const BRIGHT: [f32; 3] = [178.0, 24.0, 43.0];
    const MIDDLE: f32 = 247.0;
    let colour = |(pixel, &counts): (&Rgb, &bool)| {
        if !counts {
            return [96; 3];
        }
        let at = (luminance(*pixel) / scale).clamp(-1.0, 1.0);
        let end = if at < 0.0 { DARK } else { BRIGHT };
        end.map(|end| (MIDDLE + (end - MIDDLE) * at.abs()).round() as u8)
    };
    pixels.iter().zip(mask).map(colour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_maps_tell_bright_from_dark() {
        let map = signed_map(&[[0.0; 3], [9.0; 3], [-9.0; 3], [9.0; 3]], 1.0, &[true, true, true, false]);
        assert_eq!(map, [[247; 3], [178, 24, 43], [33, 102, 172], [96; 3]]);
    }
}
