//! Line loads: forces and moments per initial length of beams, spatial (dead) or material
//! (following the section).

use crate::effect::volume::VolumeElements;
use crate::effect::{Effect, Roles, TangentForm};
use crate::kernel::Weights;
use crate::kernel::load::{DistributedLoad, Intensity};
use crate::kernel::volume::Blocks;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, State};
use crate::tensor::Vec3;

/// The frame of the components of line loads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineLoadKind {
    /// Fixed in space: dead loads
    Spatial,
    /// Turning with the section: following loads
    Material,
}

/// All line loads of one kind.
#[derive(Clone, Debug)]
pub struct LineLoad {
    /// The frame of the loads
    pub kind: LineLoadKind,
    /// The loaded elements
    pub elements: VolumeElements<Intensity>,
    /// True if the tangent includes the derivatives of the loads
    pub tangent: bool,
}

impl Effect for LineLoad {
    fn name(&self) -> &'static str {
        match self.kind {
            LineLoadKind::Spatial => "dead line loads",
            LineLoadKind::Material => "following line loads",
        }
    }

    fn category(&self) -> Category {
        Category::External
    }

    fn connectivity(&self) -> Connectivity {
        self.elements.connectivity(Blocks::Both)
    }

    fn tangent(&self) -> TangentForm {
        let turns = self.kind == LineLoadKind::Material || self.elements.any(|line| line.moment != Vec3::ZERO);
        if self.tangent && turns { TangentForm::General } else { TangentForm::None }
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        self.elements.each_quantity(|intensity| {
            show(MirrorData::Vector(intensity.force));
            show(MirrorData::Axial(intensity.moment));
        });
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let amplitudes = &at.amplitude[..];
        match self.kind {
            LineLoadKind::Spatial => self.elements.add(&DistributedLoad::<false> { amplitudes }, at, weights, out),
            LineLoadKind::Material => self.elements.add(&DistributedLoad::<true> { amplitudes }, at, weights, out),
        }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}
