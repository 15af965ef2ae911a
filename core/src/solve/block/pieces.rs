//! Factorisation in pieces: the branches of the elimination tree, which are eliminated in parallel,
//! and the trunk that couples them.

use super::diagonal::Diagonal;
use super::elimination::Elimination;
use super::factor::Factor;
use super::tile::{Own, Part, Tile};
use crate::scalar::Instructions;
use crate::system::{Matrix, Symmetry, System};
use crate::threads;
use std::ops::{AddAssign, Range};

/// Rows eliminated between two calls of [`Piece::load`]
const AT_ONCE: usize = 8;

/// Runs an expression compiled for the vector instructions of this machine.
macro_rules! run {
    ($work:expr) => {
        Instructions::here().run(
            #[inline(always)]
            || $work,
        )
    };
}

/// Signs of the pivots of some rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Signs {
    /// Number of negative pivots; for unsymmetric tangents, of diagonal tiles with negative
    /// determinant
    pub negative: usize,
    /// Number of rows that may have lost digits, or that may cost later rows digits
    pub doubtful: usize,
}

impl AddAssign for Signs {
    fn add_assign(&mut self, other: Self) {
        self.negative += other.negative;
        self.doubtful += other.doubtful;
    }
}

/// Values of the factors of consecutive rows, without the diagonal tiles.
pub trait Piece<const W: usize>: Send + Sync + Sized {
    /// Name of the method
    const NAME: &'static str;

    /// True if the method factorises symmetric tangents, whose pivots have the signs of the
    /// eigenvalues
    const SYMMETRIC: bool;

    /// A diagonal tile of the factor
    type Own: Copy + Send + Sync;

    /// A diagonal tile of zeros
    const NOTHING: Self::Own;

    /// Values of `rows`, with the given changed blocks right of the diagonal. `None` if memory is
    /// not available.
    fn new(rows: Range<usize>, changed: Range<usize>) -> Option<Self>;

    /// Rows of the piece.
    fn rows(&self) -> Range<usize>;

    /// Views the values of the diagonal tiles of a tangent, factorised in place, as tiles of the
    /// factor.
    fn within(numbers: &[f64]) -> &[Self::Own];

    /// Mutable view of the values of the diagonal tiles of a tangent as tiles of the factor, to be
    /// factorised in place.
    fn within_mut(numbers: &mut [f64]) -> &mut [Self::Own];

    /// Loads the tangent into some rows, once, before the first elimination that changes them.
    /// Diagonal tiles are copied from `own`; without it they are in `diagonal` already.
    fn load(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        own: Option<&Own<W>>,
        beside: &[Tile<W>],
        diagonal: &mut Diagonal<&mut [Self::Own]>,
    );

    /// Adds the contribution of another piece to the diagonal tile of a row; `false` if that may
    /// lose digits.
    fn add_own(sum: &mut Self::Own, other: &Self::Own) -> bool;

    /// Adds the off-diagonal contributions of another piece to the same rows.
    fn add(&mut self, other: &Self);

    /// Sets all values to zero.
    fn clear(&mut self);

    /// Eliminates the next rows; contributions to rows after those of the piece go to `beyond`.
    /// `None` if a pivot is zero or not finite.
    fn eliminate(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        beside: &[Tile<W>],
        diagonal: &mut Diagonal<&mut [Self::Own]>,
        beyond: (&mut Self, &mut Diagonal<&mut [Self::Own]>),
    ) -> Option<Signs>;

    /// Solves with the lower factor for `x`, the right-hand side of the rows of the piece;
    /// contributions to later rows are added to `beyond`.
    fn forward(&self, look: &Look<Self, W>, x: &mut [Part<W>], beyond: &mut [Part<W>]);

    /// Solves with the upper factor for `x`, the rows of the piece, with the solution of later rows
    /// in `beyond`.
    fn backward(&self, look: &Look<Self, W>, x: &mut [Part<W>], beyond: &[Part<W>]);
}

/// Factors as a piece sees them in a solution.
pub struct Look<'a, P: Piece<W>, const W: usize> {
    pub elimination: &'a Elimination,
    /// Off-diagonal tiles of the tangent
    pub beside: &'a [Tile<W>],
    /// Diagonal tiles of the factor
    pub diagonal: Diagonal<'a, &'a [P::Own]>,
}

/// Contributions of a branch to the trunk: off-diagonal blocks, and diagonal tiles by row.
type Change<P, const W: usize> = (P, Vec<<P as Piece<W>>::Own>);

/// Factors of all branches and of the trunk.
pub struct Pieces<P: Piece<W>, const W: usize> {
    branches: Vec<P>,
    /// Contributions of each branch to the trunk
    changes: Vec<Change<P, W>>,
    trunk: P,
    /// An empty piece, for the rows after the trunk
    nothing: P,
    /// True if the last factorisation is stored in the tangent
    is_within: bool,
    /// Diagonal tiles of the factor by row, if they are not stored in the tangent
    diagonal: Vec<P::Own>,
    /// Signs of the pivots of the last factorisation; `None` if it has failed
    signs: Option<Signs>,
}

impl<P: Piece<W>, const W: usize> Pieces<P, W> {
    /// Memory for the factors of an elimination. `None` if it is not available.
    pub fn new(elimination: &Elimination) -> Option<Self> {
        let piece = |rows: &Range<usize>| P::new(rows.clone(), elimination.changed(rows));
        let (trunk, end) = (&elimination.trunk, elimination.trunk.end);
        let (mut branches, mut changes) = (Vec::new(), Vec::new());
        let both = |rows: &Range<usize>| Some((piece(rows)?, (piece(trunk)?, vec![P::NOTHING; trunk.len()])));
        threads::in_order(elimination.branches.iter(), both, |made| {
            let (branch, change) = made.unzip();
            branches.extend(branch);
            changes.extend(change);
        });
        (branches.len() == elimination.branches.len()).then_some(())?;
        let (trunk, nothing) = (piece(trunk)?, piece(&(end..end))?);
        Some(Self { branches, changes, trunk, nothing, is_within: false, diagonal: Vec::new(), signs: None })
    }

    /// Allocates the diagonal tiles of the factor; `false` if memory is not available.
    fn make_room(&mut self, rows: usize) -> bool {
        let has_room = self.diagonal.try_reserve_exact(rows - self.diagonal.len()).is_ok();
        if has_room {
            self.diagonal.resize(rows, P::NOTHING);
        }
        has_room
    }

    /// Eliminates all rows: branches in parallel, then the trunk. `diagonals` are the diagonal
    /// tiles of each piece; see [`Piece::load`] for `own`.
    fn eliminate(
        &mut self,
        elimination: &Elimination,
        own: Option<&Own<W>>,
        beside: &[Tile<W>],
        mut diagonals: Vec<Diagonal<&mut [P::Own]>>,
    ) -> Option<Signs> {
        let Self { branches, changes, trunk, nothing, .. } = self;
        let mut of_trunk = diagonals.pop()?;
        let branch = |((piece, mut diagonal), (change, later)): (_, &mut Change<P, W>)| {
            change.clear();
            later.fill(P::NOTHING);
            let mut later = Diagonal::by_rows(&mut later[..], elimination.trunk.start);
            eliminate(piece, elimination, own, beside, &mut diagonal, (change, &mut later))
        };
        let mut counted = Some(Signs::default());
        threads::in_order(branches.iter_mut().zip(diagonals).zip(&mut *changes), branch, |signs| {
            counted = counted.zip(signs).map(|(mut sum, signs)| {
                sum += signs;
                sum
            });
        });
        let mut counted = counted?;
        Instructions::here().run(
            #[inline(always)]
            || {
                trunk.load(trunk.rows(), elimination, own, beside, &mut of_trunk);
                for (change, later) in changes {
                    trunk.add(change);
                    for (row, later) in trunk.rows().zip(later) {
                        counted.doubtful += usize::from(!P::add_own(&mut of_trunk[row], later));
                    }
                }
                let mut none = Diagonal::by_rows(&mut [][..], elimination.trunk.end);
                counted += trunk.eliminate(trunk.rows(), elimination, beside, &mut of_trunk, (nothing, &mut none))?;
                Some(counted)
            },
        )
    }

    /// Factors as the pieces see them, one after the other.
    fn looks<'a>(&'a self, elimination: &'a Elimination, matrix: Matrix<'a>) -> Vec<Look<'a, P, W>> {
        debug_assert_eq!(self.is_within, matrix.holds_factors(), "another tangent");
        let (own, beside) = matrix.numbers::<W>();
        let diagonals = match self.is_within {
            true => within(elimination, P::within(own)),
            false => {
                elimination.pieces().map(|rows| Diagonal::by_rows(&self.diagonal[rows.clone()], rows.start)).collect()
            }
        };
        diagonals.into_iter().map(|diagonal| Look { elimination, beside, diagonal }).collect()
    }
}

/// Diagonal tiles of a tangent by piece.
fn within<'a, T>(elimination: &'a Elimination, tiles: &'a [T]) -> Vec<Diagonal<'a, &'a [T]>> {
    let of_piece = |node_blocks: &Range<usize>| {
        Diagonal::by_groups(&tiles[node_blocks.clone()], node_blocks.start, &elimination.order)
    };
    elimination.runs.iter().map(of_piece).collect()
}

/// Mutable diagonal tiles of a tangent by piece.
fn within_mut<'a, T>(elimination: &'a Elimination, tiles: &'a mut [T]) -> Vec<Diagonal<'a, &'a mut [T]>> {
    let mut runs: Vec<(usize, &Range<usize>)> = elimination.runs.iter().enumerate().collect();
    runs.sort_by_key(|(_, node_blocks)| (node_blocks.start, node_blocks.end));
    let parts = threads::split(tiles, runs.iter().map(|(_, node_blocks)| node_blocks.end));
    let of_piece = |((piece, node_blocks), part): ((usize, &Range<usize>), _)| {
        (piece, Diagonal::by_groups(part, node_blocks.start, &elimination.order))
    };
    let mut pieces: Vec<(usize, _)> = runs.into_iter().zip(parts).map(of_piece).collect();
    pieces.sort_by_key(|(piece, _)| *piece);
    pieces.into_iter().map(|(_, diagonal)| diagonal).collect()
}

impl<P: Piece<W>, const W: usize> Factor for Pieces<P, W> {
    fn factorise(&mut self, elimination: &Elimination, matrix: Matrix) -> bool {
        (self.is_within, self.signs) = (false, None);
        if !self.make_room(elimination.order.len()) {
            return false;
        }
        let tiles = matrix.tiles::<W>();
        let mut diagonal = std::mem::take(&mut self.diagonal);
        let parts = threads::split(&mut diagonal, elimination.pieces().map(|rows| rows.end));
        let diagonals =
            elimination.pieces().zip(parts).map(|(rows, part)| Diagonal::by_rows(part, rows.start)).collect();
        self.signs = self.eliminate(elimination, Some(&tiles.own), tiles.beside, diagonals);
        self.diagonal = diagonal;
        self.signs.is_some()
    }

    fn can_stay_within(&self, elimination: &Elimination, system: &System) -> bool {
        !elimination.runs.is_empty() && (system.pattern.symmetry == Symmetry::Whole) == P::SYMMETRIC
    }

    fn factorise_within(&mut self, elimination: &Elimination, system: &mut System) -> bool {
        (self.is_within, self.signs, self.diagonal) = (true, None, Vec::new());
        let (own, beside) = system.give_to_factors::<W>();
        let diagonals = within_mut(elimination, P::within_mut(own));
        self.signs = self.eliminate(elimination, None, beside, diagonals);
        self.signs.is_some()
    }

    fn negative(&self) -> Option<usize> {
        self.signs.filter(|_| P::SYMMETRIC).map(|signs| signs.negative)
    }

    fn has_negative_determinant(&self) -> Option<bool> {
        self.signs.map(|signs| signs.negative % 2 == 1)
    }

    fn is_sure(&self) -> bool {
        self.signs.is_some_and(|signs| signs.doubtful == 0)
    }

    fn is_symmetric(&self) -> bool {
        P::SYMMETRIC
    }

    fn name(&self) -> &'static str {
        P::NAME
    }

    fn solve(&self, elimination: &Elimination, matrix: Matrix, x: &mut [f64]) {
        let mut looks = self.looks(elimination, matrix);
        let mut parts = threads::split(x.as_chunks_mut().0, elimination.pieces().map(|rows| rows.end));
        let (Some(trunk), Some(of_trunk)) = (parts.pop(), looks.pop()) else { return };
        let branches = || self.branches.iter().zip(&looks);
        let down = |((piece, look), x): ((&P, &Look<P, W>), &mut &mut [Part<W>])| {
            let mut change = vec![[0.0; W]; elimination.trunk.len()];
            run!(piece.forward(look, x, &mut change));
            change
        };
        threads::in_order(branches().zip(&mut parts), down, |change| add(trunk, &change));
        run!(self.trunk.forward(&of_trunk, trunk, &mut []));
        run!(self.trunk.backward(&of_trunk, trunk, &[]));
        let up = |((piece, look), x): ((&P, &Look<P, W>), &mut [Part<W>])| run!(piece.backward(look, x, trunk));
        threads::each(branches().zip(parts), up);
    }
}

/// Adds vectors of the same rows.
fn add<const W: usize>(sums: &mut [Part<W>], others: &[Part<W>]) {
    sums.as_flattened_mut().iter_mut().zip(others.as_flattened()).for_each(|(sum, other)| *sum += other);
}

/// Eliminates all rows of a piece. Rows are loaded shortly before they are needed, so that the
/// tangent passes through the caches once.
fn eliminate<const W: usize, P: Piece<W>>(
    piece: &mut P,
    elimination: &Elimination,
    own: Option<&Own<W>>,
    beside: &[Tile<W>],
    diagonal: &mut Diagonal<&mut [P::Own]>,
    (beyond, of_beyond): (&mut P, &mut Diagonal<&mut [P::Own]>),
) -> Option<Signs> {
    Instructions::here().run(
        #[inline(always)]
        || {
            let all = piece.rows();
            let (mut loaded, mut signs) = (all.start, Signs::default());
            for start in all.clone().step_by(AT_ONCE) {
                let rows = start..all.end.min(start + AT_ONCE);
                let reach = loaded.max(elimination.reach(&rows, all.end));
                piece.load(std::mem::replace(&mut loaded, reach)..reach, elimination, own, beside, diagonal);
                signs += piece.eliminate(rows, elimination, beside, diagonal, (beyond, of_beyond))?;
            }
            Some(signs)
        },
    )
}
