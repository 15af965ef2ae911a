//! Kinds of warnings of decks and runs. Their names are part of the interface to users.

use serde::{Deserialize, Serialize};

/// The subject of a warning: the aspect of an answer that it puts in doubt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// The equilibrium path and the stability of equilibria
    Path,
    /// The resolution of the motion by time steps
    Time,
    /// The resolution of the shape by elements
    Mesh,
    /// Digits lost in floating-point arithmetic
    RoundOff,
    /// The deck and the effects in it; no answer is in doubt
    Deck,
}

impl About {
    /// The name of the subject in run.json.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Time => "time",
            Self::Mesh => "mesh",
            Self::RoundOff => "round_off",
            Self::Deck => "deck",
        }
    }
}

/// Defines the enum of kinds from a table with meaning, variant, name and subject of each.
macro_rules! warning_kinds {
    ($($(#[doc = $meaning:literal])+ $kind:ident: $name:literal, $about:ident;)+) => {
        /// Kinds of warnings.
        #[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
        pub enum WarningKind {
            $($(#[doc = $meaning])+ $kind,)+
        }

        impl WarningKind {
            /// All kinds of warnings.
            pub const ALL: &'static [Self] = &[$(Self::$kind),+];

            /// The name of the kind in run.json, in decks and on the terminal.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)+
                }
            }

            /// The meaning of the warning, a sentence.
            pub fn meaning(self) -> &'static str {
                match self {
                    $(Self::$kind => concat!($($meaning),+).trim_start(),)+
                }
            }

            /// The subject of the warning.
            pub fn about(self) -> About {
                match self {
                    $(Self::$kind => About::$about,)+
                }
            }
        }
    };
}

warning_kinds! {
    /// The path of equilibrium passed a point where the load factor is stationary.
    LimitPoint: "limit_point", Path;
    /// The path passed a point where the displacement that the loads do work on is stationary.
    TurningPoint: "turning_point", Path;
    /// The number of negative pivots changed: a bifurcation, or a limit point under load control.
    BranchPoint: "branch_point", Path;
    /// More points of a kind follow, which are listed as events only.
    MorePoints: "more_points", Path;
    /// A static stage ended in an unstable equilibrium.
    Unstable: "unstable", Path;
    /// A planar scene is unstable out of its plane.
    UnstableOutOfPlane: "unstable_out_of_plane", Path;
    /// Load control failed, and the path is followed by arc length.
    ArcLengthDetour: "arc_length_detour", Path;
    /// Load control goes on after a detour by arc length.
    LoadControlResumed: "load_control_resumed", Path;
    /// A state of rest was found by a motion against an artificial resistance.
    CameToRest: "came_to_rest", Path;
    /// A path ended after `max_steps` increments.
    PathEnds: "path_ends", Path;
    /// A buckling load is an estimate: no critical point was found.
    BucklingEstimate: "buckling_estimate", Path;
    /// Modes exist that a modal stage has not found: unstable ones, or some among those that were
    /// asked for.
    MissingModes: "missing_modes", Path;
    /// The state of a modal or buckling stage is no equilibrium.
    OutOfBalance: "out_of_balance", Path;
    /// A node left its axis near a whole turn, so that the columns `rc` depend on the steps.
    LostAxis: "lost_axis", Deck;
    /// The scheme dissipated a notable part of the energy.
    EnergyLoss: "energy_loss", Time;
    /// The total energy rose without work of loads or drives.
    EnergyGain: "energy_gain", Time;
    /// The energy balance has an error by energies that static stages leave out.
    EnergyBalance: "energy_balance", Time;
    /// The estimated error of fixed time steps is large.
    LongSteps: "long_steps", Time;
    /// Forces or accelerations oscillate faster than time steps resolve.
    Ringing: "ringing", Time;
    /// A fixed step failed and was taken in smaller ones.
    StepSubdivided: "step_subdivided", Deck;
    /// Mass does not determine the accelerations at the start.
    NoStartAccelerations: "no_start_accelerations", Time;
    /// A motion begins with a velocity.
    VelocityJump: "velocity_jump", Deck;
    /// A beam spins about its own axis without inertia.
    LooseSpin: "loose_spin", Deck;
    /// Tubes that hold the same beam within them block each other.
    BlockedTubes: "blocked_tubes", Deck;
    /// A history jumps from one stage to the next.
    HistoryJump: "history_jump", Deck;
    /// The history of a motion has kinks, at which velocities jump.
    HistoryKinks: "history_kinks", Deck;
    /// A load changes between the ends of fixed time steps.
    MissedLoad: "missed_load", Time;
    /// Stretching or shear is so stiff that bending is lost in its round-off.
    ExtremeStiffness: "extreme_stiffness", RoundOff;
    /// An element turns far from node to node.
    CoarseMesh: "coarse_mesh", Mesh;
    /// Tension makes bending decay over less than elements resolve.
    CoarseLayer: "coarse_layer", Mesh;
    /// The estimated error of a computed section is large, or larger than `mesh` asks for.
    CoarseSection: "coarse_section", Mesh;
    /// The stiffness is linear between two computed sections that differ much.
    CoarseTaper: "coarse_taper", Mesh;
    /// E and G of a material give a Poisson's ratio that no isotropic material has.
    PoissonRatio: "poisson_ratio", Deck;
    /// Curvatures depend on the orientation of the scene.
    FrameDependence: "frame_dependence", Mesh;
    /// Round-off takes most digits of the displacements.
    LostDigits: "lost_digits", RoundOff;
    /// Round-off takes the stiffness of the softest motion.
    LostStiffness: "lost_stiffness", RoundOff;
    /// Only stress resists a motion at the start of a stage.
    HeldByStress: "held_by_stress", Deck;
    /// A stage of a planar scene is simulated in space.
    SimulatedInSpace: "simulated_in_space", Deck;
    /// Joints with multipliers are simulated by a scheme without dissipation.
    UndampedMultipliers: "undamped_multipliers", Deck;
    /// Contacts of a dynamic stage penetrate by more than wanted.
    ContactPenetration: "contact_penetration", Time;
    /// Elements penetrate a surface between the points that carry contact forces.
    HiddenPenetration: "hidden_penetration", Mesh;
    /// Friction holds by springs that have given way far.
    SoftStick: "soft_stick", Deck;
    /// Friction takes more energy in a step than there is, or lets a part jump a long way.
    FrictionJump: "friction_jump", Path;
    /// A contact of a dynamic stage lasted few steps.
    ShortContact: "short_contact", Time;
    /// Two points at one place are not joined.
    EqualPlaces: "equal_places", Deck;
    /// Beams of a section have no mass, while bodies have.
    MasslessSection: "massless_section", Deck;
    /// A stage of fixed steps has a `step_tolerance`.
    IdleStepTolerance: "idle_step_tolerance", Deck;
    /// Later tables of initial velocities name all nodes of an earlier one.
    IdleInitial: "idle_initial", Deck;
    /// A key of `[cost]` varies something that the deck does not have.
    IdleCostKey: "idle_cost_key", Deck;
}

impl WarningKind {
    /// The kind with this name; `None` if there is none.
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_words() {
        for (k, kind) in WarningKind::ALL.iter().enumerate() {
            let name = kind.name();
            assert!(name.chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{name}");
            assert_eq!(WarningKind::ALL.iter().position(|other| other.name() == name), Some(k), "{name}");
            assert_eq!(WarningKind::of(name), Some(*kind));
        }
        assert_eq!(WarningKind::of("nothing"), None);
    }
}
