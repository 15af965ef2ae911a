//! A factorisation in pieces: branches of the elimination tree, which are eliminated at once, and the trunk, where they meet.

use super::Factor;
use super::elimination::Elimination;
use super::tile::{Part, Tiles};
use crate::real::Instructions;
use crate::system::System;
use crate::threads;
use std::ops::Range;

/// Rows that are eliminated without a look at what has to be loaded for them
const AT_ONCE: usize = 8;

/// The numbers of rows that follow each other.
pub trait Piece<const W: usize>: Send + Sync + Sized {
    /// What it does, in a word
    const NAME: &'static str;

    /// Whether it is one of symmetric tangents, whose pivots have signs that count
    const SYMMETRIC: bool;

    /// Of these rows, and blocks right of the diagonal that elimination changes. `None` where memory cannot be had.
    fn new(rows: Range<usize>, changed: Range<usize>) -> Option<Self>;

    /// Its rows.
    fn rows(&self) -> Range<usize>;

    /// Takes over the tangent in some of its rows: once, before the first elimination that changes them.
    fn load(&mut self, rows: Range<usize>, elimination: &Elimination, tiles: &Tiles<W>);

    /// Adds what belongs to the same rows.
    fn add(&mut self, other: &Self);

    /// Sets all numbers to zero.
    fn clear(&mut self);

    /// Eliminates the next of its rows; what that changes in rows later than its own goes to `beyond`. The number of negative pivots;
    /// `None` where one is zero or no number.
    fn eliminate(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        tiles: &Tiles<W>,
        beyond: &mut Self,
    ) -> Option<usize>;

    /// Solves with the lower factor for its own part `x`; what that changes in later rows goes to `beyond`.
    fn forward(&self, elimination: &Elimination, tiles: &Tiles<W>, x: &mut [Part<W>], beyond: &mut [Part<W>]);

    /// Solves with the upper factor for its own part `x`, where all later rows are solved.
    fn backward(&self, elimination: &Elimination, tiles: &Tiles<W>, x: &mut [Part<W>], beyond: &[Part<W>]);
}

/// Branches and trunk.
pub struct Pieces<P, const W: usize> {
    branches: Vec<P>,
    /// What each branch changes in the trunk
    changes: Vec<P>,
    trunk: P,
    /// Later than the trunk there is nothing.
    nothing: P,
    /// Pivots below zero in the last factorisation, where that came to its end
    negative: Option<usize>,
}

impl<P: Piece<W>, const W: usize> Pieces<P, W> {
    /// For an elimination. `None` where memory cannot be had.
    pub fn new(elimination: &Elimination) -> Option<Self> {
        let piece = |rows: &Range<usize>| P::new(rows.clone(), elimination.changed(rows));
        let (trunk, end) = (&elimination.trunk, elimination.trunk.end);
        let (mut branches, mut changes) = (Vec::new(), Vec::new());
        let both = |rows: &Range<usize>| Some((piece(rows)?, piece(trunk)?));
        threads::in_order(elimination.branches.iter(), both, |made| {
            let (branch, change) = made.unzip();
            branches.extend(branch);
            changes.extend(change);
        });
        (branches.len() == elimination.branches.len()).then_some(())?;
        Some(Self { branches, changes, trunk: piece(trunk)?, nothing: piece(&(end..end))?, negative: None })
    }
}

impl<P: Piece<W>, const W: usize> Factor for Pieces<P, W> {
    fn factorise(&mut self, elimination: &Elimination, system: &System) -> bool {
        let Self { branches, changes, trunk, nothing, negative } = self;
        let tiles = &system.tiles::<W>();
        *negative = None;
        let branch = |(piece, change): (&mut P, &mut P)| {
            change.clear();
            eliminate(piece, elimination, tiles, change)
        };
        let mut counted = Some(0);
        let add = |count: Option<usize>| counted = counted.zip(count).map(|(sum, count)| sum + count);
        threads::in_order(branches.iter_mut().zip(&mut *changes), branch, add);
        let Some(counted) = counted else { return false };
        let last = Instructions::here().run(
            #[inline(always)]
            || {
                trunk.load(trunk.rows(), elimination, tiles);
                changes.iter().for_each(|change| trunk.add(change));
                trunk.eliminate(trunk.rows(), elimination, tiles, nothing)
            },
        );
        *negative = last.map(|last| counted + last);
        last.is_some()
    }

    fn negative(&self) -> Option<usize> {
        self.negative.filter(|_| P::SYMMETRIC)
    }

    fn is_symmetric(&self) -> bool {
        P::SYMMETRIC
    }

    fn name(&self) -> &'static str {
        P::NAME
    }

    fn solve(&self, elimination: &Elimination, system: &System, x: &mut [f64]) {
        let tiles = &system.tiles::<W>();
        let ends = elimination.pieces().map(|rows| rows.end);
        let mut parts = threads::split(x.as_chunks_mut().0, ends);
        let Some(trunk) = parts.pop() else { return };
        let down = |(piece, x): (&P, &mut &mut [Part<W>])| {
            let mut change = vec![[0.0; W]; elimination.trunk.len()];
            forward(piece, elimination, tiles, x, &mut change);
            change
        };
        threads::in_order(self.branches.iter().zip(&mut parts), down, |change| {
            trunk.as_flattened_mut().iter_mut().zip(change.as_flattened()).for_each(|(x, change)| *x += change);
        });
        forward(&self.trunk, elimination, tiles, trunk, &mut []);
        backward(&self.trunk, elimination, tiles, trunk, &[]);
        let up = |(piece, x): (&P, &mut [Part<W>])| backward(piece, elimination, tiles, x, trunk);
        threads::each(self.branches.iter().zip(parts), up);
    }
}

/// Takes over the tangent not long before it is needed, so that it passes the caches once.
fn eliminate<const W: usize, P: Piece<W>>(
    piece: &mut P,
    elimination: &Elimination,
    tiles: &Tiles<W>,
    beyond: &mut P,
) -> Option<usize> {
    Instructions::here().run(
        #[inline(always)]
        || {
            let all = piece.rows();
            let (mut loaded, mut negative) = (all.start, 0);
            for start in all.clone().step_by(AT_ONCE) {
                let rows = start..all.end.min(start + AT_ONCE);
                let reach = loaded.max(elimination.reach(&rows, all.end));
                piece.load(std::mem::replace(&mut loaded, reach)..reach, elimination, tiles);
                negative += piece.eliminate(rows, elimination, tiles, beyond)?;
            }
            Some(negative)
        },
    )
}

fn forward<const W: usize, P: Piece<W>>(
    piece: &P,
    elimination: &Elimination,
    tiles: &Tiles<W>,
    x: &mut [Part<W>],
    beyond: &mut [Part<W>],
) {
    Instructions::here().run(
        #[inline(always)]
        || piece.forward(elimination, tiles, x, beyond),
    );
}

fn backward<const W: usize, P: Piece<W>>(
    piece: &P,
    elimination: &Elimination,
    tiles: &Tiles<W>,
    x: &mut [Part<W>],
    beyond: &[Part<W>],
) {
    Instructions::here().run(
        #[inline(always)]
        || piece.backward(elimination, tiles, x, beyond),
    );
}
