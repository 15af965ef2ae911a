//! Plots in pixels.

use super::super::ownership::marked_png;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use std::sync::Arc;

/// Pixels of the PNG per pixel of the SVG.
const PIXELS: f32 = 2.0;

/// The bytes of a PNG file. The font is in the binary, so that the picture is the same on every
/// machine.
pub fn draw(svg: &str) -> Result<Vec<u8>, String> {
    let mut options = Options { font_family: "Noto Sans".into(), ..Options::default() };
    Arc::make_mut(&mut options.fontdb).load_font_data(notosans::REGULAR_TTF.to_vec());
    let tree = Tree::from_str(svg, &options).map_err(|error| error.to_string())?;
    let size = tree.size().to_int_size().scale_by(PIXELS).ok_or("it has no size")?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or("it is too large")?;
    resvg::render(&tree, Transform::from_scale(PIXELS, PIXELS), &mut pixels.as_mut());
    pixels.encode_png().map(marked_png).map_err(|error| error.to_string())
}
