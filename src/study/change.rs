//! Changes that studies make to a deck: elements, steps, schemes, tolerances.
//!
//! A change is applied to the deck that was read, so that variants need no text. Its `Display` is
//! the setting that makes the same change on the command line (`--set beam.0.elements=8`). Settings
//! of users (`--set`, `--vary` of sweeps) are applied to the text instead, since they may concern
//! anything, such as parameters that expressions depend on.

use super::error::StudyError;
use crate::deck::{
    Beam, Deck, Division, InterpolationWord, MOST_STEPS, STEP_TOLERANCE, SchemeName, Span, Spanned, Stage, StageBody,
    Words,
};
use std::fmt::{self, Display, Formatter};

/// A change of a deck. Beams and stages are numbered from 0.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// The elements of each piece of a beam, or of all pieces
    Elements {
        /// The beam
        beam: usize,
        /// The elements
        divisions: Vec<Division>,
    },
    /// The order of the elements of a beam
    Order {
        /// The beam
        beam: usize,
        /// The polynomial order
        order: usize,
    },
    /// The interpolation of rotations of a beam
    Interpolation {
        /// The beam
        beam: usize,
        /// The interpolation
        word: InterpolationWord,
    },
    /// The parts of each piece of a beam that node numbers count
    Numbering {
        /// The beam
        beam: usize,
        /// The parts
        parts: Vec<Division>,
    },
    /// The scheme of a dynamic stage, with the coefficients of the deck where it has them
    Scheme {
        /// The stage
        stage: usize,
        /// The new scheme
        name: SchemeName,
    },
    /// The step of a dynamic stage
    Step {
        /// The stage
        stage: usize,
        /// The step, or the first one
        step: f64,
    },
    /// Fixed or adaptive steps of a dynamic stage
    Adaptive {
        /// The stage
        stage: usize,
        /// True for adaptive steps
        adaptive: bool,
    },
    /// The tolerance of adaptive steps of a dynamic stage
    StepTolerance {
        /// The stage
        stage: usize,
        /// Tolerance of the local error
        tolerance: f64,
    },
    /// The tolerance of Newton's method in a stage
    Tolerance {
        /// The stage
        stage: usize,
        /// Relative tolerance
        tolerance: f64,
    },
}

/// A deck with changes, refused where the text of such a deck would be refused.
pub fn apply(deck: &Deck, changes: &[Change]) -> Result<Deck, StudyError> {
    let mut changed = deck.clone();
    for change in changes {
        change
            .apply(&mut changed)
            .ok_or_else(|| StudyError::no_scene(format!("`{change}` is not a value of the deck")))?;
    }
    Ok(changed)
}

impl Change {
    /// `None` where the deck has no such beam or stage, or the value is out of bounds.
    fn apply(&self, deck: &mut Deck) -> Option<()> {
        match self {
            Self::Elements { beam, divisions } => {
                beam_of(deck, *beam)?.elements.value = possible(divisions)?;
            }
            Self::Order { beam, order } => beam_of(deck, *beam)?.order = *order,
            Self::Interpolation { beam, word } => beam_of(deck, *beam)?.interpolation = *word,
            Self::Numbering { beam, parts } => {
                let numbering = Spanned { value: possible(parts)?, span: Span::default() };
                beam_of(deck, *beam)?.numbering = Some(numbering);
            }
            Self::Tolerance { stage, tolerance } => {
                let tolerance = Some(*tolerance).filter(|&tolerance| tolerance > 0.0 && tolerance < 1.0)?;
                stage_of(deck, *stage)?.tolerance = tolerance;
            }
            Self::Scheme { stage, .. }
            | Self::Step { stage, .. }
            | Self::Adaptive { stage, .. }
            | Self::StepTolerance { stage, .. } => self.apply_to_dynamics(stage_of(deck, *stage)?)?,
        }
        Some(())
    }

    fn apply_to_dynamics(&self, stage: &mut Stage) -> Option<()> {
        let StageBody::Dynamic { end, step, scheme, step_tolerance, .. } = &mut stage.body else { return None };
        match self {
            Self::Scheme { name, .. } => *scheme = scheme.renamed(*name),
            Self::Step { step: new, .. } => {
                let is_possible = *new > 0.0 && new.is_finite() && *end / new <= MOST_STEPS as f64;
                *step = Some(*new).filter(|_| is_possible)?;
            }
            Self::Adaptive { adaptive: true, .. } => *step_tolerance = step_tolerance.or(Some(STEP_TOLERANCE)),
            Self::Adaptive { adaptive: false, .. } => *step_tolerance = None,
            Self::StepTolerance { tolerance, .. } => {
                *step_tolerance = Some(Some(*tolerance).filter(|&tolerance| tolerance > 0.0 && tolerance.is_finite())?);
            }
            Self::Elements { .. }
            | Self::Order { .. }
            | Self::Interpolation { .. }
            | Self::Numbering { .. }
            | Self::Tolerance { .. } => return None,
        }
        Some(())
    }
}

fn beam_of(deck: &mut Deck, beam: usize) -> Option<&mut Beam> {
    deck.beams.get_mut(beam)
}

fn stage_of(deck: &mut Deck, stage: usize) -> Option<&mut Stage> {
    deck.stages.get_mut(stage)
}

/// Elements or parts, where each piece is within its bounds.
fn possible(divisions: &[Division]) -> Option<Vec<Division>> {
    divisions.iter().all(Division::is_possible).then(|| divisions.to_vec())
}

/// The setting that makes the change: `beam.0.elements=8`.
impl Display for Change {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self {
            Self::Elements { beam, divisions } => write!(f, "beam.{beam}.elements={}", list(divisions)),
            Self::Order { beam, order } => write!(f, "beam.{beam}.order={order}"),
            Self::Interpolation { beam, word } => write!(f, "beam.{beam}.interpolation={:?}", word.word()),
            Self::Numbering { beam, parts } => write!(f, "beam.{beam}.numbering={}", list(parts)),
            Self::Scheme { stage, name } => write!(f, "stage.{stage}.scheme={:?}", name.word()),
            Self::Step { stage, step } => write!(f, "stage.{stage}.step={step:?}"),
            Self::Adaptive { stage, adaptive } => write!(f, "stage.{stage}.adaptive={adaptive}"),
            Self::StepTolerance { stage, tolerance } => write!(f, "stage.{stage}.step_tolerance={tolerance:?}"),
            Self::Tolerance { stage, tolerance } => write!(f, "stage.{stage}.tolerance={tolerance:?}"),
        }
    }
}

/// Divisions as in a deck, where a key of its own gives the grading.
fn list(divisions: &[Division]) -> String {
    match divisions {
        [Division::Equal(count) | Division::Graded { count, .. }] => count.to_string(),
        several => format!("[{}]", several.iter().map(entry).collect::<Vec<_>>().join(",")),
    }
}

fn entry(division: &Division) -> String {
    match division {
        Division::Equal(count) | Division::Graded { count, .. } => count.to_string(),
        Division::At(ends) => format!("{ends:?}").replace(' ', ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck;

    const DECK: &str = "[section.s]\nEA = 1\nGA = 1\nGJ = 1\nEI = 1\nrhoA = 1\n\
        [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [[0,0,0],[1,0,0],[2,0,0]]\nelements = [2, 3]\n\
        [[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.1\nSCHEME\n[[stage]]\nkind = \"static\"\nsteps = 2\n";

    fn read(text: &str) -> Deck {
        let (deck, found) = deck::read(text).unwrap();
        assert!(found.iter().all(deck::Diagnostic::is_warning), "{found:?}");
        deck
    }

    /// Without spans, which differ, and the tables for run.json.
    fn content(deck: &Deck) -> String {
        format!(
            "{:?} {:?}",
            deck.beams
                .iter()
                .map(|b| (&b.elements.value, b.order, b.interpolation, b.numbering.as_ref().map(|n| &n.value)))
                .collect::<Vec<_>>(),
            deck.stages.iter().map(|s| (s.body, s.tolerance)).collect::<Vec<_>>()
        )
    }

    #[test]
    fn changes_do_what_their_settings_do() {
        let schemes = [
            "",
            "scheme = \"newmark\"\nbeta = 0.3",
            "scheme = \"hht\"\nalpha = 0.1",
            "scheme = \"generalized_alpha\"\nrho_inf = 0.5",
        ];
        let mut changes = vec![
            Change::Elements { beam: 0, divisions: vec![Division::Equal(4), Division::At(vec![0.1, 1.0 / 3.0])] },
            Change::Elements { beam: 0, divisions: vec![Division::Equal(5)] },
            Change::Order { beam: 0, order: 3 },
            Change::Interpolation { beam: 0, word: InterpolationWord::Total },
            Change::Numbering { beam: 0, parts: vec![Division::At(vec![0.25]), Division::Equal(3)] },
            Change::Step { stage: 0, step: 0.1 / 3.0 },
            Change::Adaptive { stage: 0, adaptive: true },
            Change::Adaptive { stage: 0, adaptive: false },
            Change::Tolerance { stage: 1, tolerance: 1e-12 },
        ];
        changes.extend(SchemeName::values().map(|name| Change::Scheme { stage: 0, name }));
        for scheme in schemes {
            let text = DECK.replace("SCHEME", scheme);
            for change in &changes {
                let typed = apply(&read(&text), std::slice::from_ref(change)).unwrap();
                let written = read(&deck::apply(&text, &[change.to_string()]).unwrap());
                assert_eq!(content(&typed), content(&written), "{change} after {scheme}");
            }
            let adapts =
                [Change::Adaptive { stage: 0, adaptive: true }, Change::StepTolerance { stage: 0, tolerance: 1e-5 }];
            let written = read(&deck::apply(&text, &adapts.each_ref().map(ToString::to_string)).unwrap());
            assert_eq!(content(&apply(&read(&text), &adapts).unwrap()), content(&written));
        }
    }

    #[test]
    fn values_out_of_bounds_are_refused() {
        let deck = read(&DECK.replace("SCHEME", ""));
        for change in [
            Change::Elements { beam: 0, divisions: vec![Division::Equal(0)] },
            Change::Elements { beam: 0, divisions: vec![Division::At(vec![0.4, 0.2])] },
            Change::Elements { beam: 1, divisions: vec![Division::Equal(1)] },
            Change::Step { stage: 0, step: 1e-12 },
            Change::Step { stage: 1, step: 0.1 },
            Change::Tolerance { stage: 0, tolerance: 1.0 },
        ] {
            assert!(apply(&deck, &[change]).is_err());
        }
    }
}
