//! Blades of windIO (IEA Wind Task 37), version 1: `six_x_six` of a turbine in YAML, with the reference
//! axis, the twist, and the upper triangles of 6x6 matrices in the axes and the order of BeamDyn.

use super::beamdyn::{Blade, BladeStation, KeyPoint, MOST, ORDER, Origin, rigid};
use super::lines::ImportError;
use super::yaml::{Node, Yaml};
use crate::scene::NaturalSpline;
use beamsim_core::sorting::sort_numbers;
use beamsim_core::tensor::Vec3;
use nalgebra::Matrix6;
use std::rc::Rc;

/// Entries of the upper triangle of a 6x6 matrix
const ENTRIES: usize = 21;

/// Fractions of the length that are one place
const ONE_PLACE: f64 = 1e-9;

/// Keys that are not read and that a note names, at most
const MOST_NAMED: usize = 12;

/// Where a blade has its matrices.
const PLACE: [&str; 4] = ["components", "blade", "elastic_properties_mb", "six_x_six"];

/// Values over the fraction of the length.
struct Course {
    grid: Vec<f64>,
    values: Vec<f64>,
}

/// Matrices over the fraction of the length, in the order of sections here, with their nodes in the
/// file.
struct Matrices<'y> {
    grid: Vec<f64>,
    values: Vec<Matrix6<f64>>,
    rows: &'y [Rc<Node>],
}

/// Reads the blade of a turbine.
pub fn read_windio(name: &str, text: &str) -> Result<Blade, ImportError> {
    let yaml = Yaml::new(name, text)?;
    let Some(six) = yaml.find(yaml.root(), &PLACE) else {
        let message = format!(
            "there is no `{}`: this file has no 6x6 matrices of a blade in the form of windIO 1. beamsim does not \
             compute them from the plies of a blade; tools such as WISDEM with SONATA or PreComp write them",
            PLACE.join(".")
        );
        return Err(yaml.error(yaml.root(), message));
    };
    let axis = yaml.need(six, "reference_axis")?;
    let twist =
        six.get("twist").or_else(|| yaml.find(yaml.root(), &["components", "blade", "outer_shape_bem", "twist"]));
    let twist = twist.ok_or_else(|| yaml.error(six, "there is no `twist` here, nor in `outer_shape_bem`"))?;
    let key_points = key_points(&yaml, axis, twist)?;
    let stiffness = matrices(&yaml, six, "stiff_matrix")?;
    let mass = matrices(&yaml, six, "inertia_matrix")?;
    let title = yaml.root().get("name").and_then(Node::text).unwrap_or("A blade of windIO");
    let stations = stations(&yaml, &stiffness, &mass)?;
    Ok(Blade {
        title: title.into(),
        origin: Origin::WindIo,
        primary: name.into(),
        file: name.into(),
        member_ends: vec![0, key_points.len() - 1],
        key_points,
        stations,
        mu: None,
        rho_inf: 0.0,
        notes: not_read(&yaml).into_iter().collect(),
    })
}

/// A note about keys that were not read.
fn not_read(yaml: &Yaml) -> Option<String> {
    let keys = yaml.unread();
    let named = keys.iter().take(MOST_NAMED).cloned().collect::<Vec<_>>().join(", ");
    let more = match keys.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!keys.is_empty()).then(|| format!("not read: {named}{more}"))
}

/// Values with their grid, which increases from 0 to 1.
fn course(yaml: &Yaml, node: &Node, of: &str) -> Result<Course, ImportError> {
    let grid = grid(yaml, node, of)?;
    let at = yaml.need(node, "values")?;
    let values = yaml.numbers(at, &format!("values of {of}"))?;
    if values.len() != grid.len() {
        let message = format!("{of} has {} values and {} places in `grid`", values.len(), grid.len());
        return Err(yaml.error(at, message));
    }
    Ok(Course { grid, values })
}

fn grid(yaml: &Yaml, node: &Node, of: &str) -> Result<Vec<f64>, ImportError> {
    let at = yaml.need(node, "grid")?;
    let grid = yaml.numbers(at, &format!("`grid` of {of}"))?;
    let is_whole = grid.len() >= 2 && grid.len() <= MOST && grid[0] == 0.0 && grid[grid.len() - 1] == 1.0;
    if !is_whole || grid.windows(2).any(|pair| pair[1] - pair[0] <= ONE_PLACE) {
        return Err(yaml.error(at, format!("`grid` of {of} must increase from 0 to 1")));
    }
    Ok(grid)
}

impl Course {
    /// The natural cubic spline through its values.
    fn spline(&self) -> NaturalSpline {
        let points: Vec<Vec3> = self.values.iter().map(|&value| Vec3([value, 0.0, 0.0])).collect();
        NaturalSpline::new(&points, &self.grid)
    }
}

/// Key points at all places of the grids of the axis and of the twist: each quantity has a natural
/// cubic spline over its own grid.
fn key_points(yaml: &Yaml, axis: &Node, twist: &Node) -> Result<Vec<KeyPoint>, ImportError> {
    let mut courses = Vec::new();
    for key in ["x", "y", "z"] {
        courses.push(course(yaml, yaml.need(axis, key)?, &format!("`{key}` of the reference axis"))?);
    }
    courses.push(course(yaml, twist, "the twist")?);
    let places = union(courses.iter().map(|course| &course.grid[..]));
    let splines: Vec<NaturalSpline> = courses.iter().map(Course::spline).collect();
    let key = |&place: &f64| {
        let [x, y, z, twist] = [0, 1, 2, 3].map(|k| splines[k].at(place).0[0]);
        KeyPoint { place: [x, y, z], twist }
    };
    let keys: Vec<KeyPoint> = places.iter().map(key).collect();
    if let Some(k) = (1..keys.len()).find(|&k| keys[k].place[2] <= keys[k - 1].place[2]) {
        let message = format!("`z` of the reference axis must increase, but does not before {}", places[k]);
        return Err(yaml.error(axis, message));
    }
    Ok(keys)
}

/// All places of several grids, in order.
fn union<'g>(grids: impl Iterator<Item = &'g [f64]>) -> Vec<f64> {
    let mut all: Vec<f64> = grids.flatten().copied().collect();
    sort_numbers(&mut all);
    all.dedup_by(|next, before| *next - *before <= ONE_PLACE);
    all
}

fn matrices<'y>(yaml: &Yaml, six: &'y Node, key: &str) -> Result<Matrices<'y>, ImportError> {
    let node = yaml.need(six, key)?;
    let grid = grid(yaml, node, &format!("`{key}`"))?;
    let at = yaml.need(node, "values")?;
    let rows = yaml.items(at, &format!("values of `{key}`"))?;
    if rows.len() != grid.len() {
        let message = format!("`{key}` has {} matrices and {} places in `grid`", rows.len(), grid.len());
        return Err(yaml.error(at, message));
    }
    let mut values = Vec::new();
    for row in rows {
        let entries = yaml.numbers(row, &format!("a matrix of `{key}`"))?;
        if entries.len() != ENTRIES {
            let message =
                format!("a matrix has the {ENTRIES} entries of its upper triangle by rows, found {}", entries.len());
            return Err(yaml.error(row, message));
        }
        values.push(Matrix6::from_fn(|i, j| entries[in_triangle(ORDER[i], ORDER[j])]));
    }
    Ok(Matrices { grid, values, rows })
}

/// Number of an entry in the upper triangle by rows.
fn in_triangle(i: usize, j: usize) -> usize {
    let [row, column] = [i.min(j), i.max(j)];
    6 * row - row * (row + 1) / 2 + column
}

impl Matrices<'_> {
    /// The matrix at a place, linear between those of the grid, and the node of the one before.
    fn at(&self, place: f64) -> (Matrix6<f64>, &Node) {
        let next = self.grid.partition_point(|&known| known <= place + ONE_PLACE).clamp(1, self.grid.len() - 1);
        let part = (place - self.grid[next - 1]) / (self.grid[next] - self.grid[next - 1]);
        let [from, to] = [&self.values[next - 1], &self.values[next]];
        if part.abs() <= ONE_PLACE {
            (*from, &self.rows[next - 1])
        } else if (part - 1.0).abs() <= ONE_PLACE {
            (*to, &self.rows[next])
        } else {
            (from + (to - from) * part, &self.rows[next - 1])
        }
    }
}

fn stations(yaml: &Yaml, stiffness: &Matrices, mass: &Matrices) -> Result<Vec<BladeStation>, ImportError> {
    let station = |&eta: &f64| {
        let (stiffness, row) = stiffness.at(eta);
        let (mass, mass_row) = mass.at(eta);
        let wrong = |row: &Node, why: String| yaml.error(row, format!("the {why} (at {eta})"));
        if stiffness[(1, 1)] == 0.0 || stiffness[(2, 2)] == 0.0 {
            let why = "shear stiffness of a station is zero, as in files of PreComp: give its entries 1 and 7, or import the \
                       BeamDyn files of the blade";
            return Err(wrong(row, why.into()));
        }
        if stiffness.cholesky().is_none() {
            return Err(wrong(row, "stiffness of a station is not positive definite".into()));
        }
        let mass = rigid(&mass).map_err(|why| wrong(mass_row, format!("mass of a station {why}")))?;
        Ok(BladeStation { eta, stiffness, mass, line: row.line() })
    };
    union([&stiffness.grid[..], &mass.grid[..]].into_iter()).iter().map(station).collect()
}
