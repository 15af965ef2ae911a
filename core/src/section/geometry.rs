//! Shapes of sections: their dimensions, and the mesh of each.

use super::Point;
use super::error::{self, SectionError, check_slenderness};
use super::grid::{Fineness, Rect, mesh_rects};
use super::mesh::{Mesh, Region};
use super::outline::Outline;
use super::rings::mesh_ellipse;
use super::triangulate::{PlanarRegion, mesh_regions};
use super::walls::{Walls as WallGraph, mesh_walls};

/// A shape in its own coordinates, then turned and moved.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// The shape
    pub shape: Shape,
    /// Turn about the origin of the shape from axis 2 towards axis 3, rad
    pub turn: f64,
    /// Place of the origin of the shape
    pub shift: Point,
}

/// A shape. Lengths along axis 3 are `d` (depth), along axis 2 `b` (width). Solid shapes and
/// profiles have the middle of the box around them as origin.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A solid or hollow ellipse; a circle or tube if both half axes are equal
    Ellipse {
        /// Half axes along 2 and 3 of the outer boundary
        semi_axes: [f64; 2],
        /// Thickness of a hollow ellipse, measured on its axes
        thickness: Option<f64>,
        /// Material and orientation
        region: Region,
    },
    /// Rectangles with sides along 2 and 3 that touch along edges, in their own coordinates
    Rects {
        /// The rectangles
        rects: Vec<Rect>,
        /// Their regions
        regions: Vec<Region>,
    },
    /// A rolled or welded profile
    Profile {
        /// Kind and dimensions
        profile: Profile,
        /// Material and orientation
        region: Region,
    },
    /// Any outlines with holes and several regions, in their own coordinates
    Regions(Vec<PlanarRegion>),
    /// Walls of plies, in their own coordinates
    Walls(WallGraph),
}

/// A profile, with the names of dimensions of `sectionproperties`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// A rectangle
    Rectangle {
        /// Depth
        d: f64,
        /// Width
        b: f64,
    },
    /// A rectangular hollow section
    Box {
        /// Depth
        d: f64,
        /// Width
        b: f64,
        /// Thickness of the flanges (normal to axis 3)
        t_f: f64,
        /// Thickness of the webs
        t_w: f64,
        /// Outer radius of the corners
        r_out: f64,
    },
    /// An I section; the top flange may differ
    I {
        /// Depth
        d: f64,
        /// Width of the bottom flange
        b: f64,
        /// Thickness of the bottom flange
        t_f: f64,
        /// Thickness of the web
        t_w: f64,
        /// Root radius
        r: f64,
        /// Width of the top flange
        b_top: f64,
        /// Thickness of the top flange
        t_f_top: f64,
    },
    /// A channel, web at the left, flanges towards +2
    Channel {
        /// Depth
        d: f64,
        /// Width
        b: f64,
        /// Thickness of the flanges
        t_f: f64,
        /// Thickness of the web
        t_w: f64,
        /// Root radius
        r: f64,
    },
    /// A T section, flange on top
    T {
        /// Depth
        d: f64,
        /// Width
        b: f64,
        /// Thickness of the flange
        t_f: f64,
        /// Thickness of the web
        t_w: f64,
        /// Root radius
        r: f64,
    },
    /// An angle, heel at the lower left
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
}

impl Geometry {
    /// A shape as it is.
    pub fn new(shape: Shape) -> Self {
        Self { shape, turn: 0.0, shift: [0.0; 2] }
    }

    /// True if the section, of isotropic materials, is its own mirror image with the other sign of
    /// axis 2, and of axis 3.
    pub fn mirrors(&self) -> [bool; 2] {
        if self.turn == 0.0 && self.shift == [0.0; 2] { self.shape.mirrors() } else { [false; 2] }
    }

    /// A mesh of some level (0 the coarsest), checked.
    pub fn mesh(&self, level: usize) -> Result<Mesh, SectionError> {
        let mut mesh = self.shape.mesh(Fineness::level(level))?;
        mesh.separate_parts_at_points();
        if self.turn != 0.0 {
            mesh.turn(self.turn);
        }
        if self.shift != [0.0; 2] {
            mesh.shift(self.shift);
        }
        mesh.check()?;
        if level <= 1 && matches!(self.shape, Shape::Walls(_)) {
            mesh.check_overlap()?;
        }
        Ok(mesh)
    }
}

impl Shape {
    /// True if the shape is its own mirror image with the other sign of axis 2, and of axis 3.
    fn mirrors(&self) -> [bool; 2] {
        match self {
            Self::Ellipse { .. } => [true; 2],
            Self::Profile { profile, .. } => profile.mirrors(),
            Self::Rects { .. } | Self::Regions(_) | Self::Walls(_) => [false; 2],
        }
    }

    fn mesh(&self, fineness: Fineness) -> Result<Mesh, SectionError> {
        match self {
            Self::Ellipse { semi_axes, thickness, region } => {
                let [shorter, longer] = [semi_axes[0].min(semi_axes[1]), semi_axes[0].max(semi_axes[1])];
                check_slenderness(longer / shorter)?;
                let hole = thickness.map(|thickness| semi_axes.map(|a| a - thickness));
                if let Some(thickness) = thickness {
                    check_positive(&[("the thickness", *thickness)])?;
                    check_positive(&[("the radius of the hole", shorter - thickness)])?;
                    check_slenderness(longer / thickness)?;
                }
                mesh_ellipse(*semi_axes, hole, region, fineness)
            }
            Self::Rects { rects, regions } => mesh_rects(rects, regions, fineness),
            Self::Profile { profile, region } => profile.mesh(region, fineness),
            Self::Regions(regions) => mesh_regions(regions, fineness),
            Self::Walls(walls) => mesh_walls(walls, fineness),
        }
    }
}

impl Profile {
    /// True if the profile is its own mirror image with the other sign of axis 2, and of axis 3.
    fn mirrors(&self) -> [bool; 2] {
        match *self {
            Self::Rectangle { .. } | Self::Box { .. } => [true; 2],
            Self::I { b, t_f, b_top, t_f_top, .. } => [true, b == b_top && t_f == t_f_top],
            Self::Channel { .. } => [false, true],
            Self::T { .. } => [true, false],
            Self::Angle { .. } => [false; 2],
        }
    }

    /// Quadrilaterals where all corners are sharp, else triangles.
    fn mesh(&self, region: &Region, fineness: Fineness) -> Result<Mesh, SectionError> {
        self.check()?;
        let corners = self.corners();
        if self.radii().iter().all(|&radius| radius == 0.0) {
            let rects: Vec<Rect> = self.rects().into_iter().map(|[x2, x3]| Rect { x2, x3, region: 0 }).collect();
            return mesh_rects(&rects, std::slice::from_ref(region), fineness);
        }
        let outline = Outline::rounded(&corners, &region.name)?;
        let holes = self.hole().map(|hole| Outline::rounded(&hole, &region.name)).transpose()?;
        let planar = PlanarRegion { region: region.clone(), outline, holes: holes.into_iter().collect() };
        mesh_regions(&[planar], fineness)
    }

    /// All radii.
    fn radii(&self) -> Vec<f64> {
        match *self {
            Self::Rectangle { .. } => Vec::new(),
            Self::Box { r_out, .. } => vec![r_out],
            Self::I { r, .. } | Self::Channel { r, .. } | Self::T { r, .. } => vec![r],
            Self::Angle { r_r, r_t, .. } => vec![r_r, r_t],
        }
    }

    /// Largest length over smallest thickness.
    fn slenderness(&self) -> f64 {
        match *self {
            Self::Rectangle { d, b } => d.max(b) / d.min(b),
            Self::Box { d, b, t_f, t_w, .. }
            | Self::Channel { d, b, t_f, t_w, .. }
            | Self::T { d, b, t_f, t_w, .. } => d.max(b) / t_f.min(t_w),
            Self::I { d, b, t_f, t_w, b_top, t_f_top, .. } => d.max(b).max(b_top) / t_f.min(t_w).min(t_f_top),
            Self::Angle { d, b, t, .. } => d.max(b) / t,
        }
    }

    /// Signs and sums of dimensions.
    fn check(&self) -> Result<(), SectionError> {
        for radius in self.radii() {
            if radius < 0.0 || !radius.is_finite() {
                return Err(SectionError::NotPositive { what: "a radius".to_string(), value: radius });
            }
        }
        match *self {
            Self::Rectangle { d, b } => check_positive(&[("d", d), ("b", b)])?,
            Self::Box { d, b, t_f, t_w, .. } => {
                check_positive(&[("d", d), ("b", b), ("t_f", t_f), ("t_w", t_w)])?;
                check_positive(&[("d - 2 t_f", d - 2.0 * t_f), ("b - 2 t_w", b - 2.0 * t_w)])?;
            }
            Self::I { d, b, t_f, t_w, b_top, t_f_top, .. } => {
                let lengths = [("d", d), ("b", b), ("t_f", t_f), ("t_w", t_w), ("b_top", b_top), ("t_f_top", t_f_top)];
                check_positive(&lengths)?;
                check_positive(&[("d - t_f - t_f_top", d - t_f - t_f_top), ("b - t_w", b.min(b_top) - t_w)])?;
            }
            Self::Channel { d, b, t_f, t_w, .. } => {
                check_positive(&[("d", d), ("b", b), ("t_f", t_f), ("t_w", t_w)])?;
                check_positive(&[("d - 2 t_f", d - 2.0 * t_f), ("b - t_w", b - t_w)])?;
            }
            Self::T { d, b, t_f, t_w, .. } => {
                check_positive(&[("d", d), ("b", b), ("t_f", t_f), ("t_w", t_w)])?;
                check_positive(&[("d - t_f", d - t_f), ("b - t_w", b - t_w)])?;
            }
            Self::Angle { d, b, t, .. } => {
                check_positive(&[("d", d), ("b", b), ("t", t), ("d - t", d - t), ("b - t", b - t)])?;
            }
        }
        check_slenderness(self.slenderness())
    }

    /// Rectangles of the profile with sharp corners: from and to along 2, from and to along 3.
    fn rects(&self) -> Vec<[[f64; 2]; 2]> {
        let half = |length: f64| [-0.5 * length, 0.5 * length];
        match *self {
            Self::Rectangle { d, b } => vec![[half(b), half(d)]],
            Self::Box { d, b, t_f, t_w, .. } => {
                let [[left, right], [bottom, top]] = [half(b), half(d)];
                vec![
                    [[left, right], [bottom, bottom + t_f]],
                    [[left, right], [top - t_f, top]],
                    [[left, left + t_w], [bottom + t_f, top - t_f]],
                    [[right - t_w, right], [bottom + t_f, top - t_f]],
                ]
            }
            Self::I { d, b, t_f, t_w, b_top, t_f_top, .. } => {
                let [bottom, top] = half(d);
                vec![
                    [half(b), [bottom, bottom + t_f]],
                    [half(t_w), [bottom + t_f, top - t_f_top]],
                    [half(b_top), [top - t_f_top, top]],
                ]
            }
            Self::Channel { d, b, t_f, t_w, .. } => {
                let [[left, right], [bottom, top]] = [half(b), half(d)];
                vec![
                    [[left, right], [bottom, bottom + t_f]],
                    [[left, left + t_w], [bottom + t_f, top - t_f]],
                    [[left, right], [top - t_f, top]],
                ]
            }
            Self::T { d, b, t_f, t_w, .. } => {
                let [bottom, top] = half(d);
                vec![[half(b), [top - t_f, top]], [half(t_w), [bottom, top - t_f]]]
            }
            Self::Angle { d, b, t, .. } => {
                let [[left, right], [bottom, top]] = [half(b), half(d)];
                vec![[[left, right], [bottom, bottom + t]], [[left, left + t], [bottom + t, top]]]
            }
        }
    }

    /// Counterclockwise corners with their radii.
    fn corners(&self) -> Vec<(Point, f64)> {
        let half = |length: f64| [-0.5 * length, 0.5 * length];
        match *self {
            Self::Rectangle { d, b } => rectangle(b, d, 0.0),
            Self::Box { d, b, r_out, .. } => rectangle(b, d, r_out),
            Self::I { d, b, t_f, t_w, r, b_top, t_f_top } => {
                let [bottom, top] = half(d);
                let right = [
                    ([0.5 * b, bottom], 0.0),
                    ([0.5 * b, bottom + t_f], 0.0),
                    ([0.5 * t_w, bottom + t_f], r),
                    ([0.5 * t_w, top - t_f_top], r),
                    ([0.5 * b_top, top - t_f_top], 0.0),
                    ([0.5 * b_top, top], 0.0),
                ];
                let left = right.iter().rev().map(|&([x2, x3], r)| ([-x2, x3], r));
                right.iter().copied().chain(left).collect()
            }
            Self::Channel { d, b, t_f, t_w, r } => {
                let [[left, right], [bottom, top]] = [half(b), half(d)];
                vec![
                    ([left, bottom], 0.0),
                    ([right, bottom], 0.0),
                    ([right, bottom + t_f], 0.0),
                    ([left + t_w, bottom + t_f], r),
                    ([left + t_w, top - t_f], r),
                    ([right, top - t_f], 0.0),
                    ([right, top], 0.0),
                    ([left, top], 0.0),
                ]
            }
            Self::T { d, b, t_f, t_w, r } => {
                let [bottom, top] = half(d);
                vec![
                    ([0.5 * t_w, bottom], 0.0),
                    ([0.5 * t_w, top - t_f], r),
                    ([0.5 * b, top - t_f], 0.0),
                    ([0.5 * b, top], 0.0),
                    ([-0.5 * b, top], 0.0),
                    ([-0.5 * b, top - t_f], 0.0),
                    ([-0.5 * t_w, top - t_f], r),
                    ([-0.5 * t_w, bottom], 0.0),
                ]
            }
            Self::Angle { d, b, t, r_r, r_t } => {
                let [[left, right], [bottom, top]] = [half(b), half(d)];
                vec![
                    ([left, bottom], 0.0),
                    ([right, bottom], 0.0),
                    ([right, bottom + t], r_t),
                    ([left + t, bottom + t], r_r),
                    ([left + t, top], r_t),
                    ([left, top], 0.0),
                ]
            }
        }
    }

    /// The hole of a box with round corners.
    fn hole(&self) -> Option<Vec<(Point, f64)>> {
        let Self::Box { d, b, t_f, t_w, r_out } = *self else { return None };
        Some(rectangle(b - 2.0 * t_w, d - 2.0 * t_f, (r_out - t_f.min(t_w)).max(0.0)))
    }
}

/// Corners of a rectangle with one radius.
fn rectangle(width: f64, depth: f64, radius: f64) -> Vec<(Point, f64)> {
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[s2, s3]| ([0.5 * s2 * width, 0.5 * s3 * depth], radius))
        .to_vec()
}

/// Refuses lengths that are not positive.
fn check_positive(lengths: &[(&str, f64)]) -> Result<(), SectionError> {
    lengths.iter().try_for_each(|&(what, value)| error::check_positive(what, value))
}
