//! `[effects]`: what is forced on or off instead of letting the scene decide.

use super::reader::Table;
use super::{Span, Spanned};

/// What can be forced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffectWord {
    /// Simulation in the plane of a planar scene
    Planar,
    /// Inertia of sections against rotation
    RotaryInertia,
    /// Forces that rotations have from their spin alone: gyroscopic and centrifugal ones
    Gyroscopic,
    /// Shear of sections against the centre line
    Shear,
    /// Stretch of the centre line
    Extension,
    /// Dampers of every kind
    Damping,
    /// Weight
    Gravity,
    /// What following loads bring to the tangent
    FollowerTangent,
    /// What stress brings to the tangent of beams
    GeometricStiffness,
    /// All that is not linear in the displacements
    LargeRotations,
}

impl EffectWord {
    /// All of them
    pub const ALL: [Self; 10] = [
        Self::Planar,
        Self::RotaryInertia,
        Self::Gyroscopic,
        Self::Shear,
        Self::Extension,
        Self::Damping,
        Self::Gravity,
        Self::FollowerTangent,
        Self::GeometricStiffness,
        Self::LargeRotations,
    ];

    /// Its key
    pub fn key(self) -> &'static str {
        match self {
            Self::Planar => "planar",
            Self::RotaryInertia => "rotary_inertia",
            Self::Gyroscopic => "gyroscopic",
            Self::Shear => "shear",
            Self::Extension => "extension",
            Self::Damping => "damping",
            Self::Gravity => "gravity",
            Self::FollowerTangent => "follower_tangent",
            Self::GeometricStiffness => "geometric_stiffness",
            Self::LargeRotations => "large_rotations",
        }
    }
}

/// What the table says.
#[derive(Clone, Debug, Default)]
pub struct Effects {
    forced: Vec<(EffectWord, Spanned<bool>)>,
}

impl Effects {
    pub(super) fn read(top: &Table) -> Self {
        let Some(item) = top.get("effects") else { return Self::default() };
        let keys = EffectWord::ALL.map(EffectWord::key);
        let Some(table) = Table::new(top.context, item, "[effects]", &keys) else { return Self::default() };
        let forced = |word: EffectWord| {
            let value = table.flag(word.key())?;
            Some((word, Spanned { value, span: table.key_span(word.key()) }))
        };
        Self { forced: EffectWord::ALL.into_iter().filter_map(forced).collect() }
    }

    /// What is said of an effect, and where.
    pub fn said(&self, word: EffectWord) -> Option<&Spanned<bool>> {
        self.forced.iter().find(|(known, _)| *known == word).map(|(_, said)| said)
    }

    /// Whether an effect is not switched off.
    pub fn allow(&self, word: EffectWord) -> bool {
        self.said(word).is_none_or(|said| said.value)
    }

    /// Forces an effect.
    pub fn force(&mut self, word: EffectWord, value: bool) {
        self.forced.retain(|(known, _)| *known != word);
        self.forced.push((word, Spanned { value, span: Span::default() }));
    }
}
