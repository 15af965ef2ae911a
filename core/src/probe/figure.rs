//! The whole shape of a scene, for pictures: every node of every beam with its section axes,
//! strains and resultants.

use super::beam_point::{BeamPoint, ElementCache};
use super::place::Place;
use crate::effect::contact::{ContactParty, SurfaceContacts};
use crate::rotation::{Rotation, principal};
use crate::section::Vector6;
use crate::section::recovery::{Measure, PlacedRecovery};
use crate::system::State;
use crate::tensor::{Mat3, Vec3};
use std::sync::Arc;

/// The shape of a scene.
#[derive(Clone, Default)]
pub struct Figure {
    /// Beams
    pub lines: Vec<Line>,
    /// Rigid bodies
    pub bodies: Vec<Place>,
    /// Ends of springs and cables between nodes
    pub links: Vec<[Place; 2]>,
    /// Surfaces and contacts, if there are some
    pub contacts: Option<Arc<SurfaceContacts>>,
}

/// A beam.
#[derive(Clone)]
pub struct Line {
    /// Name of the beam
    pub name: String,
    /// Order of its elements: nodes of an element, less one
    pub order: usize,
    /// Nodes from start to end
    pub points: Vec<LinePoint>,
}

/// A node of a beam. Where beams meet, each has its own.
#[derive(Clone)]
pub struct LinePoint {
    /// The node, with the section axes of the beam there
    pub place: Place,
    /// Point of the beam for strains and resultants
    pub inside: BeamPoint,
    /// Stresses of the section, where they are wanted and known
    pub section: Option<PlacedRecovery>,
}

/// Motion, strains and resultants of a node at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Present position
    pub place: Vec3,
    /// Displacement
    pub u: Vec3,
    /// Total rotation vector, at most pi long
    pub r: Vec3,
    /// Section axes as columns
    pub axes: Mat3,
    /// Velocity
    pub velocity: Vec3,
    /// Gamma and K, section axes
    pub strain: [f64; 6],
    /// N and M, section axes: mean of both sides
    pub resultant: [f64; 6],
    /// N and M on both sides where they jump, each in its own section axes; for points with stresses
    pub jump: Option<[[f64; 6]; 2]>,
    /// Strain energy per length
    pub energy: f64,
}

impl Figure {
    /// All nodes of beams, then the bodies, then the ends of links. `origin` is the state about
    /// which the stage is linear; `None` in other stages.
    pub fn looks(&self, state: &State, origin: Option<&State>) -> Vec<Look> {
        let points = self.lines.iter().flat_map(|line| &line.points);
        let others = self.bodies.iter().chain(self.links.as_flattened());
        let mut cache = ElementCache::new(state, origin);
        points.map(|point| point.look(&mut cache)).chain(others.map(|place| bare(place, state))).collect()
    }

    /// Largest von Mises stress of the section at each look; not a number where it is not known.
    /// `None` if it is known nowhere.
    pub fn von_mises(&self, looks: &[Look]) -> Option<Vec<f64>> {
        let points = || self.lines.iter().flat_map(|line| &line.points);
        points().find(|point| point.section.is_some())?;
        let of_section = |section: &PlacedRecovery, look: &Look| {
            let of_load = |load: &[f64; 6]| {
                Some(section.largest(Measure::VonMises, &Vector6::from(*load), f64::NEG_INFINITY)?.value)
            };
            let loads = look.jump.as_ref().map_or(std::slice::from_ref(&look.resultant), |sides| sides);
            loads.iter().filter_map(of_load).reduce(f64::max)
        };
        let of_point = |(point, look): (&LinePoint, &Look)| {
            point.section.as_ref().and_then(|section| of_section(section, look)).unwrap_or(f64::NAN)
        };
        let mut values: Vec<f64> = points().zip(looks).map(of_point).collect();
        values.resize(looks.len(), f64::NAN);
        Some(values)
    }

    /// The gap and the force (global components) of contacts at each look; not a number where nothing
    /// is there to touch. `None` without contacts.
    pub fn contacts_at(&self, state: &State) -> Option<Vec<(f64, Vec3)>> {
        let nodes = self.contacts.as_ref()?.at_nodes(state);
        let beams = self.lines.iter().enumerate();
        let parties = beams.flat_map(|(beam, line)| line.points.iter().map(move |_| Some(ContactParty::Beam(beam))));
        let bodies = self.bodies.iter().map(|body| body.node().map(|node| ContactParty::Body(node.u)));
        let parties = parties.chain(bodies).chain(std::iter::repeat(None));
        let of_place = |(place, party): (&Place, Option<ContactParty>)| {
            let contact = party.and_then(|party| nodes.get(&(party, place.node()?.u)));
            let gap = contact.map_or(f64::NAN, |contact| contact.gap);
            (if gap.is_finite() { gap } else { f64::NAN }, contact.map_or(Vec3::ZERO, |contact| contact.force))
        };
        Some(self.places().zip(parties).map(of_place).collect())
    }

    /// The places of all looks.
    pub fn places(&self) -> impl Iterator<Item = &Place> {
        let points = self.lines.iter().flat_map(|line| line.points.iter().map(|point| &point.place));
        points.chain(&self.bodies).chain(self.links.as_flattened())
    }

    /// Number of nodes of beams.
    pub fn line_points(&self) -> usize {
        self.lines.iter().map(|line| line.points.len()).sum()
    }
}

impl LinePoint {
    fn look(&self, cache: &mut ElementCache) -> Look {
        let [strain, resultant] = self.inside.strain_and_stress(cache);
        // Energy of the strains that have stress: free strains have none.
        let stress = Vector6::from(resultant);
        let energy = self.inside.compliance.map_or(0.0, |compliance| 0.5 * stress.dot(&(compliance * stress)));
        let jump = self.section.as_ref().and_then(|_| self.inside.jump(cache));
        Look { strain, resultant, jump, energy, ..bare(&self.place, cache.state) }
    }
}

/// A node without strains and resultants.
fn bare(place: &Place, state: &State) -> Look {
    let motion = place.motion(state);
    Look {
        place: place.initial() + motion.u,
        u: motion.u,
        r: principal(motion.p),
        axes: Rotation::new(motion.p).r * place.frame,
        velocity: motion.u_rate,
        strain: [0.0; 6],
        resultant: [0.0; 6],
        jump: None,
        energy: 0.0,
    }
}
