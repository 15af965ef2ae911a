//! Physical quantities of columns: their units, and how their errors fall with the width of
//! elements.

use crate::run::RingingKind;

/// Physical quantity of a column. Errors are measured against the largest value of the same
/// quantity in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Displacement
    Displacement,
    /// Position in space
    Position,
    /// Rotation vector
    Rotation,
    /// Unit quaternion of the rotation
    Orientation,
    /// Unit vectors along section axes
    SectionAxis,
    /// Velocity
    Velocity,
    /// Angular velocity
    AngularVelocity,
    /// Acceleration
    Acceleration,
    /// Angular acceleration
    AngularAcceleration,
    /// Force of supports
    ReactionForce,
    /// Moment of supports
    ReactionMoment,
    /// Resultant force of a section
    SectionForce,
    /// Resultant moment of a section
    SectionMoment,
    /// Strains of stretch and shear
    Strain,
    /// Changes of curvature and twist per length
    Curvature,
    /// Stress in a section
    Stress,
    /// Stress relative to the strength of the material
    FailureIndex,
    /// Energies, all measured against the largest: the error of their sum is that of the scheme
    Energy,
    /// Momentum
    Momentum,
    /// Angular momentum
    AngularMomentum,
    /// Centre of mass
    CentreOfMass,
    /// Gaps and penetrations of contacts
    ContactGap,
    /// Forces of contacts
    ContactForce,
    /// Moments of contacts
    ContactMoment,
    /// Forces of contacts per length
    ContactForcePerLength,
    /// Lengths of beams in contact
    ContactLength,
    /// Numbers of points in contact
    ContactPoints,
    /// Angular frequency, the imaginary part of an eigenvalue of small vibrations
    AngularFrequency,
    /// Growth rate, the real part of an eigenvalue of small vibrations
    GrowthRate,
    /// Number of a stage
    Stage,
    /// Time
    Time,
    /// Load factor
    LoadFactor,
}

impl Quantity {
    /// All quantities.
    pub const ALL: [Self; 32] = [
        Self::Displacement,
        Self::Position,
        Self::Rotation,
        Self::Orientation,
        Self::SectionAxis,
        Self::Velocity,
        Self::AngularVelocity,
        Self::Acceleration,
        Self::AngularAcceleration,
        Self::ReactionForce,
        Self::ReactionMoment,
        Self::SectionForce,
        Self::SectionMoment,
        Self::Strain,
        Self::Curvature,
        Self::Stress,
        Self::FailureIndex,
        Self::Energy,
        Self::Momentum,
        Self::AngularMomentum,
        Self::CentreOfMass,
        Self::ContactGap,
        Self::ContactForce,
        Self::ContactMoment,
        Self::ContactForcePerLength,
        Self::ContactLength,
        Self::ContactPoints,
        Self::AngularFrequency,
        Self::GrowthRate,
        Self::Stage,
        Self::Time,
        Self::LoadFactor,
    ];

    /// Exponents of its units.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Orientation
            | Self::SectionAxis
            | Self::Strain
            | Self::FailureIndex
            | Self::ContactPoints
            | Self::Stage
            | Self::LoadFactor => Dimension::NUMBER,
            Self::Stress => Dimension { length: -2, ..Dimension::FORCE },
            Self::Rotation => Dimension::ANGLE,
            Self::AngularVelocity | Self::AngularFrequency => Dimension::ANGLE.times_time(-1),
            Self::AngularAcceleration => Dimension::ANGLE.times_time(-2),
            Self::GrowthRate => Dimension::NUMBER.times_time(-1),
            Self::Displacement | Self::Position | Self::CentreOfMass | Self::ContactGap | Self::ContactLength => {
                Dimension::LENGTH
            }
            Self::ContactForcePerLength => Dimension { length: -1, ..Dimension::FORCE },
            Self::Velocity => Dimension::LENGTH.times_time(-1),
            Self::Acceleration => Dimension::LENGTH.times_time(-2),
            Self::Curvature => Dimension { length: -1, ..Dimension::NUMBER },
            Self::ReactionForce | Self::SectionForce | Self::ContactForce => Dimension::FORCE,
            Self::ReactionMoment | Self::SectionMoment | Self::ContactMoment | Self::Energy => Dimension::MOMENT,
            Self::Momentum => Dimension::FORCE.times_time(1),
            Self::AngularMomentum => Dimension::MOMENT.times_time(1),
            Self::Time => Dimension::TIME,
        }
    }

    /// Quantity about an axis that goes with this one along an axis: the round-off of one shows in
    /// the other, times or over a length.
    pub fn about_axis(self) -> Option<Self> {
        match self {
            Self::Displacement => Some(Self::Rotation),
            Self::Velocity => Some(Self::AngularVelocity),
            Self::Acceleration => Some(Self::AngularAcceleration),
            Self::ReactionForce => Some(Self::ReactionMoment),
            Self::SectionForce => Some(Self::SectionMoment),
            Self::ContactForce => Some(Self::ContactMoment),
            Self::Strain => Some(Self::Curvature),
            Self::Position
            | Self::Rotation
            | Self::Orientation
            | Self::SectionAxis
            | Self::AngularVelocity
            | Self::AngularAcceleration
            | Self::ReactionMoment
            | Self::SectionMoment
            | Self::Curvature
            | Self::Stress
            | Self::FailureIndex
            | Self::Energy
            | Self::Momentum
            | Self::AngularMomentum
            | Self::CentreOfMass
            | Self::ContactGap
            | Self::ContactMoment
            | Self::ContactForcePerLength
            | Self::ContactLength
            | Self::ContactPoints
            | Self::AngularFrequency
            | Self::GrowthRate
            | Self::Stage
            | Self::Time
            | Self::LoadFactor => None,
        }
    }

    /// What ringing is judged by, for quantities that depend on accelerations. Looking for the largest stress of a section
    /// takes long; it goes with the resultants.
    pub fn ringing_kind(self) -> Option<RingingKind> {
        match self {
            Self::Acceleration => Some(RingingKind::Acceleration),
            Self::AngularAcceleration => Some(RingingKind::AngularAcceleration),
            Self::ReactionForce | Self::SectionForce | Self::ContactForce => Some(RingingKind::Force),
            Self::ReactionMoment | Self::SectionMoment | Self::ContactMoment => Some(RingingKind::Moment),
            Self::Strain => Some(RingingKind::Strain),
            Self::Curvature => Some(RingingKind::Curvature),
            Self::Displacement
            | Self::Position
            | Self::Rotation
            | Self::Orientation
            | Self::SectionAxis
            | Self::Velocity
            | Self::AngularVelocity
            | Self::Stress
            | Self::FailureIndex
            | Self::Energy
            | Self::Momentum
            | Self::AngularMomentum
            | Self::CentreOfMass
            | Self::ContactGap
            | Self::ContactForcePerLength
            | Self::ContactLength
            | Self::ContactPoints
            | Self::AngularFrequency
            | Self::GrowthRate
            | Self::Stage
            | Self::Time
            | Self::LoadFactor => None,
        }
    }

    /// Order at which its error falls with the width of elements.
    pub fn mesh_error(self) -> MeshError {
        match self {
            Self::Displacement
            | Self::Position
            | Self::Rotation
            | Self::Orientation
            | Self::SectionAxis
            | Self::Velocity
            | Self::AngularVelocity
            | Self::Energy => MeshError::Nodes,
            Self::SectionForce | Self::SectionMoment => MeshError::Slopes,
            Self::ContactLength | Self::ContactPoints | Self::Stage => MeshError::Jumps,
            Self::Acceleration
            | Self::AngularAcceleration
            | Self::ReactionForce
            | Self::ReactionMoment
            | Self::Strain
            | Self::Curvature
            | Self::Stress
            | Self::FailureIndex
            | Self::Momentum
            | Self::AngularMomentum
            | Self::CentreOfMass
            | Self::ContactGap
            | Self::ContactForce
            | Self::ContactMoment
            | Self::ContactForcePerLength
            | Self::AngularFrequency
            | Self::GrowthRate
            | Self::Time
            | Self::LoadFactor => MeshError::Unspecified,
        }
    }
}

/// Exponents of the units of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimension {
    /// Exponent of the radian
    pub angle: i32,
    /// Exponent of length
    pub length: i32,
    /// Exponent of force
    pub force: i32,
    /// Exponent of time
    pub time: i32,
}

impl Dimension {
    /// That of plain numbers.
    pub const NUMBER: Self = Self { angle: 0, length: 0, force: 0, time: 0 };
    /// That of angles.
    pub const ANGLE: Self = Self { angle: 1, ..Self::NUMBER };
    /// That of lengths.
    pub const LENGTH: Self = Self { length: 1, ..Self::NUMBER };
    /// That of forces.
    pub const FORCE: Self = Self { force: 1, ..Self::NUMBER };
    /// That of time.
    pub const TIME: Self = Self { time: 1, ..Self::NUMBER };
    /// That of moments and energies.
    pub const MOMENT: Self = Self { length: 1, ..Self::FORCE };

    const fn times_time(self, power: i32) -> Self {
        Self { time: self.time + power, ..self }
    }
}

/// Order at which the error of a quantity falls with the width of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshError {
    /// That of the motion of nodes: twice the order of elements
    Nodes,
    /// That of slopes within elements: one order less
    Slopes,
    /// No order is promised
    Unspecified,
    /// None: it changes in jumps, from one node to the next or from stage to stage
    Jumps,
}
