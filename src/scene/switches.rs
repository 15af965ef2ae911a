//! `[effects]`: tables that are switched off are taken out of the deck before the scene is built.

use crate::deck::{ContactDamping, Deck, Diagnostic, EffectWord, SchemeWord, SpringBody, StageBody};
use std::borrow::Cow;

/// The deck without what is switched off and stands in tables of its own.
pub fn deck(deck: &Deck) -> Cow<'_, Deck> {
    let [gravity, damping] = [EffectWord::Gravity, EffectWord::Damping].map(|word| deck.effects.allow(word));
    let friction = deck.effects.allow(EffectWord::Friction);
    if gravity && damping && friction {
        return Cow::Borrowed(deck);
    }
    let mut deck = deck.clone();
    if !gravity {
        deck.gravity = None;
    }
    if !damping {
        take_dampers_out(&mut deck);
    }
    if !friction {
        deck.contacts.iter_mut().for_each(|contact| contact.friction = [0.0; 2]);
    }
    Cow::Owned(deck)
}

fn take_dampers_out(deck: &mut Deck) {
    deck.damping = None;
    deck.joints.iter_mut().for_each(|joint| joint.damping = 0.0);
    for spring in &mut deck.springs {
        match &mut spring.body {
            SpringBody::Ground { damping, .. } => *damping = [0.0; 6],
            SpringBody::Between { damping, .. } => *damping = 0.0,
        }
    }
    deck.contacts.iter_mut().for_each(|contact| contact.damping = ContactDamping::Factor(0.0));
}

/// Refuses effects that cannot be switched off in the stages of the deck.
pub fn refuse_impossible(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let linear = !deck.effects.allow(EffectWord::LargeRotations);
    let tangents = [EffectWord::GeometricStiffness, EffectWord::FollowerTangent];
    let incomplete = tangents.into_iter().find(|&word| !deck.effects.allow(word));
    let mut moved = false;
    for stage in &deck.stages {
        let looks = !stage.body.kind().advances_state();
        if let (true, Some(word)) = (looks, incomplete) {
            let message = format!("{} = false removes part of the tangent, which this stage needs", word.key());
            diagnostics.push(Diagnostic::error(message, stage.span.clone()));
        }
        if !linear {
            continue;
        }
        let why = match stage.body {
            StageBody::Path { .. } => "control = \"arc_length\" needs a nonlinear stage",
            StageBody::Dynamic { scheme: SchemeWord::LieGeneralizedAlpha(_), .. } => {
                "lie_generalized_alpha needs large rotations"
            }
            StageBody::Modal { .. } | StageBody::Buckling { .. } => {
                if !moved {
                    continue;
                }
                "this stage linearises the full nonlinear model about the state reached"
            }
            StageBody::Static { .. } | StageBody::Dynamic { .. } => {
                moved = true;
                continue;
            }
        };
        let message = format!("large_rotations = false makes static and dynamic stages linear, but {why}");
        diagnostics.push(Diagnostic::error(message, stage.span.clone()));
    }
}
