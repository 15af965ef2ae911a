//! Checks of contacts before their mechanics is built.

use crate::deck::{Deck, Diagnostic, EffectWord, StageBody};

/// Refuses contacts that no stage can treat, and names that are given twice.
pub fn check(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    refuse_shared_names(deck, diagnostics);
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
