#![allow(clippy::unwrap_used)]
use serde_json::json;

use super::document::table::Table;
use super::*;

/// A cell of the 2009 grid whose gather costs 1 ms a sample and four times that at half resolution.
fn cell(start: &str, levels: u32, samples: u32, rel_mse: f64) -> Measurement {
    let gather = f64::from(samples) * if start == "half" { 4.0 } else { 1.0 };
    let object = |value: serde_json::Value| value.as_object().cloned().unwrap();
    let mut row = Measurement {
        scene: "atrium <south>".into(),
        width: 8,
        height: 4,
        technique: "hierarchical".into(),
        parameters: object(json!({
            "hierarchical.start_resolution": start,
            "hierarchical.levels": levels,
            "hierarchical.samples": samples,
            "hierarchical.radius": 20,
        })),
        frames: 10,
        time_ms_median: gather + 6.0,
        time_ms_min: gather + 5.9,
        time_ms_p95: gather + 6.2,
        pass_ms: object(
            json!({"gather_0": 0.75 * gather, "gather_1": 0.25 * gather, "combine": 5.0, "composite": 1.0}),
        ),
        images: object(json!({"final": "images/a.png", "error": "images/e.png", "truth_final": "images/t.png"})),
        adapter: "llvmpipe".into(),
        software_adapter: true,
        commit: "0123abc".into(),
        preset: "soler2009_fig6".into(),
        command: format!("evaluator render --set hierarchical.samples={samples} # </script>"),
        ..Measurement::default()
    };
    row.errors.set(MetricId::IndirectRelMse, Some(rel_mse));
    row
}

fn report() -> Report {
    Report {
        title: "Grid & {{data}}".into(),
        warnings: vec!["leaf.png is missing".into()],
        measurements: vec![
            cell("quarter", 4, 64, 0.04),
            cell("quarter", 4, 256, 0.03),
            cell("half", 4, 64, 0.05),
            cell("half", 4, 256, 0.02),
        ],
        ..Report::default()
    }
}

fn column(table: &Table, name: &str, unit: &str) -> Vec<String> {
    let index = table.columns.iter().position(|column| column.name == name && column.unit == unit).unwrap();
    table.rows.iter().map(|row| row.cells[index].text.clone()).collect()
}

#[test]
fn the_folder_is_whole_and_the_page_needs_no_network() {
    let folder = std::env::temp_dir().join(format!("halflight-report-{}", std::process::id()));
    for _ in 0..2 {
        report().write(&OutputFolder::open(&folder)).unwrap(); // writing again replaces
    }
    for file in ["results.csv", "results.json", "tables.md", "plots/time-vs-relmse.svg", "plots/cost-per-pass.svg"] {
        assert!(folder.join(file).is_file(), "{file}");
    }
    let page = std::fs::read_to_string(folder.join("index.html")).unwrap();
    let outside = page.replace("http://www.w3.org/2000/svg", "");
    assert!(
        !outside.contains("http:") && !outside.contains("https:") && !page.contains("src=\"/"),
        "only relative paths"
    );
    assert!(page.contains("<h1>Grid &amp; {{data}}</h1>"), "a text that looks like a place is a text");
    assert!(page.contains("atrium &lt;south&gt;") && page.contains("<span class=\"badge\">software</span>"));
    assert!(page.contains("0123abc") && page.contains("leaf.png is missing"));
    assert_eq!(page.matches("</script>").count(), 2, "no text ends a script early");
    let data = page.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data[0]["choices"].as_array().unwrap().len(), 5, "one truth and four cells");
    assert_eq!(data[0]["start"], 3, "the best cell stands beside the truth");
    assert_eq!(measurement::read_json(&folder.join("results.json")).unwrap(), report().measurements);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_report_may_be_empty() {
    let folder = std::env::temp_dir().join(format!("halflight-report-empty-{}", std::process::id()));
    Report::default().write(&OutputFolder::open(&folder)).unwrap();
    let lonely = Report {
        measurements: vec![Measurement { technique: "none".into(), ..Measurement::default() }],
        ..Report::default()
    };
    lonely.write(&OutputFolder::open(&folder)).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn an_unwritable_folder_is_bad_input() {
    let file = std::env::temp_dir().join(format!("halflight-report-file-{}", std::process::id()));
    std::fs::write(&file, "").unwrap();
    let error = report().write(&OutputFolder::open(&file)).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().starts_with("cannot write"), "{error}");
    std::fs::remove_file(file).unwrap();
}

#[test]
fn the_frontier_says_what_milliseconds_buy() {
    let report = report();
    let groups = groups(&report.measurements);
    let trades = trade::trades(&groups[0], &(0..groups[0].rows.len()).collect());
    let [by_rel_mse] = &trades[..] else { panic!("relMSE alone was measured") };
    let table = &by_rel_mse.table;
    assert_eq!(column(table, "#", ""), ["1", "2", "4"], "half with 64 samples is slower and worse than quarter");
    assert_eq!(column(table, "more time", "ms"), ["", "+192", "+768"]);
    assert_eq!(column(table, "change", ""), ["", "−25.0 %", "−33.3 %"]);
    // Without errors there is no frontier, but there are results.
    let mut blind = report.measurements.clone();
    blind.iter_mut().for_each(|row| row.errors = halflight_metrics::Values::default());
    let groups = super::groups(&blind);
    assert!(trade::trades(&groups[0], &(0..groups[0].rows.len()).collect()).is_empty());
    assert!(!tables::results(&groups[0]).columns.iter().any(|column| column.name == "relMSE"), "empty columns go");
}

#[test]
fn every_metric_has_its_frontier() {
    let mut report = report();
    // FLIP falls with time, SSIM is best for the fastest, bias has a sign.
    for (row, (flip, ssim, bias)) in
        report.measurements.iter_mut().zip([(0.3, 0.9, -0.02), (0.2, 0.8, 0.01), (0.1, 0.7, -0.01), (0.09, 0.6, 0.002)])
    {
        row.errors.set(MetricId::FinalFlip, Some(flip));
        row.errors.set(MetricId::FinalSsim, Some(ssim));
        row.errors.set(MetricId::IndirectBias, Some(bias));
    }
    let groups = groups(&report.measurements);
    let trades = trade::trades(&groups[0], &(0..groups[0].rows.len()).collect());
    let shown: Vec<(&str, Vec<String>)> =
        trades.iter().map(|trade| (trade.plot.choice, column(&trade.table, "#", ""))).collect();
    let rows = |rows: &[&str]| rows.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert_eq!(
        shown,
        [
            ("FLIP", rows(&["1", "3", "4"])),
            ("relMSE", rows(&["1", "2", "4"])),
            ("1 − SSIM", rows(&["1"])),
            ("|bias|", rows(&["1", "2", "4"])),
        ],
        "the default comes first; a lower SSIM is worse; bias counts by its size (rows 2 and 3 take as long)"
    );
    assert!(trades.iter().all(|trade| trade.table.columns.iter().any(|column| column.name == "relMSE")));
    let plots = plots::error_over_samples(&groups[0]);
    let svg = plots.iter().find(|plot| plot.choice == "|bias|").unwrap().drawing.inline();
    assert!(svg.contains("bias over samples") && svg.contains(">−0.02<"), "bias over samples keeps its sign: {svg}");
    let folder = std::env::temp_dir().join(format!("halflight-measures-{}", std::process::id()));
    report.write(&OutputFolder::open(&folder)).unwrap();
    let text = std::fs::read_to_string(folder.join("tables.md")).unwrap();
    for (title, wanted) in [("FLIP", true), ("relMSE", true), ("|bias|", false)] {
        assert_eq!(text.contains(&format!("### What each millisecond buys, by {title}\n")), wanted, "{title}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn rel_mse_is_explained_where_it_ranks_below_nothing() {
    let mut report = report();
    let mut none =
        Measurement { technique: "none".into(), parameters: Default::default(), ..report.measurements[0].clone() };
    (none.time_ms_median, none.time_ms_min) = (0.0, 0.0);
    none.errors.set(MetricId::FinalFlip, Some(0.5));
    none.errors.set(MetricId::IndirectRelMse, Some(0.045));
    report.measurements.iter_mut().for_each(|row| row.errors.set(MetricId::FinalFlip, Some(0.2)));
    report.measurements.push(none);
    let remark = |rows: &[Measurement]| trade::remark_on_rel_mse(&groups(rows)[0]);
    let text = remark(&report.measurements).unwrap();
    // 0.04, 0.03 and 0.02 are better than 0.045, 0.05 is not.
    assert!(
        text.starts_with("By relMSE, 1 of 4 configurations are worse") && text.contains("better than none: FLIP 4."),
        "{text}"
    );
    report.measurements[4].errors.set(MetricId::IndirectRelMse, Some(0.06));
    assert_eq!(remark(&report.measurements), None, "nothing to explain");
    assert_eq!(remark(&report.measurements[..4]), None, "nothing to compare with");
}

#[test]
fn ratios_stand_beside_the_published_ones() {
    let report = report();
    let groups = groups(&report.measurements);
    let published = tables::published(&groups[0], &groups);
    let titles: Vec<&str> = published.iter().map(|table| table.title.as_str()).collect();
    let steps = ["what the paper concludes", "gather", "combine", "composite", "total"];
    assert_eq!(titles, steps.map(|step| format!("Published and measured: {step}")));
    let [claims, gather, .., total] = &published[..] else { panic!("five tables") };
    // 26.6 / 7.1, 102.4 / 26.8, 26.8 / 7.1, 102.4 / 26.6, 26.8 / 26.6, 35.1 / 34.8.
    assert_eq!(
        column(claims, "8800 GTS", "published ratio"),
        ["3.746", "3.821", "3.775", "3.850", "1.008", "1.009", "over 70 %"]
    );
    assert_eq!(column(claims, "measured", "ratio"), ["4.000", "4.000", "4.000", "4.000", "", "", "75.0 %"]);
    let confirmed = "confirmed";
    assert_eq!(column(claims, "here", ""), [confirmed, confirmed, confirmed, confirmed, "", "", ""]);
    // Figure 6, 8800 GTS, SSIL: 7.1, 26.8, 102.4, 26.6, 26.8 ms.
    assert_eq!(column(gather, "8800 GTS", "× first row"), ["1.00", "3.77", "14.4", "3.75", "3.77"]);
    // 1 ms a sample, fourfold at half resolution; five levels were not measured.
    assert_eq!(column(gather, "measured", "× first row"), ["1.00", "4.00", "16.0", "4.00", ""]);
    assert_eq!(column(total, "measured", "ms"), ["70.0", "262", "1030", "262", ""]);
    // Another preset has no table.
    let mut other = report.measurements.clone();
    other.iter_mut().for_each(|row| row.preset = "mine".into());
    let others = super::groups(&other);
    assert!(tables::published(&others[0], &others).is_empty());
}

#[test]
fn a_table_of_two_resolutions_takes_rows_of_both_sizes() {
    let row = |[width, height]: [u32; 2], map: f64, march: f64| Measurement {
        scene: "statue".into(),
        width,
        height,
        technique: "hybrid".into(),
        preset: "lambru_table3".into(),
        parameters: [("hybrid.specular".to_owned(), "both".into())].into_iter().collect(),
        pass_ms: [("mirror_map".to_owned(), map.into()), ("specular_0".to_owned(), march.into())].into_iter().collect(),
        ..Measurement::default()
    };
    let rows = [row([320, 180], 2.0, 4.0), row([480, 270], 5.0, 6.0)];
    let groups = groups(&rows);
    assert!(tables::published(&groups[0], &groups).is_empty(), "the table stands once, behind both sizes");
    let published = tables::published(&groups[1], &groups);
    // 2.69 / 1.03, 2.23 / 1.28, 1.28 / 1.03, 2.23 / 2.69.
    assert_eq!(column(&published[0], "GTX 1070", "published ratio"), ["2.612", "1.742", "1.243", "0.8290"]);
    assert_eq!(column(&published[0], "measured", "ratio"), ["2.500", "1.500", "2.000", "1.200"]);
    let words: Vec<&str> = published[1].rows.iter().map(|row| row.cells[0].text.as_str()).collect();
    assert_eq!(words, ["1280×720 · both", "1920×1080 · both"]);
}

#[test]
fn a_step_that_the_first_row_lacks_is_compared_with_the_first_that_has_it() {
    let row = |samples: u32, visibility: &str, voxels: f64| {
        let mut row = cell("quarter", 4, samples, 0.1);
        row.preset = "soler2010_fig9".into();
        row.parameters.insert("hierarchical.visibility".into(), visibility.into());
        row.pass_ms.insert("voxels".into(), voxels.into());
        row
    };
    // Without visibility there are no voxels in the paper; a pass of that name here is no base.
    let rows = [row(64, "off", 5.0), row(64, "auto", 2.0), row(256, "auto", 3.0)];
    let groups = groups(&rows);
    let published = tables::published(&groups[0], &groups);
    let voxels = published.iter().find(|table| table.title.ends_with("voxels")).unwrap();
    assert_eq!(column(voxels, "GTX 260", "× first row")[..4], ["", "1.00", "", "1.00"]);
    assert_eq!(column(voxels, "measured", "× first row")[..4], ["2.50", "1.00", "", "1.50"]);
}

#[test]
fn each_frame_has_a_curve_of_its_own() {
    let row = |technique: &str, at_frame: Option<u32>, time: f64, error: f64| {
        let mut row = Measurement {
            technique: technique.into(),
            at_frame,
            time_ms_median: time,
            time_ms_min: time,
            ..Measurement::default()
        };
        row.errors.set(MetricId::IndirectRelMse, Some(error));
        row
    };
    let mut rows = vec![row("none", None, 0.0, 0.9), row("bitmask", None, 1.0, 0.5)];
    for (frame, error) in [(1, 0.8), (8, 0.4), (32, 0.2), (128, 0.1)] {
        rows.push(row("radiance-cache", Some(frame), 2.0, error));
    }
    let groups = groups(&rows);
    let trades = trade::trades(&groups[0], &(0..rows.len()).collect());
    let drawing = trades[0].plot.drawing.file();
    for name in ["none", "bitmask", "radiance-cache", "frontier, frame 1", "frontier, frame 128"] {
        assert_eq!(drawing.matches(&format!(">{name}</text>")).count(), 1, "{name}");
    }
    // Nothing joins the end of a curve with its start: a stair goes right and down, here by one or two steps.
    let steps: Vec<usize> = drawing
        .split("<path class=\"line ink\" d=\"M")
        .skip(1)
        .take(4)
        .map(|path| path.split('"').next().unwrap().matches('H').count())
        .collect();
    assert_eq!(steps, [1, 2, 2, 2]);
    // In frame 1 the cache is worse than what is faster.
    assert_eq!(column(&trades[0].table, "frame", ""), ["1", "1", "8", "8", "8", "32", "32", "32", "128", "128", "128"]);
}

#[test]
fn tables_mark_the_best_and_give_units() {
    let report = report();
    let groups = groups(&report.measurements);
    let results = tables::results(&groups[0]);
    let text = markdown::table(&results, 3);
    assert!(
        text.contains("| # | start resolution | levels |") || text.contains("| # | start resolution | samples |"),
        "{text}"
    );
    assert!(text.contains("time [ms]") && text.contains("**70.0**") && text.contains("**0.0200**"), "{text}");
    assert!(!text.contains("radius"), "what does not vary is no column");
    let widths: Vec<usize> =
        text.lines().filter(|line| line.starts_with('|')).map(|line| line.matches(" | ").count()).collect();
    assert!(widths.windows(2).all(|pair| pair[0] == pair[1]), "{text}");
}

#[test]
fn numbers_that_should_worry_are_warnings() {
    let mut report = report();
    report.measurements[1].errors.set(MetricId::FinalFlip, Some(f64::NAN));
    report.measurements[2].time_ms_p95 = 1e4;
    report.measurements[3].frames = 3;
    let warnings = report.all_warnings();
    let has =
        |start: &str, part: &str| warnings.iter().any(|warning| warning.starts_with(start) && warning.contains(part));
    assert!(has("leaf.png", "missing") && has("All rows", "software adapter"));
    assert!(has("#2:", "NaN") && has("#3:", "p95") && has("#4:", "fewer than 10"), "{warnings:?}");
}

#[test]
fn a_report_of_thousands_of_rows_has_few_elements_and_all_rows() {
    let rows: Vec<Measurement> = (0..3000)
        .map(|index| {
            // On the frontier: the first hundred. Every later one is slower and worse.
            let place = f64::from(index);
            let mut row = cell("half", 4, index + 1, if index < 100 { 200.5 - place } else { 900.5 + place });
            (row.time_ms_min, row.time_ms_median, row.time_ms_p95) = (place + 1.0, place + 1.0, place + 1.0);
            row.preset.clear();
            row
        })
        .collect();
    let report = Report { measurements: rows, ..Report::default() };
    let path = std::env::temp_dir().join(format!("halflight-many-rows-{}", std::process::id()));
    report.write(&OutputFolder::open(&path)).unwrap();
    let page = std::fs::read_to_string(path.join("index.html")).unwrap();
    let table = page.split("<div class=\"long\">").nth(1).expect("the table of results is long");
    let data = table.split("<script type=\"application/json\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["rows"].as_array().map(Vec::len), Some(3000));
    let column = |name: &str| data["columns"].as_array().unwrap().iter().find(|c| c["name"] == name).unwrap();
    assert_eq!(column("samples")["texts"][2999], "3000");
    assert_eq!(column("relMSE")["values"][2999], 3899.5);
    assert!(page.matches("<tr").count() < 2000, "{} rows are elements", page.matches("<tr").count());
    assert!(page.matches("class=\"mark point").count() < 2000);
    assert!(page.contains("class=\"line dots"));
    let csv = std::fs::read_to_string(path.join("results.csv")).unwrap();
    assert_eq!(csv.lines().count(), 3001);
    std::fs::remove_dir_all(path).unwrap();
}
