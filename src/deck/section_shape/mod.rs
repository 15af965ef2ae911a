//! Shapes of `[section.NAME]`: their dimensions, outlines, regions, walls and skins.

pub(super) mod airfoil;
mod angle;
pub(super) mod outline;
mod shape;
mod walls;

pub use airfoil::{Airfoil, LeadingEdgeWord, SkinPart, SkinSideWord, TrailingEdgeWord, Web};
pub use angle::{Fibre, read_angle};
pub use outline::{Outline, Region};
pub use shape::{ComputedSection, ComputedShape, Flanged, MeshAim, Reference, ReferenceWord, Shape, ShearFactor};
pub use walls::{ThetaSenseWord, Wall, WallPlies, WallSideWord, Walls};

use super::reader::{Context, Item, Table, joined};
use super::words::{Words, words};
use airfoil::read_airfoil;
use angle::read_fibre;
use outline::{read_corners, read_holes, read_regions, with_fillets};
use toml::de::DeValue;
use walls::read_walls;

words! {
    /// `shape = …`
    pub enum ShapeWord {
        /// Solid circle
        Circle = "circle",
        /// Ring
        Tube = "tube",
        /// Solid rectangle
        Rectangle = "rectangle",
        /// Solid or hollow ellipse
        Ellipse = "ellipse",
        /// I section
        I = "I",
        /// Channel, web at the left
        Channel = "channel",
        /// T section, flange on top
        T = "T",
        /// Angle, heel at the lower left
        Angle = "angle",
        /// Rectangular hollow section
        Box = "box",
        /// Outline with holes
        Polygon = "polygon",
        /// Regions of several materials
        Regions = "regions",
        /// Thin walls
        Walls = "walls",
        /// Skin of an airfoil with webs
        Airfoil = "airfoil",
    }
}

/// Keys that all shapes have.
const COMMON_KEYS: [&str; 5] = ["shape", "material", "reference", "turn", "mesh"];

/// Keys of some shapes only.
#[rustfmt::skip]
const SPECIAL_KEYS: [&str; 33] = [
    "radius", "thickness", "width", "height", "shear_factor", "d", "b", "t", "t_f", "t_w", "r", "b_top", "t_f_top", "r_r", "r_t", "r_out",
    "theta", "beta", "outline", "holes", "fillet", "region", "points", "walls", "side", "theta_sense",
    "profile", "chord", "pitch_axis", "le", "skin", "webs", "te",
];

/// Keys of sections by shape.
pub(super) const KEYS: [&str; COMMON_KEYS.len() + SPECIAL_KEYS.len()] = joined(&[&COMMON_KEYS, &SPECIAL_KEYS]);

/// Keys of `mesh = {…}`.
pub(super) const MESH_KEYS: [&str; 1] = ["size"];

impl ShapeWord {
    /// Keys that a shape needs, and others that it may have.
    fn keys(self) -> [&'static [&'static str]; 2] {
        match self {
            Self::Circle => [&["material", "radius"], &["shear_factor", "theta", "beta"]],
            Self::Tube => [&["material", "radius", "thickness"], &["shear_factor", "theta", "beta"]],
            Self::Rectangle => [&["material", "width", "height"], &["shear_factor", "theta", "beta"]],
            Self::Ellipse => [&["material", "width", "height"], &["thickness", "theta", "beta"]],
            Self::I => [&["material", "d", "b", "t_f", "t_w"], &["r", "b_top", "t_f_top", "theta", "beta"]],
            Self::Channel | Self::T => [&["material", "d", "b", "t_f", "t_w"], &["r", "theta", "beta"]],
            Self::Angle => [&["material", "d", "b", "t"], &["r_r", "r_t", "theta", "beta"]],
            Self::Box => [&["material", "d", "b"], &["t", "t_f", "t_w", "r_out", "theta", "beta"]],
            Self::Polygon => [&["material", "outline"], &["holes", "fillet", "theta", "beta"]],
            Self::Regions => [&["region"], &["material"]],
            Self::Walls => [&["points", "walls"], &["material", "side", "theta_sense"]],
            Self::Airfoil => {
                [&["profile", "chord", "le", "skin"], &["material", "pitch_axis", "webs", "te", "theta_sense"]]
            }
        }
    }
}

/// Reads a section by its shape; `layups` are the names of all layups of the deck.
pub(super) fn read_shaped(table: &Table, layups: &[String]) -> Option<ComputedSection> {
    let shape = table.required("shape");
    let Some(shape) = shape else {
        table.required("material");
        return None;
    };
    let kind = table.context.word::<ShapeWord>(shape, "shape")?;
    let [needed, possible] = kind.value.keys();
    for key in SPECIAL_KEYS.into_iter().filter(|key| !needed.contains(key) && !possible.contains(key)) {
        table.refuse(key, format!("`{key}` is not allowed with shape = \"{}\"", kind.value.word()));
    }
    for key in needed {
        table.required(key);
    }
    let material = table.optional("material", |context, item| context.text(item));
    let reference = table.optional("reference", read_reference);
    let turn = table.optional("turn", read_angle);
    let mesh = table.optional("mesh", read_mesh);
    let shear_factor = table.optional("shear_factor", |_, item| read_shear_factor(table, item));
    let fibre = read_fibre(table);
    let shape = read_shape(table, kind.value, layups);
    let (material, reference, turn, mesh, shear_factor) = (material?, reference?, turn?, mesh?, shear_factor?);
    let shape = shape?;
    let turn = turn.unwrap_or(0.0);
    let fibre = fibre?;
    let span = match kind.value {
        ShapeWord::Polygon => table.key_span("outline"),
        ShapeWord::Walls => table.key_span("walls"),
        ShapeWord::Airfoil => table.key_span("profile"),
        ShapeWord::Circle
        | ShapeWord::Tube
        | ShapeWord::Rectangle
        | ShapeWord::Ellipse
        | ShapeWord::I
        | ShapeWord::Channel
        | ShapeWord::T
        | ShapeWord::Angle
        | ShapeWord::Box
        | ShapeWord::Regions => kind.span,
    };
    Some(ComputedSection { shape, span, material, fibre, reference, turn, mesh, shear_factor })
}

fn read_shear_factor(table: &Table, item: &Item) -> Option<ShearFactor> {
    let is_energy = matches!(item.get_ref(), DeValue::String(word) if word.as_ref() == "energy");
    if is_energy { Some(ShearFactor::Energy) } else { table.positive_pair("shear_factor").map(ShearFactor::Given) }
}

fn read_reference(context: &Context, item: &Item) -> Option<Reference> {
    match item.get_ref() {
        DeValue::Array(_) => context.vector(item).map(|at| Reference::Point(at.value)),
        _ => context.word(item, "reference").map(|word| Reference::Word(word.value)),
    }
}

/// An aimed error, or the size of elements.
fn read_mesh<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<MeshAim> {
    if matches!(item.get_ref(), DeValue::Table(_)) {
        let table = Table::new(context, item, "`mesh`", &MESH_KEYS)?;
        return table.required_positive("size").map(|size| MeshAim::Size(size.value));
    }
    let error = context.number(item)?;
    if error.value > 0.0 && error.value < 1.0 {
        return Some(MeshAim::Error(error.value));
    }
    let message = format!("`mesh` is the wanted relative error, above 0 and below 1, found {}", error.value);
    context.wrong(error.span, message)
}

fn read_shape(table: &Table, kind: ShapeWord, layups: &[String]) -> Option<ComputedShape> {
    let size = |key: &str| table.positive(key).map(|v| v.value);
    // `None` of the outer option where the number is wrong.
    let optional = |key: &str| table.optional(key, |_, _| size(key));
    let radius = |key: &str| table.non_negative_or(key, 0.0);
    let flanged = || {
        let [d, b, t_f, t_w] = ["d", "b", "t_f", "t_w"].map(size);
        Some(Flanged { d: d?, b: b?, t_f: t_f?, t_w: t_w?, r: radius("r")? })
    };
    let pair = |first: &str, second: &str| {
        let both = [first, second].map(size);
        both[0].zip(both[1])
    };
    let shape = match kind {
        ShapeWord::Circle => ComputedShape::Solid(Shape::Circle { radius: size("radius")? }),
        ShapeWord::Tube => {
            let (radius, thickness) = pair("radius", "thickness")?;
            if thickness > radius {
                return table.wrong_key("thickness", "the wall is thicker than the radius");
            }
            ComputedShape::Solid(Shape::Tube { radius, thickness })
        }
        ShapeWord::Rectangle => {
            let (width, height) = pair("width", "height")?;
            ComputedShape::Solid(Shape::Rectangle { width, height })
        }
        ShapeWord::Ellipse => {
            let (width, height) = pair("width", "height")?;
            let thickness = optional("thickness")?;
            if thickness.is_some_and(|thickness| 2.0 * thickness >= width.min(height)) {
                let message = "`thickness` must be less than half of `width` and of `height`: leave it out for a \
                               solid ellipse";
                return table.wrong_key("thickness", message);
            }
            ComputedShape::Ellipse { size: [width, height], thickness }
        }
        ShapeWord::I => {
            let body = flanged()?;
            let top = [optional("b_top")?.unwrap_or(body.b), optional("t_f_top")?.unwrap_or(body.t_f)];
            ComputedShape::I { body, top }
        }
        ShapeWord::Channel => ComputedShape::Channel(flanged()?),
        ShapeWord::T => ComputedShape::T(flanged()?),
        ShapeWord::Angle => {
            let [d, b, t] = ["d", "b", "t"].map(size);
            let [r_r, r_t] = ["r_r", "r_t"].map(radius);
            ComputedShape::Angle { d: d?, b: b?, t: t?, r_r: r_r?, r_t: r_t? }
        }
        ShapeWord::Box => {
            let (d, b) = pair("d", "b")?;
            let (t_f, t_w) = read_box_walls(table)?;
            ComputedShape::Box { d, b, t_f, t_w, r_out: radius("r_out")? }
        }
        ShapeWord::Polygon => {
            let outline = read_corners(table.context, table.get("outline")?);
            let holes = read_holes(table);
            ComputedShape::Polygon { outline: with_fillets(table, outline?)?, holes: holes? }
        }
        ShapeWord::Regions => ComputedShape::Regions(read_regions(table)?),
        ShapeWord::Walls => ComputedShape::Walls(read_walls(table, layups)?),
        ShapeWord::Airfoil => ComputedShape::Airfoil(read_airfoil(table)?),
    };
    Some(shape)
}

/// Thickness of flanges and of webs of a box: `t` for both, or `t_f` and `t_w`.
fn read_box_walls(table: &Table) -> Option<(f64, f64)> {
    let size = |key: &str| table.positive(key).map(|v| v.value);
    let is_apart = table.has("t_f") || table.has("t_w");
    match (table.has("t"), is_apart) {
        (true, true) => table.wrong_key("t", "give `t`, or `t_f` and `t_w`, not both"),
        (true, false) => size("t").map(|t| (t, t)),
        (false, _) if !table.has("t_f") && !table.has("t_w") => {
            table.wrong(format!("{} needs `t`, or `t_f` and `t_w`", table.what))
        }
        (false, _) => {
            let both = ["t_f", "t_w"].map(|key| table.required(key).and_then(|_| size(key)));
            both[0].zip(both[1])
        }
    }
}
