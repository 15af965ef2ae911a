//! Sections of rectangles with sides along 2 and 3: a grid of blocks of quadrilaterals, with cells
//! that become small towards re-entrant corners and ends of walls.

use super::Point;
use super::blocks::BlockMesher;
use super::divide::{End, divide};
use super::error::{SectionError, check_positive};
use super::mesh::{Mesh, ReentrantCorner, Region};
use crate::sorting::sort_numbers;
use std::collections::HashMap;

/// Coordinates nearer than this part of the size of the section are the same
const SAME: f64 = 1e-9;

/// A rectangle of one region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// From and to along 2
    pub x2: [f64; 2],
    /// From and to along 3
    pub x3: [f64; 2],
    /// Index of the region
    pub region: usize,
}

/// Numbers of cells along a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Cells of a line with nothing special at its ends
    pub(super) least: f64,
    /// Cells that an end adds over the thickness of a wall
    pub(super) density: f64,
}

/// Fineness grows by this factor from level to level
pub const REFINEMENT: f64 = 1.5;

impl Fineness {
    /// The fineness of a level, 0 the coarsest.
    pub fn level(level: usize) -> Self {
        let factor = REFINEMENT.powi(level as i32);
        Self { least: 2.0 * factor, density: 2.0 * factor }
    }
}

/// Lines of the grid and the regions of its cells.
struct Grid {
    /// Positions of lines across axis 2 and across axis 3
    lines: [Vec<f64>; 2],
    /// Region of each cell, by columns along 2 first
    cells: Vec<Option<usize>>,
}

impl Grid {
    fn new(rects: &[Rect], regions: &[Region]) -> Result<Self, SectionError> {
        let size = rects.iter().flat_map(|r| r.x2.into_iter().chain(r.x3)).fold(0.0, |a: f64, b| a.max(b.abs()));
        let lines = [
            distinct(rects.iter().flat_map(|rect| rect.x2), SAME * size),
            distinct(rects.iter().flat_map(|rect| rect.x3), SAME * size),
        ];
        let columns = lines[0].len().saturating_sub(1);
        let rows = lines[1].len().saturating_sub(1);
        let mut grid = Self { lines, cells: vec![None; columns * rows] };
        for rect in rects {
            for [from, to] in [rect.x2, rect.x3] {
                let what = || format!("a side of a rectangle of `{}`", regions[rect.region].name);
                check_positive(what(), to - from)?;
                check_positive(what(), to - from - SAME * size)?;
            }
            for j in 0..rows {
                for i in 0..columns {
                    let middle = |axis: usize, k: usize| 0.5 * (grid.lines[axis][k] + grid.lines[axis][k + 1]);
                    let inside = |[from, to]: [f64; 2], at: f64| from < at && at < to;
                    if !inside(rect.x2, middle(0, i)) || !inside(rect.x3, middle(1, j)) {
                        continue;
                    }
                    if let Some(other) = grid.cells[j * columns + i] {
                        return Err(SectionError::OverlappingRegions {
                            first: regions[other].name.clone(),
                            second: regions[rect.region].name.clone(),
                        });
                    }
                    grid.cells[j * columns + i] = Some(rect.region);
                }
            }
        }
        Ok(grid)
    }

    /// Number of cells along an axis.
    fn count(&self, axis: usize) -> usize {
        self.lines[axis].len() - 1
    }

    /// Size of the cells of a column (axis 0) or row (axis 1).
    fn size(&self, axis: usize, k: usize) -> f64 {
        self.lines[axis][k + 1] - self.lines[axis][k]
    }

    /// The region of a cell; outside the grid there is none.
    fn cell(&self, i: isize, j: isize) -> Option<usize> {
        if i < 0 || j < 0 || i >= self.count(0) as isize || j >= self.count(1) as isize {
            return None;
        }
        self.cells[j as usize * self.count(0) + i as usize]
    }

    /// The cell at position `k` along an axis and `across` along the other.
    fn cell_along(&self, axis: usize, k: isize, across: isize) -> Option<usize> {
        if axis == 0 { self.cell(k, across) } else { self.cell(across, k) }
    }

    /// True if a crossing of lines is a re-entrant corner.
    fn is_reentrant(&self, i: isize, j: isize) -> bool {
        let around = [(i - 1, j - 1), (i, j - 1), (i - 1, j), (i, j)].map(|(i, j)| self.cell(i, j).is_some());
        around.iter().filter(|&&full| full).count() == 3
    }

    /// The re-entrant corners, with the thickness of walls that meet there.
    fn corners(&self) -> Vec<ReentrantCorner> {
        let mut corners = Vec::new();
        for j in 0..self.lines[1].len() as isize {
            for i in 0..self.lines[0].len() as isize {
                if !self.is_reentrant(i, j) {
                    continue;
                }
                // The cell opposite the empty one is common to both walls.
                for (di, dj) in [(0, 0), (-1, 0), (0, -1), (-1, -1)] {
                    if self.cell(i + di, j + dj).is_none() {
                        let column = (i - 1 - di) as usize;
                        let row = (j - 1 - dj) as usize;
                        let wall = self.size(0, column).min(self.size(1, row));
                        let at = [self.lines[0][i as usize], self.lines[1][j as usize]];
                        corners.push(ReentrantCorner { at, wall });
                    }
                }
            }
        }
        corners
    }

    /// The thickness, across an axis, over which stresses change at the ends of a column of cells.
    fn thickness(&self, axis: usize, k: usize) -> f64 {
        let across = 1 - axis;
        let mut thinnest = f64::MAX;
        let mut run = 0.0;
        let mut run_regions = Vec::new();
        let mut thinnest_layer = f64::MAX;
        for other in 0..=self.count(across) {
            match self.cell_along(axis, k as isize, other as isize) {
                Some(region) if other < self.count(across) => {
                    run += self.size(across, other);
                    thinnest_layer = thinnest_layer.min(self.size(across, other));
                    if !run_regions.contains(&region) {
                        run_regions.push(region);
                    }
                }
                _ => {
                    if run > 0.0 {
                        thinnest = thinnest.min(if run_regions.len() > 1 { thinnest_layer } else { run });
                    }
                    run = 0.0;
                    run_regions.clear();
                    thinnest_layer = f64::MAX;
                }
            }
        }
        thinnest
    }

    /// The behaviour of the solution at an end of a column of cells: `line` is the line there, `k` the column.
    fn end(&self, axis: usize, k: usize, line: usize, half_length: f64) -> End {
        let across = 1 - axis;
        let corner_on_line = (0..self.lines[across].len() as isize).any(|other| {
            let line = line as isize;
            if axis == 0 { self.is_reentrant(line, other) } else { self.is_reentrant(other, line) }
        });
        let thickness = self.thickness(axis, k);
        if corner_on_line {
            return End::Singular { radius: half_length.min(thickness) };
        }
        let changes = (0..self.count(across) as isize).any(|other| {
            let before = self.cell_along(axis, line as isize - 1, other);
            before != self.cell_along(axis, line as isize, other)
        });
        if changes { End::Layer { thickness } } else { End::Smooth }
    }

    /// Ends of cells of a column, from 0 to 1.
    fn division(&self, axis: usize, k: usize, fineness: Fineness) -> Vec<f64> {
        let length = self.size(axis, k);
        let ends = [k, k + 1].map(|line| self.end(axis, k, line, 0.5 * length));
        let singular = |end: &End| matches!(end, End::Singular { .. });
        let ends = match ends {
            [End::Singular { .. }, second] if !singular(&second) => [self.end(axis, k, k, length), second],
            [first, End::Singular { .. }] if !singular(&first) => [first, self.end(axis, k, k + 1, length)],
            both => both,
        };
        divide(length, ends, fineness.least, fineness.density)
    }
}

/// Meshes rectangles that touch along edges.
pub fn mesh_rects(rects: &[Rect], regions: &[Region], fineness: Fineness) -> Result<Mesh, SectionError> {
    if rects.is_empty() {
        return Err(SectionError::Dimensions { message: "the section has no rectangle".to_string() });
    }
    let grid = Grid::new(rects, regions)?;
    let divisions: [Vec<Vec<f64>>; 2] =
        std::array::from_fn(|axis| (0..grid.count(axis)).map(|k| grid.division(axis, k, fineness)).collect());
    let mut mesher = BlockMesher::new(regions.to_vec());
    let mut vertices: HashMap<[usize; 2], u32> = HashMap::new();
    for j in 0..grid.count(1) {
        for i in 0..grid.count(0) {
            let Some(region) = grid.cell(i as isize, j as isize) else { continue };
            let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|key| {
                let at: Point = [grid.lines[0][key[0]], grid.lines[1][key[1]]];
                *vertices.entry(key).or_insert_with(|| mesher.vertex(at))
            });
            mesher.block(corners, &divisions[0][i], &divisions[1][j], region as u32)?;
        }
    }
    let mut mesh = mesher.finish();
    mesh.corners = grid.corners();
    Ok(mesh)
}

/// Sorted values, those nearer than a tolerance once.
fn distinct(values: impl Iterator<Item = f64>, tolerance: f64) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sort_numbers(&mut sorted);
    sorted.dedup_by(|a, b| (*a - *b).abs() <= tolerance);
    sorted
}
