//! Sections by their shape, as a deck gives them.

use super::airfoil::Airfoil;
use super::angle::Fibre;
use super::outline::{Outline, Region};
use super::walls::Walls;
use crate::deck::diagnostic::{Span, Spanned};
use crate::deck::words::words;

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
    /// A circle, tube or rectangle of one material, without a wanted mesh: where the material is
    /// isotropic, its matrices and stresses have closed forms.
    pub fn solid_without_mesh(&self) -> Option<(Shape, &Spanned<String>)> {
        match (&self.shape, &self.material, self.mesh) {
            (ComputedShape::Solid(shape), Some(material), None) => Some((*shape, material)),
            (_, _, _) => None,
        }
    }

    /// The point of a circle, tube or rectangle of one material through which the line of the beam goes:
    /// all centres of these shapes are their middle.
    pub fn place_of_solid(&self) -> [f64; 2] {
        match self.reference {
            Some(Reference::Point(at)) => at,
            Some(Reference::Word(_)) | None => [0.0; 2],
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
