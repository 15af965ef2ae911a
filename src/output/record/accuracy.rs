//! The wanted accuracy of a run in run.json, and how far it was reached.

use crate::output::json::{Entries, Number};
use serde::{Deserialize, Serialize};

/// A wanted accuracy, and what was reached.
pub struct ReachedAccuracy {
    /// The columns of which an accuracy was wanted
    pub(crate) columns: Vec<ReachedColumn>,
    /// True if all estimates are at most the wanted errors
    pub(crate) is_reached: bool,
    /// The settings of the deck (`KEY=VALUE`) that reach it
    pub(crate) settings: Vec<String>,
    /// The runs of the search
    pub(crate) runs: usize,
    /// Wall-clock seconds of the search
    pub(crate) seconds: f64,
    /// Equal and placed elements, where both were looked at
    pub(crate) meshes: Option<ReachedMeshes>,
}

/// Equal elements, and elements placed where the solution varies fast.
pub struct ReachedMeshes {
    /// The best mesh of equal elements
    pub(crate) equal: ReachedMesh,
    /// The best mesh of placed ones, where one was tried
    pub(crate) placed: Option<ReachedMesh>,
    /// The number of placed elements over that of equal ones, as predicted
    pub(crate) predicted: f64,
    /// True if the placed elements were taken
    pub(crate) is_placed: bool,
}

/// A mesh that a search found.
pub struct ReachedMesh {
    /// The number of its elements
    pub(crate) elements: usize,
    /// The estimated error of the worst column
    pub(crate) estimate: f64,
    /// CPU seconds of its run
    pub(crate) seconds: f64,
}

/// The accuracy of a column. Errors are relative to the largest value of the column's kind.
pub struct ReachedColumn {
    /// The name of the column
    pub(crate) name: String,
    /// The wanted error
    pub(crate) wanted: f64,
    /// The estimated error
    pub(crate) estimate: f64,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct AccuracyRecord {
    reached: bool,
    /// The wanted and the estimated error of each column
    columns: Entries<[Number; 2]>,
    settings: Vec<String>,
    runs: usize,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    meshes: Option<MeshesRecord>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct MeshesRecord {
    equal: MeshRecord,
    placed: Option<MeshRecord>,
    /// The number of placed elements over that of equal ones, as predicted
    predicted: Number,
    /// `equal` or `placed`
    taken: String,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct MeshRecord {
    elements: usize,
    estimate: Number,
    /// CPU seconds of its run
    seconds: Number,
}

impl From<ReachedAccuracy> for AccuracyRecord {
    fn from(reached: ReachedAccuracy) -> Self {
        let entry = |column: ReachedColumn| (column.name, [Number(column.wanted), Number(column.estimate)]);
        Self {
            reached: reached.is_reached,
            columns: Entries(reached.columns.into_iter().map(entry).collect()),
            settings: reached.settings,
            runs: reached.runs,
            seconds: reached.seconds,
            meshes: reached.meshes.map(MeshesRecord::from),
        }
    }
}

impl From<ReachedMeshes> for MeshesRecord {
    fn from(meshes: ReachedMeshes) -> Self {
        let record = |ReachedMesh { elements, estimate, seconds }: ReachedMesh| MeshRecord {
            elements,
            estimate: Number(estimate),
            seconds: Number(seconds),
        };
        Self {
            equal: record(meshes.equal),
            placed: meshes.placed.map(record),
            predicted: Number(meshes.predicted),
            taken: if meshes.is_placed { "placed" } else { "equal" }.into(),
        }
    }
}
