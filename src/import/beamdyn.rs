//! Input files of BeamDyn (OpenFAST): the primary file with the key points of the reference axis,
//! the blade file with 6x6 matrices at stations, and the driver file with loads.

use super::lines::{ImportError, Lines};
use nalgebra::Matrix6;

/// Key points and stations, at most.
pub const MOST: usize = 100_000;

/// Difference of two entries of a matrix that must be equal, relative to the root of the products
/// of diagonals, that is taken for rounding of printed numbers.
const ROUNDING: f64 = 1e-3;

/// Rows of matrices of BeamDyn, x y z x y z, in the order of sections here, 1 = z, 2 = x, 3 = y.
pub const ORDER: [usize; 6] = [2, 0, 1, 5, 3, 4];

/// A key point of the reference axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyPoint {
    /// Place in the root frame
    pub(super) place: [f64; 3],
    /// Angle about the negative axis, rad
    pub(super) twist: f64,
}

/// A station with its section, in the order of axes of sections here.
#[derive(Clone, Debug, PartialEq)]
pub struct BladeStation {
    /// Fraction of the arc length of the reference axis
    pub(super) eta: f64,
    /// Stiffness
    pub(super) stiffness: Matrix6<f64>,
    /// Mass
    pub(super) mass: Matrix6<f64>,
    /// Line of its matrices in the file, from 1
    pub(super) line: usize,
}

/// Form of the files of a blade.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Of BeamDyn
    BeamDyn,
    /// Of windIO
    WindIo,
}

/// A blade in the axes of BeamDyn.
#[derive(Clone, Debug, PartialEq)]
pub struct Blade {
    /// Second line of the primary file
    pub(super) title: String,
    /// Form of the files
    pub(crate) origin: Origin,
    /// Name of the primary file
    pub(super) primary: String,
    /// Name of the blade file
    pub(super) file: String,
    /// Key points from root to tip
    pub(super) key_points: Vec<KeyPoint>,
    /// Numbers of the key points at which members end
    pub(super) member_ends: Vec<usize>,
    /// Stations from 0 to 1
    pub(super) stations: Vec<BladeStation>,
    /// Factors of stiffness-proportional damping for strains 1, 2, 3 and curvatures 1, 2, 3, times
    pub(super) mu: Option<[f64; 6]>,
    /// Spectral radius of the time integration
    pub(super) rho_inf: f64,
    /// Messages about parts of the files that are left out
    pub(super) notes: Vec<String>,
}

/// Loads and times of the driver of BeamDyn.
#[derive(Clone, Debug, PartialEq)]
pub struct Driver {
    /// Name of its file
    pub(super) file: String,
    /// End and step of a dynamic analysis; `None` for a static one
    pub(super) dynamic: Option<[f64; 2]>,
    /// Acceleration
    pub(super) gravity: [f64; 3],
    /// Force and moment per length
    pub(super) along: [f64; 6],
    /// Force and moment at the tip
    pub(super) tip: [f64; 6],
    /// Fractions of the length, with force and moment there
    pub(super) points: Vec<(f64, [f64; 6])>,
    /// Messages about parts of the files that are left out
    pub(super) notes: Vec<String>,
}

/// Reads a primary file, and the blade file that it names: `open` gives the path and the text of
/// that one.
pub fn read_blade(
    name: &str,
    text: &str,
    open: impl FnOnce(&str) -> Result<(String, String), String>,
) -> Result<Blade, ImportError> {
    let lines = Lines::new(name, text);
    if lines.find("kp_total").is_none() {
        let message = match lines.find("station_total") {
            Some(_) => "this is a blade file: give the primary file, which has the key points and names the blade file",
            None => "this is no primary input file of BeamDyn: there is no line with `kp_total`",
        };
        return Err(lines.wrong(message));
    }
    let (member_ends, first) = read_members(&lines)?;
    let key_points = read_key_points(&lines, first, member_ends.last().copied().unwrap_or(0) + 1)?;
    let (line, word) = lines.value("BldFile")?;
    let (file, blade_text) = open(word.text).map_err(|why| lines.error(line, word.column, why))?;
    let blade_lines = Lines::new(&file, &blade_text);
    let mut notes = Vec::new();
    if lines.find("UsePitchAct").is_some() && lines.flag("UsePitchAct")? {
        notes.push("the pitch actuator (UsePitchAct) is not imported: the root is clamped".into());
    }
    let mu = read_damping(&blade_lines, &mut notes)?;
    let stations = read_stations(&blade_lines)?;
    Ok(Blade {
        title: lines.line(1).trim().to_string(),
        origin: Origin::BeamDyn,
        primary: name.into(),
        key_points,
        member_ends,
        stations,
        mu,
        rho_inf: read_rho_inf(&lines)?,
        notes,
        file: file.clone(),
    })
}

fn read_rho_inf(lines: &Lines) -> Result<f64, ImportError> {
    let rho_inf = lines.number_or("rhoinf", 0.0)?;
    if !(0.0..=1.0).contains(&rho_inf) {
        let (line, word) = lines.value("rhoinf")?;
        return Err(lines.error(line, word.column, format!("`rhoinf` must be from 0 to 1, found {rho_inf}")));
    }
    Ok(rho_inf)
}

/// The key points at which members end, and the line of the first key point.
fn read_members(lines: &Lines) -> Result<(Vec<usize>, usize), ImportError> {
    let (_, members) = lines.whole("member_total", 1, MOST)?;
    let (line, total) = lines.whole("kp_total", 2, MOST)?;
    let mut ends = vec![0];
    let mut at = line;
    for member in 1..=members {
        at = lines.next_row(at + 1);
        let [number, count] = lines.row::<2>(at, "a member (its number, and that of its key points)")?;
        if number != member as f64 || count.fract() != 0.0 || !(2.0..=MOST as f64).contains(&count) {
            let message = format!("expected `{member}` and a number of key points, found {number} and {count}");
            return Err(lines.error(at, 1, message));
        }
        ends.push(ends[member - 1] + count as usize - 1);
    }
    let found = ends[members] + 1;
    if found != total {
        let message = format!("the members have {found} key points in all, `kp_total` says {total}");
        return Err(lines.error(line, 1, message));
    }
    // Two lines of headers follow.
    Ok((ends, lines.next_row(lines.next_row(at + 1) + 1) + 1))
}

fn read_key_points(lines: &Lines, first: usize, count: usize) -> Result<Vec<KeyPoint>, ImportError> {
    let mut points: Vec<KeyPoint> = Vec::new();
    let mut at = first;
    for number in 1..=count {
        at = lines.next_row(at);
        let [x, y, z, twist] = lines.row::<4>(at, &format!("key point {number} (x, y, z, twist)"))?;
        if let Some(before) = points.last().filter(|before| before.place[2] >= z) {
            let message = format!("`kp_zr` must increase, but {z} comes after {}", before.place[2]);
            return Err(lines.error(at, 1, message));
        }
        points.push(KeyPoint { place: [x, y, z], twist: twist.to_radians() });
        at += 1;
    }
    Ok(points)
}

fn read_damping(lines: &Lines, notes: &mut Vec<String>) -> Result<Option<[f64; 6]>, ImportError> {
    let (_, kind) = lines.whole("damp_type", 0, 2)?;
    if kind == 2 {
        notes.push("modal damping (damp_type = 2) is not imported: the deck has no damping".into());
    }
    if kind != 1 {
        return Ok(None);
    }
    let is_header = |line: &usize| lines.words(*line).first().is_some_and(|word| word.text.eq_ignore_ascii_case("mu1"));
    let header = (0..lines.count()).find(is_header);
    let header = header.ok_or_else(|| lines.wrong("there is no line with `mu1` above the damping coefficients"))?;
    // Units stand in the next line.
    let at = lines.next_row(lines.next_row(header + 1) + 1);
    let mu = lines.row::<6>(at, "damping coefficients")?;
    match mu.iter().find(|&&mu| mu < 0.0) {
        Some(negative) => Err(lines.error(at, 1, format!("a damping coefficient is negative: {negative}"))),
        None => Ok(Some(ORDER.map(|k| mu[k]))),
    }
}

fn read_stations(lines: &Lines) -> Result<Vec<BladeStation>, ImportError> {
    let (_, count) = lines.whole("station_total", 2, MOST)?;
    let is_title = |line: &usize| {
        let text = lines.line(*line).to_ascii_lowercase();
        text.contains("distributed prop") && text.trim_start().starts_with('-')
    };
    let title = (0..lines.count()).find(is_title);
    let title = title.ok_or_else(|| lines.wrong("there is no line `--- DISTRIBUTED PROPERTIES ---`"))?;
    let mut stations: Vec<BladeStation> = Vec::new();
    let mut at = title + 1;
    for number in 1..=count {
        at = lines.next_row(at);
        let place = at;
        let [eta] = lines.row::<1>(at, &format!("the place of station {number}"))?;
        let wanted = match (number, stations.last()) {
            (1, _) if eta != 0.0 => Some("0 at the first station".to_string()),
            (_, Some(before)) if eta <= before.eta => Some(format!("above {}, that of the station before", before.eta)),
            _ if number == count && eta != 1.0 => Some("1 at the last station".to_string()),
            _ => None,
        };
        if let Some(wanted) = wanted {
            return Err(lines.error(at, 1, format!("the place of a station must be {wanted}, found {eta}")));
        }
        let stiffness = read_matrix(lines, &mut at, &format!("the stiffness of station {number}"))?;
        let mass = read_matrix(lines, &mut at, &format!("the mass of station {number}"))?;
        if stiffness.cholesky().is_none() {
            return Err(lines.error(place, 1, format!("the stiffness of station {number} is not positive definite")));
        }
        let mass = rigid(&mass).map_err(|why| lines.error(place, 1, format!("the mass of station {number} {why}")))?;
        stations.push(BladeStation { eta, stiffness, mass, line: place + 1 });
        at += 1;
    }
    Ok(stations)
}

/// The six rows after `at`, which becomes the last of them.
fn read_matrix(lines: &Lines, at: &mut usize, of: &str) -> Result<Matrix6<f64>, ImportError> {
    let mut rows = [[0.0; 6]; 6];
    let mut places = [0; 6];
    for (row, place) in rows.iter_mut().zip(&mut places) {
        *at = lines.next_row(*at + 1);
        *place = *at;
        *row = lines.row::<6>(*at, of)?;
    }
    for i in 0..6 {
        for j in 0..i {
            let scale = (rows[i][i] * rows[j][j]).abs().sqrt();
            if (rows[i][j] - rows[j][i]).abs() > ROUNDING * scale {
                let message = format!(
                    "{of} is not symmetric: row {} has {}, row {} has {}",
                    i + 1,
                    rows[i][j],
                    j + 1,
                    rows[j][i]
                );
                return Err(lines.error(places[i], 1, message));
            }
        }
    }
    Ok(Matrix6::from_fn(|i, j| {
        let [i, j] = [ORDER[i], ORDER[j]];
        0.5 * (rows[i][j] + rows[j][i])
    }))
}

/// The mass of a rigid section, without the rounding of printed numbers: [m I, -m d~; m d~, J].
pub fn rigid(mass: &Matrix6<f64>) -> Result<Matrix6<f64>, String> {
    let axial = mass[(0, 0)];
    let m = axial + ((mass[(1, 1)] - axial) + (mass[(2, 2)] - axial)) / 3.0;
    let scale = |i: usize, j: usize| ROUNDING * (mass[(i, i)] * mass[(j, j)]).abs().sqrt();
    if let Some(k) = (0..3).find(|&k| (mass[(k, k)] - m).abs() > ROUNDING * m.abs()) {
        return Err(format!("differs by direction: {} and {m}", mass[(k, k)]));
    }
    // m d2 and m d3, each twice.
    let first = [0.5 * (mass[(3, 2)] - mass[(5, 0)]), 0.5 * (mass[(4, 0)] - mass[(3, 1)])];
    let ideal = Matrix6::from_fn(|row, column| match (row.min(column), row.max(column)) {
        (low, high) if high < 3 => f64::from(u8::from(low == high)) * m,
        (low, high) if low >= 3 => 0.5 * (mass[(low, high)] + mass[(high, low)]),
        (2, 3) => first[0],
        (0, 5) => -first[0],
        (0, 4) => first[1],
        (1, 3) => -first[1],
        _ => 0.0,
    });
    let off = |k: &usize| (mass[(k / 6, k % 6)] - ideal[(k / 6, k % 6)]).abs() > scale(k / 6, k % 6);
    match (0..36).find(off) {
        Some(_) => Err("is not that of a rigid section: [m I, -m d~; m d~, J]".into()),
        None => Ok(ideal),
    }
}

/// Reads a driver file.
pub fn read_driver(name: &str, text: &str) -> Result<Driver, ImportError> {
    let lines = Lines::new(name, text);
    if lines.find("t_final").is_none() {
        return Err(lines.wrong("this is no driver input file of BeamDyn: there is no line with `t_final`"));
    }
    let six = |key: &str| -> Result<[f64; 6], ImportError> {
        let mut values = [0.0; 6];
        for (k, value) in values.iter_mut().enumerate() {
            *value = lines.number_or(&format!("{key}({})", k + 1), 0.0)?;
        }
        Ok(values)
    };
    let mut notes = Vec::new();
    let spin = six("RootVel")?;
    if spin != [0.0; 6] {
        notes.push(format!("the motion of the root ({spin:?}) is not imported: the root is clamped"));
    }
    refuse_turned_frame(&lines)?;
    let dynamic = match lines.find("DynamicSolve") {
        Some(_) => lines.flag("DynamicSolve")?,
        None => true,
    };
    let duration = lines.number("t_final")? - lines.number_or("t_initial", 0.0)?;
    let step = lines.number("dt")?;
    if dynamic && !(duration > 0.0 && step > 0.0) {
        let (line, word) = lines.value("t_final")?;
        return Err(lines.error(line, word.column, "`t_final` must be after `t_initial`, and `dt` positive"));
    }
    Ok(Driver {
        file: name.into(),
        dynamic: dynamic.then_some([duration, step]),
        gravity: [lines.number_or("Gx", 0.0)?, lines.number_or("Gy", 0.0)?, lines.number_or("Gz", 0.0)?],
        along: six("DistrLoad")?,
        tip: six("TipLoad")?,
        points: read_point_loads(&lines)?,
        notes,
    })
}

/// Refuses a matrix of direction cosines below `GlbPos` that is not the identity.
fn refuse_turned_frame(lines: &Lines) -> Result<(), ImportError> {
    let (position, _) = lines.value("GlbPos(3)")?;
    let mut at = position + 1;
    // Lines of text stand above the matrix.
    while at < lines.count() && lines.row::<3>(at, "").is_err() && at < position + 4 {
        at += 1;
    }
    for k in 0..3 {
        let row = lines.row::<3>(at + k, "GlbDCM")?;
        let off = (0..3).any(|j| (row[j] - f64::from(u8::from(j == k))).abs() > 1e-9);
        if off {
            let message = "a blade frame that is turned against the global one (GlbDCM) is not imported: turn \
                           gravity and loads, and give the identity";
            return Err(lines.error(at + k, 1, message));
        }
    }
    Ok(())
}

fn read_point_loads(lines: &Lines) -> Result<Vec<(f64, [f64; 6])>, ImportError> {
    if lines.find("NumPointLoads").is_none() {
        return Ok(Vec::new());
    }
    let (line, count) = lines.whole("NumPointLoads", 0, MOST)?;
    let row = |k: usize| {
        // Two lines of headers stand above the rows.
        let at = line + 3 + k;
        let [eta, load @ ..] = lines.row::<7>(at, "a point load (eta, force, moment)")?;
        match (0.0..=1.0).contains(&eta) {
            true => Ok((eta, load)),
            false => Err(lines.error(at, 1, format!("a point load must be at 0 to 1, found {eta}"))),
        }
    };
    (0..count).map(row).collect()
}
