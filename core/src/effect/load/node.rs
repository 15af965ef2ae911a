//! Forces and moments at nodes, spatial (dead) or material (following the section).

use crate::effect::{Effect, Roles, TangentForm};
use crate::kernel::load::{material_force, material_moment, spatial_moment};
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, State};
use crate::tensor::Vec3;

/// Kinds of loads at nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeLoadKind {
    /// A force fixed in space: no tangent.
    SpatialForce,
    /// A moment fixed in space; not conservative.
    SpatialMoment,
    /// A force that turns with the section.
    MaterialForce,
    /// A moment that turns with the section.
    MaterialMoment,
}

/// A force or a moment at a node.
#[derive(Clone, Copy, Debug)]
pub struct NodeForce {
    /// The loaded node
    pub node: Node,
    /// Force or moment at an amplitude of one: spatial, or material in global components of the
    /// initial placement
    pub vector: Vec3,
    /// The index of its amplitude
    pub amplitude: usize,
}

/// All loads at nodes of one kind.
#[derive(Clone, Debug)]
pub struct NodeLoad {
    /// The kind of the loads
    pub kind: NodeLoadKind,
    /// The loads
    pub loads: Vec<NodeForce>,
    /// True if the tangent includes the derivatives of the loads
    pub tangent: bool,
}

impl Effect for NodeLoad {
    fn name(&self) -> &'static str {
        match self.kind {
            NodeLoadKind::SpatialForce => "dead forces",
            NodeLoadKind::SpatialMoment => "dead moments",
            NodeLoadKind::MaterialForce => "following forces",
            NodeLoadKind::MaterialMoment => "following moments",
        }
    }

    fn category(&self) -> Category {
        Category::External
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        for load in &self.loads {
            match self.kind {
                NodeLoadKind::SpatialForce => connectivity.push([load.node.u]),
                NodeLoadKind::MaterialForce => connectivity.push([load.node.u, load.node.p]),
                NodeLoadKind::SpatialMoment | NodeLoadKind::MaterialMoment => connectivity.push([load.node.p]),
            }
        }
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        if self.tangent && self.kind != NodeLoadKind::SpatialForce { TangentForm::General } else { TangentForm::None }
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        for load in &self.loads {
            show(match self.kind {
                NodeLoadKind::SpatialForce | NodeLoadKind::MaterialForce => MirrorData::Vector(load.vector),
                NodeLoadKind::SpatialMoment | NodeLoadKind::MaterialMoment => MirrorData::Axial(load.vector),
            });
        }
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let mut system = ElementSystem::new(if self.kind == NodeLoadKind::MaterialForce { 2 } else { 1 });
        for (k, load) in self.loads.iter().enumerate() {
            let vector = load.vector * at.amplitude[load.amplitude];
            let rotation = || at.rotation(load.node.p);
            system.clear();
            match self.kind {
                NodeLoadKind::SpatialForce => system.add_force(0, -vector),
                NodeLoadKind::MaterialForce => {
                    let (force, tangent) = material_force(&rotation(), vector);
                    system.add_force(0, force);
                    system.add_tangent(0, 1, tangent * weights.stiffness);
                }
                NodeLoadKind::SpatialMoment | NodeLoadKind::MaterialMoment => {
                    let kernel =
                        if self.kind == NodeLoadKind::SpatialMoment { spatial_moment } else { material_moment };
                    let (moment, tangent) = kernel(&rotation(), vector);
                    system.add_force(0, moment);
                    system.add_tangent(0, 0, tangent * weights.stiffness);
                }
            }
            out.add(k, &system);
        }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}
