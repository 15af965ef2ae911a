//! Factorisations by blocks against faer's, on patterns of every kind, and against eigenvalues.

use crate::decks::decks;
use crate::random::Random;
use beamsim::scene;
use beamsim_core::kernel::{ElementSystem, Weights};
use beamsim_core::model::{Assembly, Model, Schedule, SlotKind, StageContext, StageKind, charts};
use beamsim_core::solve::{BlockSolver, Factorisation, GeneralSolver, LinearSolver, Tangent, is_symmetric};
use beamsim_core::system::{
    Category, Connectivity, Direction, DofMap, Layout, Memory, NodeBlocks, Pattern, Plane, ResidualBuffer, State,
    Symmetry, System,
};
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::threads;
use nalgebra::DMatrix;
use std::f64::consts::PI;

const SYMMETRIES: [Symmetry; 3] = [Symmetry::Whole, Symmetry::BetweenNodeBlocks, Symmetry::None];

/// Pairs of nodes that meet.
fn chain(nodes: usize) -> Vec<[usize; 2]> {
    (1..nodes).map(|k| [k - 1, k]).collect()
}

fn tree(nodes: usize, random: &mut Random) -> Vec<[usize; 2]> {
    (1..nodes).map(|k| [random.range(0.0, k as f64) as usize, k]).collect()
}

fn ring(nodes: usize) -> Vec<[usize; 2]> {
    (0..nodes).map(|k| [k, (k + 1) % nodes]).collect()
}

fn lattice(across: usize) -> Vec<[usize; 2]> {
    let right = (0..across * across).filter(|k| k % across + 1 < across).map(|k| [k, k + 1]);
    right.chain((0..across * (across - 1)).map(|k| [k, k + across])).collect()
}

/// A tangent of nodes with two slots, each edge an element of two nodes with random blocks, some directions held, some along
/// turned axes; `shift` of the identity is added at each node.
fn system(edges: &[[usize; 2]], symmetry: Symmetry, shift: f64, random: &mut Random) -> System {
    system_in(None, edges, symmetry, shift, random)
}

/// The same in a plane, where there is one.
fn system_in(
    plane: Option<Plane>,
    edges: &[[usize; 2]],
    symmetry: Symmetry,
    shift: f64,
    random: &mut Random,
) -> System {
    let nodes = 1 + edges.iter().flatten().max().unwrap();
    let mut connectivity = Connectivity::default();
    for [a, b] in edges {
        connectivity.push([a, a, b, b].into_iter().zip([0, 1, 0, 1]).map(|(&node, half)| (2 * node + half) as u32));
    }
    let mut own = Connectivity::default();
    (0..2 * nodes as u32).for_each(|slot| own.push([slot]));
    let turns = |slot: u32| slot % 2 == 1;
    let slanted = match plane {
        None => Direction { slot: 3, axis: Vec3([0.6, 0.0, 0.8]) },
        Some(_) => Direction { slot: 2, axis: Vec3([0.6, 0.8, 0.0]) },
    };
    let first = Direction { slot: 0, axis: Vec3::UNIT[1] };
    // In large scenes some that come late in the order of elimination, too.
    let late = [(nodes as u32 | 1, Vec3::UNIT[2]), (2 * nodes as u32 - 2, Vec3::UNIT[1])];
    let late = late.map(|(slot, axis)| Direction { slot, axis });
    let mut held = vec![first, slanted];
    held.extend(late.into_iter().filter(|_| nodes > 10));
    let (dof_map, layout) = match plane {
        None => (DofMap::new(2 * nodes, &held).unwrap(), Layout::Spatial),
        Some(plane) => (DofMap::planar(2 * nodes, &held, plane, turns).unwrap(), Layout::Planar),
    };
    let node_blocks = NodeBlocks::new(2 * nodes, layout, turns);
    let pattern = Pattern::new(dof_map, node_blocks, vec![connectivity, own], symmetry);
    let mut system = System::new(pattern, 2 * nodes, &[], &[]);
    system.clear(None);
    for k in 0..edges.len() {
        let mut element = ElementSystem::new(4);
        for (row, column) in (0..4).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let block = random.tensor(1.0);
            // Blocks of one node, and those between nodes.
            let symmetric = symmetry == Symmetry::Whole || (symmetry.halves() && row / 2 != column / 2);
            let block = if row == column && symmetric { block + block.transpose() } else { block };
            element.set_tangent(row, column, &block);
            if row != column {
                element.set_tangent(column, row, &if symmetric { block.transpose() } else { random.tensor(1.0) });
            }
        }
        system.assembler(0, Category::Internal, true).add(k, &element);
    }
    for slot in 0..2 * nodes {
        let mut element = ElementSystem::new(1);
        element.set_tangent(0, 0, &Mat3::IDENTITY.scale(shift));
        system.assembler(1, Category::Internal, true).add(slot, &element);
    }
    system
}

fn dense(system: &System) -> DMatrix<f64> {
    let n = system.pattern.dof_map.count();
    let entry = |i: usize, j: usize| system.pattern.find(i as u32, j as u32).map_or(0.0, |k| system.values[k]);
    DMatrix::from_fn(n, n, entry)
}

fn patterns(random: &mut Random) -> Vec<(&'static str, Vec<[usize; 2]>)> {
    vec![
        ("pair", chain(2)),
        ("chain", chain(40)),
        ("tree", tree(60, random)),
        ("ring", ring(30)),
        ("lattice", lattice(5)),
    ]
}

/// Large enough to be eliminated in branches.
fn large_patterns(random: &mut Random) -> Vec<(&'static str, Vec<[usize; 2]>)> {
    let chains = (0..40).flat_map(|k| chain(50).into_iter().map(move |[a, b]| [50 * k + a, 50 * k + b]));
    let ladder = chain(800).into_iter().flat_map(|[a, b]| [[2 * a, 2 * b], [2 * a + 1, 2 * b + 1], [2 * a, 2 * a + 1]]);
    vec![
        ("long chain", chain(3000)),
        ("large tree", tree(2000, random)),
        ("large ring", ring(1500)),
        ("chains", chains.collect()),
        ("ladder", ladder.collect()),
    ]
}

#[test]
fn blocks_solve_what_faer_solves() {
    let mut random = Random::new(3);
    for (name, edges) in [patterns(&mut random), large_patterns(&mut random)].concat() {
        for plane in [None, Plane::normal_to(Vec3::UNIT[2])] {
            for (symmetry, shift) in SYMMETRIES.into_iter().flat_map(|symmetry| [(symmetry, 0.0), (symmetry, 30.0)]) {
                let what = format!("{name}, planar {}, symmetry {symmetry:?}, shift {shift}", plane.is_some());
                solve_both_ways(&what, plane, &edges, symmetry, shift, &mut random);
            }
        }
    }
}

fn solve_both_ways(
    what: &str,
    plane: Option<Plane>,
    edges: &[[usize; 2]],
    symmetry: Symmetry,
    shift: f64,
    random: &mut Random,
) {
    let other = system_in(plane, edges, symmetry, 30.0, random);
    let system = system_in(plane, edges, symmetry, shift, random);
    let n = system.pattern.dof_map.count();
    let wanted: Vec<f64> = (0..n).map(|_| random.range(-1.0, 1.0)).collect();
    let (mut by_blocks, mut by_faer) = (wanted.clone(), wanted.clone());
    let mut blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
    // What other tangents have left behind is gone, even where they broke down half-way.
    let mut broken = other.clone();
    let middle = system.pattern.find(n as u32 / 2, n as u32 / 2).unwrap();
    broken.values[middle] = f64::NAN;
    assert!(blocks.factorise(other.matrix()) && !blocks.factorise(broken.matrix()), "{what}");
    assert!(blocks.factorise(system.matrix()), "{what}");
    blocks.solve(system.matrix(), &mut by_blocks);
    let mut general = GeneralSolver::new(&system).unwrap();
    assert!(general.factorise(&system), "{what}");
    general.solve(&mut by_faer);
    let largest = by_faer.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let apart = by_blocks.iter().zip(&by_faer).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    // Without a dominant diagonal pivots that are not looked for across blocks cost digits.
    let allowed = if shift > 0.0 { 1e-14 } else { 1e-8 };
    assert!(apart <= allowed * largest, "{what}: {apart:e}");
    let error = system.residual(&wanted, &by_faer, &mut ResidualBuffer::default());
    assert!(error < 1e-13, "{what}: {error:e}");
}

/// To the last bit, on any number of threads; and multiplied again they give the tangent.
#[test]
fn factors_in_the_place_of_a_tangent_solve_as_those_beside_it() {
    let mut random = Random::new(21);
    let mut elsewhere = Vec::new();
    for (name, edges) in [patterns(&mut random), large_patterns(&mut random)].concat() {
        for plane in [None, Plane::normal_to(Vec3::UNIT[2])] {
            for symmetry in SYMMETRIES {
                let what = format!("{name}, planar {}, symmetry {symmetry:?}", plane.is_some());
                let system = system_in(plane, &edges, symmetry, 30.0, &mut random);
                let n = system.pattern.dof_map.count();
                let wanted: Vec<f64> = (0..n).map(|_| random.range(-1.0, 1.0)).collect();
                let mut blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
                let mut beside = wanted.clone();
                assert!(blocks.factorise(system.matrix()) && blocks.is_sure(), "{what}");
                blocks.solve(system.matrix(), &mut beside);
                if !blocks.can_stay_within(&system) {
                    elsewhere.push(name);
                    continue;
                }
                let solve = || {
                    let (mut used_up, mut x) = (system.clone(), wanted.clone());
                    let mut blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
                    assert!(blocks.factorise_within(&mut used_up) && blocks.is_sure(), "{what}");
                    assert!(used_up.holds_factors(), "{what}");
                    blocks.solve(used_up.matrix(), &mut x);
                    x
                };
                assert_eq!(solve(), beside, "{what}");
                assert_eq!(threads::on(3, solve), beside, "{what}");
                // What was factorised in another way before is gone.
                let mut used_up = system.clone();
                assert!(blocks.factorise_within(&mut used_up) && blocks.factorise(system.matrix()), "{what}");
                let mut again = wanted.clone();
                blocks.solve(system.matrix(), &mut again);
                assert_eq!(again, beside, "{what}");
            }
        }
    }
    // Branches of trees have nodes from everywhere.
    elsewhere.dedup();
    assert_eq!(elsewhere, ["large tree", "large ring"]);
}

/// To the last bit, whichever directions are held, in space and in planes, those of turned axes among them.
#[test]
fn corrections_by_nodes_are_those_by_equations() {
    let mut random = Random::new(29);
    for (name, edges) in patterns(&mut random) {
        for normal in [None, Some(Vec3::UNIT[2]), Some(Vec3::UNIT[1]), Some(Vec3([0.6, -0.48, 0.64]))] {
            let mut system =
                system_in(normal.and_then(Plane::normal_to), &edges, Symmetry::BetweenNodeBlocks, 30.0, &mut random);
            let mut vector = || Vec3([(); 3].map(|()| random.range(-1.0, 1.0)));
            let force: Vec<Vec3> = system.force[Category::Internal as usize].iter().map(|_| vector()).collect();
            let held: Vec<Vec3> = force.iter().map(|_| vector()).collect();
            system.force[Category::Internal as usize].copy_from_slice(&force);
            let mut blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
            assert!(blocks.factorise(system.matrix()), "{name}");
            let mut x = vec![0.0; system.pattern.dof_map.count()];
            system.right_hand_side(&mut x);
            assert!(x.iter().all(|&x| x != 0.0), "{name}: no forces");
            blocks.solve(system.matrix(), &mut x);
            for held in [None, Some(&held[..])] {
                // Nothing of what stood there before may stay.
                let (mut by_nodes, mut by_equations) = (force.clone(), force.clone());
                assert!(blocks.correct(&system, held, &mut by_nodes), "{name}");
                system.pattern.dof_map.scatter(&x, held, &mut by_equations);
                assert_eq!(by_nodes, by_equations, "{name}, normal {normal:?}, held {}", held.is_some());
            }
        }
    }
}

/// Of two nodes: what the first takes from the second is `taken` times what that has.
fn taking(symmetry: Symmetry, taken: f64) -> System {
    let mut system = system(&chain(2), symmetry, 0.0, &mut Random::new(5));
    let pattern = system.pattern.clone();
    let n = pattern.dof_map.count() as u32;
    for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
        let [own, other] = [row, column].map(|k| pattern.dof_map.direction(k as usize));
        let same = own.axis == other.axis && own.slot % 2 == other.slot % 2;
        let value = match (own.slot / 2, other.slot / 2) {
            _ if !same => 0.0,
            (0, 0) => 1.0,
            (1, 1) => 1.0 / taken,
            _ => 1.0,
        };
        if let Some(place) = pattern.find(row, column) {
            system.values[place] = value;
        }
    }
    system
}

#[test]
fn factorisations_that_lose_digits_are_not_sure() {
    for (symmetry, taken, sure) in [
        (Symmetry::None, 0.5, true),
        (Symmetry::None, 100.0, true),
        (Symmetry::None, 1e4, false),
        (Symmetry::None, -100.0, true),
        // No digits are lost, but that is not known of negative pivots.
        (Symmetry::Whole, 0.5, true),
        (Symmetry::Whole, 100.0, false),
    ] {
        let system = taking(symmetry, taken);
        let mut blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
        assert!(blocks.factorise(system.matrix()));
        assert_eq!(blocks.is_sure(), sure, "{symmetry:?}, {taken}");
    }
}

/// A tangent that may go is used up where nothing is lost by that, and there again for who looks at it.
#[test]
fn tangents_are_used_up_where_that_loses_no_digits() {
    for kind in ["kind = \"static\"\nsteps = 1", "kind = \"dynamic\"\nend = 1\nstep = 1"] {
        let deck = format!(
            "[point]\nroot = [0, 0, 0]\ntip = [1, 0, 0]\n[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 10\nEI = 10\nrhoA = 1\n\
             rhoJ = [2, 1, 1]\n[[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 20\n\
             [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 5, 1]\n[[stage]]\n{kind}\n\
             [effects]\nplanar = false\n"
        );
        let Ok((scene, _)) = scene::from_text(&deck) else { panic!("the deck is good: {deck}") };
        let (model, stage) = (scene.plan.model, scene.plan.stages[0].context(0));
        let rest = model.rest();
        let mut schedule = Schedule::new(&model);
        let Ok(dof_map) = schedule.begin_stage(&model, 0, stage.kind, &rest) else { panic!("the stage begins") };
        let mut assembly = Assembly::new(&stage, dof_map, &model);
        let mut solver = LinearSolver::new(&assembly.system, &[], 1.0).unwrap();
        let wanted: Vec<f64> = (0..assembly.system.pattern.dof_map.count()).map(|k| (k as f64).sin()).collect();
        // Pulled apart it is definite; of pushed together there are negative pivots.
        for (sign, goes) in [
            (1.0, true),
            (-1.0, stage.kind == StageKind::Dynamic),
            (1.0, stage.kind == StageKind::Dynamic),
            (1.0, true),
        ] {
            let weights = Weights { stiffness: sign, damping: 0.0, mass: if sign > 0.0 { 4.0 } else { -4.0 } };
            assembly.evaluate(&rest, weights, None);
            let before = assembly.system.clone();
            let mut tangent = Tangent::that_may_go(&mut assembly, &rest, weights);
            assert_eq!(solver.factorise_new(&mut tangent), Factorisation { is_done: true, is_new: true });
            assert_eq!(tangent.system().holds_factors(), goes, "{kind} {sign}");
            assert_eq!(solver.factorise_new(&mut tangent), Factorisation { is_done: true, is_new: false });
            let mut x = wanted.clone();
            assert!(solver.solve(tangent.system(), &mut x));
            assert!(before.residual(&wanted, &x, &mut ResidualBuffer::default()) < 1e-12);
            assert_eq!(tangent.look().values, before.values);
            assert!(!tangent.system().holds_factors());
        }
    }
}

/// Taken as it stands, a pivot of 1e-13 would leave three digits.
#[test]
fn rows_with_small_pivots_wait() {
    let mut random = Random::new(12);
    let mut system = system(&tree(20, &mut random), Symmetry::None, 0.0, &mut random);
    let n = system.pattern.dof_map.count() as u32;
    for k in 0..n {
        let place = system.pattern.find(k, k).unwrap();
        system.values[place] = 1e-13;
    }
    let wanted: Vec<f64> = (0..n).map(|_| random.range(-1.0, 1.0)).collect();
    let mut x = wanted.clone();
    let mut blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
    assert!(blocks.factorise(system.matrix()));
    blocks.solve(system.matrix(), &mut x);
    let left = system.residual(&wanted, &x, &mut ResidualBuffer::default());
    assert!(left < 1e-11, "{left:e}");
}

#[test]
fn pivots_that_are_no_numbers_end_a_factorisation() {
    let mut random = Random::new(13);
    for plane in [None, Plane::normal_to(Vec3::UNIT[2])] {
        for symmetry in SYMMETRIES {
            let system = system_in(plane, &tree(20, &mut random), symmetry, 30.0, &mut random);
            let n = system.pattern.dof_map.count() as u32;
            let mut blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
            let mut with = |values: &dyn Fn(u32, u32) -> Option<f64>| {
                let mut changed = system.clone();
                for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
                    if let (Some(place), Some(value)) = (system.pattern.find(row, column), values(row, column)) {
                        changed.values[place] = value;
                    }
                }
                blocks.factorise(changed.matrix())
            };
            let at = n / 2;
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(!with(&|row, column| (row == at && column == at).then_some(value)), "{value} at {at}");
                assert!(!with(&|row, column| (row == at || column == at).then_some(value)), "{value} beside {at}");
            }
            // Nothing, or as good as nothing, in all rows and columns of a node.
            for value in [0.0, -0.0, 1e-310] {
                let slot = |k: u32| system.pattern.dof_map.direction(k as usize).slot / 2;
                let meets = |row: u32, column: u32| slot(row) == slot(at) || slot(column) == slot(at);
                let entry = |row: u32, column: u32| if row == column { value } else { 0.0 };
                assert!(!with(&|row, column| meets(row, column).then(|| entry(row, column))), "{value:e}");
            }
            assert!(with(&|_, _| None));
        }
    }
}

#[test]
fn negative_pivots_are_negative_eigenvalues() {
    let mut random = Random::new(4);
    for (name, edges) in patterns(&mut random) {
        let system = system(&edges, Symmetry::Whole, 1.0, &mut random);
        let eigenvalues = dense(&system).symmetric_eigenvalues();
        let negative = eigenvalues.iter().filter(|&&value| value < 0.0).count();
        let mut blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
        assert!(blocks.factorise(system.matrix()));
        assert!(negative > 0);
        assert_eq!(blocks.negative(), Some(negative), "{name}");
    }
}

/// Branches leave to the trunk what one row after the other leaves, and no order fills more than that of least degree.
#[test]
fn large_patterns_are_eliminated_in_branches() {
    let mut random = Random::new(9);
    for (name, edges) in large_patterns(&mut random) {
        let system = system(&edges, Symmetry::Whole, 30.0, &mut random);
        let blocks = BlockSolver::new(&system.pattern, &[]).unwrap();
        let sizes = blocks.branches();
        let nodes = system.pattern.node_blocks.count();
        let trunk = nodes - sizes.iter().sum::<usize>();
        println!("{name}: {sizes:?} and {trunk}, {} blocks", blocks.blocks());
        assert!(sizes.len() > 1 && trunk < 64, "{name}: {sizes:?}");
        assert!(sizes.iter().all(|size| 4 * size <= 3 * nodes), "{name}: {sizes:?}");
        if !name.contains("ring") && name != "ladder" {
            assert_eq!(blocks.blocks(), system.pattern.pairs(), "{name}");
        }
    }
}

#[test]
fn what_a_system_multiplies_is_its_matrix() {
    let mut random = Random::new(5);
    for symmetry in SYMMETRIES {
        multiply_both_ways(&system(&tree(12, &mut random), symmetry, 2.0, &mut random), &mut random);
        multiply_in_regions(&system(&tree(3000, &mut random), symmetry, 2.0, &mut random), &mut random);
    }
}

/// Entry by entry, where tiles lie in regions and between them.
fn multiply_in_regions(system: &System, random: &mut Random) {
    assert!(system.is_cut());
    let x: Vec<f64> = (0..system.pattern.dof_map.count()).map(|_| random.range(-1.0, 1.0)).collect();
    let mut expected = vec![0.0; x.len()];
    for (column, x) in x.iter().enumerate() {
        for entry in system.pattern.entries(column as u32) {
            expected[entry.row as usize] += system.values[entry.place] * x;
        }
    }
    let product = system.multiply(&system.values, &x);
    assert!(product.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
    assert!(system.residual(&product, &x, &mut ResidualBuffer::default()) < 1e-14);
}

fn multiply_both_ways(system: &System, random: &mut Random) {
    let matrix = dense(system);
    assert_eq!(matrix == matrix.transpose(), system.pattern.symmetry == Symmetry::Whole);
    let x: Vec<f64> = (0..matrix.ncols()).map(|_| random.range(-1.0, 1.0)).collect();
    let expected = &matrix * nalgebra::DVector::from_column_slice(&x);
    let product = system.multiply(&system.values, &x);
    assert!(product.iter().zip(expected.iter()).all(|(a, b)| (a - b).abs() < 1e-14));
    assert!(system.residual(&product, &x, &mut ResidualBuffer::default()) < 1e-15);
    let nonzeros = matrix.iter().filter(|&&value| value != 0.0).count();
    assert_eq!(system.pattern.nonzeros(), nonzeros);
    for column in 0..matrix.ncols() {
        for entry in system.pattern.entries(column as u32) {
            assert_eq!(system.values[entry.place], matrix[(entry.row as usize, column)]);
        }
    }
}

/// A zero where a block wants its pivot: blocks give up, the solver goes on in general.
#[test]
fn a_lost_pivot_is_no_lost_solution() {
    let mut random = Random::new(6);
    let mut system = system(&chain(3), Symmetry::Whole, 0.0, &mut random);
    // Nodes that only meet each other: their own tiles are empty.
    let n = system.pattern.dof_map.count() as u32;
    for column in 0..n {
        for row in 0..n {
            let node = |k: u32| system.pattern.dof_map.direction(k as usize).slot / 2;
            if (node(row), node(column)) == (0, 0) || (node(row), node(column)) == (2, 2) {
                let place = system.pattern.find(row, column).unwrap();
                system.values[place] = 0.0;
            }
        }
    }
    // Two nodes of one tile each hang on one: eleven unknowns on six are singular, so one of them gets stiffness.
    for k in 0..n {
        if system.pattern.dof_map.direction(k as usize).slot / 2 == 2 {
            let place = system.pattern.find(k, k).unwrap();
            system.values[place] = 1.0;
        }
    }
    let wanted: Vec<f64> = (0..n).map(|_| random.range(-1.0, 1.0)).collect();
    let mut solver = LinearSolver::new(&system, &[], 1.0).unwrap();
    assert_eq!(solver.name(), "block LDL^T");
    let mut x = wanted.clone();
    // Positive pivots of the tangent before vouch for nothing.
    let mut before = system.clone();
    for column in 0..n {
        for entry in system.pattern.entries(column) {
            before.values[entry.place] = f64::from(u8::from(entry.row == column));
        }
    }
    assert!(solver.factorise(&before) && solver.solve(&before, &mut x) && x == wanted);
    assert!(solver.factorise(&system) && solver.solve(&system, &mut x));
    assert_eq!(solver.name(), "sparse LU");
    assert!(system.residual(&wanted, &x, &mut ResidualBuffer::default()) < 1e-13);
}

#[test]
fn nets_are_left_to_faer() {
    let mut random = Random::new(7);
    let system = system(&lattice(120), Symmetry::Whole, 30.0, &mut random);
    assert!(BlockSolver::new(&system.pattern, &[]).is_none());
    assert_eq!(LinearSolver::new(&system, &[], 1.0).unwrap().name(), "sparse LU");
}

/// Of several effects the least symmetric one counts, and of one whether it couples nodes at all.
#[test]
fn what_sits_at_single_nodes_leaves_halves() {
    let node_blocks = NodeBlocks::new(6, Layout::Spatial, |slot| slot % 2 == 1);
    let clique = |slots: &[u32]| {
        let mut connectivity = Connectivity::default();
        connectivity.push(slots.iter().copied());
        connectivity
    };
    let (own, between, parted) = (clique(&[2, 3]), clique(&[0, 1, 2, 3]), clique(&[2, 5]));
    let of = |effects: &[(&Connectivity, bool)]| Symmetry::of(effects.iter().copied(), &node_blocks);
    assert_eq!(of(&[]), Symmetry::Whole);
    assert_eq!(of(&[(&between, true), (&own, true)]), Symmetry::Whole);
    assert_eq!(of(&[(&between, true), (&own, false)]), Symmetry::BetweenNodeBlocks);
    assert_eq!(of(&[(&between, false), (&own, false)]), Symmetry::None);
    // Its displacement belongs to another node.
    assert_eq!(of(&[(&between, true), (&parted, false)]), Symmetry::None);
}

/// Effects that call their tangent symmetric are taken at their word: one half of it is kept, be it only between nodes.
#[test]
fn what_is_called_symmetric_is() {
    let mut random = Random::new(8);
    let (mut symmetric, mut between) = (0, 0);
    for path in ["decks", "decks/minimal", "decks/peers", "decks/hard", "decks/paths"].map(decks).concat() {
        let text = std::fs::read_to_string(&path).unwrap();
        let Ok((scene, _)) = scene::from_text(&text) else { continue };
        let (model, stage) = (scene.plan.model, scene.plan.stages[0].context(0));
        let mut state = model.rest();
        let mut schedule = Schedule::new(&model);
        let Ok(dof_map) = schedule.begin_stage(&model, 0, stage.kind, &state) else { continue };
        if dof_map.count() == 0 || dof_map.count() > 600 {
            continue;
        }
        let mut assembly = Assembly::new(&stage, dof_map, &model);
        let symmetry = assembly.system.pattern.symmetry;
        if !symmetry.halves() {
            continue;
        }
        schedule.set_clock(&model, &mut state, 0.1, 0.7);
        for turned in [false, true] {
            shake(&model, &stage, turned, &mut state, &mut random);
            let weights = Weights { stiffness: 1.0, damping: 0.3, mass: 0.2 };
            assembly.evaluate(&state, weights, None);
            let (half, whole) = (&assembly.system, whole_tangent(&assembly, &model, &stage, &state, weights));
            assert!(!whole.pattern.symmetry.halves(), "{}", path.display());
            if symmetry == Symmetry::Whole {
                assert!(is_symmetric(&whole.pattern, &whole.values), "{}", path.display());
            }
            assert_eq!(
                (half.pattern.nonzeros(), half.pattern.pairs()),
                (whole.pattern.nonzeros(), whole.pattern.pairs())
            );
            let x: Vec<f64> = (0..half.pattern.dof_map.count()).map(|_| random.range(-1.0, 1.0)).collect();
            let products = [half, &whole].map(|system| system.multiply(&system.values, &x));
            let sizes = whole.multiply(&whole.values.iter().map(|v| v.abs()).collect::<Vec<_>>(), &vec![1.0; x.len()]);
            let apart = products[0].iter().zip(&products[1]).zip(&sizes);
            // Numbers that small have lost digits of their own.
            let near = |((a, b), size): ((&f64, &f64), &f64)| (a - b).abs() <= 1e-12 * size.max(1e-280);
            assert!(apart.clone().all(near), "{}", path.display());
            assert!(half.residual(&products[1], &x, &mut ResidualBuffer::default()) < 1e-12, "{}", path.display());
            [half, &whole].into_iter().for_each(own_blocks_are_entries);
        }
        *(if symmetry == Symmetry::Whole { &mut symmetric } else { &mut between }) += 1;
    }
    assert!(symmetric > 50 && between > 20, "{symmetric} and {between}");
}

/// Somewhere, moving where a stage moves; where all is `turned`, half a turn away, so that neighbours sit in different charts.
fn shake(model: &Model, stage: &StageContext, turned: bool, state: &mut State, random: &mut Random) {
    let about = random.vector(1.0).normalized().unwrap() * if turned { PI } else { 0.0 };
    for (slot, kind) in model.kinds.iter().enumerate() {
        let mut any = || random.vector(0.1 * model.length / kind.arm(model.length));
        state.q[slot] = any() + if *kind == SlotKind::Rotation { about } else { Vec3::ZERO };
        if stage.kind == StageKind::Dynamic {
            (state.v[slot], state.a[slot]) = (any(), any());
        }
    }
    charts::switch(state, &model.charted(stage.kind).rotations, charts::DYNAMIC_BAND, None);
    charts::freeze(state, &model.charted(stage.kind).elements);
}

/// Blocks and entries on the diagonal are those that a search finds.
fn own_blocks_are_entries(system: &System) {
    let entry = |row: u32, column: u32| system.pattern.find(row, column).map_or(0.0, |place| system.values[place]);
    for slot in 0..system.pattern.node_blocks.slots() as u32 {
        let numbers = system.pattern.dof_map.of(slot);
        let block = numbers.map(|row| numbers.map(|column| entry(row, column)));
        assert_eq!(system.own_block(slot).0, block, "slot {slot}");
    }
    let mut diagonal = vec![f64::NAN; system.pattern.dof_map.count()];
    system.pattern.each_diagonal(|equation, place| diagonal[equation] = system.values[place]);
    for (equation, value) in (0..).zip(diagonal) {
        assert_eq!(value, entry(equation, equation), "equation {equation}");
    }
}

/// What the effects of a stage add to the tangent, on a pattern that keeps both halves.
fn whole_tangent(assembly: &Assembly, model: &Model, stage: &StageContext, state: &State, weights: Weights) -> System {
    let dof_map = assembly.system.pattern.dof_map.clone();
    let (effects, plane) = (model.acting(stage), dof_map.plane().copied());
    let connectivity = effects.iter().map(|effect| effect.connectivity()).collect();
    let pattern = Pattern::new(dof_map.clone(), model.node_blocks(dof_map.layout()), connectivity, Symmetry::None);
    let mut system = System::new(pattern, model.slots(), &Category::ALL, &[]);
    for (number, effect) in effects.into_iter().enumerate().filter(|(_, effect)| effect.tangent().exists()) {
        let mut sink = system.assembler(number, effect.category(), true);
        match plane.and_then(|plane| effect.clone().in_plane(&plane)) {
            Some(planar) => planar.add(state, &Memory::default(), weights, &mut sink),
            None => effect.add(state, &Memory::default(), weights, &mut sink),
        }
    }
    system
}

/// In space the nodes of a plane meet as they do in it, and no others: what is known of the order serves both, whether the tangent is
/// symmetric in both or, since sections turn out of the plane, in the plane alone.
#[test]
fn space_takes_over_the_order_of_a_plane() {
    let planar = |elements: usize, stage: &str| {
        let deck = format!(
            "[point]\nroot = [0, 0, 0]\ntip = [4, 3, 0]\n\
             [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e3\nEI = 1e3\nrhoA = 1\nrhoJ = [2, 1, 1]\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = {elements}\n\
             [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 5, 0]\n[[stage]]\n{stage}\n"
        );
        let Ok((scene, _)) = scene::from_text(&deck) else { panic!("the deck is good") };
        let (model, stage) = (scene.plan.model, scene.plan.stages[0].context(0));
        let mut schedule = Schedule::new(&model);
        let Ok(dof_map) = schedule.begin_stage(&model, 0, stage.kind, &model.rest()) else {
            panic!("the stage begins")
        };
        let plane = Assembly::new(&stage, dof_map, &model);
        (model, schedule, stage, plane)
    };
    let (statics, dynamics) = ("kind = \"static\"\nsteps = 1", "kind = \"dynamic\"\nend = 1\nstep = 1");
    for (kind, symmetry) in [(statics, Symmetry::Whole), (dynamics, Symmetry::BetweenNodeBlocks)] {
        let (model, schedule, stage, plane) = planar(9000, kind);
        let Ok(dof_map) = schedule.dof_map(&model, None) else { panic!("so it does in space") };
        let mut space = Assembly::new(&stage, dof_map, &model);
        assert!(plane.system.pattern.width() < space.system.pattern.width());
        assert_eq!(plane.system.pattern.symmetry, Symmetry::Whole);
        assert_eq!(space.system.pattern.symmetry, symmetry);
        assert!(space.system.pattern.is_like(&plane.system.pattern));
        let own = LinearSolver::new(&plane.system, &[], 1.0).unwrap();
        let mut solver = LinearSolver::beside(&own, &plane.system, &space.system, &[], 1.0).unwrap();
        space.evaluate(&model.rest(), Weights { stiffness: 1.0, damping: 2.0, mass: 4.0 }, None);
        if symmetry == Symmetry::Whole {
            let (rest, weights) = (model.rest(), Weights { stiffness: 1.0, damping: 2.0, mass: 4.0 });
            let mut tangent = Tangent::that_may_go(&mut space, &rest, weights);
            assert_eq!(solver.negative_pivots(&mut tangent), Some(0));
            // Formed again, it is what it was.
            tangent.look();
        }
        let solves = |solver: &mut LinearSolver, system: &System| {
            let b: Vec<f64> = (0..system.pattern.dof_map.count()).map(|k| (k as f64).sin()).collect();
            let mut x = b.clone();
            assert!(solver.factorise(system) && solver.solve(system, &mut x));
            assert!(system.residual(&b, &x, &mut ResidualBuffer::default()) < 1e-11);
        };
        solves(&mut solver, &space.system);
        // Where others meet nothing is taken over.
        let (model, _, _, mut other) = planar(7, kind);
        assert!(!space.system.pattern.is_like(&other.system.pattern));
        let mut solver = LinearSolver::beside(&own, &plane.system, &other.system, &[], 1.0).unwrap();
        other.evaluate(&model.rest(), Weights { stiffness: 1.0, damping: 2.0, mass: 4.0 }, None);
        solves(&mut solver, &other.system);
    }
}
