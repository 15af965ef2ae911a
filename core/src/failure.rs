//! Kinds of failures that end a run. Their names are part of the interface to users.

/// The cause of a failure, which determines the exit status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The deck asks for something impossible.
    Deck,
    /// The numerical methods found no solution.
    Numerics,
    /// A file could not be read or written.
    File,
    /// A signal stopped the run.
    Signal,
}

/// Defines the enum of kinds from a table with meaning, variant, name and cause of each.
macro_rules! failure_kinds {
    ($($(#[doc = $meaning:literal])+ $kind:ident: $name:literal, $cause:ident;)+) => {
        /// Kinds of failures.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum FailureKind {
            $($(#[doc = $meaning])+ $kind,)+
        }

        impl FailureKind {
            /// All kinds of failures.
            pub const ALL: &'static [Self] = &[$(Self::$kind),+];

            /// The name of the kind in run.json, in decks and on the terminal.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)+
                }
            }

            /// The cause of failures of this kind.
            pub const fn cause(self) -> Cause {
                match self {
                    $(Self::$kind => Cause::$cause,)+
                }
            }
        }
    };
}

failure_kinds! {
    /// The deck is wrong, or asks for a stage that cannot begin.
    Deck: "deck", Deck;
    /// Neighbouring nodes turn too far against each other for their element.
    MeshTooCoarse: "mesh_too_coarse", Numerics;
    /// No balance was found, or no step that is short enough.
    NotConverged: "not_converged", Numerics;
    /// A mechanism or a loose part.
    Singular: "singular", Numerics;
    /// A beam or a body penetrates a surface where its contact begins to act.
    ContactStart: "contact_start", Deck;
    /// A beam or a body may have passed through a surface, or through a beam.
    ContactPassed: "contact_passed", Numerics;
    /// A node has slid to the end of the beam on which it slides.
    SliderEnd: "slider_end", Numerics;
    /// A force, a motion or a result is not finite.
    NonFinite: "non_finite", Numerics;
    /// The total energy grows without work of loads or drives.
    EnergyGrowth: "energy_growth", Numerics;
    /// A size exceeds the stated bounds.
    Limit: "limit", Deck;
    /// A file could not be read or written.
    Io: "io", File;
    /// A signal stopped the run.
    Interrupted: "interrupted", Signal;
}

impl FailureKind {
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
        for kind in FailureKind::ALL {
            assert!(kind.name().chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{kind:?}");
            assert_eq!(FailureKind::of(kind.name()), Some(*kind));
        }
        assert_eq!(FailureKind::of("finished"), None);
    }
}
