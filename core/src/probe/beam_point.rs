//! Points of beams that strains, resultants and stresses are read at.

use crate::effect::elasticity::{ElementStresses, StressField};
use crate::section::Vector6;
use crate::section::recovery::{PlacedRecovery, PointStress};
use crate::system::State;
use crate::tensor::{Mat3, Vec3};
use std::collections::VecDeque;
use std::sync::Arc;

/// A point within beam elements: between two elements of a beam it has two sides.
#[derive(Clone)]
pub struct BeamPoint {
    /// Number of the beam in the scene
    pub beam: usize,
    /// The part of the length of the beam before it
    pub fraction: f64,
    /// Elasticity of the scene, one for each way to interpolate rotations
    pub elasticity: Vec<Arc<dyn StressField>>,
    /// The elements of the beam
    pub elements: BeamElements,
    /// For each side the number of the element in the scene, and xi in it
    pub sides: Vec<(u32, f64)>,
    /// Initial section axes as columns
    pub frame: Mat3,
}

/// The elements of a beam.
#[derive(Clone)]
pub struct BeamElements {
    /// Number of the first one in the scene
    pub first: u32,
    /// True for each node between two of them at which nothing else acts, in order
    pub plain: Arc<[bool]>,
}

/// A point of a beam with the stresses of its section.
#[derive(Clone)]
pub struct StressPlace {
    /// The point, for resultants
    pub inside: BeamPoint,
    /// The section there
    pub section: PlacedRecovery,
}

/// A fixed point of the section at a point of a beam.
#[derive(Clone)]
pub struct StressPoint {
    /// The point of the beam, for resultants
    pub inside: BeamPoint,
    /// Stresses there under unit resultants
    pub stress: PointStress,
}

/// Strains and stresses of the elements that were looked at last, at one state: neighbouring points
/// share elements.
pub struct SeenElements<'a> {
    /// The state
    pub(super) state: &'a State,
    /// The state about which the stage is linear; `None` in other stages
    origin: Option<&'a State>,
    /// Elements by their numbers
    seen: VecDeque<(u32, Option<Arc<ElementStresses>>)>,
}

/// Elements that are kept: those around a point.
const KEPT: usize = 4;

impl<'a> SeenElements<'a> {
    /// Elements at a state. `origin` is the state about which the stage is linear; `None` in other
    /// stages.
    pub fn new(state: &'a State, origin: Option<&'a State>) -> Self {
        Self { state, origin, seen: VecDeque::new() }
    }

    fn element(&mut self, number: u32, elasticity: &[Arc<dyn StressField>]) -> Option<Arc<ElementStresses>> {
        if let Some((_, known)) = self.seen.iter().find(|(seen, _)| *seen == number) {
            return known.clone();
        }
        let found = elasticity.iter().find_map(|field| field.stresses(number, self.state, self.origin)).map(Arc::new);
        self.seen.truncate(KEPT - 1);
        self.seen.push_front((number, found.clone()));
        found
    }
}

impl BeamPoint {
    /// N and M in section axes, see [`strain_and_stress`](Self::strain_and_stress).
    pub fn resultant(&self, state: &State, origin: Option<&State>) -> Vector6 {
        Vector6::from(self.strain_and_stress(&mut SeenElements::new(state, origin))[1])
    }

    /// Gamma and K, then N and M, in section axes: see [`ElementStresses`]; mean of both sides.
    pub fn strain_and_stress(&self, seen: &mut SeenElements) -> [[f64; 6]; 2] {
        let mut mean = [[0.0; 6]; 2];
        for &(element, xi) in &self.sides {
            let Some(stresses) = seen.element(element, &self.elasticity) else { continue };
            let along = if stresses.hides_force_along() { self.force_along(element, seen) } else { Vec3::ZERO };
            let (strain, stress) = stresses.at(xi, along);
            let local = |v: Vec3| self.frame.transpose_mul(v).0;
            let values = [[local(strain.gamma), local(strain.kappa)], [local(stress.n), local(stress.m)]];
            for (sum, part) in mean.iter_mut().flatten().zip(values.as_flattened().as_flattened()) {
                *sum += part / self.sides.len() as f64;
            }
        }
        mean
    }

    /// The force per length on an element (material, global components), from the jumps of the force
    /// at its ends, where these are plain. Where they differ the shorter one counts, and none where
    /// they point apart.
    fn force_along(&self, element: u32, seen: &mut SeenElements) -> Vec3 {
        let BeamElements { first, plain } = &self.elements;
        let mut jump_behind = |before: u32| {
            let is_plain = plain.get((before - first) as usize).copied().unwrap_or(false);
            let mut of = |number: u32| seen.element(number, &self.elasticity);
            is_plain.then(|| Some(of(before)?.force_along(&*of(before + 1)?))).flatten()
        };
        let start = if element > *first { jump_behind(element - 1) } else { None };
        match [start, jump_behind(element)] {
            [Some(start), Some(end)] if start.dot(end) <= 0.0 => Vec3::ZERO,
            [Some(start), Some(end)] => {
                if start.squared() < end.squared() {
                    start
                } else {
                    end
                }
            }
            [start, end] => start.or(end).unwrap_or(Vec3::ZERO),
        }
    }
}
