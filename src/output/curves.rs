//! Histories as curves in one picture: several runs, stored references, error bars as bands.

use super::plot::COLOURS;
use kuva::prelude::*;

/// Points of a line; more are seen by nobody.
const MOST_POINTS: usize = 2000;

/// A picture of histories.
pub struct Curves {
    /// Above it
    pub title: String,
    /// Below the horizontal axis
    pub x: String,
    /// Beside the vertical axis
    pub y: String,
    /// The lines
    pub curves: Vec<Curve>,
}

/// A column of a history.
pub struct Curve {
    /// In the legend
    pub name: String,
    /// Its points, in order
    pub points: Vec<(f64, f64)>,
    /// How uncertain they are, where that is known
    pub bars: Option<Vec<f64>>,
    /// Lines of one colour belong together: columns of one name
    pub colour: usize,
    /// Lines of one dash belong together: runs; 0 is drawn whole
    pub dash: usize,
}

impl Curves {
    /// The text of an SVG file.
    pub fn to_svg(&self) -> String {
        let (plots, layout) = self.drawn();
        render_to_svg(plots, layout)
    }

    /// The bytes of a PNG file, 1720 x 960; an error is what the drawing library says.
    #[cfg(feature = "png")]
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        let (plots, layout) = self.drawn();
        render_to_png(plots, layout, 2.0)
    }

    fn drawn(&self) -> (Vec<Plot>, Layout) {
        let plots: Vec<Plot> = self.curves.iter().map(Curve::plot).collect();
        let layout = Layout::auto_from_plots(&plots)
            .with_title(self.title.as_str())
            .with_x_label(self.x.as_str())
            .with_y_label(self.y.as_str())
            .with_width(860.0)
            .with_height(480.0);
        (plots, layout)
    }
}

impl Curve {
    fn plot(&self) -> Plot {
        let kept = thinned(&self.points);
        let colour = COLOURS[self.colour % COLOURS.len()];
        let points: Vec<(f64, f64)> = kept.iter().map(|&k| self.points[k]).collect();
        let mut line =
            LinePlot::new().with_data(points).with_color(colour).with_stroke_width(1.6).with_legend(self.name.as_str());
        if let Some(bars) = &self.bars {
            let edge = |side: f64| kept.iter().map(|&k| self.points[k].1 + side * bars[k]).collect::<Vec<f64>>();
            line = line.with_band(edge(-1.0), edge(1.0));
        }
        match self.dash % 4 {
            0 => line,
            1 => line.with_dashed(),
            2 => line.with_dotted(),
            _ => line.with_dashdot(),
        }
        .into()
    }
}

/// Numbers of points that tell what all do: of each stretch the lowest and the highest, and the ends.
fn thinned(points: &[(f64, f64)]) -> Vec<usize> {
    if points.len() <= MOST_POINTS {
        return (0..points.len()).collect();
    }
    let stretch = points.len().div_ceil(MOST_POINTS / 2);
    let mut kept = vec![0];
    for first in (0..points.len()).step_by(stretch) {
        let all = first..points.len().min(first + stretch);
        let by = |a: &usize, b: &usize| points[*a].1.total_cmp(&points[*b].1);
        kept.extend(all.clone().min_by(by).into_iter().chain(all.max_by(by)));
    }
    kept.push(points.len() - 1);
    kept.sort_unstable();
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "png")]
    #[test]
    fn png_files_hold_the_picture() {
        let points = vec![(0.0, 0.0), (1.0, 2.0)];
        let curve = Curve { name: "tip.ux".into(), points, bars: None, colour: 0, dash: 0 };
        let curves = Curves { title: "A tip".into(), x: "time".into(), y: "tip.ux".into(), curves: vec![curve] };
        let png = curves.to_png().unwrap();
        let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
        assert_eq!((&png[..8], &png[12..16]), (&b"\x89PNG\r\n\x1a\n"[..], &b"IHDR"[..]));
        assert_eq!((number(16), number(20)), (1720, 960));
    }

    #[test]
    fn peaks_of_long_histories_stay() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|k| (k as f64, (k as f64 * 1e-3).sin())).collect();
        points[77_777].1 = 9.0;
        let kept = thinned(&points);
        assert!(kept.len() <= MOST_POINTS + 2 && kept.contains(&77_777) && kept[0] == 0 && kept.ends_with(&[99_999]));
        assert!(kept.is_sorted());
    }
}
