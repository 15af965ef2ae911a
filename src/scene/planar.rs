//! The plane of planar scenes, or the reason why a scene has none.

use super::compose::Reason;
use super::mesh::Mesh;
use crate::deck::{Deck, Diagnostic, EffectWord, SchemeWord, StageBody};
use beamsim_core::model::Model;
use beamsim_core::run::InitialMotion;
use beamsim_core::system::{MirrorData, Plane, rounded};

/// The plane of a scene, if it has one and the deck does not refuse it.
pub fn plane(
    deck: &Deck,
    model: &Model,
    mesh: &Mesh,
    initial: &[InitialMotion],
    diagnostics: &mut Vec<Diagnostic>,
) -> (Option<Plane>, Reason) {
    let wanted = deck.effects.said(EffectWord::Planar);
    let found = match wanted {
        Some(flag) if !flag.value => Err("off by [effects]".to_string()),
        _ => find(deck, model, mesh, initial),
    };
    let name = "planar";
    match found {
        Ok(plane) => {
            let [x, y, z] = plane.normal().0;
            let which = if [x, y, z].iter().filter(|c| **c == 0.0).count() == 2 {
                ["x = constant", "y = constant", "z = constant"][[x, y, z].iter().position(|c| *c != 0.0).unwrap_or(2)]
                    .into()
            } else {
                format!("the plane normal to {}", rounded(plane.normal()))
            };
            let reason = format!(
                "all of it lies in {which} and is loaded there: three unknowns a node in static and dynamic stages"
            );
            (Some(plane), Reason { name, active: true, reason })
        }
        Err(reason) => {
            if let Some(flag) = wanted.filter(|flag| flag.value) {
                let message = format!("planar = true, but this scene is not planar ({reason})");
                diagnostics.push(Diagnostic::error(message, flag.span.clone()));
            }
            (None, Reason { name, active: false, reason })
        }
    }
}

fn find(deck: &Deck, model: &Model, mesh: &Mesh, initial: &[InitialMotion]) -> Result<Plane, String> {
    if model.linear {
        return Err("large_rotations = false: linear stages are simulated in space".into());
    }
    let is_lie =
        |body: &StageBody| matches!(body, StageBody::Dynamic { scheme: SchemeWord::LieGeneralizedAlpha(_), .. });
    if deck.stages.iter().any(|stage| is_lie(&stage.body)) {
        return Err("lie_generalized_alpha: no kernel for planes".into());
    }
    Plane::of(model.length, &|show| {
        let nodes = mesh.beams.iter().flat_map(|beam| &beam.nodes);
        nodes.for_each(|&node| show("beams", MirrorData::Place(mesh.nodes[node].place)));
        model.mirror_data(show);
        for motion in initial {
            show("initial motion", MirrorData::Vector(motion.velocity));
            show("initial motion", MirrorData::Axial(motion.spin));
        }
    })
}
