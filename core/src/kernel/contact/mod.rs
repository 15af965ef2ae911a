//! Contact with friction of beams and bodies against rigid surfaces, and of pairs of beams.
//!
//! Sections are round with a radius r for contact, whatever their stiffness. A contact adds f =
//! dW/dq, in the sign of internal forces (g = f_int + f_acc - f_ext), and K = df/dq.
//!
//! Order of reading: [`surface`], [`edge`], [`tube`], [`mesh`] (distance, normal and curvature of
//! rigid surfaces),
//! [`law`] (normal force of a gap), [`friction`] (traction by return mapping), [`point`] (forces
//! and tangent of one contact point), [`along`] (closest points that move along an element),
//! [`beam_pair`] (the same of two elements), [`pair_search`] (their closest points, and motions that
//! keep them apart), [`grid`] (elements that are near each other).
//!
//! Kernels here run one point at a time, not on lanes: branches may follow values.

pub mod along;
pub mod beam_pair;
pub mod cone;
pub mod distance;
pub mod edge;
pub mod friction;
pub mod grid;
pub mod law;
pub mod mesh;
mod mesh_parts;
#[cfg(test)]
mod mesh_tests;
mod mesh_tree;
pub mod minimum;
mod outline;
pub mod pair_search;
pub mod point;
pub mod surface;
pub mod tube;
pub mod variation;

#[cfg(test)]
pub(crate) mod dual;
#[cfg(test)]
mod pair_tests;
#[cfg(test)]
mod tests;

pub use along::{MAX_MINIMA, Minima, Minimum, MinimumKind, ShapeAt, minima};
pub use beam_pair::{PairLaw, PairSide, add_pair};
pub use cone::Cone;
pub use distance::{Distance, Feature, Side, Undefined};
pub use edge::Edge;
pub use friction::{CarriedTraction, FrictionLaw, Status, Traction};
pub use law::{NormalForce, NormalLaw};
pub use mesh::TriangleMesh;
pub use mesh_parts::MeshError;
pub use point::{Carrier, ContactLaw, Place, PointState, add_point};
pub use surface::{Shape, Surface};
pub use tube::{Tube, TubeEnds, TubeError};
pub use variation::{ContactNode, NodeBefore, NodeBlocks, NodeTurning};
