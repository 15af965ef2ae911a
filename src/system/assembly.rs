//! Forces and tangent of the whole scene, and the sink through which one effect adds to them.

use super::equations::Equations;
use super::pattern::{Pattern, Places, TILE, Tile, WIDTH};
use super::plane::Plane;
use super::state::Slot;
use crate::kernel::{ElementSystem, MAX_NODES, PlanarSystem};
use crate::real::{Instructions, LANES, Lanes, each_lane};
use crate::tensor::{Mat3, Vec3};
use std::ops::Range;

/// What a force is; the stop test of Newton and the energy account look at them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Category {
    /// Stress resultants and springs
    Internal,
    /// Mass times acceleration, in all its forms
    Inertia,
    /// Loads, entered with the opposite sign
    External,
    /// What takes energy away with velocities
    Damping,
}

/// The forces g = f_int + f_acc - f_ext, by category and slot, and the values of the tangent J = s K + d C + m M.
///
/// Forces are conjugate to the unknowns of the slot (global components, the chart of the state).
#[derive(Clone, Debug)]
pub struct System {
    /// The pattern of the tangent
    pub pattern: Pattern,
    /// By category and slot
    pub force: [Vec<Vec3>; 4],
    /// Whether each effect's tangent is symmetric, and so their sum
    pub symmetric: bool,
    /// The values of the tangent, tile by tile: that of the last evaluation with weights
    pub values: Vec<f64>,
    /// Counts how often the tangent has become another one
    pub revision: u64,
    /// Prescribed increments of held directions, whose effect on the free equations is collected in `lifted`.
    lift: Vec<Vec3>,
    lifts: bool,
    lifted: Vec<f64>,
    /// Systems of elements that stand side by side, kept between evaluations
    room: Vec<ElementSystem<Lanes>>,
}

impl System {
    /// A system of zeros.
    pub fn new(pattern: Pattern, slots: usize, symmetric: bool) -> Self {
        let zero = vec![Vec3::ZERO; slots];
        let (values, equations) = (pattern.values(), pattern.equations.count());
        Self {
            pattern,
            symmetric,
            force: [zero.clone(), zero.clone(), zero.clone(), zero.clone()],
            values: vec![0.0; values],
            revision: 0,
            lift: zero,
            lifts: false,
            lifted: vec![0.0; equations],
            room: Vec::new(),
        }
    }

    /// Sets forces and tangent to zero. `lift` holds increments of the held directions that the next correction
    /// shall take with it.
    pub fn clear(&mut self, lift: Option<&[Vec3]>) {
        self.clear_forces();
        self.revision += 1;
        self.values.fill(0.0);
        self.lifts = lift.is_some();
        if let Some(lift) = lift {
            self.lift.copy_from_slice(lift);
        }
    }

    /// The sum of the forces at a slot.
    #[inline]
    pub fn total(&self, slot: usize) -> Vec3 {
        self.force[0][slot] + self.force[1][slot] + self.force[2][slot] + self.force[3][slot]
    }

    /// Sets forces to zero for a new evaluation, without prescribed increments; the tangent is left as it is.
    pub fn clear_forces(&mut self) {
        self.forget_forces();
        self.lifted.fill(0.0);
        self.lifts = false;
    }

    /// Drops all forces and keeps the tangent.
    pub fn forget_forces(&mut self) {
        self.force.iter_mut().for_each(|f| f.fill(Vec3::ZERO));
    }

    /// Puts a force in the place of all that stand at a slot.
    pub fn replace_force(&mut self, slot: Slot, force: Vec3) {
        self.force.iter_mut().for_each(|f| f[slot as usize] = Vec3::ZERO);
        self.force[Category::Internal as usize][slot as usize] = force;
    }

    /// The tangent tile by tile, in the order of the pattern; each by its columns. `W` is the width of the pattern.
    pub fn tiles<const W: usize>(&self) -> &[Tile<W>] {
        tiles(&self.values)
    }

    /// A x, for a matrix with these values on the pattern of the tangent.
    pub fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        if self.pattern.width() == WIDTH { self.product::<WIDTH>(values, x) } else { self.product::<3>(values, x) }
    }

    fn product<const W: usize>(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        let mut sums = vec![[0.0; W]; self.pattern.groups.count()];
        let parts = self.pattern.apart::<W>(x);
        self.each_tile::<W>(values, |row, column, tile| {
            for (line, &x) in tile.iter().zip(&parts[column]) {
                sums[row].iter_mut().zip(line).for_each(|(sum, value)| *sum += value * x);
            }
        });
        self.pattern.join(&sums, &mut out);
        out
    }

    /// Shows each tile with the groups of its rows and of its columns.
    #[inline(always)]
    pub fn each_tile<const W: usize>(&self, values: &[f64], mut show: impl FnMut(usize, usize, &Tile<W>)) {
        let mut tiles = tiles(values).iter();
        for column in 0..self.pattern.groups.count() {
            for (&row, tile) in self.pattern.rows_of(column).iter().zip(&mut tiles) {
                show(row as usize, column, tile);
            }
        }
    }

    /// b - A x, and its largest component over what round-off in A, x and b may leave there: |A| |x| + |b|, row by row.
    pub fn residual(&self, b: &[f64], x: &[f64]) -> (Vec<f64>, f64) {
        if self.pattern.width() == WIDTH { self.residual_of::<WIDTH>(b, x) } else { self.residual_of::<3>(b, x) }
    }

    fn residual_of<const W: usize>(&self, b: &[f64], x: &[f64]) -> (Vec<f64>, f64) {
        let parts = self.pattern.apart::<W>(x);
        let mut residuals = self.pattern.apart::<W>(b);
        let mut sizes: Vec<_> = residuals.iter().map(|part| part.map(f64::abs)).collect();
        Instructions::here().run(
            #[inline(always)]
            || {
                self.each_tile::<W>(&self.values, |row, column, tile| {
                    let (mut residual, mut size) = (residuals[row], sizes[row]);
                    for (line, &x) in tile.iter().zip(&parts[column]) {
                        for r in 0..W {
                            let term = line[r] * x;
                            residual[r] -= term;
                            size[r] += term.abs();
                        }
                    }
                    (residuals[row], sizes[row]) = (residual, size);
                });
            },
        );
        // Numbers that small have lost digits of their own.
        let ratio = |(r, size): (&f64, &f64)| r.abs() / size.max(1e-280);
        let worst = residuals.as_flattened().iter().zip(sizes.as_flattened()).map(ratio).fold(0.0, f64::max);
        let mut residual = vec![0.0; b.len()];
        self.pattern.join(&residuals, &mut residual);
        (residual, worst)
    }

    /// The right-hand side of the correction: -g - J lift on the free equations.
    pub fn right_hand_side(&self, out: &mut [f64]) {
        self.fill_right_hand_side(|slot| self.total(slot), out);
    }

    /// The same for other forces than those that were assembled.
    pub fn right_hand_side_of(&self, force: &[Vec3], out: &mut [f64]) {
        self.fill_right_hand_side(|slot| force[slot], out);
    }

    /// The same again, without what prescribed increments bring.
    pub fn right_hand_side_without_lift(&self, force: &[Vec3], out: &mut [f64]) {
        self.right_hand_side_of(force, out);
        out.iter_mut().zip(&self.lifted).for_each(|(out, lifted)| *out += lifted);
    }

    fn fill_right_hand_side(&self, force: impl Fn(usize) -> Vec3, out: &mut [f64]) {
        let equations = &self.pattern.equations;
        for slot in 0..self.force[0].len() {
            let local = equations.to_local(slot as Slot, force(slot));
            for (k, number) in equations.of(slot as Slot).into_iter().enumerate() {
                if number != Equations::HELD {
                    out[number as usize] = -local.0[k] - self.lifted[number as usize];
                }
            }
        }
    }

    /// The sink of effect number `effect`.
    pub fn sink(&mut self, effect: usize, category: Category, with_tangent: bool) -> Sink<'_> {
        Sink {
            places: &self.pattern.places[effect],
            equations: &self.pattern.equations,
            force: &mut self.force,
            category,
            values: &mut self.values,
            lift: self.lifts.then_some(&self.lift[..]),
            lifted: &mut self.lifted,
            room: &mut self.room,
            with_tangent,
        }
    }
}

/// Adds one lane of a tile to its place.
#[inline(always)]
fn add_lane(place: &mut [f64], tile: &[Lanes; TILE], lane: usize) {
    for (sums, lanes) in place.as_chunks_mut::<LANES>().0.iter_mut().zip(tile.as_chunks::<LANES>().0) {
        *sums = (Lanes(*sums) + Lanes(each_lane!(|k| lanes[k].0[lane]))).0;
    }
}

/// Values as tiles.
fn tiles<const W: usize>(values: &[f64]) -> &[Tile<W>] {
    values.as_chunks::<W>().0.as_chunks::<W>().0
}

/// Through this an effect adds the force and tangent of its instances.
pub struct Sink<'a> {
    places: &'a Places,
    equations: &'a Equations,
    force: &'a mut [Vec<Vec3>; 4],
    category: Category,
    values: &'a mut [f64],
    lift: Option<&'a [Vec3]>,
    lifted: &'a mut [f64],
    room: &'a mut Vec<ElementSystem<Lanes>>,
    with_tangent: bool,
}

impl Sink<'_> {
    /// A system of zeros to compute with, of so many blocks.
    pub fn lend(&mut self, blocks: usize) -> ElementSystem<Lanes> {
        let Some(fits) = self.room.iter().position(|system| system.blocks() == blocks) else {
            return ElementSystem::new(blocks);
        };
        let mut system = self.room.swap_remove(fits);
        system.clear();
        system
    }

    /// Takes it back for the next evaluation.
    pub fn take_back(&mut self, system: ElementSystem<Lanes>) {
        self.room.push(system);
    }

    /// Adds instance `k`; the blocks of `element` are in the order of the slots of its clique.
    #[inline]
    pub fn add(&mut self, k: usize, element: &ElementSystem) {
        let forces = &mut self.force[self.category as usize];
        for (force, &slot) in element.forces().iter().zip(self.places.cliques.get(k)) {
            forces[slot as usize] += Vec3(*force);
        }
        if !self.with_tangent {
            return;
        }
        if self.equations.plane().is_some() {
            if let Some(lift) = self.lift {
                self.add_lift(k, &self.in_local_axes(k, element), lift);
            }
            return self.add_in_plane(k, element.tiles(), |value| *value);
        }
        if self.places.special[k] {
            return self.add_special(k, element);
        }
        self.add_tangent(k, element);
    }

    /// Adds the first `count` of the instances from `first` on that stand in lanes, in their order: sums do not depend on who stands
    /// beside whom. An instance that `is_apart` is left to `alone`.
    #[inline(always)]
    pub fn add_lanes(
        &mut self,
        first: usize,
        count: usize,
        elements: &ElementSystem<Lanes>,
        is_apart: impl Fn(usize) -> bool,
        mut alone: impl FnMut(usize, &mut Self),
    ) {
        // In a plane all are special, and none is but where increments are prescribed.
        let special = |sink: &Self, lane: usize| {
            let special =
                if sink.equations.plane().is_some() { sink.lift.is_some() } else { sink.places.special[first + lane] };
            sink.with_tangent && special
        };
        if !(0..count).any(|lane| is_apart(lane) || special(self, lane)) {
            return self.add_plain(first, 0..count, elements);
        }
        for lane in 0..count {
            if is_apart(lane) {
                alone(lane, self);
            } else if special(self, lane) {
                self.add(first + lane, &elements.lane(lane));
            } else {
                self.add_plain(first, lane..lane + 1, elements);
            }
        }
    }

    /// The same where none touches a held direction or turned axes.
    #[inline(always)]
    fn add_plain(&mut self, first: usize, lanes: Range<usize>, elements: &ElementSystem<Lanes>) {
        let forces = &mut self.force[self.category as usize];
        for lane in lanes.clone() {
            for (force, &slot) in elements.forces().iter().zip(self.places.cliques.get(first + lane)) {
                forces[slot as usize] += Vec3([force[0].0[lane], force[1].0[lane], force[2].0[lane]]);
            }
        }
        if !self.with_tangent {
            return;
        }
        if self.equations.plane().is_some() {
            for lane in lanes.clone() {
                self.add_in_plane(first + lane, elements.tiles(), |lanes| lanes.0[lane]);
            }
            return;
        }
        if self.places.whole {
            return self.add_whole(first, lanes, elements);
        }
        for lane in lanes {
            self.add_blocks(first + lane, elements.blocks(), elements.tiles(), |lanes| lanes.0[lane]);
        }
    }

    /// Adds the tangents of elements of whole nodes, one element after the other.
    #[inline(always)]
    fn add_whole(&mut self, first: usize, lanes: Range<usize>, elements: &ElementSystem<Lanes>) {
        for lane in lanes {
            for (tile, &place) in elements.tiles().iter().zip(self.places.of(first + lane)) {
                add_lane(&mut self.values[place as usize..place as usize + TILE], tile, lane);
            }
        }
    }

    /// Adds instances that lie in the plane, as [`Sink::add_lanes`] does those in space; each couples whole nodes.
    #[inline(always)]
    pub fn add_planar<const N: usize>(
        &mut self,
        plane: &Plane,
        first: usize,
        count: usize,
        elements: &PlanarSystem<N, Lanes>,
        is_apart: impl Fn(usize) -> bool,
        mut alone: impl FnMut(usize, &mut Self),
    ) {
        let forces = elements.forces_in_space(plane.axes());
        for lane in 0..count {
            if is_apart(lane) || (self.with_tangent && self.places.special[first + lane]) {
                alone(lane, self);
                continue;
            }
            let all = &mut self.force[self.category as usize];
            for (force, &slot) in forces.as_flattened().iter().zip(self.places.cliques.get(first + lane)) {
                all[slot as usize] += Vec3(force.0.map(|component| component.0[lane]));
            }
            if !self.with_tangent {
                continue;
            }
            if !self.places.whole {
                self.add_planar_parts(first + lane, elements, lane);
                continue;
            }
            for (tile, &place) in elements.tangent.as_flattened().iter().zip(self.places.of(first + lane)) {
                let target = &mut self.values[place as usize..place as usize + tile.len()];
                target.iter_mut().zip(tile).for_each(|(sum, value)| *sum += value.0[lane]);
            }
        }
    }

    /// Whether prescribed increments act through the tangent.
    pub fn lifts(&self) -> bool {
        self.with_tangent && self.lift.is_some()
    }

    /// Adds instances that couple displacements alone, in lanes, by mass matrices of the plane: their forces (global components), and
    /// `weight` times the matrices.
    #[inline(always)]
    pub fn add_planar_mass<const N: usize>(
        &mut self,
        plane: &Plane,
        first: usize,
        count: usize,
        forces: &[Vec3<Lanes>; N],
        mass: &[[Lanes; N]; N],
        weight: f64,
    ) {
        for lane in 0..count {
            let k = first + lane;
            let all = &mut self.force[self.category as usize];
            for (force, &slot) in forces.iter().zip(self.places.cliques.get(k)) {
                all[slot as usize] += Vec3(force.0.map(|component| component.0[lane]));
            }
            if !self.with_tangent || weight == 0.0 {
                continue;
            }
            let entries = mass.as_flattened().iter().map(|entry| entry.0[lane] * weight);
            if self.places.special[k] {
                self.add_constrained_mass(plane, k, N, entries);
                continue;
            }
            for (entry, &place) in entries.zip(self.places.of(k)) {
                self.values[place as usize] += entry;
                self.values[place as usize + 4] += entry;
            }
        }
    }

    /// The same where directions are held: a mass is one in all directions, and between slots with other axes their cosine.
    #[cold]
    fn add_constrained_mass(&mut self, plane: &Plane, k: usize, nodes: usize, entries: impl Iterator<Item = f64>) {
        let slots = self.places.cliques.get(k);
        let frame = |slot: Slot| self.equations.frame(slot).unwrap_or(*plane.axes());
        for (number, (entry, &place)) in entries.zip(self.places.of(k)).enumerate() {
            let (i, j) = (slots[number / nodes], slots[number % nodes]);
            let (rows, columns) = (self.equations.of(i), self.equations.of(j));
            let cosines = frame(i).transpose_matmul(frame(j));
            for c in (0..2).filter(|&c| columns[c] != Equations::HELD) {
                for r in (0..2).filter(|&r| rows[r] != Equations::HELD) {
                    self.values[place as usize + 3 * c + r] += cosines.0[r][c] * entry;
                }
            }
        }
    }

    /// Adds the tangent of one lane where nodes may share displacements: each entry of a tile goes to where those of its slots meet.
    fn add_planar_parts<const N: usize>(&mut self, k: usize, elements: &PlanarSystem<N, Lanes>, lane: usize) {
        let places = self.places.of(k);
        let slot = |node: usize, direction: usize| 2 * node + direction / 2;
        for (i, tiles) in elements.tangent.iter().enumerate() {
            for (j, tile) in tiles.iter().enumerate() {
                for (entry, value) in tile.iter().enumerate() {
                    let (row, column) = (slot(i, entry % 3), slot(j, entry / 3));
                    self.values[places[2 * N * row + column] as usize + entry] += value.0[lane];
                }
            }
        }
    }

    #[inline]
    fn add_tangent(&mut self, k: usize, element: &ElementSystem) {
        if !self.places.whole {
            return self.add_blocks(k, element.blocks(), element.tiles(), |value| *value);
        }
        for (tile, &place) in element.tiles().iter().zip(self.places.of(k)) {
            let target = &mut self.values[place as usize..place as usize + TILE];
            target.iter_mut().zip(tile).for_each(|(sum, value)| *sum += value);
        }
    }

    /// Adds to the tiles of a plane what the tangent of an element in space has there; `pick` takes the instance's number from each entry.
    #[inline(always)]
    fn add_in_plane<T>(&mut self, k: usize, tiles: &[[T; TILE]], pick: impl Fn(&T) -> f64) {
        let (slots, places) = (self.places.cliques.get(k), self.places.of(k));
        let (shared, across) = if self.places.whole { (2, slots.len() / 2) } else { (1, slots.len()) };
        for (row, &i) in slots.iter().enumerate() {
            for (column, &j) in slots.iter().enumerate() {
                let (from_rows, from_columns) = (self.equations.of(i), self.equations.of(j));
                let tile = &tiles[row / 2 * slots.len().div_ceil(2) + column / 2];
                let entry = |r: usize, c: usize| pick(&tile[(column % 2 * 3 + c) * WIDTH + row % 2 * 3 + r]);
                let mut block = Mat3([0, 1, 2].map(|r| [0, 1, 2].map(|c| entry(r, c))));
                if let Some(frame) = self.equations.frame(i) {
                    block = frame.transpose_matmul(block);
                }
                if let Some(frame) = self.equations.frame(j) {
                    block = block * frame;
                }
                let place = places[row / shared * across + column / shared] as usize;
                for c in (0..3).filter(|&c| from_columns[c] != Equations::HELD) {
                    for r in (0..3).filter(|&r| from_rows[r] != Equations::HELD) {
                        self.values[place + 3 * c + r] += block.0[r][c];
                    }
                }
            }
        }
    }

    /// Adds the tangent in blocks of 3 x 3; `pick` takes the instance's number from each entry.
    #[inline(always)]
    fn add_blocks<T>(&mut self, k: usize, blocks: usize, tiles: &[[T; TILE]], pick: impl Fn(&T) -> f64) {
        for (number, &place) in self.places.of(k).iter().enumerate() {
            let (row, column) = (number / blocks, number % blocks);
            let tile = &tiles[row / 2 * blocks.div_ceil(2) + column / 2];
            for c in 0..3 {
                let (from, to) = ((column % 2 * 3 + c) * WIDTH + row % 2 * 3, place as usize + c * WIDTH);
                for r in 0..3 {
                    self.values[to + r] += pick(&tile[from + r]);
                }
            }
        }
    }

    /// Adds forces of instance `k` that damp, block by block; their tangent goes with the others.
    pub fn add_damping(&mut self, k: usize, force: &[Vec3]) {
        for (&slot, &force) in self.places.cliques.get(k).iter().zip(force) {
            self.force[Category::Damping as usize][slot as usize] += force;
        }
    }

    /// As [`Sink::add`], for instances with turned axes or held directions.
    #[cold]
    #[inline(never)]
    fn add_special(&mut self, k: usize, element: &ElementSystem) {
        let mut local = self.in_local_axes(k, element);
        if let Some(lift) = self.lift {
            self.add_lift(k, &local, lift);
        }
        self.drop_held(self.places.cliques.get(k), &mut local);
        self.add_tangent(k, &local);
    }

    /// The tangent in the axes of its slots.
    fn in_local_axes(&self, k: usize, element: &ElementSystem) -> ElementSystem {
        let slots = self.places.cliques.get(k);
        let mut local = element.clone();
        let mut frames: [Option<Mat3>; 2 * MAX_NODES] = [None; 2 * MAX_NODES];
        for (frame, &slot) in frames.iter_mut().zip(slots) {
            *frame = self.equations.frame(slot);
        }
        for row in 0..slots.len() {
            for column in 0..slots.len() {
                let mut block = element.tangent_block(row, column);
                if let Some(frame) = frames[row] {
                    block = frame.transpose_matmul(block);
                }
                if let Some(frame) = frames[column] {
                    block = block * frame;
                }
                local.set_tangent(row, column, block);
            }
        }
        local
    }

    /// Rows and columns of held directions are no part of the tangent.
    fn drop_held(&self, slots: &[Slot], local: &mut ElementSystem) {
        let free = |slot: &Slot| self.equations.of(*slot).map(|number| number != Equations::HELD);
        for (row, rows) in slots.iter().map(free).enumerate() {
            for (column, columns) in slots.iter().map(free).enumerate() {
                let mut block = local.tangent_block(row, column);
                for (r, line) in block.0.iter_mut().enumerate() {
                    line.iter_mut().zip(columns).filter(|(_, free)| !(rows[r] && *free)).for_each(|(x, _)| *x = 0.0);
                }
                local.set_tangent(row, column, block);
            }
        }
    }

    fn add_lift(&mut self, k: usize, local: &ElementSystem, lift: &[Vec3]) {
        let slots = self.places.cliques.get(k);
        for (column, &slot) in slots.iter().enumerate() {
            let mut increment = self.equations.to_local(slot, lift[slot as usize]);
            for (j, number) in self.equations.of(slot).into_iter().enumerate() {
                if number != Equations::HELD {
                    increment.0[j] = 0.0;
                }
            }
            if increment == Vec3::ZERO {
                continue;
            }
            for (row, &other) in slots.iter().enumerate() {
                let push = local.tangent_block(row, column) * increment;
                for (i, number) in self.equations.of(other).into_iter().enumerate() {
                    if number != Equations::HELD {
                        self.lifted[number as usize] += push.0[i];
                    }
                }
            }
        }
    }
}
