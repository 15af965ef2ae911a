//! Errors of sections, with messages for engineers.

use super::Point;
use std::fmt;

/// The reason why a section cannot be computed.
#[derive(Clone, Debug, PartialEq)]
pub enum SectionError {
    /// Elastic constants without a positive definite stiffness
    NotPositiveDefinite {
        /// Name of the material
        material: String,
    },
    /// Poisson's ratio of an isotropic material outside -1 < nu <= 0.4999
    PoissonRatio {
        /// Name of the material
        material: String,
        /// The ratio
        nu: f64,
    },
    /// A number that has to be positive
    NotPositive {
        /// Meaning of the number
        what: String,
        /// Its value
        value: f64,
    },
    /// Dimensions of a shape that contradict each other
    Dimensions {
        /// The contradiction
        message: String,
    },
    /// Two edges of outlines cross
    CrossingEdges {
        /// First and last point of one edge
        first: [Point; 2],
        /// First and last point of the other edge
        second: [Point; 2],
    },
    /// An outline that is not a closed curve with an area
    Outline {
        /// Name of the region
        region: String,
        /// The fault
        message: String,
    },
    /// A region that contains no element, because others cover it
    EmptyRegion {
        /// Name of the region
        region: String,
    },
    /// Two regions cover the same place
    OverlappingRegions {
        /// Name of one region
        first: String,
        /// Name of the other region
        second: String,
    },
    /// The section consists of several parts
    NotConnected {
        /// A region of one part
        first: String,
        /// A region of another part
        second: String,
        /// A point of the other part
        near: Point,
    },
    /// A wall that is too thin for double precision
    TooThin {
        /// Length over thickness
        ratio: f64,
    },
    /// A coarse mesh that is already too large
    TooLarge {
        /// Its number of nodes
        nodes: usize,
    },
    /// The mesh generator failed
    Meshing {
        /// Name of a region
        region: String,
        /// The reason
        message: String,
    },
    /// An element with a wrong side out
    InvertedElement {
        /// Name of the region
        region: String,
        /// Centre of the element
        at: Point,
    },
    /// The stiffness of the section could not be factorised
    Singular,
    /// Somebody asked to stop
    Interrupted,
}

impl fmt::Display for SectionError {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NotPositiveDefinite { material } => write!(
                out,
                "the elastic constants of material `{material}` are impossible: its stiffness matrix is not positive \
                 definite. Usually a Poisson ratio is too large: |nu12| < sqrt(E1/E2), and so for 13 and 23"
            ),
            Self::PoissonRatio { material, nu } => {
                write!(out, "material `{material}` has nu = {nu}: a section from a shape needs -1 < nu <= 0.4999")
            }
            Self::NotPositive { what, value } => write!(out, "{what} is {}, but must be positive", rounded(*value)),
            Self::Dimensions { message } => write!(out, "{message}"),
            Self::CrossingEdges { first, second } => write!(
                out,
                "two edges cross: from {} to {}, and from {} to {}",
                show(first[0]),
                show(first[1]),
                show(second[0]),
                show(second[1])
            ),
            Self::Outline { region, message } => write!(out, "the outline of `{region}` {message}"),
            Self::EmptyRegion { region } => {
                write!(out, "region `{region}` has no area of its own: other regions or holes cover it")
            }
            Self::OverlappingRegions { first, second } => write!(
                out,
                "regions `{first}` and `{second}` overlap: cut a hole into one of them, or let them share an edge"
            ),
            Self::NotConnected { first, second, near } => write!(
                out,
                "the section is not one piece: `{second}` near {} does not touch `{first}` along an edge, so that \
                 torsion is undefined. Let the regions share an edge",
                show(*near)
            ),
            Self::TooThin { ratio } => write!(
                out,
                "a wall is {ratio:.0} times as long as it is thick: above {MAX_SLENDERNESS}, round-off spoils the solution. Use a stiffness \
                 matrix, or closed forms for thin walls"
            ),
            Self::TooLarge { nodes } => write!(
                out,
                "a coarse mesh already has {nodes} nodes, more than the limit of {MAX_NODES}: give fewer points, or merge \
                 plies of one angle"
            ),
            Self::Meshing { region, message } => write!(out, "no mesh for region `{region}`: {message}"),
            Self::InvertedElement { region, at } => write!(
                out,
                "the mesh of region `{region}` has a folded element near {}: a curved edge comes too close to \
                 another edge. Usually a wall or skin is thicker than its radius or than half of the room for it",
                show(*at)
            ),
            Self::Singular => {
                write!(out, "the equations of the section are singular: check dimensions and elastic constants")
            }
            Self::Interrupted => write!(out, "interrupted"),
        }
    }
}

impl std::error::Error for SectionError {}

impl SectionError {
    /// The error of a section that was moved: its points are shown where they were, from `origin`.
    pub fn moved(self, origin: Point) -> Self {
        if origin == [0.0; 2] {
            return self;
        }
        let back = |at: Point| [at[0] + origin[0], at[1] + origin[1]];
        match self {
            Self::CrossingEdges { first, second } => {
                Self::CrossingEdges { first: first.map(back), second: second.map(back) }
            }
            Self::NotConnected { first, second, near } => Self::NotConnected { first, second, near: back(near) },
            Self::InvertedElement { region, at } => Self::InvertedElement { region, at: back(at) },
            Self::Dimensions { message } => {
                Self::Dimensions { message: format!("{message} (points are given from {})", show(origin)) }
            }
            Self::NotPositiveDefinite { .. }
            | Self::PoissonRatio { .. }
            | Self::NotPositive { .. }
            | Self::Outline { .. }
            | Self::EmptyRegion { .. }
            | Self::OverlappingRegions { .. }
            | Self::TooThin { .. }
            | Self::TooLarge { .. }
            | Self::Meshing { .. }
            | Self::Singular
            | Self::Interrupted => self,
        }
    }
}

/// Most nodes of a mesh
const MAX_NODES: usize = 100_000;

/// Refuses a mesh that would take minutes.
pub fn check_nodes(nodes: usize) -> Result<(), SectionError> {
    match nodes > MAX_NODES {
        true => Err(SectionError::TooLarge { nodes }),
        false => Ok(()),
    }
}

/// Walls may be this much longer than thick. The condition of the equations grows with the fourth
/// power; corrections of the solution remove the round-off up to here, but above about 5000 there
/// is no factorisation.
const MAX_SLENDERNESS: f64 = 3000.0;

/// Refuses walls that are too thin for double precision.
pub fn check_slenderness(ratio: f64) -> Result<(), SectionError> {
    match ratio > MAX_SLENDERNESS {
        true => Err(SectionError::TooThin { ratio }),
        false => Ok(()),
    }
}

/// Refuses a number that is not positive, or not a number.
pub fn check_positive(what: impl Into<String>, value: f64) -> Result<(), SectionError> {
    match value > 0.0 && value.is_finite() {
        true => Ok(()),
        false => Err(SectionError::NotPositive { what: what.into(), value }),
    }
}

/// A number without the round-off of a difference.
fn rounded(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// A point as "(x2, x3)".
pub fn show(point: Point) -> String {
    let [x2, x3] = point.map(rounded);
    format!("({x2}, {x3})")
}
