//! `scheme = …` of dynamic stages, with its coefficients.

use super::reader::Table;
use super::words::{Words, words};

words! {
    /// Names of time schemes.
    pub enum SchemeName {
        /// Newmark
        Newmark = "newmark",
        /// Hilber, Hughes and Taylor
        Hht = "hht",
        /// Chung and Hulbert
        GeneralizedAlpha = "generalized_alpha",
        /// Increments of rotation in the tangent space
        LieGeneralizedAlpha = "lie_generalized_alpha",
        /// Lobatto IIIA of order four
        Lobatto = "lobatto",
    }
}

/// A time scheme with its coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SchemeWord {
    /// beta, gamma
    Newmark(f64, f64),
    /// alpha
    Hht(f64),
    /// rho_inf
    GeneralizedAlpha(f64),
    /// rho_inf
    LieGeneralizedAlpha(f64),
    /// Without coefficients
    Lobatto,
}

impl SchemeWord {
    /// The name of the scheme.
    pub fn name(self) -> SchemeName {
        match self {
            Self::Newmark(..) => SchemeName::Newmark,
            Self::Hht(_) => SchemeName::Hht,
            Self::GeneralizedAlpha(_) => SchemeName::GeneralizedAlpha,
            Self::LieGeneralizedAlpha(_) => SchemeName::LieGeneralizedAlpha,
            Self::Lobatto => SchemeName::Lobatto,
        }
    }

    /// The scheme of another name. It keeps the coefficients that it shares with this one, and has the default ones otherwise.
    pub fn renamed(self, name: SchemeName) -> Self {
        let rho_inf = match self {
            Self::GeneralizedAlpha(rho_inf) | Self::LieGeneralizedAlpha(rho_inf) => rho_inf,
            Self::Newmark(..) | Self::Hht(_) | Self::Lobatto => RHO_INF,
        };
        match name {
            name if name == self.name() => self,
            SchemeName::Newmark => Self::Newmark(BETA, GAMMA),
            SchemeName::Hht => Self::Hht(ALPHA),
            SchemeName::GeneralizedAlpha => Self::GeneralizedAlpha(rho_inf),
            SchemeName::LieGeneralizedAlpha => Self::LieGeneralizedAlpha(rho_inf),
            SchemeName::Lobatto => Self::Lobatto,
        }
    }
}

/// Keys of coefficients, of all schemes.
pub(super) const COEFFICIENTS: [&str; 4] = ["beta", "gamma", "alpha", "rho_inf"];

impl SchemeName {
    /// Keys of the coefficients of a scheme.
    pub(super) fn coefficients(self) -> &'static [&'static str] {
        match self {
            Self::Newmark => &["beta", "gamma"],
            Self::Hht => &["alpha"],
            Self::GeneralizedAlpha | Self::LieGeneralizedAlpha => &["rho_inf"],
            Self::Lobatto => &[],
        }
    }
}

/// Default of `beta`.
const BETA: f64 = 0.25;
/// Default of `gamma`.
const GAMMA: f64 = 0.5;
/// Default of `alpha`.
const ALPHA: f64 = 0.05;
/// Default of `rho_inf`.
const RHO_INF: f64 = 0.9;

pub(super) fn read_scheme(table: &Table) -> Option<SchemeWord> {
    let name = table.word_or("scheme", SchemeName::Newmark)?;
    for key in COEFFICIENTS.into_iter().filter(|key| !name.coefficients().contains(key)) {
        let owners = SchemeName::values().filter(|owner| owner.coefficients().contains(&key));
        let owners: Vec<String> = owners.map(|owner| format!("\"{}\"", owner.word())).collect();
        table.refuse(key, format!("`{key}` is only allowed with scheme = {}", owners.join(" or ")));
    }
    match name {
        SchemeName::Newmark => {
            let beta = table.positive_or("beta", BETA);
            let gamma = table.positive_or("gamma", GAMMA);
            Some(SchemeWord::Newmark(beta?, gamma?))
        }
        SchemeName::Hht => read_within(table, "alpha", ALPHA, 1.0 / 3.0).map(SchemeWord::Hht),
        SchemeName::GeneralizedAlpha => read_within(table, "rho_inf", RHO_INF, 1.0).map(SchemeWord::GeneralizedAlpha),
        SchemeName::LieGeneralizedAlpha => {
            read_within(table, "rho_inf", RHO_INF, 1.0).map(SchemeWord::LieGeneralizedAlpha)
        }
        SchemeName::Lobatto => Some(SchemeWord::Lobatto),
    }
}

/// A number from 0 to `most`.
fn read_within(table: &Table, key: &str, default: f64, most: f64) -> Option<f64> {
    if !table.has(key) {
        return Some(default);
    }
    let number = table.number(key)?;
    if (0.0..=most).contains(&number.value) {
        return Some(number.value);
    }
    table.context.wrong(number.span, format!("`{key}` must be between 0 and {most}, found {}", number.value))
}
