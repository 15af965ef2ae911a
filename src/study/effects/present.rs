//! The effects that a scene has.

use crate::deck::{self, Damping, Deck, EffectWord, SpringBody};
use crate::scene::Scene;

/// The names of an effect in the reasons of a scene. Dampers have none: they are found in the
/// tables of the deck.
pub(super) fn names(word: EffectWord) -> &'static [&'static str] {
    match word {
        EffectWord::Planar => &["planar"],
        EffectWord::RotaryInertia => &["rotary inertia", "section inertia at nodes"],
        EffectWord::Gyroscopic => &["gyroscopic forces"],
        EffectWord::Shear => &["shear"],
        EffectWord::Extension => &["extension"],
        EffectWord::TorsionCoupling => &["torsion coupling"],
        EffectWord::Damping => &[],
        EffectWord::Gravity => &["gravity on beams", "gravity on bodies"],
        EffectWord::FollowerTangent => &["follower tangent"],
        EffectWord::GeometricStiffness => &["geometric stiffness"],
        EffectWord::Contact => &["contact"],
        EffectWord::Friction => &["friction of contacts"],
        EffectWord::LargeRotations => &["large rotations"],
    }
}

/// True if an effect acts in a scene.
pub(super) fn acts(word: EffectWord, deck: &Deck, scene: &Scene) -> bool {
    let named = scene.reasons.iter().any(|reason| reason.active && names(word).contains(&reason.name));
    named || (word == EffectWord::Damping && is_damped(deck))
}

fn is_damped(deck: &Deck) -> bool {
    let sprung = |spring: &deck::Spring| match spring.body {
        SpringBody::Ground { damping, .. } => damping != [0.0; 6],
        SpringBody::Between { damping, .. } => damping != 0.0,
    };
    deck.damping.is_some_and(|damping| damping != Damping::NONE)
        || deck.springs.iter().any(sprung)
        || deck.joints.iter().any(|joint| joint.damping != 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::Words;

    /// An effect whose name no scene has would always be absent.
    #[test]
    fn scenes_have_every_name() {
        let text = include_str!("../../../decks/robot_arm.toml");
        let (scene, _) = crate::scene::from_text(text).unwrap();
        for name in EffectWord::values().flat_map(names) {
            assert!(scene.reasons.iter().any(|reason| reason.name == *name), "{name}");
        }
    }
}
