//! Sliding joints: a node that stays on the line of a beam, free along it or driven.
//!
//! Forces and tangent are those of [`crate::kernel::guide`]. The place s on the line is an unknown, or
//! is prescribed; multipliers are the force on the node. Each element of the beam is an instance, of
//! which one acts in a state: that at the present s.

use super::{Constraint, Effect, MotorState, Roles, TangentForm};
use crate::kernel::guide::{GuideWeights, LinePoint, add_slide, block, element_at, stencil, weights};
use crate::kernel::joint::GapFactors;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, Slot, State};
use crate::tensor::Vec3;
use std::ops::Range;

/// A node of the line of a beam.
#[derive(Clone, Copy, Debug)]
pub struct GuideNode {
    /// Its displacement
    pub u: Slot,
    /// Its initial place
    pub place: Vec3,
}

/// The line of a beam.
#[derive(Clone, Debug)]
pub struct Guide {
    /// The nodes in their order, two or more
    pub nodes: Vec<GuideNode>,
    /// Arc lengths of the nodes at the start, from the first node along the chords
    knots: Vec<f64>,
}

/// A node on the line of a beam.
#[derive(Clone, Copy, Debug)]
pub struct Slider {
    /// The displacement of the node that slides
    pub u: Slot,
    /// The initial place on the line from which its displacement counts: a node that begins beside the
    /// line keeps that distance, so that nothing jumps
    pub place: Vec3,
    /// The number of the guide
    pub guide: usize,
    /// The arc length at which it begins
    pub start: f64,
    /// The slot of the sliding from there, in the first component
    pub slide: Slot,
    /// The slot of the multipliers
    pub force: Slot,
}

/// All sliding joints.
#[derive(Clone, Debug, Default)]
pub struct Sliders {
    /// The beams on which nodes slide
    pub guides: Vec<Guide>,
    /// The nodes
    pub sliders: Vec<Slider>,
}

/// A sliding node in a state.
struct SliderNow {
    element: usize,
    nodes: Range<usize>,
    weights: GuideWeights,
    line: LinePoint,
}

impl Guide {
    /// The line through these nodes.
    pub fn new(nodes: Vec<GuideNode>) -> Self {
        let mut knots = vec![0.0];
        for pair in nodes.windows(2) {
            knots.push(knots[knots.len() - 1] + (pair[1].place - pair[0].place).norm());
        }
        Self { nodes, knots }
    }

    /// The number of elements between its nodes.
    pub fn elements(&self) -> usize {
        self.nodes.len() - 1
    }

    /// Its length at the start.
    pub fn length(&self) -> f64 {
        self.knots[self.nodes.len() - 1]
    }

    /// The arc length at which the line is nearest to a place at the start, and its place there.
    pub fn nearest(&self, place: Vec3) -> (f64, Vec3) {
        let initial = |s: f64| {
            let element = element_at(&self.knots, s);
            let nodes: Vec<Vec3> = stencil(element, self.nodes.len()).map(|k| self.nodes[k].place).collect();
            LinePoint::new(&weights(&self.knots, element, s), &nodes)
        };
        let distance = |s: f64| (initial(s).place - place).norm();
        let nearest_node = self.knots.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let mut s = nearest_node.unwrap_or(0.0);
        for _ in 0..NEAREST_ITERATIONS {
            let line = initial(s);
            s = (s + (place - line.place).dot(line.slope) / line.slope.dot(line.slope)).clamp(0.0, self.length());
        }
        (s, initial(s).place)
    }
}

/// Corrections of the place on the line that is nearest to a point on it: more than enough for one
/// that is there.
const NEAREST_ITERATIONS: usize = 20;

/// A node has left the line if it is farther beyond its end than this part of the length.
const AT_END: f64 = 1e-9;

impl Sliders {
    /// The arc length of a node in a state.
    fn place_on_line(slider: &Slider, at: &State) -> f64 {
        slider.start + at.q[slider.slide as usize].0[0]
    }

    fn now(&self, slider: &Slider, at: &State) -> SliderNow {
        let guide = &self.guides[slider.guide];
        let s = Self::place_on_line(slider, at);
        let element = element_at(&guide.knots, s);
        let nodes = stencil(element, guide.nodes.len());
        let weights = weights(&guide.knots, element, s);
        let places: Vec<Vec3> =
            guide.nodes[nodes.clone()].iter().map(|node| node.place + at.q[node.u as usize]).collect();
        SliderNow { element, nodes, weights, line: LinePoint::new(&weights, &places) }
    }

    /// The rates at the place of a slider on its line, from rates of all slots.
    fn rate_of_line(&self, slider: &Slider, now: &SliderNow, rates: &[Vec3]) -> LinePoint {
        let nodes = &self.guides[slider.guide].nodes[now.nodes.clone()];
        let of_nodes: Vec<Vec3> = nodes.iter().map(|node| rates[node.u as usize]).collect();
        LinePoint::new(&now.weights, &of_nodes)
    }
}

impl Effect for Sliders {
    fn name(&self) -> &'static str {
        "sliding joints"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        for slider in &self.sliders {
            let guide = &self.guides[slider.guide];
            for element in 0..guide.elements() {
                let nodes = guide.nodes[stencil(element, guide.nodes.len())].iter().map(|node| node.u);
                connectivity.push([slider.u, slider.slide, slider.force].into_iter().chain(nodes));
            }
        }
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::Symmetric
    }

    /// Sliding joints have no planar form.
    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        show(MirrorData::Spatial);
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        // In a tangent without stiffness multipliers constrain accelerations.
        let couple = if weights.stiffness != 0.0 { weights.stiffness } else { weights.mass };
        let factors = GapFactors { forces: weights.stiffness, multiplier: couple };
        let mut first = 0;
        for slider in &self.sliders {
            let now = self.now(slider, at);
            let mut system = ElementSystem::new(block::GUIDE + now.nodes.len());
            let place = slider.place + at.q[slider.u as usize];
            let force = at.q[slider.force as usize];
            add_slide(&now.weights, &now.line, now.nodes.len(), place, force, factors, &mut system);
            out.add(first + now.element, &system);
            first += self.guides[slider.guide].elements();
        }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles { constraint: Some(self), ..Roles::NONE }
    }
}

impl Constraint for Sliders {
    fn drift(&self, at: &State, rates: &mut [Vec3], rates2: &mut [Vec3]) {
        for slider in &self.sliders {
            let now = self.now(slider, at);
            let [line, line_rate] = [&at.v, &at.a].map(|rates| self.rate_of_line(slider, &now, rates));
            let [speed, speed_rate] = [&at.v, &at.a].map(|rates| rates[slider.slide as usize].0[0]);
            let (u, force) = (slider.u as usize, slider.force as usize);
            rates[force] = at.v[u] - line.place - now.line.slope * speed;
            rates2[force] = at.a[u]
                - line_rate.place
                - now.line.slope * speed_rate
                - (line.slope * 2.0 + now.line.curvature * speed) * speed;
        }
    }

    fn remember(&self, _at: &mut State) {}

    fn motors(&self, _at: &State, _show: &mut dyn FnMut(MotorState)) {}

    fn turned(&self, _from: &[f64], _to: &[f64]) -> Option<(Slot, f64)> {
        None
    }

    fn held_by_ground(&self, _at: &State, _node: Node) -> (Vec3, Vec3) {
        (Vec3::ZERO, Vec3::ZERO)
    }

    fn follow_nodes(&self, at: &mut State) {
        for slider in &self.sliders {
            let now = self.now(slider, at);
            let of_line = self.rate_of_line(slider, &now, &at.v);
            let slope = now.line.slope;
            let speed = slope.dot(at.v[slider.u as usize] - of_line.place) / slope.squared();
            at.v[slider.slide as usize].0[0] = speed;
        }
    }

    fn left(&self, at: &State) -> Option<Slot> {
        let has_left = |slider: &&Slider| {
            let length = self.guides[slider.guide].length();
            let s = Self::place_on_line(slider, at);
            s < -AT_END * length || s > (1.0 + AT_END) * length
        };
        self.sliders.iter().find(has_left).map(|slider| slider.u)
    }
}
