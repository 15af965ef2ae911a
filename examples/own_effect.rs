//! An effect of one's own: a soft wall that pushes a node back the harder the nearer it comes.
//!
//! With the distance d of the node from the wall the energy is E = F r exp(-d/r): the force is F exp(-d/r) along the normal, the
//! stiffness F/r exp(-d/r). A wall beside the tip of a cantilever takes a part of the load; the balance of both at the tip is one
//! equation for one unknown, which is solved here by itself.

use beamsim_core::effect::{Effect, Energy, Roles, TangentForm};
use beamsim_core::kernel::{ElementSystem, Weights};
use beamsim_core::model::{ModelBuilder, SectionMatrices, StraightBeam};
use beamsim_core::run::{Plan, Run, Snapshot, Stage};
use beamsim_core::system::{Assembler, Category, Connectivity, Memory, MirrorData, Slot, State};
use beamsim_core::tensor::Vec3;
use std::error::Error;

const LENGTH: f64 = 1.0;
const BENDING_STIFFNESS: f64 = 100.0;
const SHEAR_STIFFNESS: f64 = 1e6;
/// On the tip, towards the wall
const LOAD: f64 = 0.3;

/// A wall beside one node.
struct SoftWall {
    /// The displacement of the node
    slot: Slot,
    /// Unit vector from the wall to the node
    normal: Vec3,
    /// Distance of the node from the wall at the start
    gap: f64,
    /// Force where the node touches the wall
    force: f64,
    /// The way over which the force falls to its e-th part
    range: f64,
}

impl SoftWall {
    /// The force along the normal, for a displacement of the node along the normal.
    fn push(&self, along: f64) -> f64 {
        self.force * (-(self.gap + along) / self.range).exp()
    }
}

impl Effect for SoftWall {
    fn name(&self) -> &'static str {
        "soft wall"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        connectivity.push([self.slot]);
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::Symmetric
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        show(MirrorData::Vector(self.normal));
    }

    /// An internal force is the derivative of the energy: it points against the push.
    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let push = self.push(at.q[self.slot as usize].dot(self.normal));
        let mut system = ElementSystem::new(1);
        system.add_force(0, self.normal * -push);
        system.add_tangent(0, 0, self.normal.outer(self.normal) * (weights.stiffness * push / self.range));
        out.add(0, &system);
    }

    fn energy(&self, at: &State) -> Energy {
        let push = self.push(at.q[self.slot as usize].dot(self.normal));
        Energy { kinetic: 0.0, strain: push * self.range }
    }

    fn strain_of(&self, _at: &State, field: &[Vec3], length: f64) -> f64 {
        field[self.slot as usize].dot(self.normal).abs() / length
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}

fn wall(slot: Slot) -> SoftWall {
    SoftWall { slot, normal: Vec3::UNIT[1], gap: 2e-4, force: 1.0, range: 1e-4 }
}

/// The displacement of the tip along the normal.
fn computed() -> Result<f64, Box<dyn Error>> {
    let mut builder = ModelBuilder::new();
    let root = builder.node("root", Vec3::ZERO);
    let tip = builder.node("tip", Vec3([LENGTH, 0.0, 0.0]));
    let resultants = [1e6, SHEAR_STIFFNESS, SHEAR_STIFFNESS, 100.0, BENDING_STIFFNESS, BENDING_STIFFNESS];
    builder.beam(StraightBeam {
        ends: [root, tip],
        section: SectionMatrices::diagonal(resultants),
        axis3: Vec3::UNIT[2],
        elements: 4,
        order: 3,
    })?;
    builder.clamp(root)?;
    builder.force(tip, Vec3([0.0, -LOAD, 0.0]))?;
    let slots = builder.slots(tip)?;
    builder.effect(wall(slots.u));
    let plan = Plan::new(builder.build()?, vec![Stage::statics(4)]);
    let mut along = 0.0;
    let mut watch = |at: &Snapshot| {
        along = at.state.q[slots.u as usize].0[1];
        Ok(())
    };
    let (result, _) = Run::new(plan, &mut watch).finish();
    result?;
    Ok(along)
}

/// The balance k u + load = push(u) of a linear cantilever and the wall, by bisection.
fn balanced() -> f64 {
    let flexibility = LENGTH.powi(3) / (3.0 * BENDING_STIFFNESS) + LENGTH / SHEAR_STIFFNESS;
    let wall = wall(0);
    let rest = |along: f64| along / flexibility + LOAD - wall.push(along);
    let mut low = -LOAD * flexibility;
    let mut high = LENGTH;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if rest(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

fn main() -> Result<(), Box<dyn Error>> {
    let [found, exact] = [computed()?, balanced()];
    let error = (found / exact - 1.0).abs();
    println!(
        "the tip moves by {found:.9e}, the balance of beam and wall is at {exact:.9e}: relative error {error:.1e}"
    );
    // The displacement is small: what is not linear in it is of the order of its square.
    assert!(error < 1e-5, "{found} against {exact}");
    Ok(())
}

#[test]
fn the_wall_takes_its_part() -> Result<(), Box<dyn Error>> {
    main()
}
