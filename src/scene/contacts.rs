//! Checks of contacts before their mechanics is built.

use crate::deck::{Contact, Deck, Diagnostic, EffectWord, StageBody};
use std::collections::HashMap;

/// Refuses contacts that no stage can treat, and names that are given twice.
pub fn check(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    refuse_shared_names(deck, diagnostics);
    refuse_shared_pairs(deck, diagnostics);
    if deck.contacts.is_empty() || !deck.effects.allow(EffectWord::Contact) {
        return;
    }
    if !deck.effects.allow(EffectWord::LargeRotations) {
        let span = deck.contacts[0].span.clone();
        diagnostics.push(Diagnostic::error("large_rotations = false does not support [[contact]]", span));
    }
    for (number, stage) in deck.stages.iter().enumerate() {
        let Some(contact) = deck
            .contacts
            .iter()
            .find(|contact| contact.stages.as_ref().is_none_or(|stages| stages.contains(&(number + 1))))
        else {
            continue;
        };
        let looks = !stage.body.kind().advances_state();
        let is_supported = matches!(stage.body, StageBody::Static { .. } | StageBody::Dynamic { .. });
        if is_supported || (looks && !rubs(deck)) {
            continue;
        }
        let what = if looks { "[[contact]] with friction" } else { "[[contact]]" };
        let message = format!("{} does not support {what}", stage.body.in_words());
        let diagnostic = Diagnostic::error(message, stage.span.clone());
        let help = format!("give `{}` the `stages` in which it acts, without this one", contact.name.value);
        diagnostics.push(diagnostic.help(help).context(contact.name.span.clone(), "this contact"));
    }
}

/// Two parties that a contact lets touch, by their names.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Pair<'a> {
    /// A beam on a surface
    BeamOnSurface(&'a str, &'a str),
    /// A node on a surface
    NodeOnSurface(&'a str, &'a str),
    /// Two beams, in the order of their names
    Beams(&'a str, &'a str),
    /// A beam on itself
    Itself(&'a str),
}

impl Pair<'_> {
    fn in_words(self) -> String {
        match self {
            Self::BeamOnSurface(a, b) | Self::NodeOnSurface(a, b) | Self::Beams(a, b) => format!("`{a}` and `{b}`"),
            Self::Itself(beam) => format!("`{beam}` with itself"),
        }
    }
}

/// The pairs of a contact.
fn pairs(contact: &Contact) -> Vec<Pair<'_>> {
    let [beams, nodes, surfaces, with] = [&contact.beams, &contact.nodes, &contact.surfaces, &contact.with]
        .map(|list| list.iter().map(|name| name.value.as_str()).collect::<Vec<_>>());
    let mut all = Vec::new();
    for &surface in &surfaces {
        all.extend(beams.iter().map(|beam| Pair::BeamOnSurface(beam, surface)));
        all.extend(nodes.iter().map(|node| Pair::NodeOnSurface(node, surface)));
    }
    for &beam in &beams {
        all.extend(with.iter().map(|&other| Pair::Beams(beam.min(other), beam.max(other))));
        all.extend(contact.touches_itself.then_some(Pair::Itself(beam)));
    }
    all
}

/// Refuses two contacts of one pair in one stage: each would push.
fn refuse_shared_pairs(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let acts_in =
        |contact: &Contact, stage: usize| contact.stages.as_ref().is_none_or(|stages| stages.contains(&stage));
    let meet = |a: &Contact, b: &Contact| (1..=deck.stages.len()).any(|stage| acts_in(a, stage) && acts_in(b, stage));
    let mut known: HashMap<Pair, Vec<&Contact>> = HashMap::new();
    for contact in &deck.contacts {
        let mut twice = None;
        for pair in pairs(contact) {
            let others = known.entry(pair).or_default();
            twice = twice.or_else(|| others.iter().find(|other| meet(other, contact)).map(|other| (pair, *other)));
            others.push(contact);
        }
        let Some((pair, other)) = twice else { continue };
        let message = format!("the contact of {} is in two [[contact]] tables: it would count double", pair.in_words());
        let diagnostic = Diagnostic::error(message, contact.name.span.clone());
        let diagnostic = diagnostic.context(other.name.span.clone(), "the other one");
        diagnostics.push(diagnostic.help("leave it out of one, or give the two different `stages`"));
    }
}

/// True if some contact has friction.
fn rubs(deck: &Deck) -> bool {
    let allowed = deck.effects.allow(EffectWord::Friction);
    allowed && deck.contacts.iter().any(|contact| contact.friction != [0.0; 2])
}

/// Columns begin with the name of a point, a beam or a contact, which must be told apart.
fn refuse_shared_names(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    for (k, contact) in deck.contacts.iter().enumerate() {
        let name = &contact.name.value;
        let points = deck.points.iter().map(|(point, _)| ("point", point));
        let beams = deck.beams.iter().map(|beam| ("beam", &beam.name));
        let contacts = deck.contacts[..k].iter().map(|other| ("contact", &other.name));
        let Some((kind, other)) = points.chain(beams).chain(contacts).find(|(_, other)| other.value == *name) else {
            continue;
        };
        let message = format!("the contact `{name}` has the name of a {kind}: columns could not be told apart");
        let diagnostic = Diagnostic::error(message, contact.name.span.clone());
        diagnostics.push(diagnostic.context(other.span.clone(), format!("this {kind}")));
    }
}
