//! Effects of the mass of beams and bodies: inertia, inertia in rotating frames, mass-proportional
//! damping, and fading inertia.

mod beam_mass;
mod fading;
mod mass_damping;
mod planar;
mod rigid_body;
mod rotary;
mod rotating_frame;
mod section;

pub use beam_mass::BeamMass;
pub use fading::{FadingInertia, fading_force};
pub use mass_damping::{BeamMassDamping, BodyMassDamping};
pub use rigid_body::{Body, RigidBody};
pub use rotary::RotaryInertia;
pub use rotating_frame::{FrameMotion, FrameRamp, RotatingFrame};
pub use section::SectionInertia;

use crate::kernel::inertia::Inertia;
use crate::system::MirrorData;

/// Shows the mirror data of mass properties, by which a scene may lie in a plane.
pub(super) fn inertia_mirror_data(inertia: &Inertia, show: &mut dyn FnMut(MirrorData)) {
    show(MirrorData::Vector(inertia.offset));
    show(MirrorData::Tensor(inertia.about_node));
}
