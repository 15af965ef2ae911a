//! Bending that tension makes decay over less than elements resolve: it is told, and `--accuracy` resolves it.

use super::folder::{Folder, status};
use crate::random::Random;
use crate::scenes::{Simulation, frequencies, list, simulate};
use beamsim_core::tensor::Vec3;
use beamsim_core::warning::WarningKind;
use std::fs;

/// A wire of length 10 with EI = 1 along `axis`, held at its start by `support`, under a tension at its end and a force
/// across in its middle.
fn wire(tension: f64, elements: usize, order: usize, support: &str, [axis, across]: [Vec3; 2]) -> String {
    let at = |s: f64| list(axis * s);
    let [middle, end] = [at(5.0), at(10.0)];
    let [pull, push] = [list(axis * tension), list(across * (2e-4 * tension))];
    format!(
        "[effects]\nplanar = false\n[point]\na = [0, 0, 0]\nm = {middle}\nb = {end}\n[section.s]\nEA = 1e9\nGA = 1e9\nEI = 1\nGJ = 1\nrhoA = 1\nrhoJ = [2e-4, 1e-4, 1e-4]\n\
         [[beam]]\nname = \"wire\"\nsection = \"s\"\nthrough = [\"a\", \"m\", \"b\"]\nelements = [{elements}, {elements}]\norder = {order}\n\
         {support}[[load]]\nat = \"b\"\nforce = {pull}\n[[load]]\nat = \"m\"\nforce = {push}\n\
         [output]\nnodes = [\"a\"]\ncolumns = [\"reaction\"]\n[[stage]]\nkind = \"static\"\nsteps = 4\n"
    )
}

const CLAMP: &str = "[[support]]\nat = \"a\"\nfix = \"all\"\n";

const ALONG_X: [Vec3; 2] = [Vec3([1.0, 0.0, 0.0]), Vec3([0.0, 0.0, 1.0])];

fn is_told(run: &Simulation) -> bool {
    run.counters.findings.warnings.iter().any(|warning| warning.kind == WarningKind::CoarseLayer)
}

/// The moment at the clamp over the exact one, F sqrt(EI/N) for a force F across.
fn share_of_moment(run: &Simulation, tension: f64) -> f64 {
    let moment = Vec3(run.vector("a.m")).norm();
    moment / (2e-4 * tension.sqrt())
}

#[test]
fn bending_that_no_element_resolves_is_told() {
    let mut random = Random::new(41);
    for tension in [2e4, 5e5] {
        for order in 1..=3 {
            let axis = random.direction();
            let across = axis.cross(random.direction()).normalized().unwrap();
            let [coarse, fine] =
                [6, 600].map(|elements| simulate(&wire(tension, elements, order, CLAMP, [axis, across])));
            let [off, close] = [&coarse, &fine].map(|run| (share_of_moment(run, tension) - 1.0).abs());
            assert!(off > 0.05 && is_told(&coarse), "{tension}, order {order}: {off}");
            assert!(close < 2e-3 && !is_told(&fine), "{tension}, order {order}: {close}");
        }
    }
}

#[test]
fn bending_without_layers_is_not_told() {
    // A hinge leaves a wire straight on both sides but for the force in its middle: a distributed one bends it evenly.
    let hinge = "[[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\"]\n";
    let even =
        wire(2e4, 6, 2, hinge, ALONG_X).replace("[[load]]\nat = \"m\"\nforce", "[[load]]\nalong = \"wire\"\nforce");
    assert!(!is_told(&simulate(&even)));
    // Twist does not decay.
    let twisted = wire(2e4, 6, 2, CLAMP, ALONG_X)
        .replace("[[load]]\nat = \"m\"\nforce = [0.0, 0.0, 4.0]", "[[load]]\nat = \"m\"\nmoment = [0.1, 0, 0]");
    assert!(twisted.contains("moment") && !is_told(&simulate(&twisted)));
    // Compression makes no layers, and a stiff wire resolves them.
    assert!(!is_told(&simulate(&wire(-1e-3, 6, 2, CLAMP, ALONG_X))));
    assert!(!is_told(&simulate(&wire(1.0, 6, 2, CLAMP, ALONG_X))));
}

/// A blade on a hub of radius zero that turns at 100 rad/s, of length 10 with EI = 1 and a mass of 1 per length.
fn blade(elements: usize) -> String {
    format!(
        "[point]\na = [0, 0, 0]\nb = [10, 0, 0]\n[section.s]\nEA = 1e8\nGA = 1e8\nEI = 1\nGJ = 1\nrhoA = 1\nrhoJ = [2e-4, 1e-4, 1e-4]\n\
         [[beam]]\nname = \"blade\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = {elements}\norder = 2\n{CLAMP}\
         [[stage]]\nkind = \"static\"\nsteps = 4\nframe = {{ spin = [0, 0, 100] }}\n\
         [[stage]]\nkind = \"modal\"\nmodes = 2\nframe = {{ spin = [0, 0, 100] }}\n"
    )
}

#[test]
fn modes_whose_bending_no_element_resolves_are_told() {
    // The lowest mode is lag, which only the layer at the hub resists: 1.4408 (400 elements; 1.4424 for 1500).
    let [coarse, fine] = [10, 400].map(blade);
    assert!((frequencies(&coarse)[0] - 1.44).abs() > 0.5 && is_told(&simulate(&coarse)));
    assert!((frequencies(&fine)[0] - 1.4408).abs() < 2e-3 && !is_told(&simulate(&fine)));
}

#[test]
fn an_accuracy_is_that_of_resolved_bending() {
    let folder = Folder::new("coarse_layers");
    for tension in [5e4, 5e5] {
        folder.write("wire.toml", &wire(tension, 5, 2, CLAMP, ALONG_X));
        let run = folder.beamsim(&["run", "wire.toml", "--accuracy", "1e-3", "--out", "out", "--force"]);
        assert_eq!(status(&run), 0, "{}", String::from_utf8_lossy(&run.stderr));
        let history = fs::read_to_string(folder.0.join("out/history.csv")).unwrap();
        let [names, last] =
            [history.lines().next(), history.lines().last()].map(|line| line.unwrap().split(',').collect::<Vec<_>>());
        let moment =
            names.iter().position(|name| *name == "a.my").map(|k| last[k].parse::<f64>().unwrap().abs()).unwrap();
        let exact = 2e-4 * tension.sqrt();
        assert!((moment / exact - 1.0).abs() < 1e-3, "{tension}: {moment} for {exact}");
    }
}

#[test]
fn frequencies_that_bending_does_not_matter_for_are_not_told() {
    // A pinned string of steel, 0.65 m, with a radius of 0.15 mm, under 70 N: its modes are sines.
    let string = "[effects]\nplanar = false\n[point]\na = [0, 0, 0]\nb = [0.65, 0, 0]\n[material.steel]\nE = 2e11\nnu = 0.3\nrho = 7850\n[section.s]\nmaterial = \"steel\"\nshape = \"circle\"\nradius = 0.15e-3\n\
         [[beam]]\nname = \"string\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 10\norder = 2\n\
         [[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\"]\n[[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\"]\n\
         [[load]]\nat = \"b\"\nforce = [70, 0, 0]\n[[stage]]\nkind = \"static\"\nsteps = 2\n[[stage]]\nkind = \"modal\"\nmodes = 8\n";
    assert!(!is_told(&simulate(string)));
}

#[test]
fn a_stiff_beam_beside_a_wire_does_not_hide_it() {
    let mast = "[[beam]]\nname = \"mast\"\nsection = \"stiff\"\nthrough = [\"a\", \"c\"]\nelements = 4\n[section.stiff]\nEA = 1e9\nGA = 1e9\nEI = 1e6\nGJ = 1e6\n[[load]]\nat = \"c\"\nforce = [1e4, 0, 0]\n";
    let both = wire(2e4, 6, 2, CLAMP, ALONG_X)
        .replace("[section.s]", "c = [0, 0, 3]\n[section.s]")
        .replace("[output]", &format!("{mast}[output]"));
    assert!(is_told(&simulate(&both)));
}
