//! Results of analyses: modes, critical loads, special points of equilibrium paths.

use super::failure::{Moment, ShortNumber};
use crate::warning::WarningKind;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The result of an analysis, beside its rows.
#[derive(Clone, Debug, PartialEq)]
pub enum StageResult {
    /// Small motions, by frequency
    Modes(Vec<Mode>),
    /// Critical loads, nearest above the load that was reached first
    CriticalLoads(Vec<CriticalLoad>),
}

impl StageResult {
    /// Its numbers, in the order of [`StageWork::results`](super::StageWork::results).
    pub fn values(&self) -> Vec<f64> {
        match self {
            Self::Modes(modes) => modes.iter().flat_map(|mode| [mode.omega, mode.growth]).collect(),
            Self::CriticalLoads(loads) => loads.iter().map(|critical| critical.load).collect(),
        }
    }
}

/// A small motion exp(s t), s = growth + i omega.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Mode {
    /// Imaginary part of s, not negative
    pub omega: f64,
    /// Real part of s; positive: it grows.
    pub growth: f64,
}

impl Mode {
    /// |s|
    pub fn size(&self) -> f64 {
        self.omega.hypot(self.growth)
    }
}

/// A load factor at which the tangent loses its stiffness.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct CriticalLoad {
    /// The load factor
    pub load: f64,
    /// Its kind
    pub kind: CriticalKind,
}

/// Kinds of critical loads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum CriticalKind {
    /// Another branch begins; the path goes on.
    Branch,
    /// The load is stationary.
    Limit,
    /// The path has no critical point that was reached: the load at which the tangent, extrapolated
    /// from smaller loads, would be singular
    Estimate,
}

impl CriticalKind {
    /// Its name in buckling.csv
    pub fn name(self) -> &'static str {
        match self {
            Self::Branch => "branch",
            Self::Limit => "limit",
            Self::Estimate => "estimate",
        }
    }
}

/// Something special on a path of equilibrium.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Event {
    /// Where
    pub at: Moment,
    /// Its kind
    pub kind: EventKind,
    /// How many pivots of the tangent are negative behind it, where that is known
    pub negative_pivots: Option<usize>,
    /// False where their number does not tell whether the state is stable: in a rotating frame Coriolis forces may hold it
    pub pivots_tell: bool,
}

/// Kinds of special points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum EventKind {
    /// The load factor is stationary.
    Limit,
    /// The displacement that the loads do work on is stationary.
    Turning,
    /// The number of negative pivots changed: a bifurcation, or a limit point of load control.
    Branch,
}

impl EventKind {
    /// Its name in run.json
    pub fn name(self) -> &'static str {
        match self {
            Self::Limit => "limit point",
            Self::Turning => "turning point",
            Self::Branch => "branch or limit point passed",
        }
    }

    /// The warning that tells of it.
    pub(super) fn warning(self) -> WarningKind {
        match self {
            Self::Limit => WarningKind::LimitPoint,
            Self::Turning => WarningKind::TurningPoint,
            Self::Branch => WarningKind::BranchPoint,
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Moment { stage, load, .. } = self.at;
        write!(f, "{} in stage {stage} at load factor {}", self.kind.name(), ShortNumber(load))?;
        match self.negative_pivots {
            None => Ok(()),
            Some(0) => f.write_str(": stable after it"),
            Some(n) if !self.pivots_tell => {
                write!(f, ": {n} negative pivots after it, against which Coriolis forces may hold it")
            }
            Some(1) => f.write_str(": unstable after it, 1 negative pivot"),
            Some(n) => write!(f, ": unstable after it, {n} negative pivots"),
        }
    }
}
