//! Points of beams that strains, resultants and stresses are read at.

use crate::effect::elasticity::{ElementStresses, StressField};
use crate::section::recovery::{PlacedRecovery, PointStress};
use crate::section::{Matrix6, Vector6};
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
    /// Where it lies in elements: two at a node between them, the one before it first
    pub sides: Vec<BeamSide>,
    /// True if resultants may jump there: where something acts, and at a corner
    pub jumps: bool,
    /// Strains over resultants, section axes; `None` for a section without stiffness against some strain
    pub compliance: Option<Matrix6>,
    /// Gamma and K of the free strain, section axes, where its amplitude is one
    pub free: Vector6,
}

/// A side of a point of a beam.
#[derive(Clone, Copy)]
pub struct BeamSide {
    /// Number of the element in the scene
    pub element: u32,
    /// The place in it, from -1 to 1
    pub xi: f64,
    /// Initial section axes as columns; those of both sides differ at a corner
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

/// The strains and stresses of elements that were asked for last, at one state: neighbouring points
/// share elements.
pub struct ElementCache<'a> {
    /// The state
    pub(super) state: &'a State,
    /// The state about which the stage is linear; `None` in other stages
    origin: Option<&'a State>,
    /// Elements by their numbers
    seen: VecDeque<(u32, Option<Arc<ElementStresses>>)>,
    /// Forces per length from the jumps at nodes, by the number of the element before the node
    jumps: VecDeque<(u32, Option<Vec3>)>,
}

/// Number of elements, and of nodes, that are kept: the two beside a node, and two neighbours of
/// each.
const KEPT: usize = 6;

impl<'a> ElementCache<'a> {
    /// Elements at a state. `origin` is the state about which the stage is linear; `None` in other
    /// stages.
    pub fn new(state: &'a State, origin: Option<&'a State>) -> Self {
        Self { state, origin, seen: VecDeque::new(), jumps: VecDeque::new() }
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

    /// The force per length from the jump at the node between an element and the next one.
    fn jump(&mut self, before: u32, elasticity: &[Arc<dyn StressField>]) -> Option<Vec3> {
        if let Some(&(_, known)) = self.jumps.iter().find(|(seen, _)| *seen == before) {
            return known;
        }
        let [this, next] = [before, before + 1].map(|number| self.element(number, elasticity));
        let found = this.zip(next).map(|(this, next)| this.force_along(&next));
        self.jumps.truncate(KEPT - 1);
        self.jumps.push_front((before, found));
        found
    }
}

impl BeamPoint {
    /// N and M in section axes, see [`strain_and_stress`](Self::strain_and_stress).
    pub fn resultant(&self, state: &State, origin: Option<&State>) -> Vector6 {
        Vector6::from(self.strain_and_stress(&mut ElementCache::new(state, origin))[1])
    }

    /// Gamma and K, then N and M, in the section axes of the first side; mean of both sides.
    pub fn strain_and_stress(&self, cache: &mut ElementCache) -> [[f64; 6]; 2] {
        let frame = self.sides[0].frame;
        let sides: Vec<_> = self.sides.iter().filter_map(|side| self.at(&BeamSide { frame, ..*side }, cache)).collect();
        let mean = |part: usize, k: usize| sides.iter().map(|side| side[part][k]).sum::<f64>() / sides.len() as f64;
        [0, 1].map(|part| std::array::from_fn(|k| mean(part, k)))
    }

    /// Gamma and K, then N and M, in section axes, on each side.
    pub fn at_sides(&self, cache: &mut ElementCache) -> Vec<[[f64; 6]; 2]> {
        self.sides.iter().filter_map(|side| self.at(side, cache)).collect()
    }

    /// N and M on both sides, each in its section axes, where they jump.
    pub fn jump(&self, cache: &mut ElementCache) -> Option<[[f64; 6]; 2]> {
        if !self.jumps {
            return None;
        }
        let sides: Vec<[f64; 6]> = self.at_sides(cache).into_iter().map(|[_, resultant]| resultant).collect();
        sides.try_into().ok()
    }

    /// The point seen from each of its sides alone, where resultants jump; otherwise the point.
    pub fn by_jumps(self) -> Vec<Self> {
        if !self.jumps {
            return vec![self];
        }
        self.sides.iter().map(|side| Self { sides: vec![*side], ..self.clone() }).collect()
    }

    /// Gamma and K, then N and M, in section axes, on a side: see [`ElementStresses`]. Strains belong to the
    /// resultants and to the section at the point.
    fn at(&self, side: &BeamSide, cache: &mut ElementCache) -> Option<[[f64; 6]; 2]> {
        let local = |v: Vec3| side.frame.transpose_mul(v).0;
        let stresses = cache.element(side.element, &self.elasticity)?;
        let along = if stresses.hides_force_along() { self.force_along(side.element, cache) } else { Vec3::ZERO };
        let (strain, stress) = stresses.at(side.xi, along);
        let six = |a: Vec3, b: Vec3| Vector6::from_iterator([local(a), local(b)].into_iter().flatten());
        let resultant = six(stress.n, stress.m);
        let strain = match &self.compliance {
            Some(compliance) => compliance * resultant + self.free * stresses.free_amplitude,
            None => six(strain.gamma, strain.kappa),
        };
        Some([strain.into(), resultant.into()])
    }

    /// The force per length on an element (material, global components), from the jumps of the force
    /// at its ends, where these are plain; with one plain end also from the jump at the next node. Of
    /// two the shorter counts, and none where the angle between them is not below 90 degrees:
    /// concentrated forces make single jumps.
    fn force_along(&self, element: u32, cache: &mut ElementCache) -> Vec3 {
        // Nodes by the number of the element before them.
        let mut at_node = |before: i64| {
            let number = before - i64::from(self.elements.first);
            let is_plain = usize::try_from(number).is_ok_and(|k| self.elements.plain.get(k) == Some(&true));
            if is_plain { cache.jump(before as u32, &self.elasticity) } else { None }
        };
        let element = i64::from(element);
        let [one, other] = match [at_node(element - 1), at_node(element)] {
            [Some(start), Some(end)] => [Some(start), Some(end)],
            [Some(start), None] => [Some(start), at_node(element - 2)],
            [None, Some(end)] => [Some(end), at_node(element + 1)],
            [None, None] => [None, None],
        };
        match [one, other] {
            [Some(one), Some(other)] if one.dot(other) <= 0.0 => Vec3::ZERO,
            [Some(one), Some(other)] if other.squared() < one.squared() => other,
            [one, _] => one.unwrap_or(Vec3::ZERO),
        }
    }
}
