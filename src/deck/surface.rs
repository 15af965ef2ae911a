//! `[[surface]]`: rigid surfaces that beams and bodies touch.

use super::axes::{Axes, read_axes, read_direction};
use super::diagnostic::{Span, Spanned};
use super::history::{HistoryUse, read_history_use};
use super::point::{PointRef, check_name, read_point, read_point_list};
use super::reader::{Context, Item, Table};
use super::stage::read_stages;
use super::words::{Words, words};
use toml::de::DeValue;

/// `[[surface]]`
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name
    pub(crate) name: Spanned<String>,
    /// Its shape
    pub(crate) body: SurfaceBody,
    /// The side on which beams are
    pub side: SideWord,
    /// The node that carries it; left out: the ground
    pub(crate) on: Option<Spanned<String>>,
    /// A motion of its own
    pub(crate) motion: Option<SurfaceMotion>,
    /// Factor of its motion over time or load factor
    pub(crate) history: Option<HistoryUse>,
    /// Stages of its motion, from 1; left out: all
    pub(crate) stages: Option<Vec<usize>>,
    /// Place of the table
    pub(crate) span: Span,
}

/// A point of a surface by its name or its coordinates.
pub type SurfacePoint = Spanned<PointRef>;

/// The centre line of a tube.
#[derive(Clone, Debug)]
pub enum TubeLine {
    /// Points
    Through(Vec<SurfacePoint>),
    /// Start, a point between, end of a circular arc
    Arc([SurfacePoint; 3]),
}

/// Shapes of surfaces.
#[derive(Clone, Debug)]
pub enum SurfaceBody {
    /// A plane
    Plane {
        /// A point of it
        point: SurfacePoint,
        /// The normal into free space
        normal: [f64; 3],
    },
    /// A sphere
    Sphere {
        /// Its centre
        at: SurfacePoint,
        /// Its radius
        radius: f64,
    },
    /// A cylinder without ends
    Cylinder {
        /// Two points of its axis
        axis: [SurfacePoint; 2],
        /// Its radius
        radius: f64,
    },
    /// A cone with spherical ends; a capsule if the radii are equal
    Cone {
        /// The centres of its ends
        axis: [SurfacePoint; 2],
        /// The radii of its ends
        radii: [f64; 2],
    },
    /// A torus
    Torus {
        /// Its centre
        at: SurfacePoint,
        /// Its axis
        axis: [f64; 3],
        /// The radius of its centre line
        ring: f64,
        /// The radius of its section
        radius: f64,
    },
    /// A box
    Box {
        /// Its centre
        at: SurfacePoint,
        /// Half of its edges
        half: [f64; 3],
        /// The directions of its edges; left out: the global axes
        axes: Option<Axes>,
    },
    /// A tube
    Tube {
        /// Its centre line
        line: TubeLine,
        /// True for a spline through the points, false for straight pieces
        smooth: bool,
        /// One radius, or one for each point
        radii: Spanned<Vec<f64>>,
    },
    /// A triangle mesh
    Mesh {
        /// The file of its triangles
        file: Spanned<String>,
        /// Length of the deck over length of the file
        scale: f64,
        /// The place of the origin of the file; left out: the origin
        at: Option<SurfacePoint>,
        /// The directions of the axes of the file; left out: the global axes
        axes: Option<Axes>,
    },
}

/// A prescribed motion of a surface.
#[derive(Clone, Debug)]
pub enum SurfaceMotion {
    /// A displacement
    Shift([f64; 3]),
    /// A rotation
    Turn {
        /// The axis, of any length
        axis: [f64; 3],
        /// A point of the axis
        about: SurfacePoint,
        /// Radians
        angle: f64,
    },
}

words! {
    /// `kind = …` of a surface
    pub enum SurfaceWord {
        /// Plane
        Plane = "plane",
        /// Sphere
        Sphere = "sphere",
        /// Cylinder without ends
        Cylinder = "cylinder",
        /// Cylinder with spherical ends
        Capsule = "capsule",
        /// Cone with spherical ends
        Cone = "cone",
        /// Torus
        Torus = "torus",
        /// Box
        Box = "box",
        /// Tube along a curve
        Tube = "tube",
        /// Triangle mesh from a file
        Mesh = "mesh",
    }
}

words! {
    /// `side = …`
    pub enum SideWord {
        /// Beams are outside of the body
        Outside = "outside",
        /// Beams are inside, as a wire in a tube
        Inside = "inside",
    }
}

impl SurfaceWord {
    /// Keys of the shape, which others refuse.
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Plane => &["point", "normal"],
            Self::Sphere => &["at", "radius", "side"],
            Self::Cylinder | Self::Capsule | Self::Cone => &["from", "to", "radius", "side"],
            Self::Torus => &["at", "axis", "ring", "radius", "side"],
            Self::Box => &["at", "half", "axes", "side"],
            Self::Tube => &["through", "arc", "smooth", "radius", "side"],
            Self::Mesh => &["file", "scale", "at", "axes", "side"],
        }
    }
}

/// Keys that belong to some shapes only.
const SHAPE_KEYS: [&str; 16] = [
    "point", "normal", "at", "radius", "from", "to", "axis", "ring", "half", "axes", "through", "arc", "smooth",
    "file", "scale", "side",
];

/// Keys of `[[surface]]`.
pub(super) const KEYS: [&str; 25] = [
    "name", "kind", "point", "normal", "at", "radius", "from", "to", "axis", "ring", "half", "axes", "through", "arc",
    "smooth", "file", "scale", "side", "on", "move", "rotate", "about", "angle", "history", "stages",
];

pub(super) fn read_surface<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Surface> {
    let table = Table::new(context, item, "[[surface]]", &KEYS)?;
    let name = table.required_text("name").and_then(|name| check_name(context, name));
    let kind = table.required("kind").and_then(|item| context.word::<SurfaceWord>(item, "kind"))?.value;
    for key in SHAPE_KEYS.into_iter().filter(|key| !kind.keys().contains(key)) {
        table.refuse(key, format!("`{key}` is not allowed with kind = \"{}\"", kind.word()));
    }
    let body = read_body(&table, kind);
    let side = table.word_or("side", SideWord::Outside);
    let on = table.optional("on", |context, item| context.text(item));
    let motion = read_motion(&table);
    let stages = read_stages(&table);
    let history = read_history_use(&table, stages.iter().flatten().next());
    if matches!(motion, Some(None)) {
        for key in ["history", "stages", "angle", "about"] {
            table.refuse(key, format!("`{key}` belongs to a motion: give `move` or `rotate`"));
        }
    }
    let surface = Surface {
        name: name?,
        body: body?,
        side: side?,
        on: on?,
        motion: motion?,
        history,
        stages: stages?,
        span: table.span.clone(),
    };
    if surface.on.is_some() && surface.motion.is_some() {
        return table.wrong_key("on", "a surface is carried by a node (`on`) or has a motion of its own, not both");
    }
    Some(surface)
}

fn read_body(table: &Table, kind: SurfaceWord) -> Option<SurfaceBody> {
    match kind {
        SurfaceWord::Plane => {
            let point = required_point(table, "point");
            let normal = read_direction(table, "normal");
            Some(SurfaceBody::Plane { point: point?, normal: normal? })
        }
        SurfaceWord::Sphere => {
            let at = required_point(table, "at");
            let radius = table.required_positive("radius");
            Some(SurfaceBody::Sphere { at: at?, radius: radius?.value })
        }
        SurfaceWord::Cylinder => {
            let axis = read_axis(table);
            let radius = table.required_positive("radius");
            Some(SurfaceBody::Cylinder { axis: axis?, radius: radius?.value })
        }
        SurfaceWord::Capsule => {
            let axis = read_axis(table);
            let radius = table.required_positive("radius")?.value;
            Some(SurfaceBody::Cone { axis: axis?, radii: [radius; 2] })
        }
        SurfaceWord::Cone => {
            let axis = read_axis(table);
            let radii = read_radii(table)?;
            match <[f64; 2]>::try_from(radii.value) {
                Ok(radii) => Some(SurfaceBody::Cone { axis: axis?, radii }),
                Err(_) => table.context.wrong(radii.span, "`radius` of a cone is two numbers: at `from` and at `to`"),
            }
        }
        SurfaceWord::Torus => {
            let at = required_point(table, "at");
            let axis = read_direction(table, "axis");
            let ring = table.required_positive("ring");
            let radius = table.required_positive("radius")?;
            let ring = ring?.value;
            if radius.value >= ring {
                return table.context.wrong(radius.span, "`radius` of a torus must be smaller than its `ring`");
            }
            Some(SurfaceBody::Torus { at: at?, axis: axis?, ring, radius: radius.value })
        }
        SurfaceWord::Box => {
            let at = required_point(table, "at");
            let axes = read_axes(table);
            let half = table.required("half").and_then(|item| table.context.vector::<3>(item))?;
            if half.value.iter().any(|&half| half <= 0.0) {
                return table.context.wrong(half.span, "`half` of a box is three positive lengths");
            }
            Some(SurfaceBody::Box { at: at?, half: half.value, axes: axes? })
        }
        SurfaceWord::Tube => read_tube(table),
        SurfaceWord::Mesh => {
            let file = table.required_text("file");
            let scale = table.positive_or("scale", 1.0);
            let at = table.optional("at", read_point);
            let axes = read_axes(table);
            Some(SurfaceBody::Mesh { file: file?, scale: scale?, at: at?, axes: axes? })
        }
    }
}

fn read_tube(table: &Table) -> Option<SurfaceBody> {
    let context = table.context;
    let smooth = table.flag_or("smooth", true);
    let radii = read_radii(table);
    let (line, points) = match (table.get("through"), table.get("arc")) {
        (Some(item), None) => {
            let points = read_point_list(context, item)?;
            if points.len() < 2 {
                return context.wrong(item.span(), "`through` needs two or more points");
            }
            let count = points.len();
            (TubeLine::Through(points), count)
        }
        (None, Some(item)) => {
            let Ok(points) = read_point_list(context, item)?.try_into() else {
                return context.wrong(item.span(), "`arc` must be [start, any point between, end]");
            };
            (TubeLine::Arc(points), 2)
        }
        (Some(_), Some(item)) => {
            return context.wrong(item.span(), "a tube takes either `through` (points) or `arc`, not both");
        }
        (None, None) => return table.wrong("a tube needs `through` (points) or `arc`"),
    };
    let radii = radii?;
    let count = radii.value.len();
    if count != 1 && count != points {
        let message = format!("`radius` has {count} numbers; give one, or {points}: one for each point");
        return context.wrong(radii.span, message);
    }
    Some(SurfaceBody::Tube { line, smooth: smooth?, radii })
}

/// One positive number, or a list of them.
fn read_radii(table: &Table) -> Option<Spanned<Vec<f64>>> {
    let item = table.required("radius")?;
    let radii = match item.get_ref() {
        DeValue::Array(_) => table.context.numbers(item, None)?,
        _ => table.context.number(item)?.map(|radius| vec![radius]),
    };
    if radii.value.is_empty() || radii.value.iter().any(|&radius| radius <= 0.0) {
        return table.context.wrong(radii.span, "`radius` must be positive");
    }
    Some(radii)
}

fn required_point(table: &Table, key: &str) -> Option<SurfacePoint> {
    read_point(table.context, table.required(key)?)
}

fn read_axis(table: &Table) -> Option<[SurfacePoint; 2]> {
    let from = required_point(table, "from");
    let to = required_point(table, "to");
    Some([from?, to?])
}

/// `Some(None)` without a motion.
fn read_motion(table: &Table) -> Option<Option<SurfaceMotion>> {
    match (table.has("move"), table.has("rotate")) {
        (true, true) => table.wrong_key("rotate", "a surface has one motion: `move` or `rotate`"),
        (true, false) => {
            for key in ["about", "angle"] {
                table.refuse(key, format!("`{key}` is only allowed with `rotate`"));
            }
            Some(Some(SurfaceMotion::Shift(table.vector("move")?.value)))
        }
        (false, true) => {
            let axis = read_direction(table, "rotate");
            let about = required_point(table, "about");
            let angle = table.required_number("angle");
            Some(Some(SurfaceMotion::Turn { axis: axis?, about: about?, angle: angle?.value }))
        }
        (false, false) => Some(None),
    }
}
