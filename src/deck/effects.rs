//! `[effects]`: effects that are forced on or off instead of letting the scene decide.

use super::reader::Table;
use super::words::{Words, words};
use super::{Span, Spanned};

words! {
    /// Keys of `[effects]`.
    pub enum EffectWord {
        /// Simulation in the plane of a planar scene
        Planar = "planar",
        /// Inertia of sections against rotation
        RotaryInertia = "rotary_inertia",
        /// Forces that rotations have from their spin alone: gyroscopic and centrifugal ones
        Gyroscopic = "gyroscopic",
        /// Shear of sections against the centre line
        Shear = "shear",
        /// Stretch of the centre line
        Extension = "extension",
        /// What couples the torsion of sections with their other strains
        TorsionCoupling = "torsion_coupling",
        /// Dampers of every kind
        Damping = "damping",
        /// Weight
        Gravity = "gravity",
        /// The tangent of following loads
        FollowerTangent = "follower_tangent",
        /// The tangent of stress in beams
        GeometricStiffness = "geometric_stiffness",
        /// Contacts with surfaces
        Contact = "contact",
        /// Friction of contacts
        Friction = "friction",
        /// All that is not linear in the displacements
        LargeRotations = "large_rotations",
    }
}

impl EffectWord {
    /// The key of an effect.
    pub fn key(self) -> &'static str {
        self.word()
    }
}

/// `[effects]`
#[derive(Clone, Debug, Default)]
pub struct Effects {
    forced: Vec<(EffectWord, Spanned<bool>)>,
}

impl Effects {
    pub(super) fn read(top: &Table) -> Self {
        let Some(item) = top.get("effects") else { return Self::default() };
        let keys: Vec<&'static str> = EffectWord::words().collect();
        let Some(table) = Table::new(top.context, item, "[effects]", &keys) else { return Self::default() };
        let forced = |word: EffectWord| {
            let value = table.flag(word.word())?;
            Some((word, Spanned { value, span: table.key_span(word.word()) }))
        };
        Self { forced: EffectWord::values().filter_map(forced).collect() }
    }

    /// The value that the deck gives an effect, with its place; none where it leaves it out.
    pub fn said(&self, word: EffectWord) -> Option<&Spanned<bool>> {
        self.forced.iter().find(|(known, _)| *known == word).map(|(_, said)| said)
    }

    /// True unless an effect is switched off.
    pub fn allow(&self, word: EffectWord) -> bool {
        self.said(word).is_none_or(|said| said.value)
    }

    /// Forces an effect.
    pub fn force(&mut self, word: EffectWord, value: bool) {
        self.forced.retain(|(known, _)| *known != word);
        self.forced.push((word, Spanned { value, span: Span::default() }));
    }
}
