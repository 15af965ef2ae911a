//! Kinds of joints, one row of data each. Nothing else in the code knows one kind from another: a
//! new kind is a row here, and its word in the deck's JSON Schema.

use std::fmt;

/// A pair of axes, the first carried by A and the second by B, that stay normal to each other.
pub type NormalPair = (usize, usize);

/// A coordinate of a joint: how far B has turned about e_1, or slid along it, as seen from A.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreeCoordinate {
    /// The angle about e_1
    Angle,
    /// The displacement along e_1
    Slide,
}

impl FreeCoordinate {
    /// The coordinate's name in the deck: the key of a motor.
    pub fn word(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Slide => "displacement",
        }
    }
}

/// A joint to ground that sits at its node, without arms: held components of the node's own
/// unknowns do most of its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroundHold {
    /// Held displacements along e_1, e_2, e_3 and held components of the rotation vector along
    /// these axes. Two held components make a hinge.
    pub components: [bool; 6],
    /// Pairs that no held component keeps normal, and that need multipliers
    pub normal: &'static [NormalPair],
}

/// A kind of joint. The joint's axes are e_1, e_2, e_3; the deck gives none of them, e_1, or e_1
/// and e_2.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct JointKind {
    /// The deck's word
    pub word: &'static str,
    /// How many axes the deck gives
    pub axes: usize,
    /// Axes of A along which B does not slide
    pub held: [bool; 3],
    /// Pairs of axes that stay normal
    pub normal: &'static [NormalPair],
    /// The holds of a joint to ground at its node
    pub ground: GroundHold,
    /// The coordinate on which a spring, a damper or a motor may act
    pub driven: Option<FreeCoordinate>,
}

/// B does not slide: both ends stay at one point.
const POINT: [bool; 3] = [true; 3];

/// B slides along e_1 of A only.
const ACROSS: [bool; 3] = [false, true, true];

/// B turns about e_1 only, which both carry.
const HINGE: &[NormalPair] = &[(0, 1), (0, 2)];

/// B does not turn.
const LOCKED: &[NormalPair] = &[(0, 1), (1, 2), (2, 0)];

/// Held components do all the work of a joint to ground.
const fn by_components(components: [bool; 6]) -> GroundHold {
    GroundHold { components, normal: &[] }
}

impl JointKind {
    /// All kinds, in the order in which messages list them.
    #[rustfmt::skip]
    pub const ALL: [Self; 6] = [
        // All rotations are free.
        Self {
            word: "spherical", axes: 0, held: POINT, normal: &[], driven: None,
            ground: by_components([true, true, true, false, false, false]),
        },
        // B turns about e_1.
        Self {
            word: "revolute", axes: 1, held: POINT, normal: HINGE, driven: Some(FreeCoordinate::Angle),
            ground: by_components([true, true, true, false, true, true]),
        },
        // B turns about e_1 of A and e_2 of B.
        Self {
            word: "universal", axes: 2, held: POINT, normal: &[(0, 1)], driven: None,
            ground: GroundHold { components: [true, true, true, false, false, false], normal: &[(0, 1)] },
        },
        // B slides along e_1.
        Self {
            word: "prismatic", axes: 1, held: ACROSS, normal: LOCKED, driven: Some(FreeCoordinate::Slide),
            ground: by_components([false, true, true, true, true, true]),
        },
        // B slides along e_1 and turns about it. A drive would have to say on which of the two it
        // acts: there is none.
        Self {
            word: "cylindrical", axes: 1, held: ACROSS, normal: HINGE, driven: None,
            ground: by_components([false, true, true, false, true, true]),
        },
        // Nothing is free.
        Self {
            word: "rigid", axes: 0, held: POINT, normal: LOCKED, driven: None,
            ground: by_components([true; 6]),
        },
    ];

    /// The kind with this word.
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.word == word)
    }

    /// A and B have one displacement: nodes at one point can share its unknowns.
    pub fn shares_displacement(&self) -> bool {
        self.held == POINT
    }

    /// It takes hold of the rotation of its ends.
    pub fn holds_rotation(&self) -> bool {
        !self.normal.is_empty()
    }
}

impl fmt::Debug for JointKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint between nodes and the same joint to ground leave as many motions free.
    #[test]
    fn ground_holds_as_many_components_as_gaps_are_closed() {
        for kind in JointKind::ALL {
            let count = |held: &[bool]| held.iter().filter(|held| **held).count();
            let between = count(&kind.held) + kind.normal.len();
            let to_ground = count(&kind.ground.components) + kind.ground.normal.len();
            assert_eq!(between, to_ground, "{kind:?}");
            assert_eq!(kind.held[..], kind.ground.components[..3], "{kind:?}");
            assert!(kind.normal.len() <= 3, "{kind:?} has more gaps than multipliers");
        }
    }

    #[test]
    fn drives_act_on_what_is_free() {
        for kind in JointKind::ALL {
            let is_free = match kind.driven {
                None => true,
                Some(FreeCoordinate::Angle) => !kind.ground.components[3] && kind.normal == HINGE,
                Some(FreeCoordinate::Slide) => !kind.held[0],
            };
            assert!(is_free, "{kind:?}");
            assert!(kind.driven.is_none() || kind.axes == 1, "{kind:?}");
        }
    }

    #[test]
    fn words_are_unique() {
        for kind in JointKind::ALL {
            assert_eq!(JointKind::of_word(kind.word), Some(kind));
        }
    }
}
