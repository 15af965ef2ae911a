//! The reason of contacts that `check` tells: the pairs that may touch, and those that pass through each other.

use crate::deck::{self, Deck, Spanned};
use beamsim_core::effect::contact::SurfaceContacts;
use std::collections::BTreeSet;

/// Pairs of beams that are named in the reason of contacts, at most.
const NAMED_PAIRS: usize = 6;

/// Names in all contacts up to which pairs without a contact are listed.
const MOST_PARTIES: usize = 64;

/// The reason of contacts, with what may touch what.
pub(super) fn reason_of(deck: &Deck, out: &SurfaceContacts) -> String {
    let with_surfaces = deck.contacts.iter().filter(|contact| !contact.surfaces.is_empty());
    let meets = |contact: &deck::Contact| {
        let parties = listed(contact.beams.iter().chain(&contact.nodes));
        format!("{parties} with {}", listed(contact.surfaces.iter()))
    };
    let mut parts: Vec<String> = with_surfaces.map(meets).take(NAMED_PAIRS).collect();
    let elements: usize = out.chains.iter().map(|chain| chain.elements()).sum();
    if elements > 0 {
        parts.push(format!("{elements} pair(s) of an element or a body with a surface in all"));
    }
    if !out.pairs.is_empty() {
        let meets = |[a, b]: [&str; 2]| if a == b { format!("{a} with itself") } else { format!("{a} with {b}") };
        let mut named: Vec<String> = out.pairs.names().take(NAMED_PAIRS).map(meets).collect();
        if out.pairs.len() > NAMED_PAIRS {
            named.push(format!("{} more pairs of beams", out.pairs.len() - NAMED_PAIRS));
        }
        let named = named.join(", ");
        let count = out.pairs.element_pairs();
        parts.push(format!(
            "{named}: {count} pair(s) of elements (not those near each other along a beam, or near a node that they \
             share or a joint)"
        ));
    }
    let idle = idle_names(deck);
    if !idle.is_empty() {
        parts.push(format!("no [[contact]] names {}", listed(idle.into_iter())));
    }
    parts.extend(apart(deck));
    format!("{} [[contact]] table(s): {}", deck.contacts.len(), parts.join("; "))
}

/// Names one after the other, the first of many.
fn listed<'a>(names: impl Iterator<Item = &'a Spanned<String>>) -> String {
    let names: Vec<&str> = names.map(|name| name.value.as_str()).collect();
    let more = names.len().saturating_sub(NAMED_PAIRS);
    let shown = names[..names.len() - more].join(", ");
    if more == 0 { shown } else { format!("{shown} and {more} more") }
}

/// Beams, bodies and surfaces that touch nothing, since no contact names them.
fn idle_names(deck: &Deck) -> Vec<&Spanned<String>> {
    let of_contact = |contact: &deck::Contact| {
        let parties = [&contact.beams, &contact.nodes, &contact.with, &contact.surfaces].into_iter().flatten();
        parties.map(|name| name.value.clone()).collect::<Vec<_>>()
    };
    let named: Vec<String> = deck.contacts.iter().flat_map(of_contact).collect();
    let beams = deck.beams.iter().map(|beam| &beam.name);
    let bodies = deck.bodies.iter().map(|body| &body.at);
    // A body that carries a surface touches with that.
    let carriers: Vec<&str> =
        deck.surfaces.iter().filter_map(|surface| Some(surface.on.as_ref()?.value.as_str())).collect();
    let bodies = bodies.filter(|body| !carriers.contains(&body.value.as_str()));
    let surfaces = deck.surfaces.iter().map(|surface| &surface.name);
    beams.chain(bodies).chain(surfaces).filter(|name| !named.contains(&name.value)).collect()
}

/// Beams, bodies and surfaces that contacts name.
#[derive(Default)]
struct Parties<'a> {
    beams: Vec<&'a str>,
    bodies: Vec<&'a str>,
    surfaces: Vec<&'a str>,
    /// Pairs that some contact names, in both orders
    met: BTreeSet<[&'a str; 2]>,
}

impl<'a> Parties<'a> {
    fn of(deck: &'a Deck) -> Self {
        fn values(names: &[Spanned<String>]) -> impl Iterator<Item = &str> {
            names.iter().map(|name| name.value.as_str())
        }
        fn add<'a>(all: &mut Vec<&'a str>, names: impl Iterator<Item = &'a str>) {
            names.for_each(|name| {
                if !all.contains(&name) {
                    all.push(name);
                }
            });
        }
        let mut out = Self::default();
        for contact in &deck.contacts {
            for own in values(&contact.beams).chain(values(&contact.nodes)) {
                let others = values(&contact.with).chain(values(&contact.surfaces));
                out.met.extend(others.flat_map(|other| [[own, other], [other, own]]));
            }
            if contact.touches_itself {
                out.met.extend(values(&contact.beams).map(|own| [own, own]));
            }
            add(&mut out.beams, values(&contact.beams).chain(values(&contact.with)));
            add(&mut out.bodies, values(&contact.nodes));
            add(&mut out.surfaces, values(&contact.surfaces));
        }
        // A body does not touch the surface that it carries.
        let carried = deck.surfaces.iter().filter_map(|table| Some([table.on.as_ref()?, &table.name]));
        out.met.extend(carried.map(|pair| pair.map(|name| name.value.as_str())));
        out
    }

    /// Pairs of a beam and another one or itself, and of a beam or body and a surface, that no contact names.
    fn apart(&self) -> Vec<[&'a str; 2]> {
        let Self { beams, bodies, surfaces, met } = self;
        let among_beams = beams.iter().enumerate().flat_map(|(k, a)| beams[k..].iter().map(move |b| [*a, *b]));
        let parties = beams.iter().chain(bodies);
        let with_surfaces = parties.flat_map(|party| surfaces.iter().map(move |surface| [*party, *surface]));
        among_beams.chain(with_surfaces).filter(|pair| !met.contains(pair)).collect()
    }
}

/// The pairs of parties that pass through each other, since no contact names both; none where all pairs are named, or
/// there are so many parties that their pairs are beyond a list.
fn apart(deck: &Deck) -> Option<String> {
    let counted = |contact: &deck::Contact| {
        contact.beams.len() + contact.nodes.len() + contact.with.len() + contact.surfaces.len()
    };
    if deck.contacts.iter().map(counted).sum::<usize>() > MOST_PARTIES {
        return None;
    }
    let parties = Parties::of(deck);
    let pairs = parties.apart();
    let named = |[a, b]: &[&str; 2]| if a == b { format!("{a} and itself") } else { format!("{a} and {b}") };
    let mut shown: Vec<String> = pairs.iter().take(NAMED_PAIRS).map(named).collect();
    if pairs.len() > NAMED_PAIRS {
        shown.push(format!("{} more pairs", pairs.len() - NAMED_PAIRS));
    }
    if parties.bodies.len() > 1 {
        shown.push("bodies and each other (spheres of `nodes` touch surfaces alone)".into());
    }
    (!shown.is_empty()).then(|| format!("no contact, as no [[contact]] names both: {}", shown.join(", ")))
}
