//! `[section.NAME]`: stiffness and mass of a cross-section.

use super::by_name::Named;
use super::diagnostic::Spanned;
use super::reader::{Context, Item, Table, joined, kind_of};
use super::section_shape::{self, ComputedSection};
use super::words::words;
use toml::de::DeValue;

/// `[section.NAME]`
#[derive(Clone, Debug)]
pub struct Section {
    /// Name of the table
    pub name: Spanned<String>,
    /// Stiffness and mass in one of three ways
    pub body: SectionBody,
    /// Points of the shape at which stresses are written
    pub(crate) probes: Vec<SectionProbe>,
    /// Search for the largest stress near re-entrant corners
    pub(crate) corner: CornerWord,
}

impl Named for Section {
    fn name(&self) -> &str {
        &self.name.value
    }
}

/// A named point of a shape.
#[derive(Clone, Debug)]
pub struct SectionProbe {
    /// Name
    pub(crate) name: Spanned<String>,
    /// Coordinates 2 and 3 of the shape
    pub(crate) at: [f64; 2],
}

words! {
    /// `corner = …`
    pub enum CornerWord {
        /// Points within a wall thickness of a sharp re-entrant corner are left out
        Exclude = "exclude",
        /// All points are looked at
        Include = "include",
    }
}

/// The three ways to give a section.
#[derive(Clone, Debug)]
pub enum SectionBody {
    /// Resultants
    Resultants {
        /// EA, GA2, GA3, GJ, EI2, EI3
        stiffness: [f64; 6],
        /// Mass per length
        mass: Option<f64>,
        /// Rotary inertia per length about 1, 2, 3
        rotary: Option<[f64; 3]>,
    },
    /// Full matrices in the order Gamma1 Gamma2 Gamma3 K1 K2 K3
    Full {
        /// 6x6 stiffness
        stiffness: [[f64; 6]; 6],
        /// 6x6 mass
        mass: Option<[[f64; 6]; 6]>,
    },
    /// A shape of which the matrices follow
    Computed(Box<ComputedSection>),
}

const RESULTANT_KEYS: [&str; 6] = ["EA", "GA", "GJ", "EI", "rhoA", "rhoJ"];
const FULL_KEYS: [&str; 2] = ["stiffness", "mass"];

const STRESS_KEYS: [&str; 2] = ["probe", "corner"];

/// Keys of `[section.NAME]`.
pub(super) const KEYS: [&str; 10 + section_shape::KEYS.len()] =
    joined(&[&RESULTANT_KEYS, &FULL_KEYS, &section_shape::KEYS, &STRESS_KEYS]);

/// Reads a section; `layups` are the names of all layups of the deck.
pub(super) fn read_section<'a>(
    context: &'a Context,
    name: Spanned<String>,
    item: &'a Item<'a>,
    layups: &[String],
) -> Option<Section> {
    let table = Table::new(context, item, format!("[section.{}]", name.value), &KEYS)?;
    let first_of = |keys: &[&'static str]| keys.iter().copied().find(|key| table.has(key));
    let by_resultants = first_of(&RESULTANT_KEYS);
    let by_matrices = first_of(&FULL_KEYS);
    let by_shape = first_of(&section_shape::KEYS);
    let body = match (by_resultants, by_matrices, by_shape) {
        (Some(_), None, None) => read_resultants(&table),
        (None, Some(_), None) => read_full(&table),
        (None, None, Some(_)) => {
            section_shape::read_shaped(&table, layups).map(|section| SectionBody::Computed(Box::new(section)))
        }
        (None, None, None) => table.wrong(format!(
            "{} needs section stiffnesses (EA, GA, GJ, EI), or `stiffness`, or `material` and `shape`",
            table.what
        )),
        (Some(_), Some(second), _) | (Some(_), None, Some(second)) | (None, Some(_), Some(second)) => table.wrong_key(
            second,
            format!("{} is defined in two ways; keep only one of: EA, GA, GJ, EI; `stiffness`; `shape`", table.what),
        ),
    };
    if by_shape.is_none() {
        for key in STRESS_KEYS {
            table.refuse(key, format!("`{key}` is about stresses, which a section has only by its `shape`"));
        }
    }
    let probes = if table.has("probe") { read_probes(&table) } else { Some(Vec::new()) };
    let corner = table.word_or("corner", CornerWord::Exclude);
    Some(Section { name, body: body?, probes: probes?, corner: corner? })
}

/// Names and places of points. A name begins with a letter, so that columns of places such as
/// `arm@0.5` are told apart.
fn read_probes(table: &Table) -> Option<Vec<SectionProbe>> {
    let points = Table::of_names(table.context, table.get("probe")?, "`probe`")?;
    let read = |(name, item): (Spanned<String>, &Item)| {
        let at = table.context.vector(item)?.value;
        let is_plain = name.value.chars().all(|c| c.is_alphanumeric() || c == '_');
        if !is_plain || !name.value.starts_with(char::is_alphabetic) {
            let message = format!(
                "a point of a section has a name of letters and digits that begins with a letter, found `{}`",
                name.value
            );
            return table.context.wrong(name.span, message);
        }
        Some(SectionProbe { name, at })
    };
    let all: Vec<_> = points.entries().map(read).collect();
    all.into_iter().collect()
}

fn read_resultants(table: &Table) -> Option<SectionBody> {
    let extension = table.required_positive("EA");
    let shear = table.positive_pair("GA");
    let torsion = table.required_positive("GJ");
    let bending = table.positive_pair("EI");
    let mass = table.non_negative("rhoA");
    let rotary = table.non_negative_vector::<3>("rhoJ");
    let [ga2, ga3] = shear?;
    let [ei2, ei3] = bending?;
    Some(SectionBody::Resultants {
        stiffness: [extension?.value, ga2, ga3, torsion?.value, ei2, ei3],
        mass: mass.map(|mass| mass.value),
        rotary: rotary.map(|rotary| rotary.value),
    })
}

fn read_full(table: &Table) -> Option<SectionBody> {
    let stiffness = table.required("stiffness").and_then(|item| read_matrix(table, "stiffness", item));
    let mass = table.optional("mass", |_, item| read_matrix(table, "mass", item));
    Some(SectionBody::Full { stiffness: stiffness?, mass: mass? })
}

/// A symmetric matrix of N by N; definiteness is checked where it is used.
pub(super) fn read_matrix<const N: usize>(table: &Table, key: &str, item: &Item) -> Option<[[f64; N]; N]> {
    let context = table.context;
    let DeValue::Array(rows) = item.get_ref() else {
        let message = format!("`{key}` must be a list of {N} rows, found {}", kind_of(item.get_ref()));
        return context.wrong(item.span(), message);
    };
    if rows.len() != N {
        return context.wrong(item.span(), format!("`{key}` must have {N} rows, found {}", rows.len()));
    }
    let rows: Vec<Option<[f64; N]>> = rows.iter().map(|row| context.vector(row).map(|v| v.value)).collect();
    let rows: Vec<[f64; N]> = rows.into_iter().collect::<Option<_>>()?;
    let out: [[f64; N]; N] = rows.try_into().ok()?;
    let largest = out.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    for i in 0..N {
        for j in 0..i {
            if (out[i][j] - out[j][i]).abs() > 1e-9 * largest {
                let row = i + 1;
                let column = j + 1;
                let message = format!(
                    "`{key}` must be symmetric; entry ({row}, {column}) is {}, but the mirrored one is {}",
                    out[i][j], out[j][i]
                );
                return context.wrong(item.span(), message);
            }
        }
    }
    Some(out)
}
