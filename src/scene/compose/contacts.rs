//! Contacts of beams and bodies with surfaces, and of beams with beams.

use super::contact_reason::reason_of;
use super::{Composer, DrivenTable, stage_set};
use crate::deck::{
    self, ContactDamping, ContactRadius, Deck, Diagnostic, EffectWord, EndsWord, SectionBody, Shape, Spanned, Stage,
    StageBody, SurfaceMotion,
};
use crate::scene::joints::FoundJoint;
use crate::scene::mesh::MeshBeam;
use crate::scene::names::{self, unknown, unknown_beam};
use crate::scene::path;
use crate::scene::surfaces;
use beamsim_core::effect::contact::{
    BeamPairs, Chain, ChainNode, ContactLaws, Meeting, SceneSurface, Strand, SurfaceCarrier, SurfaceContacts,
};
use beamsim_core::kernel::contact::law::damping_of;
use beamsim_core::model::Amplitude;
use beamsim_core::run::Driven;
use beamsim_core::system::{ContactStiffness, Slot};
use beamsim_core::tensor::Vec3;
use beamsim_core::warning::WarningKind;
use std::f64::consts::PI;
use std::sync::Arc;

/// The smallest bound of penetrations that follows motions, in contacts that name none, over [`PENETRATION`] times the
/// radius.
const LEAST_PENETRATION: f64 = 1e-6;

/// The largest penetration of contacts that name none, over the radius.
const PENETRATION: f64 = 1e-3;

/// The first stiffness of contacts with beams, over the bending stiffness of an element.
const OF_BENDING: f64 = 1e-2;

/// The stiffness with which contacts of static stages begin is at most this factor times EA/h, with the distance h
/// of nodes: results do not depend on it, but round-off of gaps times a larger one would be forces.
const STIFFEST: f64 = 1e4;

/// The first stiffness of contacts with beams, over the stiffness of an element in extension.
const OF_EXTENSION: f64 = 1e-4;

/// Steps that a contact in a dynamic stage lasts, at least.
const STEPS_OF_CONTACT: f64 = 10.0;

const NAME: &str = "contact";
const FRICTION: &str = "friction of contacts";

/// Beams that may touch each other, while contacts are added.
#[derive(Default)]
struct PairParts {
    beams: Vec<(String, Strand)>,
    meetings: Vec<Meeting>,
}

impl Composer<'_> {
    pub(super) fn contacts(&mut self, connections: &[FoundJoint]) {
        let deck = self.deck;
        let is_off = !deck.effects.allow(EffectWord::Contact);
        if deck.contacts.is_empty() || is_off {
            let why = if is_off { super::SWITCHED_OFF } else { "no [[contact]]" };
            self.reason(NAME, false, why);
            return self.reason(FRICTION, false, why);
        }
        let surfaces: Vec<Option<SceneSurface>> = deck.surfaces.iter().map(|table| self.surface(table)).collect();
        let mut out = SurfaceContacts::default();
        let mut pairs = PairParts::default();
        for contact in &deck.contacts {
            self.add_contact(contact, &surfaces, &mut out, &mut pairs);
        }
        out.pairs = BeamPairs::new(pairs.beams, pairs.meetings, &self.connected(connections));
        // Contacts keep the numbers of the tables of surfaces.
        let Some(surfaces) = surfaces.into_iter().collect::<Option<Vec<_>>>() else { return };
        out.surfaces = surfaces;
        let rubs = out.laws.iter().any(ContactLaws::rubs);
        let reason = reason_of(deck, &out);
        if rubs {
            self.reason(FRICTION, true, "`friction` in [[contact]]");
        } else if deck.effects.allow(EffectWord::Friction) {
            self.reason(FRICTION, false, "no `friction` in [[contact]]");
        } else {
            self.reason(FRICTION, false, super::SWITCHED_OFF);
        }
        let out = Arc::new(out);
        self.reason(NAME, true, reason);
        self.out.contacts = Some(out.clone());
        self.out.effects.push(out);
    }

    /// The slots of displacement of nodes that joints connect.
    fn connected(&self, connections: &[FoundJoint]) -> Vec<[Slot; 2]> {
        let slots = |joint: &FoundJoint| {
            let [a, b] = joint.nodes;
            Some([a?, b?].map(|node| self.mesh.nodes[node].node.u))
        };
        connections.iter().filter_map(slots).collect()
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    fn surface(&mut self, table: &deck::Surface) -> Option<SceneSurface> {
        let surface = match surfaces::surface(self.deck, table) {
            Ok(surface) => surface,
            Err(diagnostic) => {
                self.report(diagnostic);
                return None;
            }
        };
        let carrier = self.carrier(table)?;
        Some(SceneSurface { name: table.name.value.clone(), surface, carrier })
    }

    fn carrier(&mut self, table: &deck::Surface) -> Option<SurfaceCarrier> {
        if let Some(on) = &table.on {
            let (node, _) = self.node(on)?;
            let node = self.mesh.nodes[node];
            return Some(SurfaceCarrier::Node { node: node.node, place: node.place });
        }
        match &table.motion {
            None => Some(SurfaceCarrier::Ground),
            Some(SurfaceMotion::Shift(shift)) => {
                let shift = Vec3(*shift);
                let direction = shift.normalized().unwrap_or(Vec3::UNIT[0]);
                let amplitude = self.motion_of_surface(table, shift.norm())?;
                Some(SurfaceCarrier::Shift { direction, amplitude })
            }
            Some(SurfaceMotion::Turn { axis, about, angle }) => {
                let about = names::place(self.deck, about).map_err(|diagnostic| self.report(diagnostic)).ok()?;
                let amplitude = self.motion_of_surface(table, *angle)?;
                Some(SurfaceCarrier::Turn { about, axis: Vec3(*axis), amplitude })
            }
        }
    }

    /// The number of the amplitude of a surface that moves by `full`.
    fn motion_of_surface(&mut self, table: &deck::Surface, full: f64) -> Option<usize> {
        let found = crate::scene::constraints::find_history(self.deck, self.histories, table.history.as_ref());
        let history = found.map_err(|diagnostic| self.diagnostics.push(diagnostic)).ok()?;
        self.out.amplitudes.push(Amplitude::of_motion(full, history, stage_set(table.stages.as_ref())));
        let number = self.out.amplitudes.len() - 1;
        self.out.driven.push(DrivenTable {
            drives: Driven::Amplitude(number),
            what: "motion of a surface",
            span: table.span.clone(),
            history: table.history.clone(),
        });
        Some(number)
    }

    fn add_contact(
        &mut self,
        contact: &deck::Contact,
        surfaces: &[Option<SceneSurface>],
        out: &mut SurfaceContacts,
        pairs: &mut PairParts,
    ) {
        let number = out.laws.len();
        self.refuse_unused_radii(contact);
        let parties = self.parties(contact, number);
        let with: Vec<Strand> = contact.with.iter().filter_map(|name| self.beam_named(contact, name, number)).collect();
        let radius = parties.iter().chain(&with).map(|party| party.radius).fold(f64::INFINITY, f64::min);
        let laws = self.laws_of(contact, radius);
        out.laws.push(laws);
        for name in &contact.surfaces {
            let Some(surface) = self.deck.surfaces.iter().position(|surface| surface.name.value == name.value) else {
                let known = self.deck.surfaces.iter().map(|surface| surface.name.value.as_str());
                self.report(unknown("surface", name, known));
                continue;
            };
            let carrier = surfaces[surface].as_ref().and_then(SceneSurface::carrier_node);
            for party in &parties {
                if carrier.is_some_and(|carrier| party.nodes.iter().any(|node| node.node.u == carrier.u)) {
                    let message = format!("the surface `{}` is carried by a node that would touch it", name.value);
                    self.report(Diagnostic::error(message, name.span.clone()));
                    continue;
                }
                out.chains.push(Chain { surface, strand: party.clone() });
            }
        }
        self.warn_of_blocked_tubes(contact, surfaces, radius);
        self.add_meetings(contact, parties, with, pairs);
    }

    /// Tubes that part: a beam that must stay within both goes into neither branch.
    fn warn_of_blocked_tubes(&mut self, contact: &deck::Contact, surfaces: &[Option<SceneSurface>], radius: f64) {
        let named = |name: &Spanned<String>| {
            surfaces
                .iter()
                .flatten()
                .find(|surface| surface.name == name.value)
                .map(|surface| (surface, name.span.clone()))
        };
        let of_contact: Vec<_> = contact.surfaces.iter().filter_map(named).collect();
        for (k, (second, span)) in of_contact.iter().enumerate() {
            for (first, _) in &of_contact[..k] {
                if let (Some(place), Some(_)) = (first.leaves(second, radius), second.leaves(first, radius)) {
                    let [x, y, z] = place.0;
                    let message = format!(
                        "the tubes `{}` and `{}` part near [{x:.4}, {y:.4}, {z:.4}], and what touches both must stay within \
                         both: it can go into neither branch",
                        first.name, second.name
                    );
                    let help = "a vessel with branches is one surface: a closed mesh, or a [[contact]] for each branch \
                                with its own `stages`";
                    let warning = Diagnostic::warning(WarningKind::BlockedTubes, message, span.clone()).help(help);
                    self.report(warning);
                }
            }
        }
    }

    /// The laws of a contact whose thinnest party has this radius.
    fn laws_of(&mut self, contact: &deck::Contact, radius: f64) -> ContactLaws {
        let of_radius = PENETRATION * radius;
        let of_radius = if of_radius.is_finite() { of_radius } else { 1.0 };
        let penetration = contact.penetration.unwrap_or(of_radius);
        ContactLaws {
            name: contact.name.value.clone(),
            friction: contact.friction,
            stick: contact.stick,
            penetration,
            least_penetration: contact.penetration.unwrap_or(LEAST_PENETRATION * of_radius),
            damping: match contact.damping {
                ContactDamping::Factor(damping) => damping,
                ContactDamping::Restitution { restitution, speed } => {
                    damping_of(restitution, speed).unwrap_or_default()
                }
            },
            amplitude: self.switch(contact.stages.as_ref()),
        }
    }

    /// Adds the meetings of a contact: beams with other beams, and with themselves.
    fn add_meetings(&self, contact: &deck::Contact, own: Vec<Strand>, with: Vec<Strand>, pairs: &mut PairParts) {
        if with.is_empty() && !contact.touches_itself {
            return;
        }
        let first = pairs.beams.len();
        let second = first + own.len();
        let end = second + with.len();
        let name = |strand: &Strand| strand.beam.map_or(String::new(), |beam| self.mesh.beams[beam].name.clone());
        // A stiffness of the deck is that of a point: of two beams in series.
        let of_each = if contact.stiffness.is_some() { 2.0 } else { 1.0 };
        for mut strand in own.into_iter().chain(with) {
            for stiffness in &mut strand.stiffness {
                stiffness.augmented *= of_each;
                stiffness.penalty *= of_each;
            }
            pairs.beams.push((name(&strand), strand));
        }
        for a in first..second {
            pairs.meetings.extend((second..end).map(|b| Meeting { strands: [a, b] }));
            if contact.touches_itself {
                pairs.meetings.push(Meeting { strands: [a, a] });
            }
        }
    }

    /// A beam of contact number `own`.
    fn beam_named(&mut self, contact: &deck::Contact, name: &Spanned<String>, own: usize) -> Option<Strand> {
        let Some(number) = self.mesh.beams.number(&name.value) else {
            self.diagnostics.extend(unknown_beam(self.deck, name));
            return None;
        };
        let radius = self.radius(contact, name, Some(&self.mesh.beams[number]))?;
        Some(self.beam_party(contact, own, number, radius))
    }

    /// The beams and nodes of contact number `own`.
    fn parties(&mut self, contact: &deck::Contact, own: usize) -> Vec<Strand> {
        let mut parties: Vec<Strand> =
            contact.beams.iter().filter_map(|name| self.beam_named(contact, name, own)).collect();
        for name in &contact.nodes {
            let Some((node, _)) = self.node(name) else { continue };
            let radius = self.radius(contact, name, None);
            let stiffness = self.stiffness_at(contact, node);
            if stiffness.is_none() {
                let message = format!("the contact of node `{}` needs `stiffness`: no beam gives one", name.value);
                let help = "`stiffness` is the force per penetration of a point";
                self.report(Diagnostic::error(message, contact.span.clone()).help(help));
            }
            let (Some(radius), Some(stiffness)) = (radius, stiffness) else { continue };
            let placed = self.mesh.nodes[node];
            parties.push(Strand {
                contact: own,
                beam: None,
                radius,
                length: 0.0,
                nodes: vec![ChainNode { node: placed.node, place: placed.place, fraction: 0.0 }],
                order: 0,
                stiffness: vec![stiffness],
                has_caps: true,
            });
        }
        parties
    }

    fn refuse_unused_radii(&mut self, contact: &deck::Contact) {
        let ContactRadius::Each(radii) = &contact.radius else { return };
        let named = contact.beams.iter().chain(&contact.nodes).chain(&contact.with);
        let all: Vec<&str> = named.map(|name| name.value.as_str()).collect();
        for (name, _) in radii.iter().filter(|(name, _)| !all.contains(&name.value.as_str())) {
            self.report(unknown("beam or node of this contact", name, all.iter().copied()));
        }
    }

    /// The radius of a beam or a node in contact.
    fn radius(&mut self, contact: &deck::Contact, name: &Spanned<String>, beam: Option<&MeshBeam>) -> Option<f64> {
        let found = match &contact.radius {
            ContactRadius::One(radius) => Some(*radius),
            ContactRadius::Each(radii) => {
                radii.iter().find(|(known, _)| known.value == name.value).map(|(_, radius)| *radius)
            }
            ContactRadius::OfSections => beam.and_then(|beam| radius_of_sections(self.deck, &beam.name)),
        };
        if found.is_none() {
            let message = format!("the contact needs a `radius` for `{}`", name.value);
            let help = "only beams with one section of shape = \"circle\" or \"tube\" about their line have a radius of \
                        their own";
            self.report(Diagnostic::error(message, contact.span.clone()).help(help));
        }
        found
    }

    fn beam_party(&self, contact: &deck::Contact, own: usize, number: usize, radius: f64) -> Strand {
        let beam = &self.mesh.beams[number];
        let node = |(&node, &fraction): (&usize, &f64)| {
            let placed = self.mesh.nodes[node];
            ChainNode { node: placed.node, place: placed.place, fraction }
        };
        Strand {
            contact: own,
            beam: Some(number),
            radius,
            length: beam.line.length,
            nodes: beam.nodes.iter().zip(&beam.fractions).map(node).collect(),
            order: beam.order,
            stiffness: (0..beam.elements.len()).map(|k| self.stiffness_of(contact, beam, k)).collect(),
            has_caps: contact.ends == EndsWord::Round,
        }
    }

    /// The stiffness of contacts of element `k` of a beam.
    fn stiffness_of(&self, contact: &deck::Contact, beam: &MeshBeam, k: usize) -> ContactStiffness {
        let [from, to] = [beam.fractions[k * beam.order], beam.fractions[(k + 1) * beam.order]];
        let section = beam.section.at(0.5 * (from + to));
        let width = beam.line.length * (to - from) / beam.order as f64;
        let extension = section.stiffness[0][0] / width;
        if let Some(stiffness) = contact.stiffness {
            return ContactStiffness { augmented: stiffness.min(STIFFEST * extension), penalty: stiffness };
        }
        let bending = section.stiffness[4][4].min(section.stiffness[5][5]) / (width * width * width);
        let mass = section.mass.map_or(0.0, |mass| mass.mass) * width;
        let resolved = match shortest_step(self.deck) {
            Some(step) if mass > 0.0 => mass * (PI / (STEPS_OF_CONTACT * step)).powi(2),
            Some(_) | None => f64::INFINITY,
        };
        ContactStiffness {
            augmented: OF_BENDING * bending + OF_EXTENSION * extension,
            penalty: extension.min(resolved),
        }
    }

    /// The stiffness of contacts of a node: that of the deck, or of a beam there.
    fn stiffness_at(&self, contact: &deck::Contact, node: usize) -> Option<ContactStiffness> {
        if let Some(stiffness) = contact.stiffness {
            return Some(ContactStiffness { augmented: stiffness, penalty: stiffness });
        }
        self.mesh.beams.iter().find_map(|beam| {
            let number = beam.nodes.iter().position(|&known| known == node)?;
            Some(self.stiffness_of(contact, beam, (number / beam.order).min(beam.elements.len() - 1)))
        })
    }
}

/// The shortest time step that dynamic stages of a deck begin with.
fn shortest_step(deck: &Deck) -> Option<f64> {
    let step = |stage: &Stage| if let StageBody::Dynamic { step, .. } = stage.body { Some(step) } else { None };
    let steps = deck.stages.iter().filter_map(step);
    steps.min_by(f64::total_cmp)
}

/// The radius of a beam whose sections are equal circles or tubes about its line.
fn radius_of_sections(deck: &Deck, beam: &str) -> Option<f64> {
    let beam = deck.beams.named(beam)?;
    if !path::along(beam, beam.offset.as_ref()).is_zero() {
        return None;
    }
    let radius = |name: &Spanned<String>| {
        let section = deck.sections.named(&name.value)?;
        let SectionBody::Computed(body) = &section.body else { return None };
        let (shape, _) = body.solid_without_mesh()?;
        match shape {
            Shape::Circle { radius } | Shape::Tube { radius, .. } => {
                (body.place_of_solid() == [0.0; 2]).then_some(radius)
            }
            Shape::Rectangle { .. } => None,
        }
    };
    let radii: Option<Vec<f64>> = beam.sections.iter().map(radius).collect();
    let radii = radii?;
    radii.iter().all(|radius| *radius == radii[0]).then_some(radii[0])
}
