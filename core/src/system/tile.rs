//! Tiles: the dense blocks of a tangent.

/// A block of the tangent, by columns.
pub type Tile<const W: usize> = [[f64; W]; W];

/// The transpose.
#[inline(always)]
pub fn transposed<const W: usize>(tile: &Tile<W>) -> Tile<W> {
    let mut out = [[0.0; W]; W];
    for c in 0..W {
        for r in 0..W {
            out[c][r] = tile[r][c];
        }
    }
    out
}
