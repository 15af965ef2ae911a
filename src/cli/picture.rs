//! Arguments of `beamsim plot`, and the formats of its pictures.

use super::error::CommandError;
use crate::output::{LinePlot, OutputKind};
use std::path::{Path, PathBuf};

/// Arguments of `beamsim plot`.
#[derive(clap::Args)]
pub struct PlotArguments {
    /// Folders of results, or histories (CSV); several are drawn on the same axes. Or a profile.csv:
    /// resultants and stresses along beams
    #[arg(required = true, value_name = "RESULTS")]
    pub(crate) results: Vec<PathBuf>,
    /// A column, such as tip.ux; may be repeated (default: the first six displacements that change;
    /// without displacements, the first six columns)
    #[arg(long = "column", value_name = "COLUMN")]
    pub columns: Vec<String>,
    /// Of a profile, a beam; may be repeated (default: all beams)
    #[arg(long = "beam", value_name = "BEAM")]
    pub beams: Vec<String>,
    /// Of a profile, the stage at whose end it is drawn (default: the last one)
    #[arg(long, value_name = "STAGE")]
    pub stage: Option<usize>,
    /// The column of the horizontal axis (default: time; if no stage is dynamic, the load factor,
    /// one stage after another)
    #[arg(long, value_name = "COLUMN")]
    pub x: Option<String>,
    /// A stored history (CSV) to compare with
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// The picture, .svg or (in builds with `--features png`) .png (default: plot.svg in the first
    /// folder)
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Formats of plots.
#[derive(Clone, Copy)]
pub enum Format {
    /// Vectors
    Svg,
    /// Pixels
    Png,
}

impl Format {
    /// The format that the name of a file asks for.
    pub fn of(path: &Path) -> Result<Self, CommandError> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            None | Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            Some(other) => {
                let message = format!("unknown file type `.{other}`: plots are written as .svg or .png");
                Err(CommandError::Usage(message))
            }
        }
    }

    /// The kind of its files.
    pub fn kind(self) -> OutputKind {
        match self {
            Self::Svg => OutputKind::Svg,
            Self::Png => OutputKind::Png,
        }
    }

    /// A plot in this format.
    pub fn draw(self, plot: &LinePlot) -> Result<Vec<u8>, CommandError> {
        match self {
            Self::Svg => Ok(plot.to_svg().into_bytes()),
            Self::Png => png(plot),
        }
    }
}

#[cfg(feature = "png")]
fn png(plot: &LinePlot) -> Result<Vec<u8>, CommandError> {
    plot.to_png().map_err(|why| CommandError::Usage(format!("the plot cannot be drawn: {why}")))
}

#[cfg(not(feature = "png"))]
fn png(_plot: &LinePlot) -> Result<Vec<u8>, CommandError> {
    let message =
        "this build writes .svg only; for .png, install it by `cargo install --path . --locked --features png`";
    Err(CommandError::Usage(message.into()))
}
