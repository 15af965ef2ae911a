//! Checks of a deck before its mechanics is built.

use super::compose::Composition;
use super::contacts;
use super::mesh::Mesh;
use super::scheme::coefficients;
use super::section::{self, contraction, solid_material};
use crate::deck::{self, Deck, Diagnostic, Elastic, LoadTarget, MotionWhat, Named, SectionBody, Spanned, StageBody};
use beamsim_core::integrate::Stages;
use beamsim_core::model::{StageSet, Support};
use beamsim_core::system::Direction;
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::warning::WarningKind;
use nalgebra::{Matrix3, SymmetricEigen};
use std::collections::{HashMap, HashSet};

/// Part by which the stiffness of a taper may exceed that of linear dimensions without a warning: that
/// of a stiffness that grows by a factor of 2.9
const LARGEST_EXCESS: f64 = 0.11;

/// Checks names, stages, and what a stage needs.
pub fn deck(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    if deck.stage_count == 0 {
        diagnostics.push(Diagnostic::whole("the deck has no [[stage]]: nothing would be simulated"));
    }
    if deck.beams.is_empty() && deck.bodies.is_empty() {
        diagnostics.push(Diagnostic::whole("the deck has no [[beam]] and no [[body]]: there is nothing to simulate"));
    }
    refuse_twins("beam", deck.beams.iter().map(|b| &b.name), diagnostics);
    refuse_twins("surface", deck.surfaces.iter().map(|surface| &surface.name), diagnostics);
    contacts::check(deck, diagnostics);
    clocks_go_forward(deck, diagnostics);
    mass_where_needed(deck, diagnostics);
    warn_of_sections(deck, diagnostics);
    warn_of_coarse_tapers(deck, diagnostics);
    warn_of_equal_places(deck, diagnostics);
    refuse_idle_tables(deck, diagnostics);
    refuse_vectors_where_there_are_increments(deck, diagnostics);
    refuse_histories_on_paths(deck, diagnostics);
}

pub(super) fn refuse_twins<'a>(
    kind: &str,
    names: impl Iterator<Item = &'a Spanned<String>>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let mut known: HashMap<&str, &Spanned<String>> = HashMap::new();
    for name in names {
        let first = known.entry(&name.value).or_insert(name);
        if !std::ptr::eq(*first, name) {
            let diagnostic = Diagnostic::error(format!("there are two {kind}s `{}`", name.value), name.span.clone());
            diagnostics.push(diagnostic.context(first.span.clone(), "the first"));
        }
    }
}

fn clocks_go_forward(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let mut clock = 0.0;
    for stage in &deck.stages {
        if let StageBody::Dynamic { end, .. } = stage.body {
            if end <= clock {
                let message =
                    format!("`end` is {end}, but the stage starts at time {clock} (`end` is a time, not a duration)");
                diagnostics.push(Diagnostic::error(message, stage.span.clone()));
            }
            let interval = deck.output.interval.unwrap_or(f64::INFINITY);
            if (end - clock) / interval > deck::MOST_STEPS as f64 {
                let message = format!("`interval` gives more rows than the limit of {}", deck::MOST_STEPS);
                diagnostics.push(Diagnostic::limit(message, stage.span.clone()));
            }
            // A stage with `until` may end at any time before.
            if stage.until.is_none() {
                clock = end;
            }
        }
    }
}

/// Warns of computed sections, which beams use, whose error is large, and of their materials.
fn warn_of_sections(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let users: HashSet<&str> =
        deck.beams.iter().flat_map(|beam| &beam.sections).map(|name| name.value.as_str()).collect();
    let used = || deck.sections.iter().filter(|section| users.contains(section.name()));
    diagnostics.extend(used().filter_map(|section| super::computed::warning(section, deck)));
    let is_solid_of =
        |section: &deck::Section, material: &str| solid_material(section).is_some_and(|name| name.value == material);
    for material in &deck.materials {
        let name = &material.name;
        let Elastic::Isotropic(elastic) = material.elastic else { continue };
        if contraction(&elastic) == elastic.poisson || !used().any(|section| is_solid_of(section, &name.value)) {
            continue;
        }
        let message = format!(
            "E and G of material `{}` give Poisson's ratio {:.3}, which no isotropic material has: sections are \
             computed without their contraction",
            name.value, elastic.poisson
        );
        let help = "this is right for timber and other materials with fibres along the beam; else check E and G";
        diagnostics.push(Diagnostic::warning(WarningKind::PoissonRatio, message, name.span.clone()).help(help));
    }
}

/// Warns of stiffness that is linear between two computed sections which differ much.
fn warn_of_coarse_tapers(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let section = |name: &Spanned<String>| deck.sections.named(&name.value);
    for beam in &deck.beams {
        let excess = |pair: &[Spanned<String>]| {
            let ends = [section(&pair[0])?, section(&pair[1])?];
            Some((section::excess_of_taper(ends, deck)?, ends.map(|section| &section.name.value)))
        };
        let all = beam.sections.windows(2).filter_map(excess);
        let Some((excess, [first, second])) = all.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if excess <= LARGEST_EXCESS {
            continue;
        }
        let message = format!(
            "the stiffness of beam `{}` varies linearly between the sections `{first}` and `{second}`, which differ \
             much: if their dimensions vary linearly, it is up to {:.0} % too large there",
            beam.name.value,
            100.0 * excess
        );
        let help = "give sections in between, with `stations`";
        diagnostics.push(Diagnostic::warning(WarningKind::CoarseTaper, message, beam.name.span.clone()).help(help));
    }
}

/// Inertia and gravity need mass: of beams, or of bodies that massless beams carry.
fn mass_where_needed(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let inertia = |s: &deck::Stage| s.body.kind().needs_inertia() || s.frame.is_some();
    let dynamic = deck.stages.iter().any(inertia);
    let weighed = deck.gravity.as_ref().is_some_and(|g| g.value != [0.0; 3]);
    if !dynamic && !weighed {
        return;
    }
    let why = if dynamic { "a stage with inertia" } else { "`gravity`" };
    for own in &deck.sections {
        let Some(Missing { key, zero }) = missing_mass(deck, own) else { continue };
        let used = |beam: &&deck::Beam| beam.sections.iter().any(|name| name.value == own.name.value);
        let users: Vec<&deck::Beam> = deck.beams.iter().filter(used).collect();
        let Some(beam) = users.first() else { continue };
        // Between a section with mass and one without there is no taper of mass.
        let has_mass =
            |name: &Spanned<String>| deck.sections.named(&name.value).is_some_and(|s| missing_mass(deck, s).is_none());
        let tapers = users.iter().any(|beam| beam.sections.iter().any(has_mass));
        let name = &own.name;
        let diagnostic = if deck.bodies.is_empty() || tapers {
            Diagnostic::error(format!("section `{}` needs {key} for {why}", name.value), name.span.clone())
        } else {
            let message = format!("section `{}` has no mass: in {why} only bodies have mass", name.value);
            Diagnostic::warning(WarningKind::MasslessSection, message, name.span.clone())
                .help(format!("if this is intended, write {zero}"))
        };
        diagnostics.push(diagnostic.context(beam.name.span.clone(), "used by this beam"));
    }
}

/// The missing mass of a section.
struct Missing {
    /// The key
    key: &'static str,
    /// The key with which a deck states that there is none
    zero: &'static str,
}

fn missing_mass(deck: &Deck, section: &deck::Section) -> Option<Missing> {
    match &section.body {
        SectionBody::Resultants { mass: None, .. } => Some(Missing { key: "`rhoA`", zero: "`rhoA = 0`" }),
        SectionBody::Full { mass: None, .. } => Some(Missing { key: "`mass`", zero: "a `mass` of zeros" }),
        SectionBody::Computed(body) => {
            let without = !super::computed::has_density(body, deck);
            let key = if solid_material(section).is_some() { "a material with `rho`" } else { "materials with `rho`" };
            without.then_some(Missing { key, zero: "`rho = 0`" })
        }
        SectionBody::Resultants { mass: Some(_), .. } | SectionBody::Full { mass: Some(_), .. } => None,
    }
}

/// Points at one place are not joined.
fn warn_of_equal_places(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let mut used: HashSet<&str> = HashSet::new();
    for beam in &deck.beams {
        for point in beam.path.points() {
            if let deck::PointRef::Name(name) = &point.value {
                used.insert(name);
            }
        }
    }
    // Places are compared as numbers: -0 is 0.
    let key = |place: &[f64; 3]| place.map(|x| (x + 0.0).to_bits());
    let mut at_place: HashMap<[u64; 3], &Spanned<String>> = HashMap::new();
    for (name, place) in deck.points.iter().filter(|(name, _)| used.contains(name.value.as_str())) {
        let first = at_place.entry(key(place)).or_insert(name);
        if !std::ptr::eq(*first, name) {
            let message = format!(
                "the points `{}` and `{}` have the same coordinates but are not connected",
                first.value, name.value
            );
            let diagnostic = Diagnostic::warning(WarningKind::EqualPlaces, message, name.span.clone());
            diagnostics.push(diagnostic.help("beams are connected where they use the same point name"));
        }
    }
}

/// Refuses what only dynamic stages use where there is none.
fn refuse_idle_tables(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let dynamic = deck.stages.iter().any(|s| s.body.kind().advances_time());
    if dynamic || deck.stages.is_empty() {
        return;
    }
    if let Some(initial) = deck.initials.first() {
        let message = "[[initial]] needs a dynamic stage: this deck has none";
        diagnostics.push(Diagnostic::error(message, initial.span.clone()));
    }
    if deck.output.interval.is_some() {
        let message = "`interval` of [output] is a time and needs a dynamic stage: this deck has none";
        diagnostics
            .push(Diagnostic::error(message, deck.output.interval_span.clone()).help("`every` writes each n-th row"));
    }
}

/// A path whose load factor turns back cannot follow a history of it.
fn refuse_histories_on_paths(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    for (number, stage) in deck.stages.iter().enumerate() {
        if !matches!(stage.body, StageBody::Path { .. } | StageBody::Buckling { .. }) {
            continue;
        }
        let what = stage.body.in_words();
        for history in histories_in(deck, number + 1) {
            let message = format!("{what} does not support `history`: its load factor may decrease");
            let diagnostic = Diagnostic::error(message, history.span.clone());
            diagnostics.push(diagnostic.context(stage.span.clone(), "this stage"));
        }
    }
}

/// The names of the histories that go on in a stage, from 1.
pub fn histories_in(deck: &Deck, stage: usize) -> impl Iterator<Item = &Spanned<String>> {
    let acts = move |stages: &Option<Vec<usize>>| stages.as_ref().is_none_or(|stages| stages.contains(&stage));
    let loads = deck.loads.iter().filter(move |l| acts(&l.stages)).filter_map(|l| l.history.as_ref());
    let motions = deck.motions.iter().filter(move |m| acts(&m.stages)).filter_map(|m| m.history.as_ref());
    let motors = deck.joints.iter().filter_map(|j| j.motor.as_ref()).filter_map(|motor| motor.history.as_ref());
    let drives = deck.sliders.iter().filter_map(|s| s.drive.as_ref()).filter_map(|drive| drive.history.as_ref());
    let surfaces = deck.surfaces.iter().filter(move |s| acts(&s.stages)).filter_map(|s| s.history.as_ref());
    let strains = deck.beams.iter().filter_map(|b| b.free_strain.as_ref()).filter_map(|f| f.history.as_ref());
    let all = loads.chain(motions).chain(motors).chain(drives).chain(strains).chain(surfaces);
    all.filter(move |history| history.goes_on_in(stage)).map(|history| &history.name)
}

/// Refuses total interpolation and single held rotation components under the rotation-aware scheme,
/// which has no total rotation vectors.
fn refuse_vectors_where_there_are_increments(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    let incremental = |stage: &deck::Stage| {
        matches!(stage.body, StageBody::Dynamic { scheme: deck::SchemeWord::LieGeneralizedAlpha(_), .. })
    };
    let mut numbered = deck.stages.iter().enumerate().filter(|(_, stage)| incremental(stage));
    let numbers: Vec<usize> = numbered.clone().map(|(number, _)| number + 1).collect();
    let Some((_, stage)) = numbered.next() else { return };
    let scheme = "scheme = \"lie_generalized_alpha\"";
    for beam in deck.beams.iter().filter(|beam| beam.interpolation == deck::InterpolationWord::Total) {
        let name = &beam.name.value;
        let message = format!("{scheme} needs interpolation = \"relative\", beam `{name}` has \"total\"");
        let diagnostic = Diagnostic::error(message, beam.name.span.clone());
        diagnostics.push(diagnostic.context(stage.span.clone(), "this stage"));
    }
    let acts = |support: &&deck::Support| {
        support.stages.as_ref().is_none_or(|stages| stages.iter().any(|stage| numbers.contains(stage)))
    };
    for support in deck.supports.iter().filter(acts) {
        if support.fix[3..].iter().filter(|&&fixed| fixed).count() == 1 {
            let message = format!("{scheme} cannot fix a single rotation component");
            let diagnostic = Diagnostic::error(message, support.span.clone()).help("use a joint to ground");
            diagnostics.push(diagnostic.context(stage.span.clone(), "this stage"));
        }
    }
}

/// Warns of joints with multipliers under a scheme without dissipation: multipliers and
/// accelerations oscillate from step to step.
pub fn warn_of_undamped_multipliers(deck: &Deck, composition: &Composition, diagnostics: &mut Vec<Diagnostic>) {
    if composition.multipliers.is_empty() {
        return;
    }
    for stage in &deck.stages {
        let StageBody::Dynamic { scheme, .. } = stage.body else { continue };
        let scheme = coefficients(scheme);
        // With a balance in the middle each step restores the rates of joints, but not those of stiff directions
        // beside them.
        let restores_rates = scheme.stages == Stages::MiddleAndEnd && deck.beams.is_empty();
        if !scheme.dissipates() && !restores_rates {
            let message = "joints with Lagrange multipliers need a scheme with numerical dissipation: otherwise \
                           accelerations and joint forces oscillate from step to step";
            let help = "use scheme = \"generalized_alpha\"; without dissipation the run may even fail to converge";
            let diagnostic = Diagnostic::warning(WarningKind::UndampedMultipliers, message, stage.span.clone());
            diagnostics.push(diagnostic.help(help));
        }
    }
}

/// Warns of beams that bend more easily about one axis than about another, and turn about their own axis without inertia.
pub fn warn_of_loose_spins(beams: &[String], deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    for beam in deck.beams.iter().filter(|beam| beams.contains(&beam.name.value)) {
        let message = format!(
            "nothing resists a spin of the beam `{}` about its own axis, and it has no inertia about it: where it bends it \
             turns at once, in leaps, or steps fail",
            beam.name.value
        );
        let help = "give its section rotary inertia, `rhoJ`: of a solid section `rhoA` times the squares of its radii of \
                    gyration";
        diagnostics.push(Diagnostic::warning(WarningKind::LooseSpin, message, beam.name.span.clone()).help(help));
    }
}

/// The stiffness of a beam against stretching and shear, over its bending stiffness and with its length, from
/// which round-off of the first is felt in the second: more than a thousandth of it.
const EXTREME_STIFFNESS: f64 = 1e13;

/// Warns of beams that are meant to be rigid in some direction, and lose the digits of the others.
pub fn warn_of_extreme_stiffness(mesh: &Mesh, deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    for (beam, table) in mesh.beams.iter().zip(&deck.beams) {
        let ratio = |s: f64| {
            let stiffness = beam.section.at(s).stiffness;
            let stiffest = (0..3).map(|k| stiffness[k][k]).fold(0.0, f64::max);
            stiffest * beam.line.length.powi(2) / stiffness[4][4].min(stiffness[5][5])
        };
        let ratio = ratio(0.0).max(ratio(1.0));
        if ratio > EXTREME_STIFFNESS {
            let message = format!(
                "beam `{}` resists stretching or shear {ratio:.0e} times as much as bending: about {:.0} of 16 digits are \
                 lost in round-off",
                beam.name,
                ratio.log10()
            );
            let help = "EA and GA of 1e6 EI/length^2 are as good as rigid: displacements change by less than 1e-5";
            let diagnostic = Diagnostic::warning(WarningKind::ExtremeStiffness, message, table.name.span.clone());
            diagnostics.push(diagnostic.help(help));
        }
    }
}

/// A point mass on no beam has no rotation to speak of. Directions of its rotation that neither
/// inertia nor a spring nor a constraint touches are held, so that the tangent stays regular.
pub fn loose_rotations(deck: &Deck, mesh: &Mesh, composition: &Composition, held: &[Support]) -> Vec<Support> {
    let Composition { bodies, springs, jointed, .. } = composition;
    let on_beams: HashSet<usize> = mesh.beams.iter().flat_map(|beam| beam.nodes.iter().copied()).collect();
    let mut supports = Vec::new();
    for &node in deck.bodies.iter().filter_map(|body| mesh.points.get(&body.at.value)) {
        let slot = mesh.nodes[node].node.p;
        let moved =
            |m: &deck::Motion| m.at.value == mesh.name_of(node) && matches!(m.what, MotionWhat::Rotation { .. });
        if on_beams.contains(&node) || jointed.contains(&node) || deck.motions.iter().any(moved) {
            continue;
        }
        let holding = || held.iter().filter(|support| support.directions.iter().any(|d| d.slot == slot));
        let stages = match holding().any(|support| support.stages.0.is_some()) {
            true => (0..deck.stages.len()).map(|stage| StageSet(Some(vec![stage]))).collect(),
            false => vec![StageSet::default()],
        };
        for stages in stages {
            let mut touched = Mat3::ZERO;
            let mut touch = |m: Mat3| {
                if m.max_abs() > 0.0 {
                    touched += m * (1.0 / m.max_abs());
                }
            };
            bodies.iter().filter(|b| b.node.p == slot).for_each(|b| touch(b.inertia.about_node));
            springs.iter().filter(|s| s.node.p == slot).for_each(|s| touch(s.rotation));
            let holds = |support: &&Support| stages.0.iter().flatten().all(|&stage| support.stages.contains(stage));
            let directions = holding().filter(holds).flat_map(|support| &support.directions);
            directions.filter(|d| d.slot == slot).for_each(|d| touch(d.axis.outer(d.axis)));
            let directions = untouched(touched).into_iter().map(|axis| Direction { slot, axis }).collect();
            supports.push(Support { directions, stages });
        }
    }
    supports
}

/// A moment about an axis that nothing holds, and that has no inertia either, has no answer;
/// `loose`: see [`loose_rotations`].
pub fn refuse_moments(deck: &Deck, mesh: &Mesh, loose: &[Support], diagnostics: &mut Vec<Diagnostic>) {
    let axes = |node: &str| {
        let slot = mesh.points.get(node).map(|&node| mesh.nodes[node].node.p);
        // Where a support holds in some stages, a moment may act in those.
        let always = loose.iter().filter(|support| support.stages.0.is_none());
        let directions = always.flat_map(|support| &support.directions);
        directions.filter(move |direction| Some(direction.slot) == slot).map(|direction| direction.axis)
    };
    for load in &deck.loads {
        let (LoadTarget::At(at), Some(moment)) = (&load.target, &load.moment) else { continue };
        let moment = Vec3(moment.start);
        if axes(&at.value).any(|axis| axis.dot(moment).abs() > 1e-9 * moment.norm()) {
            let message =
                format!("the moment on `{}` acts about an axis without inertia and without constraint", at.value);
            let help = "give the body `inertia` about it, or constrain it by a support or a spring";
            diagnostics.push(Diagnostic::error(message, load.span.clone()).help(help));
        }
    }
}

/// The directions without an eigenvalue.
fn untouched(m: Mat3) -> Vec<Vec3> {
    if m == Mat3::ZERO {
        return Vec3::UNIT.to_vec();
    }
    let eigen = SymmetricEigen::new(Matrix3::from_fn(|i, j| m.0[i][j]));
    let empty = (0..3).filter(|&k| eigen.eigenvalues[k].abs() < 1e-12);
    empty.map(|k| Vec3([0, 1, 2].map(|i| eigen.eigenvectors[(i, k)]))).collect()
}
