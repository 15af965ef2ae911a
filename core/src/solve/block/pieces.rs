//! Factorisation in pieces: the branches of the elimination tree, which are eliminated in parallel,
//! and the trunk that couples them.

use super::diagonal::Diagonal;
use super::elimination::Elimination;
use super::factor::Factor;
use super::tile::{BlockVector, DiagonalTiles, Tile};
use crate::scalar::Instructions;
use crate::system::{Matrix, Symmetry, System};
use crate::threads;
use std::ops::{AddAssign, Range};

/// Rows eliminated between two calls of [`Piece::load`]
const ROWS_PER_LOAD: usize = 8;

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
pub struct PivotSigns {
    /// Number of negative pivots; for unsymmetric tangents, of diagonal tiles with negative
    /// determinant
    pub(super) negative: usize,
    /// Number of rows that may have lost digits, or that may cost later rows digits
    pub(super) doubtful: usize,
}

impl AddAssign for PivotSigns {
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
    type DiagonalTile: Copy + Send + Sync;

    /// A diagonal tile of zeros
    const NOTHING: Self::DiagonalTile;

    /// Values of `rows`, with the given changed blocks right of the diagonal. `None` if memory is
    /// not available.
    fn new(rows: Range<usize>, changed: Range<usize>) -> Option<Self>;

    /// Rows of the piece.
    fn rows(&self) -> Range<usize>;

    /// Views the values of the diagonal tiles of a tangent, factorised in place, as tiles of the
    /// factor.
    fn within(numbers: &[f64]) -> &[Self::DiagonalTile];

    /// Mutable view of the values of the diagonal tiles of a tangent as tiles of the factor, to be
    /// factorised in place.
    fn within_mut(numbers: &mut [f64]) -> &mut [Self::DiagonalTile];

    /// Loads the tangent into some rows, once, before the first elimination that changes them.
    /// Diagonal tiles are copied from `own`; without it they are in `diagonal` already.
    fn load(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        own: Option<&DiagonalTiles<W>>,
        beside: &[Tile<W>],
        diagonal: &mut Diagonal<&mut [Self::DiagonalTile]>,
    );

    /// Adds the contribution of another piece to the diagonal tile of a row; `false` if that may
    /// lose digits.
    fn add_own(sum: &mut Self::DiagonalTile, other: &Self::DiagonalTile) -> bool;

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
        diagonal: &mut Diagonal<&mut [Self::DiagonalTile]>,
        beyond: LaterTargets<Self, W>,
    ) -> Option<PivotSigns>;

    /// Solves with the lower factor for `x`, the right-hand side of the rows of the piece;
    /// contributions to later rows are added to `beyond`.
    fn forward(&self, factors: &PieceFactors<Self, W>, x: &mut [BlockVector<W>], beyond: &mut [BlockVector<W>]);

    /// Solves with the upper factor for `x`, the rows of the piece, with the solution of later rows
    /// in `beyond`.
    fn backward(&self, factors: &PieceFactors<Self, W>, x: &mut [BlockVector<W>], beyond: &[BlockVector<W>]);
}

/// Factors as a piece sees them in a solution.
pub struct PieceFactors<'a, P: Piece<W>, const W: usize> {
    pub(super) elimination: &'a Elimination,
    /// Off-diagonal tiles of the tangent
    pub(super) beside: &'a [Tile<W>],
    /// Diagonal tiles of the factor
    pub(super) diagonal: Diagonal<'a, &'a [P::DiagonalTile]>,
}

/// Contributions of a branch to the trunk.
struct TrunkContribution<P: Piece<W>, const W: usize> {
    /// Off-diagonal blocks
    blocks: P,
    /// Diagonal tiles by row
    diagonal: Vec<P::DiagonalTile>,
}

/// Targets of the contributions to rows after those of a piece.
pub struct LaterTargets<'a, 's, P: Piece<W>, const W: usize> {
    /// Off-diagonal blocks
    pub(super) blocks: &'a mut P,
    /// Diagonal tiles
    pub(super) diagonal: &'a mut Diagonal<'s, &'s mut [P::DiagonalTile]>,
}

/// Factors of all branches and of the trunk.
pub struct Pieces<P: Piece<W>, const W: usize> {
    branches: Vec<P>,
    /// Contributions of each branch to the trunk
    contributions: Vec<TrunkContribution<P, W>>,
    trunk: P,
    /// An empty piece, for the rows after the trunk
    nothing: P,
    /// True if the last factorisation is stored in the tangent
    is_within: bool,
    /// Diagonal tiles of the factor by row, if they are not stored in the tangent
    diagonal: Vec<P::DiagonalTile>,
    /// Signs of the pivots of the last factorisation; `None` if it has failed
    signs: Option<PivotSigns>,
}

impl<P: Piece<W>, const W: usize> Pieces<P, W> {
    /// Memory for the factors of an elimination. `None` if it is not available.
    pub fn new(elimination: &Elimination) -> Option<Self> {
        let piece = |rows: &Range<usize>| P::new(rows.clone(), elimination.changed(rows));
        let trunk = &elimination.trunk;
        let end = elimination.trunk.end;
        let mut branches = Vec::new();
        let mut contributions = Vec::new();
        let both = |rows: &Range<usize>| {
            let branch = piece(rows)?;
            let contribution = TrunkContribution { blocks: piece(trunk)?, diagonal: vec![P::NOTHING; trunk.len()] };
            Some((branch, contribution))
        };
        threads::in_order(elimination.branches.iter(), both, |made| {
            let (branch, contribution) = made.unzip();
            branches.extend(branch);
            contributions.extend(contribution);
        });
        (branches.len() == elimination.branches.len()).then_some(())?;
        let trunk = piece(trunk)?;
        let nothing = piece(&(end..end))?;
        Some(Self { branches, contributions, trunk, nothing, is_within: false, diagonal: Vec::new(), signs: None })
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
        own: Option<&DiagonalTiles<W>>,
        beside: &[Tile<W>],
        mut diagonals: Vec<Diagonal<&mut [P::DiagonalTile]>>,
    ) -> Option<PivotSigns> {
        let Self { branches, contributions, trunk, nothing, .. } = self;
        let mut of_trunk = diagonals.pop()?;
        let branch = |((piece, mut diagonal), contribution): (_, &mut TrunkContribution<P, W>)| {
            contribution.blocks.clear();
            contribution.diagonal.fill(P::NOTHING);
            let mut of_later = Diagonal::by_rows(&mut contribution.diagonal[..], elimination.trunk.start);
            let beyond = LaterTargets { blocks: &mut contribution.blocks, diagonal: &mut of_later };
            eliminate(piece, elimination, own, beside, &mut diagonal, beyond)
        };
        let mut counted = Some(PivotSigns::default());
        threads::in_order(branches.iter_mut().zip(diagonals).zip(&mut *contributions), branch, |signs| {
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
                for contribution in contributions {
                    trunk.add(&contribution.blocks);
                    for (row, tile) in trunk.rows().zip(&contribution.diagonal) {
                        counted.doubtful += usize::from(!P::add_own(&mut of_trunk[row], tile));
                    }
                }
                let mut none = Diagonal::by_rows(&mut [][..], elimination.trunk.end);
                let beyond = LaterTargets { blocks: nothing, diagonal: &mut none };
                counted += trunk.eliminate(trunk.rows(), elimination, beside, &mut of_trunk, beyond)?;
                Some(counted)
            },
        )
    }

    /// Factors as the pieces see them, one after the other.
    fn factors_of_pieces<'a>(
        &'a self,
        elimination: &'a Elimination,
        matrix: Matrix<'a>,
    ) -> Vec<PieceFactors<'a, P, W>> {
        debug_assert_eq!(self.is_within, matrix.holds_factors(), "another tangent");
        let (own, beside) = matrix.numbers::<W>();
        let diagonals = match self.is_within {
            true => within(elimination, P::within(own)),
            false => {
                elimination.pieces().map(|rows| Diagonal::by_rows(&self.diagonal[rows.clone()], rows.start)).collect()
            }
        };
        diagonals.into_iter().map(|diagonal| PieceFactors { elimination, beside, diagonal }).collect()
    }
}

/// Diagonal tiles of a tangent by piece.
fn within<'a, T>(elimination: &'a Elimination, tiles: &'a [T]) -> Vec<Diagonal<'a, &'a [T]>> {
    let of_piece = |node_blocks: &Range<usize>| {
        Diagonal::by_node_blocks(&tiles[node_blocks.clone()], node_blocks.start, &elimination.order)
    };
    elimination.runs.iter().map(of_piece).collect()
}

/// Mutable diagonal tiles of a tangent by piece.
fn within_mut<'a, T>(elimination: &'a Elimination, tiles: &'a mut [T]) -> Vec<Diagonal<'a, &'a mut [T]>> {
    let mut runs: Vec<(usize, &Range<usize>)> = elimination.runs.iter().enumerate().collect();
    runs.sort_by_key(|(_, node_blocks)| (node_blocks.start, node_blocks.end));
    let parts = threads::split(tiles, runs.iter().map(|(_, node_blocks)| node_blocks.end));
    let of_piece = |((piece, node_blocks), part): ((usize, &Range<usize>), _)| {
        (piece, Diagonal::by_node_blocks(part, node_blocks.start, &elimination.order))
    };
    let mut pieces: Vec<(usize, _)> = runs.into_iter().zip(parts).map(of_piece).collect();
    pieces.sort_by_key(|(piece, _)| *piece);
    pieces.into_iter().map(|(_, diagonal)| diagonal).collect()
}

impl<P: Piece<W>, const W: usize> Factor for Pieces<P, W> {
    fn factorise(&mut self, elimination: &Elimination, matrix: Matrix) -> bool {
        self.is_within = false;
        self.signs = None;
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
        self.is_within = true;
        self.signs = None;
        self.diagonal = Vec::new();
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
        let mut factors_of_pieces = self.factors_of_pieces(elimination, matrix);
        let mut parts = threads::split(x.as_chunks_mut().0, elimination.pieces().map(|rows| rows.end));
        let Some(trunk) = parts.pop() else { return };
        let Some(of_trunk) = factors_of_pieces.pop() else { return };
        let branches = || self.branches.iter().zip(&factors_of_pieces);
        let down = |((piece, factors), x): ((&P, &PieceFactors<P, W>), &mut &mut [BlockVector<W>])| {
            let mut change = vec![[0.0; W]; elimination.trunk.len()];
            run!(piece.forward(factors, x, &mut change));
            change
        };
        threads::in_order(branches().zip(&mut parts), down, |change| add(trunk, &change));
        run!(self.trunk.forward(&of_trunk, trunk, &mut []));
        run!(self.trunk.backward(&of_trunk, trunk, &[]));
        let up = |((piece, factors), x): ((&P, &PieceFactors<P, W>), &mut [BlockVector<W>])| {
            run!(piece.backward(factors, x, trunk))
        };
        threads::each(branches().zip(parts), up);
    }
}

/// Adds vectors of the same rows.
fn add<const W: usize>(sums: &mut [BlockVector<W>], others: &[BlockVector<W>]) {
    sums.as_flattened_mut().iter_mut().zip(others.as_flattened()).for_each(|(sum, other)| *sum += other);
}

/// Eliminates all rows of a piece. Rows are loaded shortly before they are needed, so that the
/// tangent passes through the caches once.
fn eliminate<const W: usize, P: Piece<W>>(
    piece: &mut P,
    elimination: &Elimination,
    own: Option<&DiagonalTiles<W>>,
    beside: &[Tile<W>],
    diagonal: &mut Diagonal<&mut [P::DiagonalTile]>,
    beyond: LaterTargets<P, W>,
) -> Option<PivotSigns> {
    Instructions::here().run(
        #[inline(always)]
        || {
            let all = piece.rows();
            let mut loaded = all.start;
            let mut signs = PivotSigns::default();
            for start in all.clone().step_by(ROWS_PER_LOAD) {
                let rows = start..all.end.min(start + ROWS_PER_LOAD);
                let reach = loaded.max(elimination.reach(&rows, all.end));
                piece.load(std::mem::replace(&mut loaded, reach)..reach, elimination, own, beside, diagonal);
                let beyond = LaterTargets { blocks: beyond.blocks, diagonal: beyond.diagonal };
                signs += piece.eliminate(rows, elimination, beside, diagonal, beyond)?;
            }
            Some(signs)
        },
    )
}
