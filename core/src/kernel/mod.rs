//! Pure functions at a Gauss point or of one element (Makinen 2007, section 3): no ids, no files,
//! no allocation.
//!
//! Every kernel writes forces in one sign, g = f_int + f_acc - f_ext, and tangents as derivatives
//! of g, so that loads, stiffness and inertia add up without a case distinction.

pub mod beam;
pub mod contact;
pub mod elastic;
pub mod element;
pub mod guide;
pub mod inertia;
pub mod joint;
pub mod law;
pub mod load;
pub mod pair;
pub mod planar;
pub mod relative;
pub mod seam;
pub mod shape;
pub mod spline;
pub mod turn;
pub mod volume;

pub use element::{ElementSystem, MAX_NODES, NodeMotion, NodePlace, Placed, TILE, WIDTH, Weights};
pub use planar::PlanarSystem;
