//! Friction where sliding turns round within time steps: adaptive ones, whose local error does not show it,
//! and fixed ones, which tell.

use crate::random::Random;
use crate::scenes::{Simulation, list, simulate};
use beamsim_core::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

const G: f64 = 9.81;

/// A block of radius 0.05 on a plane, in units of length and mass, and turned.
struct Block {
    units: [f64; 2],
    /// Axes along the sliding, across it, and along the normal
    axes: Mat3,
    friction: f64,
}

impl Block {
    fn random(random: &mut Random) -> Self {
        let mut unit = || 10.0_f64.powf(random.range(-3.0, 3.0));
        let units = [unit(), unit()];
        let [along, across] = random.axes();
        let rows = [along, across, along.cross(across)].map(|axis| axis.0);
        Self { units, axes: Mat3(rows).transpose(), friction: random.range(0.1, 0.6) }
    }

    /// The deck with a static stage, in which it comes to lie, and a dynamic one.
    fn deck(&self, plane: &str, start: f64, end: f64, settings: &str) -> String {
        let Self { units: [length, mass], axes, friction } = self;
        let vector = |local: [f64; 3]| list(*axes * Vec3(local) * *length);
        let rows = |local: [f64; 3]| list(*axes * Vec3(local));
        format!(
            "gravity = {gravity}\n[point]\nb = {place}\n[[body]]\nat = \"b\"\nmass = {mass:e}\n\
             [[support]]\nat = \"b\"\naxes = [{first}, {second}]\nfix = [\"ux\", \"uy\"]\nstages = [1]\n\
             [[initial]]\nat = \"b\"\nvelocity = {velocity}\n\
             [[surface]]\nname = \"p\"\nkind = \"plane\"\npoint = [0, 0, 0]\nnormal = {normal}\n{plane}\
             [[contact]]\nname = \"c\"\nnodes = [\"b\"]\nsurfaces = [\"p\"]\nradius = {radius:e}\nfriction = {friction}\n\
             stiffness = {stiffness:e}\nstick = 0.01\n[[stage]]\nkind = \"static\"\nsteps = 1\n\
             [[stage]]\nkind = \"dynamic\"\nend = {end}\nscheme = \"generalized_alpha\"\n{settings}\n\
             [output]\nnodes = [\"b\"]\ncolumns = [\"u\", \"v\"]\n",
            gravity = vector([0.0, 0.0, -G]),
            place = vector([0.0, 0.0, 0.05]),
            first = rows([1.0, 0.0, 0.0]),
            second = rows([0.0, 1.0, 0.0]),
            velocity = vector([start, 0.0, 0.0]),
            normal = rows([0.0, 0.0, 1.0]),
            radius = 0.05 * length,
            stiffness = 1e6 * mass,
        )
    }

    /// The way along the sliding at the end, without units.
    fn way(&self, run: &Simulation) -> f64 {
        let [length, _] = self.units;
        (self.axes.transpose() * Vec3(run.vector("b.u"))).0[0] / length
    }
}

#[test]
fn what_slides_in_adaptive_steps_stops_where_it_should() {
    let mut random = Random::new(4);
    for _ in 0..12 {
        let block = Block::random(&mut random);
        let start = random.range(0.6, 5.0);
        let stops = start / (block.friction * G);
        for tolerance in [1e-3, 1e-4] {
            let settings = format!("step = 1e-3\nadaptive = true\nstep_tolerance = {tolerance}");
            let way = block.way(&simulate(&block.deck("", start, 1.3 * stops, &settings)));
            let exact = 0.5 * start * stops;
            // The spring of stick gives by mu g/100, in units of the normal's spring.
            assert!((way / exact - 1.0).abs() < 5e-3, "{start}, {tolerance}: {way} for {exact}, {:?}", block.units);
        }
    }
}

/// A block on a belt that goes to and fro, at a rate.
struct Belt {
    block: Block,
    rate: f64,
    deck: String,
}

impl Belt {
    fn random(random: &mut Random) -> Self {
        let block = Block::random(random);
        let rate = random.range(2.0, 5.0);
        let way = list(block.axes * Vec3([block.units[0], 0.0, 0.0]));
        let deck = format!(
            "move = {way}\nhistory = {{ name = \"h\", stages = [2] }}\n[history.h]\nexpr = \"1 - cos({rate}*t)\"\n"
        );
        Self { block, rate, deck }
    }

    fn run(&self, settings: &str) -> Simulation {
        simulate(&self.block.deck(&self.deck, 0.0, 3.0, settings))
    }

    fn way(&self, settings: &str) -> f64 {
        self.block.way(&self.run(settings))
    }
}

#[test]
fn a_belt_that_goes_to_and_fro_takes_along_what_lies_on_it() {
    let mut random = Random::new(7);
    for _ in 0..4 {
        let belt = Belt::random(&mut random);
        let exact = belt.way("step = 1e-3");
        for tolerance in [1e-3, 1e-4, 1e-5] {
            let found = belt.way(&format!("step = 1e-3\nadaptive = true\nstep_tolerance = {tolerance}"));
            let rate = belt.rate;
            assert!((found - exact).abs() < 0.01 * exact.abs().max(0.1), "{rate}, {tolerance}: {found} for {exact}");
        }
    }
}

#[test]
fn fixed_steps_tell_of_the_friction_that_they_miss() {
    let mut random = Random::new(11);
    let tells =
        |run: &Simulation| run.counters.findings.warnings.iter().any(|w| w.to_string().contains("for friction"));
    let mut untold = 0.0_f64;
    for _ in 0..10 {
        let belt = Belt::random(&mut random);
        let good = belt.run("step = 1e-3");
        assert!(!tells(&good), "{}", belt.rate);
        let exact = belt.block.way(&good);
        for steps in [12.0, 17.0, 25.0, 35.0, 60.0, 100.0, 200.0] {
            let step = 2.0 * PI / belt.rate / steps;
            let run = belt.run(&format!("step = {step:e}\nadaptive = false"));
            let error = (belt.block.way(&run) - exact).abs() / exact.abs().max(0.5);
            let told = tells(&run);
            untold = if told { untold } else { untold.max(error) };
            assert!(told || steps > 35.0, "{}, {steps} steps", belt.rate);
            assert!(!told || steps < 200.0, "{}, {steps} steps", belt.rate);
        }
    }
    assert!(untold < 0.08, "{untold}");
}
