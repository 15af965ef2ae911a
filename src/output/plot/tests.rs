use super::layout::{MAX_POINTS, thinned};
use super::text::{Block, width, wrapped};
use super::ticks::Ticks;
use super::*;

fn line(name: &str, points: Vec<(f64, f64)>) -> Line {
    Line { name: name.into(), points, bars: None, beside: Vec::new(), style: LineStyle::Dashed { colour: 0, dash: 0 } }
}

fn plot(lines: Vec<Line>, scale: Scale) -> LinePlot {
    let axis = |title: &str| Axis { title: title.into(), scale };
    LinePlot {
        title: "A tip".into(),
        x: axis("time [s]"),
        y: axis("tip.ux [mm]"),
        lines,
        level: None,
        boundaries: Vec::new(),
    }
}

/// Texts of a class in a picture.
fn texts(svg: &str, class: &str) -> Vec<String> {
    let begins = format!("<text class=\"{class} ");
    let all = svg.lines().filter(|line| line.starts_with(&begins));
    all.map(|line| line.split_once('>').unwrap().1.trim_end_matches("</text>").to_string()).collect()
}

/// A number among the attributes of texts of a class.
fn attributes(svg: &str, class: &str, key: &str) -> Vec<f64> {
    let begins = format!("<text class=\"{class} ");
    let number = |line: &str| {
        let rest = line.split_once(&format!(" {key}=\"")).unwrap().1;
        rest.split_once('"').unwrap().0.parse::<f64>().unwrap()
    };
    svg.lines().filter(|line| line.starts_with(&begins)).map(number).collect()
}

/// Pixels across and down of texts of a class.
fn places(svg: &str, class: &str) -> Vec<(f64, f64)> {
    attributes(svg, class, "x").into_iter().zip(attributes(svg, class, "y")).collect()
}

/// Numbers that are spread over many sizes, the same each time.
fn numbers(count: usize) -> impl Iterator<Item = f64> {
    let mut state = 88_172_645_463_325_252_u64;
    (0..count).map(move |_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let digits = (state % 2_000_001) as f64 - 1e6;
        digits * 10.0_f64.powi((state >> 40) as i32 % 41 - 26)
    })
}

#[test]
fn texts_of_linear_ticks_are_their_values() {
    let all: Vec<f64> = numbers(4000).collect();
    for pair in all.chunks_exact(2) {
        let (low, high) = (pair[0].min(pair[1]), pair[0].max(pair[1]));
        if high - low <= 1e-9 * low.abs().max(high.abs()) {
            continue;
        }
        for max_labels in [1, 2, 5, 10] {
            let ticks = Ticks::new(Scale::Linear, low, high, max_labels).labelled;
            assert!((2..=max_labels.max(7) + 1).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            let room = 1e-6 * (high - low);
            for tick in &ticks {
                assert_eq!(tick.text.parse::<f64>().unwrap(), tick.value, "{low} {high}");
                assert!(tick.value >= low - room && tick.value <= high + room, "{low} {high}: {}", tick.text);
            }
            assert!(ticks.windows(2).all(|pair| pair[0].text != pair[1].text && pair[0].value < pair[1].value));
        }
    }
}

#[test]
fn ticks_are_round_and_evenly_spaced() {
    let texts = |low: f64, high: f64, max_labels: usize| -> Vec<String> {
        Ticks::new(Scale::Linear, low, high, max_labels).labelled.into_iter().map(|tick| tick.text).collect()
    };
    assert_eq!(texts(0.0, 0.0375, 8), ["0", "0.005", "0.010", "0.015", "0.020", "0.025", "0.030", "0.035"]);
    assert_eq!(texts(-0.3, 0.9, 4), ["0", "0.5"]);
    assert_eq!(texts(-1.0, 1.0, 4), ["-1.0", "-0.5", "0", "0.5", "1.0"]);
    assert_eq!(texts(1e-5, 9e-5, 5), ["20e-6", "40e-6", "60e-6", "80e-6"]);
    assert_eq!(texts(0.0, 2.5e7, 5), ["0", "5e6", "10e6", "15e6", "20e6", "25e6"]);
    assert_eq!(texts(1000.00001, 1000.00003, 2), ["1000.00001", "1000.00002", "1000.00003"]);
    assert_eq!(texts(0.0, 30000.0, 3), ["0", "10000", "20000", "30000"]);
}

#[test]
fn logarithmic_ticks_are_powers_of_ten_or_finer() {
    let texts = |low: f64, high: f64| -> Vec<String> {
        Ticks::new(Scale::Logarithmic, low, high, 8).labelled.into_iter().map(|tick| tick.text).collect()
    };
    assert_eq!(texts(1e-15, 10.0), ["1e-14", "1e-12", "1e-10", "1e-8", "1e-6", "1e-4", "0.01", "1"]);
    assert_eq!(texts(0.9e-3, 120.0), ["0.001", "0.01", "0.1", "1", "10", "100"]);
    assert_eq!(texts(0.8, 60.0), ["1", "2", "5", "10", "20", "50"]);
    assert_eq!(texts(2.1, 2.9), ["2.1", "2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9"]);
    let fine = Ticks::new(Scale::Logarithmic, 1e-3, 1.0, 4);
    assert!(fine.minor.contains(&3e-3) && fine.minor.contains(&0.9) && fine.labelled.len() == 4);
    for exponent in -250..250 {
        for tick in
            Ticks::new(Scale::Logarithmic, 0.7 * 10.0_f64.powi(exponent), 10.0_f64.powi(exponent + 7), 8).labelled
        {
            assert_eq!(tick.text.parse::<f64>().unwrap(), tick.value);
        }
    }
}

#[test]
fn ticks_of_a_picture_stand_where_their_texts_say() {
    let svg = plot(vec![line("tip.ux", vec![(0.0, -0.0123), (0.07, 0.0291)])], Scale::Linear).to_svg();
    let (texts, places) = (texts(&svg, "y-tick"), places(&svg, "y-tick"));
    let values: Vec<f64> = texts.iter().map(|text| text.parse().unwrap()).collect();
    assert!(values.len() > 4, "{texts:?}");
    let slope = (places[1].1 - places[0].1) / (values[1] - values[0]);
    for (value, place) in values.iter().zip(&places) {
        assert!((places[0].1 + slope * (value - values[0]) - place.1).abs() < 0.3, "{texts:?}");
    }
    assert!(slope < 0.0);
}

#[test]
fn titles_fit_whatever_their_length() {
    let long = "A tip of an arm that is bent by a force which follows its section, with a title that tells all of it; "
        .repeat(3);
    let unbroken = "x".repeat(400);
    for title in ["A tip", long.trim(), &unbroken] {
        let mut plot = plot(vec![line(title, vec![(0.0, 0.0), (1.0, 1.0)])], Scale::Linear);
        for place in [&mut plot.title, &mut plot.x.title, &mut plot.y.title] {
            *place = title.into();
        }
        let svg = plot.to_svg();
        assert!(svg.contains(&format!("<title>{title}</title>")), "the whole title is for screen readers");
        for class in ["title", "x-title", "legend"] {
            let sizes = attributes(&svg, class, "font-size");
            for ((text, (x, _)), size) in texts(&svg, class).iter().zip(places(&svg, class)).zip(sizes) {
                let room = width(text, size);
                let start = if class == "legend" { x } else { x - 0.5 * room };
                assert!(start >= 0.0 && start + room <= 860.0, "{class} {text}");
            }
        }
        let (ends, starts) = (places(&svg, "title"), places(&svg, "y-tick"));
        assert!(ends.iter().all(|(_, title)| starts.iter().all(|(_, tick)| title < tick)));
        assert!(places(&svg, "y-title").iter().all(|(x, _)| *x < starts[0].0));
    }
    assert_eq!(wrapped("one two three", 10.0, 45.0), ["one two", "three"]);
    let cut = Block::fit(&long, &[17.0, 13.0], 3, 800.0);
    assert!(cut.lines.len() <= 3 && cut.size == 13.0);
}

#[test]
fn long_legends_make_the_picture_higher() {
    let lines =
        |count: usize| (0..count).map(|k| line(&format!("results/arm_{k}: tip.ux"), vec![(0.0, 0.0), (1.0, 1.0)]));
    let height = |count: usize| {
        let svg = plot(lines(count).collect(), Scale::Linear).to_svg();
        let (_, rest) = svg.split_once(" height=\"").unwrap();
        assert_eq!(texts(&svg, "legend").len(), count);
        assert!(
            places(&svg, "legend")
                .iter()
                .all(|(x, y)| *x < 860.0 && *y < rest.split_once('"').unwrap().0.parse().unwrap())
        );
        rest.split_once('"').unwrap().0.parse::<f64>().unwrap()
    };
    assert_eq!(height(3), 480.0);
    assert!(height(90) > 600.0);
}

#[test]
fn histories_that_stand_still_or_are_huge_are_drawn() {
    for points in [
        vec![],
        vec![(0.0, 0.0)],
        vec![(0.0, 3.0), (1.0, 3.0)],
        vec![(0.0, 3.0), (1.0, 3.0 + 1e-15)],
        vec![(0.0, -1e308), (1e308, 1e308)],
        vec![(0.0, 5e-324), (5e-324, 0.0)],
        vec![(1e9, 1.0), (1e9 + 1e-3, 2.0)],
        vec![(0.0, f64::NAN), (1.0, 1.0)],
    ] {
        for scale in [Scale::Linear, Scale::Logarithmic] {
            let svg = plot(vec![line("tip.ux", points.clone())], scale).to_svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}");
            let texts = texts(&svg, "y-tick");
            assert!(texts.len() > 1 || scale == Scale::Logarithmic, "{points:?}: {texts:?}");
        }
    }
}

#[test]
fn levels_boundaries_marks_and_dark_colours_are_drawn() {
    let mut plot = plot(Vec::new(), Scale::Logarithmic);
    let marked = Line {
        beside: vec![(3.0, 2e-3), (0.0, 1.0)],
        style: LineStyle::Marked(1),
        ..line("order 2", vec![(1.0, 1e-2), (10.0, 1e-4)])
    };
    plot.lines = vec![Line { style: LineStyle::Background, ..line("best of all", marked.points.clone()) }, marked];
    plot.level = Some(Level { value: 5e-5, name: "reference uncertainty".into() });
    plot.boundaries = vec![Boundary { at: 3.0, name: "stage 2".into() }];
    let svg = plot.to_svg();
    assert_eq!(texts(&svg, "legend"), ["best of all", "order 2", "reference uncertainty"]);
    assert_eq!(texts(&svg, "boundary"), ["stage 2"]);
    assert!(svg.contains("prefers-color-scheme: dark") && svg.contains("stroke-dasharray"));
    // A level far below would only squeeze the lines.
    plot.level = Some(Level { value: 1e-9, name: "reference uncertainty".into() });
    assert_eq!(texts(&plot.to_svg(), "legend").len(), 2);
}

#[test]
fn names_are_escaped() {
    let svg = plot(vec![line("a<b & \"c\"\u{7}", vec![(0.0, 0.0), (1.0, 1.0)])], Scale::Linear).to_svg();
    assert_eq!(texts(&svg, "legend"), ["a&lt;b &amp; &quot;c&quot;"]);
}

#[test]
fn peaks_of_long_histories_stay() {
    let mut points: Vec<(f64, f64)> = (0..100_000).map(|k| (k as f64, (k as f64 * 1e-3).sin())).collect();
    points[77_777].1 = 9.0;
    let kept = thinned(&points);
    assert!(kept.len() <= MAX_POINTS + 2 && kept.contains(&77_777) && kept[0] == 0 && kept.ends_with(&[99_999]));
    assert!(kept.is_sorted());
}

#[cfg(feature = "png")]
#[test]
fn png_files_hold_the_picture() {
    let png = plot(vec![line("tip.ux", vec![(0.0, 0.0), (1.0, 2.0)])], Scale::Linear).to_png().unwrap();
    // The mark stands between the header and the pixels.
    let begins = |at: usize, text: &[u8]| png[at..].starts_with(text);
    assert!(begins(37, b"tEXtSoftware\0beamsim ") && begins(12, b"IHDR"));
    let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
    assert_eq!((&png[..8], &png[12..16]), (&b"\x89PNG\r\n\x1a\n"[..], &b"IHDR"[..]));
    assert_eq!((number(16), number(20)), (1720, 960));
}
