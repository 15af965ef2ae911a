//! Shapes of `[section.NAME]`: their dimensions, outlines, regions, walls and skins.

use super::diagnostic::{Diagnostic, Span, Spanned};
use super::reader::{Context, Item, Table, joined, kind_of};
use super::words::{Words, words};
use std::f64::consts::TAU;
use toml::de::DeValue;

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

words! {
    /// `reference = …`
    pub enum ReferenceWord {
        /// Centre of the area
        Centroid = "centroid",
        /// The point at which a shear force makes no twist
        ShearCentre = "shear_centre",
        /// The point at which an axial force makes no curvature
        TensionCentre = "tension_centre",
        /// Centre of mass
        MassCentre = "mass_centre",
    }
}

words! {
    /// `side = …`
    pub enum WallSideWord {
        /// The wall lies to the left of its line, looking along it
        Left = "left",
        /// The line is the middle of the wall
        Middle = "middle",
        /// The wall lies to the right of its line
        Right = "right",
    }
}

words! {
    /// `theta_sense = …`
    pub enum ThetaSenseWord {
        /// Angles of fibres turn towards the direction of the wall
        Wall = "wall",
        /// Angles of fibres turn towards +2
        Fixed = "fixed",
    }
}

words! {
    /// `le = …`
    pub enum LeadingEdgeWord {
        /// The leading edge points to +2
        Plus = "+2",
        /// The leading edge points to -2
        Minus = "-2",
    }
}

words! {
    /// `side = …` of a part of a skin
    pub enum SkinSideWord {
        /// The first half of the profile
        Upper = "upper",
        /// The second half of the profile
        Lower = "lower",
        /// Both halves
        Both = "both",
    }
}

words! {
    /// `te = …`
    pub enum TrailingEdgeWord {
        /// The skins end where their inner faces meet, joined by a wall
        Close = "close",
        /// The room between the skins behind that is filled
        Fill = "fill",
    }
}

/// `shear_factor = …`
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShearFactor {
    /// Along 2 and 3
    Given([f64; 2]),
    /// That of the energy of Saint-Venant flexure
    Energy,
}

/// A cross-section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Solid circle
    Circle {
        /// Radius
        radius: f64,
    },
    /// Ring
    Tube {
        /// Outer radius
        radius: f64,
        /// Wall
        thickness: f64,
    },
    /// Solid rectangle
    Rectangle {
        /// Along axis 2
        width: f64,
        /// Along axis 3
        height: f64,
    },
}

/// A section whose matrices are computed from its shape.
#[derive(Clone, Debug)]
pub struct ComputedSection {
    /// Shape
    pub(crate) shape: ComputedShape,
    /// Place of the shape
    pub(crate) span: Span,
    /// Name of the material of the whole, or of what names none itself
    pub(crate) material: Option<Spanned<String>>,
    /// Orientation of the material of the whole
    pub(crate) fibre: Fibre,
    /// The point of the shape through which the line of the beam goes
    pub(crate) reference: Option<Reference>,
    /// Turn of the shape about the line of the beam, from axis 2 towards axis 3, rad
    pub(crate) turn: f64,
    /// Aim of the mesh, where given
    pub(crate) mesh: Option<MeshAim>,
    /// Shear factors along 2 and 3 of closed forms
    pub(crate) shear_factor: Option<ShearFactor>,
}

/// `theta` and `beta`
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fibre {
    /// Angle of the fibre from axis 1 towards the tangent, rad
    pub(crate) theta: f64,
    /// Angle of the tangent from axis 2 towards axis 3, rad
    pub(crate) beta: f64,
}

/// `reference = …`
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reference {
    /// A centre
    Word(ReferenceWord),
    /// A point of the shape
    Point([f64; 2]),
}

/// `mesh = …`
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeshAim {
    /// Relative error of the stiffness
    Error(f64),
    /// Largest size of an element
    Size(f64),
}

/// Dimensions of a channel or T: depth `d` along 3, width `b` along 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flanged {
    /// Depth
    pub(crate) d: f64,
    /// Width
    pub(crate) b: f64,
    /// Thickness of the flanges
    pub(crate) t_f: f64,
    /// Thickness of the web
    pub(crate) t_w: f64,
    /// Root radius
    pub(crate) r: f64,
}

/// A shape of `[section.NAME]`.
#[derive(Clone, Debug)]
pub enum ComputedShape {
    /// Circle, tube or rectangle
    Solid(Shape),
    /// Ellipse
    Ellipse {
        /// Full width and height
        size: [f64; 2],
        /// Thickness of a hollow one
        thickness: Option<f64>,
    },
    /// I section
    I {
        /// Web and bottom flange
        body: Flanged,
        /// Width and thickness of the top flange
        top: [f64; 2],
    },
    /// Channel
    Channel(Flanged),
    /// T section
    T(Flanged),
    /// Angle
    Angle {
        /// Depth
        d: f64,
        /// Width
        b: f64,
        /// Thickness of the legs
        t: f64,
        /// Root radius
        r_r: f64,
        /// Toe radius
        r_t: f64,
    },
    /// Rectangular hollow section
    Box {
        /// Depth
        d: f64,
        /// Width
        b: f64,
        /// Thickness of the flanges
        t_f: f64,
        /// Thickness of the webs
        t_w: f64,
        /// Outer radius
        r_out: f64,
    },
    /// Outline with holes
    Polygon {
        /// Outer boundary
        outline: Outline,
        /// Holes
        holes: Vec<Outline>,
    },
    /// Regions
    Regions(Vec<Region>),
    /// Thin walls
    Walls(Walls),
    /// Airfoil
    Airfoil(Airfoil),
}

impl ComputedSection {
    /// A plain circle, tube or rectangle.
    pub fn of_shape(shape: Shape, material: Spanned<String>, shear_factor: Option<ShearFactor>) -> Self {
        let span = material.span.clone();
        Self {
            shape: ComputedShape::Solid(shape),
            span,
            material: Some(material),
            fibre: Fibre::default(),
            reference: None,
            turn: 0.0,
            mesh: None,
            shear_factor,
        }
    }
}

impl ComputedShape {
    /// True if the shape is given in coordinates of the user, whose origin means something.
    pub fn has_own_origin(&self) -> bool {
        match self {
            Self::Polygon { .. } | Self::Regions(_) | Self::Airfoil(_) => true,
            Self::Solid(_)
            | Self::Ellipse { .. }
            | Self::I { .. }
            | Self::Channel(_)
            | Self::T(_)
            | Self::Angle { .. }
            | Self::Box { .. }
            | Self::Walls(_) => false,
        }
    }
}

/// A closed line.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// Corners, and the radius of each
    Corners(Vec<([f64; 2], f64)>),
    /// A circle
    Circle {
        /// Centre
        centre: [f64; 2],
        /// Radius
        radius: f64,
    },
}

/// `[[section.NAME.region]]`
#[derive(Clone, Debug)]
pub struct Region {
    /// Name of the material, if not that of the section
    pub material: Option<Spanned<String>>,
    /// Outer boundary
    pub(crate) outline: Outline,
    /// Holes
    pub(crate) holes: Vec<Outline>,
    /// Orientation of the material
    pub(crate) fibre: Fibre,
    /// Place of the table
    pub(crate) span: Span,
}

/// Walls between points.
#[derive(Clone, Debug)]
pub struct Walls {
    /// Names and places of points
    pub(crate) points: Vec<(Spanned<String>, [f64; 2])>,
    /// Walls
    pub(crate) walls: Vec<Wall>,
    /// Sense of angles of fibres
    pub(crate) theta_sense: ThetaSenseWord,
}

/// A wall.
#[derive(Clone, Debug)]
pub struct Wall {
    /// Names of its points
    pub(crate) ends: [Spanned<String>; 2],
    /// Its plies
    pub(crate) plies: WallPlies,
    /// Side of the line on which it lies
    pub(crate) side: WallSideWord,
    /// A point between the ends, of a round wall
    pub(crate) arc: Option<[f64; 2]>,
    /// Its place in the text
    pub(crate) span: Span,
}

/// The build of a wall.
#[derive(Clone, Debug)]
pub enum WallPlies {
    /// Thickness, of the material of the section
    Thickness(f64),
    /// Name of a layup
    Layup(Spanned<String>),
}

/// The skin of an airfoil with webs.
#[derive(Clone, Debug)]
pub struct Airfoil {
    /// Points in parts of the chord, from the trailing edge over the upper side back
    pub(crate) profile: Spanned<Vec<[f64; 2]>>,
    /// Length of the chord
    pub(crate) chord: f64,
    /// Part of the chord, from the leading edge, at which the origin lies
    pub(crate) pitch_axis: f64,
    /// Direction of the leading edge
    pub(crate) leading_edge: LeadingEdgeWord,
    /// Parts of the skin
    pub(crate) skin: Vec<SkinPart>,
    /// Webs
    pub(crate) webs: Vec<Web>,
    /// Trailing edge
    pub(crate) trailing_edge: TrailingEdgeWord,
    /// Sense of angles of fibres
    pub(crate) theta_sense: ThetaSenseWord,
}

/// A part of the skin between two parts of the chord.
#[derive(Clone, Debug)]
pub struct SkinPart {
    /// Its ends, as parts of the chord from the leading edge
    pub(crate) ends: [f64; 2],
    /// Name of its layup
    pub(crate) layup: Spanned<String>,
    /// Side of the profile
    pub(crate) side: SkinSideWord,
}

/// A web between both sides of the skin.
#[derive(Clone, Debug)]
pub struct Web {
    /// Part of the chord
    pub(crate) at: f64,
    /// Name of its layup
    pub(crate) layup: Spanned<String>,
    /// Its place in the text
    pub(crate) span: Span,
}

/// Relative round-off of a full turn that was computed
const ROUND_OFF: f64 = 1e-9;

/// Most points of an outline, walls or regions of a section.
const MOST_PARTS: usize = 2000;

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

/// Keys of `[[section.NAME.region]]`.
pub(super) const REGION_KEYS: [&str; 7] = ["material", "outline", "circle", "rect", "holes", "theta", "beta"];

/// Keys of `mesh = {…}`.
pub(super) const MESH_KEYS: [&str; 1] = ["size"];

/// Keys of a circle.
pub(super) const CIRCLE_KEYS: [&str; 2] = ["centre", "radius"];

/// Keys of a hole that is not a list of points.
const HOLE_KEYS: [&str; 2] = ["circle", "rect"];

/// Keys of a wall that is a table.
const WALL_KEYS: [&str; 6] = ["from", "to", "thickness", "layup", "side", "arc"];

/// Keys of a part of a skin.
pub(super) const SKIN_KEYS: [&str; 4] = ["from", "to", "layup", "side"];

/// Keys of a web.
pub(super) const WEB_KEYS: [&str; 3] = ["at", "layup", "normal"];

words! {
    /// `normal = …` of a web
    pub enum WebNormalWord {
        /// The web stands normal to the chord
        Chord = "chord",
    }
}

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

fn read_fibre(table: &Table) -> Option<Fibre> {
    let theta = table.optional("theta", read_angle);
    let beta = table.optional("beta", read_angle);
    Some(Fibre { theta: theta?.unwrap_or(0.0), beta: beta?.unwrap_or(0.0) })
}

/// An angle in rad, of at most a full turn: more is usually meant in degrees.
pub(super) fn read_angle(context: &Context, item: &Item) -> Option<f64> {
    let angle = context.number(item)?;
    if angle.value.abs() <= TAU * (1.0 + ROUND_OFF) {
        return Some(angle.value);
    }
    let message = format!("an angle of {} rad is more than a full turn", angle.value);
    let help = format!("angles are in rad: write \"{}*deg\"", angle.value);
    context.report(Diagnostic::error(message, angle.span).help(help));
    None
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

/// A list of at least three points.
fn read_corners(context: &Context, item: &Item) -> Option<Outline> {
    let points = read_points(context, item, "an outline")?;
    Some(Outline::Corners(points.into_iter().map(|at| (at, 0.0)).collect()))
}

/// A list of at least three points.
fn read_points(context: &Context, item: &Item, what: &str) -> Option<Vec<[f64; 2]>> {
    let DeValue::Array(points) = item.get_ref() else {
        let message = format!("{what} is a list of points [x2, x3], found {}", kind_of(item.get_ref()));
        return context.wrong(item.span(), message);
    };
    if points.len() < 3 {
        return context.wrong(item.span(), format!("{what} needs three or more points, found {}", points.len()));
    }
    check_count(context, item, points.len())?;
    let points: Vec<Option<[f64; 2]>> = points.iter().map(|at| context.vector(at).map(|at| at.value)).collect();
    points.into_iter().collect()
}

/// Refuses lists that are too long.
fn check_count(context: &Context, item: &Item, count: usize) -> Option<()> {
    if count <= MOST_PARTS {
        return Some(());
    }
    let message = format!("{count} entries are more than the limit of {MOST_PARTS} for a section");
    context.report(Diagnostic::limit(message, item.span()));
    None
}

/// Gives corners the radii of `fillet`: one for all, or one for each.
fn with_fillets(table: &Table, outline: Outline) -> Option<Outline> {
    let (Some(item), Outline::Corners(mut corners)) = (table.get("fillet"), outline.clone()) else {
        return Some(outline);
    };
    let radii = match item.get_ref() {
        DeValue::Array(_) => table.context.numbers(item, Some(corners.len()))?.value,
        _ => vec![table.context.number(item)?.value; corners.len()],
    };
    if let Some(radius) = radii.iter().find(|&&radius| radius < 0.0) {
        return table.wrong_key("fillet", format!("`fillet` must not be negative, found {radius}"));
    }
    corners.iter_mut().zip(radii).for_each(|(corner, radius)| corner.1 = radius);
    Some(Outline::Corners(corners))
}

/// `holes`: a list of lists of points, of circles and of rectangles.
fn read_holes<'a>(table: &Table<'a>) -> Option<Vec<Outline>> {
    let Some(item) = table.get("holes") else { return Some(Vec::new()) };
    let DeValue::Array(holes) = item.get_ref() else {
        return table.wrong_key("holes", "`holes` is a list of outlines: [[[x2, x3], …], { circle = r }]");
    };
    let holes: Vec<Option<Outline>> = holes.iter().map(|hole| read_hole(table.context, hole)).collect();
    holes.into_iter().collect()
}

fn read_hole<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Outline> {
    if !matches!(item.get_ref(), DeValue::Table(_)) {
        return read_corners(context, item);
    }
    let table = Table::new(context, item, "a hole", &HOLE_KEYS)?;
    match (table.get("circle"), table.get("rect")) {
        (Some(circle), None) => read_circle(context, circle),
        (None, Some(rect)) => read_rect(context, rect),
        (Some(_), Some(_)) | (None, None) => table.wrong("a hole is a list of points, a `circle` or a `rect`"),
    }
}

/// A radius about the origin, [x2, x3, radius], or a table of centre and radius.
fn read_circle<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Outline> {
    let is_table = matches!(item.get_ref(), DeValue::Table(_));
    let (centre, radius) = if is_table {
        let table = Table::new(context, item, "`circle`", &CIRCLE_KEYS)?;
        (table.vector_or("centre", [0.0; 2])?, table.required_positive("radius")?)
    } else if matches!(item.get_ref(), DeValue::Array(_)) {
        let Spanned { value: [x2, x3, radius], span } = context.vector::<3>(item)?;
        ([x2, x3], Spanned { value: radius, span })
    } else {
        ([0.0; 2], context.number(item)?)
    };
    if radius.value <= 0.0 {
        return context.wrong(radius.span, format!("the radius must be positive, found {}", radius.value));
    }
    Some(Outline::Circle { centre, radius: radius.value })
}

/// From and to along 2, from and to along 3.
fn read_rect(context: &Context, item: &Item) -> Option<Outline> {
    let Spanned { value: [left, right, bottom, top], span } = context.vector::<4>(item)?;
    if left >= right || bottom >= top {
        return context.wrong(span, "`rect` is [x2 from, x2 to, x3 from, x3 to], each pair increasing");
    }
    let corners = [[left, bottom], [right, bottom], [right, top], [left, top]];
    Some(Outline::Corners(corners.map(|at| (at, 0.0)).to_vec()))
}

fn read_regions(table: &Table) -> Option<Vec<Region>> {
    let item = table.get("region")?;
    check_count(table.context, item, table.list("region").len())?;
    let regions: Vec<Option<Region>> = table.list("region").into_iter().map(|item| read_region(table, item)).collect();
    if regions.is_empty() && table.has("region") {
        return table.wrong_key("region", "a section of regions needs at least one [[section.NAME.region]]");
    }
    regions.into_iter().collect()
}

fn read_region<'a>(section: &Table<'a>, item: &'a Item<'a>) -> Option<Region> {
    let table = Table::new(section.context, item, "a region", &REGION_KEYS)?;
    let material = table.optional("material", |context, item| context.text(item));
    if !table.has("material") && !section.has("material") {
        table.required("material");
    }
    let outline = match (table.get("outline"), table.get("circle"), table.get("rect")) {
        (Some(item), None, None) => read_corners(table.context, item),
        (None, Some(item), None) => read_circle(table.context, item),
        (None, None, Some(item)) => read_rect(table.context, item),
        _ => table.wrong("a region needs one of `outline`, `circle`, `rect`"),
    };
    let holes = read_holes(&table);
    let fibre = read_fibre(&table);
    Some(Region { material: material?, outline: outline?, holes: holes?, fibre: fibre?, span: item.span() })
}

fn read_walls(table: &Table, layups: &[String]) -> Option<Walls> {
    let points = Table::of_names(table.context, table.get("points")?, "`points`")?;
    let points: Vec<_> = points.entries().map(|(name, item)| Some((name, table.context.vector(item)?.value))).collect();
    let points: Vec<_> = points.into_iter().collect::<Option<_>>()?;
    let item = table.get("walls")?;
    let DeValue::Array(walls) = item.get_ref() else {
        return table.wrong_key("walls", "`walls` is a list of [from, to, thickness or layup]");
    };
    check_count(table.context, item, walls.len())?;
    let side = table.word_or("side", WallSideWord::Middle)?;
    let walls: Vec<Option<Wall>> = walls.iter().map(|wall| read_wall(table, wall, &points, side, layups)).collect();
    let walls: Vec<Wall> = walls.into_iter().collect::<Option<_>>()?;
    let theta_sense = table.word_or("theta_sense", ThetaSenseWord::Wall)?;
    if walls.iter().any(|wall| matches!(wall.plies, WallPlies::Thickness(_))) {
        table.required("material")?;
    }
    Some(Walls { points, walls, theta_sense })
}

/// `["a", "b", 0.002]`, or a table.
fn read_wall<'a>(
    section: &Table<'a>,
    item: &'a Item<'a>,
    points: &[(Spanned<String>, [f64; 2])],
    side: WallSideWord,
    layups: &[String],
) -> Option<Wall> {
    let context = section.context;
    let span = item.span();
    if let DeValue::Array(parts) = item.get_ref() {
        let parts: Vec<_> = parts.iter().collect();
        let [from, to, plies] = parts[..] else {
            return context.wrong(span, "a wall is [from, to, thickness or layup]: [\"a\", \"b\", 0.002]");
        };
        let ends = [context.text(from), context.text(to)];
        let plies = read_plies(context, plies, layups);
        let [from, to] = ends;
        return Some(Wall { ends: [from?, to?], plies: plies?, side, arc: None, span });
    }
    let table = Table::new(context, item, "a wall", &WALL_KEYS)?;
    let from = table.required_text("from");
    let to = table.required_text("to");
    let plies = match (table.get("thickness"), table.get("layup")) {
        (Some(_), None) => table.positive("thickness").map(|thickness| WallPlies::Thickness(thickness.value)),
        (None, Some(_)) => table.text("layup").map(WallPlies::Layup),
        (Some(_), Some(_)) => table.wrong_key("layup", "a wall has `thickness` or `layup`, not both"),
        (None, None) => table.wrong("a wall needs `thickness` or `layup`"),
    };
    let side = table.word_or("side", side)?;
    let arc = table.optional("arc", |context, item| read_between(context, item, points));
    Some(Wall { ends: [from?, to?], plies: plies?, side, arc: arc?, span })
}

/// A point of a round wall: its name or its place.
fn read_between(context: &Context, item: &Item, points: &[(Spanned<String>, [f64; 2])]) -> Option<[f64; 2]> {
    if !matches!(item.get_ref(), DeValue::String(_)) {
        return context.vector(item).map(|at| at.value);
    }
    let name = context.text(item)?;
    match points.iter().find(|(known, _)| known.value == name.value) {
        Some((_, at)) => Some(*at),
        None => context.wrong(name.span, format!("the section has no point `{}`", name.value)),
    }
}

/// A thickness, or the name of a layup. A text that names no layup is an expression if it can be
/// one.
fn read_plies(context: &Context, item: &Item, layups: &[String]) -> Option<WallPlies> {
    if let DeValue::String(text) = item.get_ref() {
        let is_name = text.chars().all(|c| c.is_alphanumeric() || c == '_' || c == ' ' || c == '-');
        let is_known = layups.iter().any(|name| name == text.as_ref());
        let is_parameter = context.parameters.names().any(|name| name == text.as_ref());
        if is_known || is_name && !is_parameter {
            return context.text(item).map(WallPlies::Layup);
        }
    }
    let thickness = context.number(item)?;
    if thickness.value > 0.0 {
        return Some(WallPlies::Thickness(thickness.value));
    }
    context.wrong(thickness.span, format!("a wall must have a positive thickness, found {}", thickness.value))
}

fn read_airfoil(table: &Table) -> Option<Airfoil> {
    let context = table.context;
    let profile = table.get("profile").and_then(|item| {
        let points = read_points(context, item, "`profile`")?;
        Some(Spanned { value: points, span: item.span() })
    });
    let chord = table.positive("chord");
    let pitch_axis = table.optional("pitch_axis", |context, item| context.number(item));
    let leading_edge = table.word::<LeadingEdgeWord>("le");
    let skin = read_list(table, "skin", read_skin_part);
    let webs = if table.has("webs") { read_list(table, "webs", read_web) } else { Some(Vec::new()) };
    let trailing_edge = table.word_or("te", TrailingEdgeWord::Close);
    let theta_sense = table.word_or("theta_sense", ThetaSenseWord::Wall);
    Some(Airfoil {
        profile: profile?,
        chord: chord?.value,
        pitch_axis: pitch_axis?.map_or(0.0, |at| at.value),
        leading_edge: leading_edge?.value,
        skin: skin?,
        webs: webs?,
        trailing_edge: trailing_edge?,
        theta_sense: theta_sense?,
    })
}

fn read_list<'a, T>(
    table: &Table<'a>,
    key: &str,
    read: impl Fn(&'a Context, &'a Item<'a>) -> Option<T>,
) -> Option<Vec<T>> {
    let all: Vec<Option<T>> = table.list(key).into_iter().map(|item| read(table.context, item)).collect();
    all.into_iter().collect()
}

fn read_skin_part<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<SkinPart> {
    let table = Table::new(context, item, "a part of the skin", &SKIN_KEYS)?;
    let from = table.optional("from", |context, item| context.number(item))?.map_or(0.0, |from| from.value);
    let to = table.optional("to", |context, item| context.number(item))?.map_or(1.0, |to| to.value);
    let layup = table.required_text("layup");
    let side = table.word_or("side", SkinSideWord::Both)?;
    if !(0.0..=1.0).contains(&from) || !(0.0..=1.0).contains(&to) || from >= to {
        return table.wrong("`from` and `to` are parts of the chord from 0 to 1, `from` below `to`");
    }
    Some(SkinPart { ends: [from, to], layup: layup?, side })
}

fn read_web<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Web> {
    let table = Table::new(context, item, "a web", &WEB_KEYS)?;
    let at = table.required_number("at")?;
    let layup = table.required_text("layup");
    table.word_or("normal", WebNormalWord::Chord)?;
    if at.value <= 0.0 || at.value >= 1.0 {
        return context.wrong(at.span, format!("a web is at a part of the chord between 0 and 1, found {}", at.value));
    }
    Some(Web { at: at.value, layup: layup?, span: item.span() })
}
