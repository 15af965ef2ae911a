//! Quantities and units of the columns of a history, for titles and labels.

use serde_json::Value;

/// Labels of the units of a deck. Numbers are never converted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Units {
    length: Option<String>,
    force: Option<String>,
    time: Option<String>,
}

/// A unit as exponents of base units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Dimension {
    angle: i32,
    force: i32,
    length: i32,
    time: i32,
}

const NUMBER: Dimension = Dimension { angle: 0, force: 0, length: 0, time: 0 };
const ANGLE: Dimension = Dimension { angle: 1, ..NUMBER };
const LENGTH: Dimension = Dimension { length: 1, ..NUMBER };
const TIME: Dimension = Dimension { time: 1, ..NUMBER };
const FORCE: Dimension = Dimension { force: 1, ..NUMBER };
/// The dimension of moments and energies.
const MOMENT: Dimension = Dimension { force: 1, length: 1, ..NUMBER };
const ANGULAR_VELOCITY: Dimension = Dimension { angle: 1, time: -1, ..NUMBER };

impl Dimension {
    const fn per_time(self, power: i32) -> Self {
        Self { time: self.time - power, ..self }
    }
}

/// The quantity that some columns show.
struct Quantity {
    /// Ends of the names of the columns, which follow a dot if a column belongs to a node
    suffixes: &'static [&'static str],
    name: &'static str,
    dimension: Dimension,
}

const fn quantity(suffixes: &'static [&'static str], name: &'static str, dimension: Dimension) -> Quantity {
    Quantity { suffixes, name, dimension }
}

/// Quantities of a node, a point on a beam, the run, or a mode.
const OF_NODES: [Quantity; 21] = [
    quantity(&["stage"], "stage", NUMBER),
    quantity(&["time"], "time", TIME),
    quantity(&["load"], "load factor", NUMBER),
    quantity(&["ux", "uy", "uz"], "displacement", LENGTH),
    quantity(&["x", "y", "z"], "position", LENGTH),
    quantity(&["rx", "ry", "rz"], "rotation", ANGLE),
    quantity(&["d1x", "d1y", "d1z"], "section axis d1", NUMBER),
    quantity(&["d2x", "d2y", "d2z"], "section axis d2", NUMBER),
    quantity(&["d3x", "d3y", "d3z"], "section axis d3", NUMBER),
    quantity(&["vx", "vy", "vz"], "velocity", LENGTH.per_time(1)),
    quantity(&["wx", "wy", "wz"], "angular velocity", ANGULAR_VELOCITY),
    quantity(&["ax", "ay", "az"], "acceleration", LENGTH.per_time(2)),
    quantity(&["alphax", "alphay", "alphaz"], "angular acceleration", ANGULAR_VELOCITY.per_time(1)),
    quantity(&["fx", "fy", "fz"], "reaction force", FORCE),
    quantity(&["mx", "my", "mz"], "reaction moment", MOMENT),
    quantity(&["N1", "N2", "N3"], "section force", FORCE),
    quantity(&["M1", "M2", "M3"], "section moment", MOMENT),
    quantity(&["G1", "G2", "G3"], "strain", NUMBER),
    quantity(&["K1", "K2", "K3"], "change of curvature", Dimension { length: -1, ..NUMBER }),
    quantity(&["omega"], "angular frequency", ANGULAR_VELOCITY),
    quantity(&["growth"], "growth rate", NUMBER.per_time(1)),
];

/// Quantities of the whole scene, each with the name of its group, which columns begin with.
const OF_SCENES: [(&str, Quantity); 4] = [
    ("energy", quantity(&["kinetic", "strain", "external", "damped", "total"], "energy", MOMENT)),
    ("momentum", quantity(&["px", "py", "pz"], "momentum", Dimension { force: 1, time: 1, ..NUMBER })),
    ("momentum", quantity(&["lx", "ly", "lz"], "angular momentum", Dimension { time: 1, ..MOMENT })),
    ("momentum", quantity(&["cx", "cy", "cz"], "centre of mass", LENGTH)),
];

fn find(column: &str) -> Option<&'static Quantity> {
    let column = column.strip_suffix(".err").unwrap_or(column);
    let (place, suffix) = column.rsplit_once('.').unwrap_or(("", column));
    let has_suffix = |quantity: &&Quantity| quantity.suffixes.contains(&suffix);
    let of_scene = OF_SCENES.iter().filter(|(group, _)| *group == place).map(|(_, quantity)| quantity).find(has_suffix);
    of_scene.or_else(|| OF_NODES.iter().find(has_suffix))
}

/// The name of the quantity of a column, such as `displacement` for `tip.ux`.
pub fn quantity_of(column: &str) -> Option<&'static str> {
    find(column).map(|quantity| quantity.name)
}

impl Units {
    /// The labels of a deck, in the form that `run.json` contains.
    pub fn of_deck(deck: &Value) -> Self {
        let label = |key: &str| deck["units"][key].as_str().map(str::trim).filter(|label| !label.is_empty());
        let [length, force, time] = ["length", "force", "time"].map(|key| label(key).map(str::to_string));
        Self { length, force, time }
    }

    /// The unit of a column, such as `N·m` or `mm/s²`. Plain numbers have none, nor have columns whose
    /// unit has a part that the deck does not give.
    pub fn of_column(&self, column: &str) -> Option<String> {
        self.label(find(column)?.dimension)
    }

    /// The unit of forces.
    pub fn force(&self) -> Option<String> {
        self.label(FORCE)
    }

    /// The unit of moments.
    pub fn moment(&self) -> Option<String> {
        self.label(MOMENT)
    }

    /// A title followed by the unit of a column, such as `tip.ux [mm]`.
    pub fn title(&self, title: &str, column: &str) -> String {
        self.of_column(column).map_or_else(|| title.to_string(), |unit| format!("{title} [{unit}]"))
    }

    fn label(&self, dimension: Dimension) -> Option<String> {
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
    use beamsim_core::probe::{NODE_GROUPS, WHOLE_GROUPS};
    use serde_json::json;

    #[test]
    fn every_column_has_a_name() {
        let of_nodes = NODE_GROUPS.iter().flat_map(|(_, suffixes)| suffixes.iter().map(|s| format!("tip.{s}")));
        let whole =
            WHOLE_GROUPS.iter().flat_map(|(group, suffixes)| suffixes.iter().map(move |s| format!("{group}.{s}")));
        for column in of_nodes.chain(whole) {
            assert!(quantity_of(&column).is_some(), "{column}");
        }
        assert_eq!((quantity_of("tip.uq"), quantity_of("b@0.1.N1")), (None, Some("section force")));
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
