//! Elasticity of beams, with two interpolations of rotations, and damping of strain rates.

mod beam;
mod built;
mod element;
mod element_stresses;
mod interpolation;
mod planar;
mod strain_rate_damping;

pub use beam::{BeamElasticity, ElasticElements, StressField};
pub use built::{BuiltBeams, RotationInterpolation};
pub use element::{BeamLaw, ElasticElement, ElasticPoint};
pub use element_stresses::ElementStresses;
pub use interpolation::{Interpolation, RelativeVectors, TotalVectors};
pub use strain_rate_damping::{StrainRateDamping, Viscosity};
