//! Kinds of joints, one row of data each. No other code distinguishes kinds: a new kind is a row
//! here, and its word in the JSON Schema of decks.

use std::fmt;

/// A pair of axes, the first carried by A and the second by B, that stay normal to each other.
pub type NormalPair = (usize, usize);

/// A free coordinate of a joint: the rotation of B about e_1, or its displacement along e_1,
/// relative to A.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreeCoordinate {
    /// The angle about e_1, in radians
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

/// The holds of a joint to ground without arms, which holds components of the unknowns of its node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroundHold {
    /// Held displacements along e_1, e_2, e_3, then held components of the rotation vector along
    /// these axes; two held rotation components make a hinge
    pub components: [bool; 6],
    /// Pairs of axes that need multipliers, since held components do not keep them normal
    pub normal: &'static [NormalPair],
}

/// A kind of joint. Its axes are e_1, e_2, e_3, of which the deck gives none, e_1, or e_1 and e_2.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct JointKind {
    /// The word of the kind in the deck
    pub word: &'static str,
    /// The number of axes that the deck gives
    pub axes: usize,
    /// Axes of A along which B does not slide
    pub held: [bool; 3],
    /// Pairs of axes that stay normal
    pub normal: &'static [NormalPair],
    /// The holds of a joint of this kind between ground and a node, without arms
    pub ground: GroundHold,
    /// The coordinate on which a spring, a damper or a motor may act
    pub driven: Option<FreeCoordinate>,
}

/// Held axes of a joint without slide: both ends stay at one point.
const POINT: [bool; 3] = [true; 3];

/// Held axes of a joint that slides along e_1 of A.
const ACROSS: [bool; 3] = [false, true, true];

/// Normal pairs of a joint that turns about e_1 only, an axis of both ends.
const HINGE: &[NormalPair] = &[(0, 1), (0, 2)];

/// Normal pairs of a joint without rotation.
const LOCKED: &[NormalPair] = &[(0, 1), (1, 2), (2, 0)];

/// The holds of a joint to ground without multipliers.
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
        // B slides along e_1 and turns about it. It has no drive, which would have to choose
        // between both coordinates.
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

    /// True if both ends have one displacement, whose unknowns nodes at one point can share.
    pub fn shares_displacement(&self) -> bool {
        self.held == POINT
    }

    /// True if it constrains the rotations of its ends.
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

    /// A joint between nodes and a joint of equal kind to ground constrain equally many motions.
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
            assert_eq!(JointKind::ALL.into_iter().find(|other| other.word == kind.word), Some(kind));
        }
    }
}
