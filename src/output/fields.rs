//! fields.pvd and one .vtu file per row, for ParaView and other readers of VTK: the whole shape
//! with its axes, strains and resultants.
//!
//! Elements are cells of their own order, so that curved elements look curved. Numbers follow the
//! XML as raw bytes ("appended").

use super::files::{FIELDS, PARTIAL_FIELDS};
use super::folder::INDICES;
use super::{Extent, OutputError, ResultFolder, Row};
use beamsim_core::probe::{Figure, Look};
use beamsim_core::run::{Moment, Snapshot};
use beamsim_core::system::State;
use serde::{Deserialize, Serialize};
use std::ffi::OsStr;
use std::fmt::Write;
use std::fs::{self, File};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// VTK's cell types of lines with two, three and four nodes.
const LINES: [u8; 3] = [3, 21, 35];
/// VTK's cell type of a single node.
const VERTEX: u8 = 1;

/// A file of a row.
#[derive(Clone, Debug, Deserialize, Serialize)]
struct FieldFile {
    name: String,
    /// The time for ParaView
    time: f64,
    /// Its length in bytes
    bytes: u64,
}

/// Time for making files safe on the disk at once, at most. A run writes them faster than disks
/// confirm them; what is left is written by the system within its usual half a minute.
const SAFE_TIME: Duration = Duration::from_secs(1);

/// Fields as far as they are written.
#[derive(Deserialize, Serialize)]
pub struct SavedFields {
    written: Vec<FieldFile>,
    /// A row that is written only if no other follows
    pending: Option<PendingRow>,
}

/// A row that may have to be written later.
#[derive(Clone, Deserialize, Serialize)]
struct PendingRow {
    moment: Moment,
    state: State,
    /// The state about which the stage is linear
    origin: Option<State>,
}

/// Writes the fields of a run.
pub struct FieldsWriter {
    /// The folder of the files until the run has ended
    part: PathBuf,
    figure: Figure,
    /// True if every row has its own time, because all stages advance it
    timed: bool,
    /// The files so far
    written: Vec<FieldFile>,
    /// The number of files that are safe on the disk
    safe: usize,
    /// A row that is written only if no other follows
    pending: Option<PendingRow>,
}

impl FieldsWriter {
    /// Creates the fields in a folder of results. `timed` is true if all stages advance time;
    /// otherwise rows are numbered for ParaView.
    pub fn create(folder: &ResultFolder, figure: Figure, timed: bool) -> Result<Self, OutputError> {
        let part = folder.part(FIELDS);
        fs::create_dir(&part).map_err(|error| OutputError::file(&part, error))?;
        Ok(Self { part, figure, timed, written: Vec::new(), safe: 0, pending: None })
    }

    /// Opens the fields of a run that is resumed.
    pub fn resume(folder: &ResultFolder, figure: Figure, timed: bool, saved: SavedFields) -> Result<Self, OutputError> {
        let part = folder.part(FIELDS);
        if !part.exists() {
            folder.reopen(PARTIAL_FIELDS, FIELDS)?;
        }
        let SavedFields { written, pending } = saved;
        let own = |name: &OsStr| written.iter().any(|file| name == file.name.as_str());
        let wrong = |error| OutputError::file(&part, error);
        for entry in fs::read_dir(&part).map_err(wrong)? {
            let entry = entry.map_err(wrong)?;
            if !own(&entry.file_name()) {
                fs::remove_file(entry.path()).map_err(wrong)?;
            }
        }
        for file in &written {
            let path = part.join(&file.name);
            if fs::metadata(&path).map_or(0, |found| found.len()) != file.bytes {
                let why = "was lost in a crash of the machine: begin the run anew with --fresh";
                return Err(OutputError::content(&path, why));
            }
        }
        Ok(Self { figure, timed, safe: written.len(), written, pending, part })
    }

    /// Makes the files so far safe on the disk, as far as that is soon done, and tells what it takes to
    /// go on behind them.
    pub fn save(&mut self) -> Result<SavedFields, OutputError> {
        let begun = Instant::now();
        for file in &self.written[self.safe..] {
            if begun.elapsed() > SAFE_TIME {
                break;
            }
            let path = self.part.join(&file.name);
            let synced = File::open(&path).and_then(|file| file.sync_all());
            synced.map_err(|error| OutputError::file(&path, error))?;
            self.safe += 1;
        }
        Ok(SavedFields { written: self.written.clone(), pending: self.pending.clone() })
    }

    /// Takes a converged state, and writes it if its row is wanted.
    pub fn row(&mut self, at: &Snapshot, row: Row) -> Result<(), OutputError> {
        let time = if self.timed { at.state.time } else { row.number as f64 };
        self.pending = None;
        let moment = Moment { stage: at.stage, time, load: at.state.load };
        if row.wanted {
            return self.write(moment, at.state, at.origin);
        }
        self.pending = Some(PendingRow { moment, state: at.state.clone(), origin: at.origin.cloned() });
        Ok(())
    }

    /// Writes a file; the time of `at` is the one for ParaView.
    fn write(&mut self, at: Moment, state: &State, origin: Option<&State>) -> Result<(), OutputError> {
        let content = grid(&self.figure, at.stage, state, origin);
        let name = format!("{:06}.vtu", self.written.len());
        let path = self.part.join(&name);
        fs::write(&path, &content).map_err(|error| OutputError::file(&path, error))?;
        self.written.push(FieldFile { name, time: at.time, bytes: content.len() as u64 });
        Ok(())
    }

    /// Completes the fields, and returns the name of their index: `fields.pvd`, or
    /// `fields.partial.pvd` where the run failed.
    pub fn finish(mut self, folder: &ResultFolder, extent: Extent) -> Result<&'static str, OutputError> {
        if let Some(PendingRow { moment, state, origin }) = self.pending.take() {
            self.write(moment, &state, origin.as_ref())?;
        }
        self.save()?;
        let [name, index_name] = [[FIELDS, PARTIAL_FIELDS], INDICES].map(|names| extent.name(names));
        folder.write(index_name, index(name, &self.written).as_bytes())?;
        Ok(index_name)
    }
}

fn index(folder: &str, written: &[FieldFile]) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for FieldFile { name, time, .. } in written {
        let _ = writeln!(text, "<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{folder}/{name}\"/>");
    }
    text + "</Collection>\n</VTKFile>\n"
}

/// The XML of a file, and the raw numbers after it.
#[derive(Default)]
struct Grid {
    xml: String,
    raw: Vec<u8>,
}

impl Grid {
    fn array(&mut self, name: &str, kind: &str, components: usize, bytes: Vec<u8>) {
        let offset = self.raw.len();
        let _ = writeln!(
            self.xml,
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>"
        );
        self.raw.extend((bytes.len() as u64).to_le_bytes());
        self.raw.extend(bytes);
    }

    fn floats(&mut self, name: &str, components: usize, values: impl Iterator<Item = f64>) {
        self.array(name, "Float64", components, values.flat_map(f64::to_le_bytes).collect());
    }

    fn tag(&mut self, tag: &str) {
        self.xml.push_str(tag);
        self.xml.push('\n');
    }
}

/// A state as an unstructured grid. `origin` is the state about which the stage is linear.
fn grid(figure: &Figure, stage: usize, state: &State, origin: Option<&State>) -> Vec<u8> {
    let looks = figure.looks(state, origin);
    let cells = Cells::of(figure);
    let mut grid = Grid::default();
    grid.tag("<?xml version=\"1.0\"?>");
    grid.tag("<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">");
    grid.tag("<UnstructuredGrid>\n<FieldData>");
    for (name, value) in [("TimeValue", state.time), ("stage", stage as f64), ("load", state.load)] {
        grid.tag(&format!(
            "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfTuples=\"1\" format=\"ascii\">{value:?}</DataArray>"
        ));
    }
    grid.tag("</FieldData>");
    grid.tag(&format!("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<Points>", looks.len(), cells.types.len()));
    grid.floats("position", 3, looks.iter().flat_map(|look| look.place.0));
    grid.tag("</Points>\n<PointData Vectors=\"displacement\">");
    point_data(&mut grid, &looks);
    if let Some(stress) = figure.von_mises(&looks) {
        grid.floats("vm", 1, stress.into_iter());
    }
    if let Some(contacts) = figure.contacts_at(state) {
        grid.floats("gap", 1, contacts.iter().map(|(gap, _)| *gap));
        grid.floats("contact_force", 3, contacts.iter().flat_map(|(_, force)| force.0));
    }
    grid.tag("</PointData>\n<CellData>");
    grid.array("beam", "Int32", 1, cells.beams.iter().flat_map(|beam| beam.to_le_bytes()).collect());
    grid.tag("</CellData>\n<Cells>");
    grid.array("connectivity", "Int64", 1, cells.nodes.iter().flat_map(|node| node.to_le_bytes()).collect());
    grid.array("offsets", "Int64", 1, cells.ends.iter().flat_map(|end| end.to_le_bytes()).collect());
    grid.array("types", "UInt8", 1, cells.types.clone());
    grid.tag("</Cells>\n</Piece>\n</UnstructuredGrid>");
    let Grid { xml, raw } = grid;
    [xml.as_bytes(), b"<AppendedData encoding=\"raw\">\n_", &raw, b"\n</AppendedData>\n</VTKFile>\n"].concat()
}

fn point_data(grid: &mut Grid, looks: &[Look]) {
    grid.floats("displacement", 3, looks.iter().flat_map(|look| look.u.0));
    grid.floats("rotation", 3, looks.iter().flat_map(|look| look.r.0));
    for (k, name) in ["d1", "d2", "d3"].into_iter().enumerate() {
        grid.floats(name, 3, looks.iter().flat_map(|look| look.axes.column(k).0));
    }
    grid.floats("velocity", 3, looks.iter().flat_map(|look| look.velocity.0));
    six(grid, ["N", "M"], looks, |look| &look.resultant);
    six(grid, ["Gamma", "K"], looks, |look| &look.strain);
    grid.floats("strain_energy_per_length", 1, looks.iter().map(|look| look.energy));
}

/// Adds two arrays: three numbers along the section axes, and three about them.
fn six(grid: &mut Grid, names: [&str; 2], looks: &[Look], of: fn(&Look) -> &[f64; 6]) {
    for (half, name) in names.into_iter().enumerate() {
        grid.floats(name, 3, looks.iter().flat_map(|look| of(look)[3 * half..][..3].iter().copied()));
    }
}

/// Elements as cells.
#[derive(Default)]
struct Cells {
    nodes: Vec<i64>,
    ends: Vec<i64>,
    types: Vec<u8>,
    beams: Vec<i32>,
}

impl Cells {
    fn of(figure: &Figure) -> Self {
        let mut cells = Self::default();
        let mut first = 0;
        for (number, line) in figure.lines.iter().enumerate() {
            let order = line.order;
            for element in 0..(line.points.len() - 1) / order {
                let start = first + element * order;
                // VTK lists both end nodes before the inner ones.
                let inner = (1..order).map(|k| start + k);
                cells.push([start, start + order].into_iter().chain(inner), LINES[order - 1], number as i32);
            }
            first += line.points.len();
        }
        for body in 0..figure.bodies.len() {
            cells.push(std::iter::once(first + body), VERTEX, -1);
        }
        first += figure.bodies.len();
        for link in 0..figure.links.len() {
            cells.push((0..2).map(|end| first + 2 * link + end), LINES[0], -1);
        }
        cells
    }

    fn push(&mut self, nodes: impl Iterator<Item = usize>, kind: u8, beam: i32) {
        self.nodes.extend(nodes.map(|node| node as i64));
        self.ends.push(self.nodes.len() as i64);
        self.types.push(kind);
        self.beams.push(beam);
    }
}
