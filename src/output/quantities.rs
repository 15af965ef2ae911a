//! Quantities and units of the columns of a history, for titles and labels.

use beamsim_core::probe::{ColumnPart, Dimension, Quantity, find_part};
use serde_json::Value;

/// Labels of the units of a deck. Numbers are never converted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Units {
    length: Option<String>,
    force: Option<String>,
    time: Option<String>,
}

/// The row of the table of columns for a column or its error bar.
fn find(column: &str) -> Option<&'static ColumnPart> {
    find_part(column.strip_suffix(".err").unwrap_or(column))
}

/// The name of the quantity of a column, such as `displacement` for `tip.ux`.
pub fn quantity_of(column: &str) -> Option<&'static str> {
    find(column).map(|part| part.title)
}

impl Units {
    /// The labels of a deck, in the form that `run.json` contains.
    pub fn of_deck(deck: &Value) -> Self {
        let label = |key: &str| deck["units"][key].as_str().map(str::trim).filter(|label| !label.is_empty());
        let [length, force, time] = ["length", "force", "time"].map(|key| label(key).map(str::to_string));
        Self { length, force, time }
    }

    /// The names of dimensions in the place of units.
    pub fn dimensions() -> Self {
        let [length, force, time] = ["length", "force", "time"].map(|name| Some(name.to_string()));
        Self { length, force, time }
    }

    /// The unit of the columns of a row of the table of columns.
    pub fn of_part(&self, part: &ColumnPart) -> Option<String> {
        self.label(part.quantity.dimension())
    }

    /// The unit of a column, such as `N·m` or `mm/s²`. Plain numbers have none, nor have columns whose
    /// unit has a part that the deck does not give.
    pub fn of_column(&self, column: &str) -> Option<String> {
        self.of_part(find(column)?)
    }

    /// The unit of lengths.
    pub fn length(&self) -> Option<String> {
        self.label(Dimension::LENGTH)
    }

    /// The unit of forces.
    pub fn force(&self) -> Option<String> {
        self.label(Dimension::FORCE)
    }

    /// The unit of stresses.
    pub fn stress(&self) -> Option<String> {
        self.label(Quantity::Stress.dimension())
    }

    /// The unit of moments.
    pub fn moment(&self) -> Option<String> {
        self.label(Dimension::MOMENT)
    }

    /// A title followed by the unit of a column, such as `tip.ux [mm]`.
    pub fn title(&self, title: &str, column: &str) -> String {
        self.of_column(column).map_or_else(|| title.to_string(), |unit| format!("{title} [{unit}]"))
    }

    /// The unit of a dimension.
    pub fn label(&self, dimension: Dimension) -> Option<String> {
        let Dimension { angle, force, length, time } = dimension;
        let mut above = Vec::new();
        let mut below = Vec::new();
        let radians = Some("rad".to_string());
        for (label, power) in [(&radians, angle), (&self.force, force), (&self.length, length), (&self.time, time)] {
            if power == 0 {
                continue;
            }
            let label = label.as_deref()?;
            let power_text = if power.abs() == 2 { "²" } else { "" };
            let part = format!("{label}{power_text}");
            if power > 0 { above.push(part) } else { below.push(part) }
        }
        let numerator = if above.is_empty() { "1".to_string() } else { above.join("·") };
        if below.is_empty() {
            return if above.is_empty() { None } else { Some(numerator) };
        }
        Some(format!("{numerator}/{}", below.join("·")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn columns_have_the_names_of_their_quantities() {
        assert_eq!(quantity_of("tip.uq"), None);
        assert_eq!(quantity_of("b@0.1.N1"), Some("section force"));
        assert_eq!(quantity_of("tip.rz.err"), Some("rotation vector"));
        assert_eq!(quantity_of("load"), Some("load factor"));
        assert_eq!(quantity_of("mode2.growth"), Some("growth rate"));
    }

    #[test]
    fn units_are_made_of_those_of_the_deck() {
        let units = Units::of_deck(&json!({ "units": { "length": "mm", "force": "kN", "time": "s" } }));
        for (column, unit) in [
            ("time", Some("s")),
            ("load", None),
            ("tip.ux", Some("mm")),
            ("tip.ux.err", Some("mm")),
            ("b@0.1.rx", Some("rad")),
            ("tip.ax", Some("mm/s²")),
            ("tip.alphaz", Some("rad/s²")),
            ("tip.my", Some("kN·mm")),
            ("arm@0.5.K2", Some("1/mm")),
            ("arm@0.5.G1", None),
            ("tip.qw", None),
            ("energy.strain", Some("kN·mm")),
            ("momentum.px", Some("kN·s")),
            ("momentum.ly", Some("kN·mm·s")),
            ("momentum.cz", Some("mm")),
            ("omega", Some("rad/s")),
            ("growth", Some("1/s")),
            ("whatever", None),
        ] {
            assert_eq!(units.of_column(column).as_deref(), unit, "{column}");
        }
        let some = Units::of_deck(&json!({ "units": { "length": "m", "time": " " } }));
        assert_eq!((some.of_column("tip.ux").as_deref(), some.of_column("tip.vx")), (Some("m"), None));
        assert_eq!(some.title("tip.vx", "tip.vx"), "tip.vx");
        assert_eq!(Units::of_deck(&json!({})).of_column("time"), None);
    }
}
