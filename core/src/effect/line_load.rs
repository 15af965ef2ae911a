//! Forces and moments per initial length along beams: fixed in space, or turning with the section.

use super::Effect;
use super::volume::VolumeElements;
use crate::kernel::Weights;
use crate::kernel::load::{Intensity, Line};
use crate::kernel::volume::Blocks;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, State};
use crate::tensor::Vec3;

/// Whether the components are spatial or turn with the section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineLoadKind {
    /// Fixed in space
    Spatial,
    /// Turning with the section
    Material,
}

/// All line loads of one kind.
#[derive(Clone, Debug)]
pub struct LineLoad {
    /// What they are
    pub kind: LineLoadKind,
    /// The loaded elements
    pub elements: VolumeElements<Intensity>,
    /// Whether the tangent knows how they turn
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

    fn has_tangent(&self) -> bool {
        let turns = self.kind == LineLoadKind::Material || self.elements.any(|line| line.moment != Vec3::ZERO);
        self.tangent && turns
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
            LineLoadKind::Spatial => self.elements.add(&Line::<false> { amplitudes }, at, weights, out),
            LineLoadKind::Material => self.elements.add(&Line::<true> { amplitudes }, at, weights, out),
        }
    }
}
