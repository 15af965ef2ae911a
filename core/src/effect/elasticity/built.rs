//! Elastic beams as effects of a model. They are built here and not where a scene is composed, so
//! that their kernels are compiled in this crate, once, and with full optimisation.

use super::beam::{BeamElasticity, ElasticElements, StressField};
use super::interpolation::{Interpolation, RelativeVectors, TotalVectors};
use super::strain_rate_damping::{StrainRateDamping, Viscosity};
use crate::effect::Effect;
use std::sync::Arc;

/// The interpolation of rotations in the elements of a beam.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RotationInterpolation {
    /// Of total rotation vectors, all in one chart
    Total,
    /// Of rotation vectors relative to a frame that turns with the element
    Relative,
}

/// The effects of elastic beams with one interpolation of rotations.
#[derive(Clone)]
pub struct BuiltBeams {
    /// Internal forces
    pub elasticity: Arc<dyn Effect>,
    /// Strains and stresses of the elements, for outputs
    pub stresses: Arc<dyn StressField>,
    /// Strain-rate damping, if one was given
    pub damping: Option<Arc<dyn Effect>>,
}

impl RotationInterpolation {
    /// The name of the elasticity of beams with this interpolation.
    pub fn elasticity_name(self) -> &'static str {
        match self {
            Self::Total => TotalVectors::NAME,
            Self::Relative => RelativeVectors::NAME,
        }
    }

    /// The name of the strain-rate damping of beams with this interpolation.
    pub fn damping_name(self) -> &'static str {
        match self {
            Self::Total => TotalVectors::DAMPING_NAME,
            Self::Relative => RelativeVectors::DAMPING_NAME,
        }
    }

    /// Builds the effects of elements. `geometric_stiffness`: the tangent includes how stress
    /// rotates with the beams. `damping`: stress per strain rate.
    pub fn build(self, elements: ElasticElements, geometric_stiffness: bool, damping: Option<Viscosity>) -> BuiltBeams {
        match self {
            Self::Total => build::<TotalVectors>(elements, geometric_stiffness, damping),
            Self::Relative => build::<RelativeVectors>(elements, geometric_stiffness, damping),
        }
    }
}

fn build<I: Interpolation>(
    elements: ElasticElements,
    geometric_stiffness: bool,
    damping: Option<Viscosity>,
) -> BuiltBeams {
    let stressed = BeamElasticity::<I>::new(elements);
    let elasticity = Arc::new(if geometric_stiffness { stressed } else { stressed.without_geometric_stiffness() });
    match damping {
        None => BuiltBeams { elasticity: elasticity.clone(), stresses: elasticity, damping: None },
        Some(viscosity) => {
            let damping = Arc::new(StrainRateDamping { elasticity: elasticity.clone(), viscosity });
            BuiltBeams { elasticity, stresses: damping.clone(), damping: Some(damping) }
        }
    }
}
