//! The largest stresses of a run in run.json.

use crate::output::json::Number;
use crate::scene::Mesh;
use beamsim_core::probe::{Envelope, Extreme, StressPlace};
use serde::{Deserialize, Serialize};

/// The largest stresses of a section on a beam.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct StressRecord {
    beam: String,
    section: String,
    vm: Option<ExtremeRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    index: Option<ExtremeRecord>,
}

/// A largest value: when and where it was, and the resultants N1 N2 N3 M1 M2 M3 then.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct ExtremeRecord {
    value: Number,
    stage: usize,
    time: Number,
    load: Number,
    fraction: f64,
    point: [f64; 2],
    region: String,
    resultant: [Number; 6],
}

/// The largest stresses of all places by beam and section, in the order of the beams.
pub(super) fn stress_records(envelope: &Envelope, mesh: &Mesh) -> Vec<StressRecord> {
    let mut records: Vec<StressRecord> = Vec::new();
    for (place, found) in envelope.places().iter().zip(envelope.found()) {
        let beam = &mesh.beams[place.inside.beam].name;
        let section = &place.section.section().name;
        let number = records.iter().position(|known| known.beam == *beam && known.section == *section);
        let number = number.unwrap_or_else(|| {
            records.push(StressRecord { beam: beam.clone(), section: section.clone(), ..StressRecord::default() });
            records.len() - 1
        });
        let record = &mut records[number];
        for (known, new) in [(&mut record.vm, found.von_mises), (&mut record.index, found.index)] {
            let is_larger = |new: &Extreme| known.as_ref().is_none_or(|known| new.value > known.value.0);
            if let Some(new) = new.filter(is_larger) {
                *known = Some(extreme_record(&new, place));
            }
        }
    }
    records
}

fn extreme_record(found: &Extreme, place: &StressPlace) -> ExtremeRecord {
    ExtremeRecord {
        value: Number(found.value),
        stage: found.moment.stage,
        time: Number(found.moment.time),
        load: Number(found.moment.load),
        fraction: place.inside.fraction,
        point: found.at,
        region: place.section.section().regions.get(found.region).cloned().unwrap_or_default(),
        resultant: found.resultant.map(Number),
    }
}
