//! Forces and tangent of the whole scene.

use super::assembler::{Assembler, SystemSlice};
use super::category::Category;
use super::pattern::{CouplingTile, Pattern, Symmetry, WIDTH};
use super::regions::{self, Region};
use super::state::Slot;
use super::storage::{Tiles, as_tiles};
use super::tile::{Tile, transposed};
use super::values::TileValues;
use crate::kernel::ElementSystem;
use crate::scalar::{Instructions, Lanes};
use crate::tensor::{Mat3, Vec3, zeros};
use crate::threads;
use std::ops::Range;

/// Buffer for residuals of linear solves, kept between solves to save its allocation.
#[derive(Default)]
pub struct ResidualBuffer {
    residuals: Vec<f64>,
}

impl ResidualBuffer {
    /// Slices of the buffer by node block: the residual of each tile row, and the size it is
    /// compared with.
    fn take<const W: usize>(&mut self, pattern: &Pattern) -> &mut [[[f64; W]; 2]] {
        let length = 2 * W * pattern.node_blocks.count();
        self.residuals.resize(self.residuals.len().max(length), 0.0);
        self.residuals[..length].as_chunks_mut::<W>().0.as_chunks_mut::<2>().0
    }
}

/// Values of a tangent with its pattern. Factors may have overwritten the diagonal tiles.
#[derive(Clone, Copy)]
pub struct Matrix<'a> {
    /// Sparsity pattern of the values
    pub(crate) pattern: &'a Pattern,
    values: &'a [f64],
    holds_factors: bool,
}

impl<'a> Matrix<'a> {
    /// Matrix with the given values, stored by `pattern.storage`.
    pub fn new(pattern: &'a Pattern, values: &'a [f64]) -> Self {
        Self { pattern, values, holds_factors: false }
    }

    /// Tiles of the matrix, each stored by columns. `W` is the tile width of the pattern.
    pub fn tiles<const W: usize>(self) -> Tiles<'a, W> {
        debug_assert!(!self.holds_factors, "there is no tangent");
        self.pattern.storage.tiles(self.values)
    }

    /// Values of the diagonal tiles, or of the factors that have overwritten them, and the
    /// off-diagonal tiles.
    pub fn numbers<const W: usize>(self) -> (&'a [f64], &'a [Tile<W>]) {
        let (own, beside) = self.values.split_at(self.pattern.storage.boundary());
        (own, as_tiles(beside))
    }

    /// True if factors have overwritten the diagonal tiles.
    pub fn holds_factors(self) -> bool {
        self.holds_factors
    }
}

/// Nodal forces g = f_int + f_acc - f_ext by category and slot, and the values of the tangent J = s
/// K + d C + m M.
///
/// Forces are conjugate to the unknowns of their slot (global components, in the chart of the
/// state).
#[derive(Clone, Debug)]
pub struct System {
    /// Sparsity pattern of the tangent
    pub pattern: Pattern,
    /// Nodal forces by category and slot; lists of categories without any effect are empty.
    pub force: [Vec<Vec3>; 4],
    /// Indices of the categories that some effect adds to, in the scene and in each region
    acting: Vec<usize>,
    acting_in: Vec<Vec<usize>>,
    /// Values of the tangent, stored by `pattern.storage`. They are those of the last evaluation
    /// with weights, unless [factors](System::holds_factors) have overwritten them.
    pub values: Vec<f64>,
    /// Number of changes of the tangent so far, by which factorisations recognise it
    pub(crate) revision: u64,
    /// True if factors have overwritten the diagonal tiles.
    holds_factors: bool,
    /// Prescribed increments of held directions, by slot (global components). The tangent times
    /// these is summed in `prescribed_forces`, by equation.
    prescribed_increment: Vec<Vec3>,
    is_prescribed: bool,
    prescribed_forces: Vec<f64>,
    /// Buffers for element forces and tangents, kept between evaluations: of the whole scene, then
    /// of each region
    buffers: Vec<Vec<ElementSystem<Lanes>>>,
}

impl System {
    /// A system of zeros. Internal forces and those of the categories `everywhere` act at all
    /// slots, those of `of_effects` (one list per effect) where the effect has instances.
    pub fn new(pattern: Pattern, slots: usize, everywhere: &[Category], of_effects: &[Vec<Category>]) -> Self {
        let acting_in = acting_in(&pattern, everywhere, of_effects);
        let acts = |category: &usize| acting_in.iter().any(|acting| acting.contains(category));
        let acting: Vec<usize> = (0..Category::ALL.len()).filter(acts).collect();
        let force = |category: Category| match acting.contains(&(category as usize)) {
            true => zeros(slots),
            false => Vec::new(),
        };
        let values = pattern.values();
        Self {
            buffers: vec![Vec::new(); 1 + pattern.regions.len()],
            pattern,
            force: Category::ALL.map(force),
            acting,
            acting_in,
            values: vec![0.0; values],
            revision: 0,
            holds_factors: false,
            prescribed_increment: Vec::new(),
            is_prescribed: false,
            prescribed_forces: Vec::new(),
        }
    }

    /// Sets forces and tangent to zero. `prescribed_increment` holds the increments of held
    /// directions (by slot, global components) that the next correction includes.
    pub fn clear(&mut self, prescribed_increment: Option<&[Vec3]>) {
        self.begin(true, prescribed_increment);
        self.each_part(|part| part.clear(true));
    }

    /// Calls `work` on the slice of each region, in parallel, or on the whole system if it has one
    /// region only.
    pub fn each_part(&mut self, work: impl Fn(&mut SystemSlice) + Send + Sync) {
        match self.is_cut() {
            true => threads::each(self.parts().into_iter(), |mut part| work(&mut part)),
            false => work(&mut self.whole()),
        }
    }

    /// Begins an evaluation. The forces and the tangent of each slice are still to be
    /// [cleared](SystemSlice::clear).
    pub fn begin(&mut self, with_tangent: bool, prescribed_increment: Option<&[Vec3]>) {
        self.revision += u64::from(with_tangent);
        self.holds_factors &= !with_tangent;
        if self.is_prescribed || prescribed_increment.is_some() {
            self.prescribed_forces.clear();
            self.prescribed_forces.resize(self.pattern.dof_map.count(), 0.0);
        }
        self.is_prescribed = prescribed_increment.is_some();
        if let Some(prescribed_increment) = prescribed_increment {
            threads::copy(&mut self.prescribed_increment, prescribed_increment);
        }
    }

    /// Force of a category at a slot (global components); zero if the category does not act.
    #[inline]
    pub fn part_of(&self, category: Category, slot: usize) -> Vec3 {
        self.force[category as usize].get(slot).copied().unwrap_or(Vec3::ZERO)
    }

    /// Sum of the forces of all categories at a slot (global components).
    #[inline]
    pub fn total(&self, slot: usize) -> Vec3 {
        self.acting.iter().fold(Vec3::ZERO, |sum, &category| sum + self.force[category][slot])
    }

    /// Forces, indexed by slot of the scene, of the categories that act in a region.
    #[inline]
    pub fn acting_in(&self, region: &Region) -> impl Iterator<Item = &[Vec3]> {
        self.acting_in[region.number].iter().map(|&category| &self.force[category][..])
    }

    /// Sets forces to zero for a new evaluation without prescribed increments. The tangent is kept.
    pub fn clear_forces(&mut self) {
        self.begin(false, None);
        self.each_part(|part| part.clear(false));
    }

    /// Sets all forces to zero without beginning an evaluation. The tangent is kept.
    pub fn forget_forces(&mut self) {
        self.force.iter_mut().for_each(|f| f.fill(Vec3::ZERO));
    }

    /// Replaces the forces of all categories at a slot by one internal force (global components).
    pub fn replace_force(&mut self, slot: Slot, force: Vec3) {
        self.acting.iter().for_each(|&category| self.force[category][slot as usize] = Vec3::ZERO);
        self.force[Category::Internal as usize][slot as usize] = force;
    }

    /// The tangent, or the factors that have overwritten its diagonal tiles.
    pub fn matrix(&self) -> Matrix<'_> {
        Matrix { pattern: &self.pattern, values: &self.values, holds_factors: self.holds_factors }
    }

    /// True if factors have overwritten the diagonal tiles. The tangent is then undefined until the
    /// next evaluation with weights.
    pub fn holds_factors(&self) -> bool {
        self.holds_factors
    }

    /// Gives the storage of the diagonal tiles to a factorisation, together with the off-diagonal
    /// tiles to read. The tangent is undefined from here on.
    pub fn give_to_factors<const W: usize>(&mut self) -> (&mut [f64], &[Tile<W>]) {
        self.holds_factors = true;
        let (own, beside) = self.values.split_at_mut(self.pattern.storage.boundary());
        (own, as_tiles(beside))
    }

    /// The 3 x 3 diagonal block of a slot in its local axes, with zeros for held directions.
    pub fn own_block(&self, slot: Slot) -> Mat3 {
        debug_assert!(!self.holds_factors, "there is no tangent");
        let mut block = Mat3::ZERO;
        self.pattern.own_entries(slot).for_each(|([r, c], place)| block.0[r][c] = self.values[place]);
        block
    }

    /// Adds a symmetric 3 x 3 block (local axes of the slot) to the diagonal block of a slot, in
    /// its free directions.
    pub fn add_to_own_block(&mut self, slot: Slot, block: &Mat3) {
        debug_assert!(!self.holds_factors, "there is no tangent");
        // In symmetric storage an entry shares its position with its mirror image.
        let once = self.pattern.symmetry == Symmetry::Whole;
        for ([r, c], place) in self.pattern.own_entries(slot).filter(|([r, c], _)| r <= c || !once) {
            self.values[place] += block.0[r][c];
        }
        self.revision += 1;
    }

    /// Product A x of a matrix with the given values on this pattern and a vector by equation.
    pub fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut out = x.to_vec();
        match self.pattern.width() {
            WIDTH => self.product::<WIDTH>(values, &mut out),
            _ => self.product::<3>(values, &mut out),
        }
        out
    }

    fn product<const W: usize>(&self, values: &[f64], x: &mut [f64]) {
        let mut sums = vec![[0.0; W]; self.pattern.node_blocks.count()];
        self.each_product::<W, _>(
            values,
            x,
            &mut sums,
            #[inline(always)]
            |sum: &mut [f64; W], tile: &Tile<W>, x: &[f64; W]| {
                for (line, x) in tile.iter().zip(x) {
                    sum.iter_mut().zip(line).for_each(|(sum, value)| *sum += value * x);
                }
            },
        );
        self.pattern.join(|node_block| &sums[node_block], x);
    }

    /// Calls `show` with each tile, the item of the node block of its rows, and the entries of x of
    /// its columns. Regions are processed in parallel. Tiles known only as transposes of stored
    /// ones are shown, too.
    fn each_product<const W: usize, K: Send>(
        &self,
        values: &[f64],
        x: &[f64],
        of_rows: &mut [K],
        show: impl Fn(&mut K, &Tile<W>, &[f64; W]) + Send + Sync,
    ) {
        let Pattern { regions, storage, symmetry, .. } = &self.pattern;
        let tiles = storage.tiles::<W>(values);
        let halves = symmetry.halves();
        regions::each(
            regions,
            of_rows,
            |region| region.node_blocks.end,
            |region, part| {
                Instructions::here().run(
                    #[inline(always)]
                    || {
                        for column in region.node_blocks.clone() {
                            let own = column - region.node_blocks.start;
                            let x_own = self.pattern.part::<W>(column, x);
                            tiles.own.with(
                                column,
                                #[inline(always)]
                                |tile| show(&mut part[own], tile, &x_own),
                            );
                            for tile in self.pattern.tiles_of(column) {
                                let row = self.pattern.rows[tile] as usize;
                                let Some(of_row) = part.get_mut(row.wrapping_sub(region.node_blocks.start)) else {
                                    continue;
                                };
                                show(of_row, &tiles.beside[tile], &x_own);
                                if halves {
                                    let x_row = self.pattern.part::<W>(row, x);
                                    show(&mut part[own], &transposed(&tiles.beside[tile]), &x_row);
                                }
                            }
                        }
                    },
                );
            },
        );
        for &CouplingTile { column, tile } in &self.pattern.between {
            let row = self.pattern.rows[tile] as usize;
            show(&mut of_rows[row], &tiles.beside[tile], &self.pattern.part::<W>(column, x));
            if halves {
                show(&mut of_rows[column], &transposed(&tiles.beside[tile]), &self.pattern.part::<W>(row, x));
            }
        }
    }

    /// Calls `show` with row, column (node blocks) and value of each stored tile in the given
    /// columns.
    #[inline(always)]
    pub fn each_tile<const W: usize>(&self, columns: Range<usize>, mut show: impl FnMut(usize, usize, &Tile<W>)) {
        let tiles = self.matrix().tiles();
        for column in columns {
            tiles.own.with(
                column,
                #[inline(always)]
                |tile| show(column, column, tile),
            );
            let beside = &tiles.beside[self.pattern.tiles_of(column)];
            for (&row, tile) in self.pattern.rows_of(column).iter().zip(beside) {
                show(row as usize, column, tile);
            }
        }
    }

    /// Largest backward error of a solution x of A x = b: max over the rows of |b - A x|_i / (|A|
    /// |x| + |b|)_i. The residual stays in `buffer`.
    pub fn residual(&self, b: &[f64], x: &[f64], buffer: &mut ResidualBuffer) -> f64 {
        if self.pattern.width() == WIDTH {
            self.residual_of::<WIDTH>(b, x, buffer)
        } else {
            self.residual_of::<3>(b, x, buffer)
        }
    }

    fn residual_of<const W: usize>(&self, b: &[f64], x: &[f64], buffer: &mut ResidualBuffer) -> f64 {
        debug_assert!(!self.holds_factors, "there is no tangent");
        let pattern = &self.pattern;
        let residuals = buffer.take::<W>(pattern);
        threads::each_part(residuals, |start, residuals| {
            for (node_block, [residual, size]) in (start..).zip(residuals) {
                *residual = pattern.part(node_block, b);
                *size = residual.map(f64::abs);
            }
        });
        self.each_product::<W, _>(
            &self.values,
            x,
            residuals,
            #[inline(always)]
            |[residual, size]: &mut [[f64; W]; 2], tile: &Tile<W>, x: &[f64; W]| {
                for (line, x) in tile.iter().zip(x) {
                    for r in 0..W {
                        let term = line[r] * x;
                        residual[r] -= term;
                        size[r] += term.abs();
                    }
                }
            },
        );
        // Sizes below 1e-280 may consist of subnormal numbers, which have fewer digits.
        let ratio = |(r, size): (&f64, &f64)| r.abs() / size.max(1e-280);
        let of_part = |[part, sizes]: &[[f64; W]; 2]| part.iter().zip(sizes).map(ratio).fold(0.0, f64::max);
        threads::largest(residuals.len(), |own| residuals[own].iter().map(of_part).fold(0.0, f64::max))
    }

    /// Writes the residual b - A x of the last call of [`System::residual`] to `out`, by equation.
    pub fn last_residual(&self, buffer: &ResidualBuffer, out: &mut [f64]) {
        if self.pattern.width() == WIDTH { self.join::<WIDTH>(buffer, out) } else { self.join::<3>(buffer, out) }
    }

    fn join<const W: usize>(&self, buffer: &ResidualBuffer, out: &mut [f64]) {
        let residuals = buffer.residuals.as_chunks::<W>().0;
        self.pattern.join(|node_block| &residuals[2 * node_block], out);
    }

    /// Right-hand side of the linear system of a correction: -g - J du_prescribed, by free
    /// equation.
    pub fn right_hand_side(&self, out: &mut [f64]) {
        let total =
            |region: &Region, slot: usize| self.acting_in(region).fold(Vec3::ZERO, |sum, force| sum + force[slot]);
        self.fill_right_hand_side(total, out);
    }

    /// Right-hand side -g - J du_prescribed of one node block, by tile row.
    #[inline(always)]
    pub fn right_hand_side_at<const W: usize>(&self, node_block: usize) -> [f64; W] {
        let Pattern { dof_map, node_blocks, .. } = &self.pattern;
        let region = self.pattern.region_of(node_block);
        let own_equations = self.pattern.equations_of(node_block);
        let mut own = [0.0; W];
        let force = |slot: u32| self.acting_in(region).fold(Vec3::ZERO, |sum, force| sum + force[slot as usize]);
        let slots = node_blocks.members(node_block);
        if !self.is_prescribed && dof_map.are_components(slots.clone()) && 3 * slots.len() == W {
            slots.zip(own.as_chunks_mut().0).for_each(|(slot, own)| *own = (-force(slot)).0);
            return own;
        }
        if W == 3 && !self.is_prescribed && dof_map.are_planar(slots.clone()) {
            let u = slots.start;
            let p = slots.start + 1;
            let across = dof_map.to_local(u, -force(u));
            let about = dof_map.to_local(p, -force(p));
            own.copy_from_slice(&[across.0[0], across.0[1], about.0[2]]);
            return own;
        }
        for slot in slots {
            let force = force(slot);
            let local = dof_map.to_local(slot, force);
            let own = &mut own[..own_equations.len()];
            dof_map.each_of(slot as usize, local, own_equations.start, own, |own, entry| *own = -entry);
        }
        if self.is_prescribed {
            own.iter_mut()
                .zip(&self.prescribed_forces[own_equations])
                .for_each(|(own, prescribed_forces)| *own -= prescribed_forces);
        }
        self.pattern.spread(node_block, own)
    }

    /// Increments of held directions (by slot, global components) that the next correction
    /// includes.
    pub fn prescribed_increment(&self) -> Option<&[Vec3]> {
        self.is_prescribed.then_some(&self.prescribed_increment)
    }

    /// Right-hand side -f - J du_prescribed for given forces f by slot (global components).
    pub fn right_hand_side_of(&self, force: &[Vec3], out: &mut [f64]) {
        self.fill_right_hand_side(|_, slot| force[slot], out);
    }

    /// Right-hand side -f for given forces f by slot (global components), without prescribed
    /// increments.
    pub fn right_hand_side_without_lift(&self, force: &[Vec3], out: &mut [f64]) {
        self.right_hand_side_of(force, out);
        out.iter_mut().zip(&self.prescribed_forces).for_each(|(out, prescribed_forces)| *out += prescribed_forces);
    }

    fn fill_right_hand_side(&self, force: impl Fn(&Region, usize) -> Vec3 + Send + Sync, out: &mut [f64]) {
        let dof_map = &self.pattern.dof_map;
        self.pattern.each_region(out, |region, out| {
            for slot in region.slots.clone() {
                let local = dof_map.to_local(slot as Slot, force(region, slot));
                dof_map.each_of(slot, local, region.equations.start, out, |out, entry| *out = -entry);
            }
            if self.is_prescribed {
                let prescribed_forces = &self.prescribed_forces[region.equations.clone()];
                out.iter_mut().zip(prescribed_forces).for_each(|(out, prescribed_forces)| *out -= prescribed_forces);
            }
        });
    }

    /// True if the scene has several regions, which are evaluated in parallel.
    pub fn is_cut(&self) -> bool {
        self.pattern.regions.len() > 1
    }

    /// The slices of all regions, which are disjoint.
    fn parts(&mut self) -> Vec<SystemSlice<'_>> {
        let Self {
            pattern,
            acting_in,
            force,
            values,
            prescribed_increment,
            is_prescribed,
            prescribed_forces,
            buffers,
            ..
        } = self;
        let regions = &pattern.regions;
        let ends = |end: fn(&Region) -> usize| regions.iter().map(end);
        let storage = &pattern.storage;
        let places = |region: &Region| [storage.on_diagonal(&region.node_blocks), storage.off_diagonal(&region.tiles)];
        let mut forces = force.each_mut().map(|force| threads::split(force, ends(|r| r.slots.end)).into_iter());
        let (own, beside) = values.split_at_mut(storage.boundary());
        let own = threads::split(own, regions.iter().map(|region| places(region)[0].end));
        let beside = threads::split(beside, regions.iter().map(|region| places(region)[1].end - storage.boundary()));
        // Without coupled nodes the list of off-diagonal tiles is empty.
        let mut own = own.into_iter();
        let mut beside = beside.into_iter();
        let values = regions.iter().map(|region| {
            let lists = [&mut own, &mut beside].map(|list| list.next().unwrap_or_default());
            TileValues::part(storage, lists, places(region).map(|range| range.start))
        });
        let mut prescribed_forces = threads::split(prescribed_forces, ends(|r| r.equations.end)).into_iter();
        let stretches = values.zip(&mut buffers[1..]).enumerate();
        let part = |(region, (values, buffers)): (usize, _)| SystemSlice {
            pattern,
            acting: &acting_in[region],
            region: Some(region),
            force: forces.each_mut().map(|forces| forces.next().unwrap_or_default()),
            values,
            prescribed_increment: is_prescribed.then_some(&prescribed_increment[..]),
            prescribed_forces: prescribed_forces.next().unwrap_or_default(),
            buffers,
        };
        stretches.map(part).collect()
    }

    /// The slice that consists of the whole system, for instances that lie in no single region.
    pub fn whole(&mut self) -> SystemSlice<'_> {
        SystemSlice {
            pattern: &self.pattern,
            acting: &self.acting,
            region: None,
            force: self.force.each_mut().map(|force| &mut force[..]),
            values: TileValues::all(&self.pattern.storage, &mut self.values),
            prescribed_increment: self.is_prescribed.then_some(&self.prescribed_increment[..]),
            prescribed_forces: &mut self.prescribed_forces,
            buffers: &mut self.buffers[0],
        }
    }

    /// Assembler of all instances of effect number `effect`.
    pub fn assembler(&mut self, effect: usize, category: Category, with_tangent: bool) -> Assembler<'_> {
        let all = 0..self.pattern.places[effect].connectivity.len();
        self.whole().into_assembler(effect, category, with_tangent, all)
    }
}

/// Indices of the acting force categories, by region.
fn acting_in(pattern: &Pattern, everywhere: &[Category], of_effects: &[Vec<Category>]) -> Vec<Vec<usize>> {
    let first = Category::ALL.map(|category| category == Category::Internal || everywhere.contains(&category));
    let mut acts = vec![first; pattern.regions.len()];
    for (categories, places) in of_effects.iter().zip(&pattern.places) {
        let touched = regions::touched(&places.connectivity, &pattern.node_blocks, &pattern.regions);
        for (acts, _) in acts.iter_mut().zip(touched).filter(|(_, touched)| *touched) {
            categories.iter().for_each(|&category| acts[category as usize] = true);
        }
    }
    acts.iter().map(|acts| (0..acts.len()).filter(|&category| acts[category]).collect()).collect()
}
