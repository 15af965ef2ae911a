//! `[[slider]]`: nodes that stay on the line of a beam, free or driven along it.

use super::diagnostic::{Span, Spanned};
use super::history::{HistoryUse, read_history_use};
use super::reader::{Context, Item, Table};

/// `[[slider]]`
#[derive(Clone, Debug)]
pub struct Slider {
    /// What slides
    pub(crate) slides: Sliding,
    /// The beam on which it slides
    pub(crate) on: Spanned<String>,
    /// A prescribed sliding; left out: free
    pub(crate) drive: Option<SliderDrive>,
    /// Place of the table
    pub(crate) span: Span,
}

/// The nodes of a `[[slider]]`.
#[derive(Clone, Debug)]
pub enum Sliding {
    /// Nodes by name
    Nodes(Vec<Spanned<String>>),
    /// All nodes of a part of a beam
    Beam {
        /// The beam
        beam: Spanned<String>,
        /// From and to, as fractions of its length
        part: [f64; 2],
    },
}

/// A prescribed sliding along the beam.
#[derive(Clone, Debug)]
pub struct SliderDrive {
    /// Initial arc length, from where the node is at the start
    pub(crate) displacement: f64,
    /// Factor over time or load factor
    pub(crate) history: Option<HistoryUse>,
}

/// Keys of `[[slider]]`.
pub(super) const KEYS: [&str; 6] = ["nodes", "beam", "part", "on", "displacement", "history"];

pub(super) fn read_slider<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Slider> {
    let table = Table::new(context, item, "[[slider]]", &KEYS)?;
    let slides = read_sliding(&table);
    let on = table.required_text("on");
    let displacement = table.optional("displacement", |context, item| context.number(item));
    let history = table.has("history").then(|| read_history_use(&table, None));
    let displacement = displacement?.map(|number| number.value);
    if displacement.is_none() {
        table.refuse("history", "`history` of a slider is only allowed with `displacement`");
    }
    let history = match history {
        Some(read) => Some(read?),
        None => None,
    };
    let drive = displacement.map(|displacement| SliderDrive { displacement, history });
    Some(Slider { slides: slides?, on: on?, drive, span: table.span.clone() })
}

fn read_sliding(table: &Table) -> Option<Sliding> {
    let context = table.context;
    match (table.get("nodes"), table.get("beam")) {
        (Some(_), Some(_)) => table.wrong_key("beam", "a slider takes either `nodes` or a `beam`, not both"),
        (Some(item), None) => {
            table.refuse("part", "`part` is only allowed with `beam`");
            let nodes = context.texts(item)?;
            if nodes.is_empty() {
                return context.wrong(item.span(), "`nodes` must name at least one node");
            }
            let is_again = |k: usize| nodes[..k].iter().any(|other| other.value == nodes[k].value);
            if let Some(k) = (0..nodes.len()).find(|&k| is_again(k)) {
                return context.wrong(nodes[k].span.clone(), format!("`nodes` names `{}` twice", nodes[k].value));
            }
            Some(Sliding::Nodes(nodes))
        }
        (None, Some(item)) => {
            let beam = context.text(item);
            let part = match table.get("part") {
                None => [0.0, 1.0],
                Some(item) => {
                    let part = context.vector::<2>(item)?;
                    let [from, to] = part.value;
                    if !(0.0 <= from && from <= to && to <= 1.0) {
                        return context.wrong(part.span, "`part` is two fractions of the length, from 0 to 1");
                    }
                    part.value
                }
            };
            Some(Sliding::Beam { beam: beam?, part })
        }
        (None, None) => table.wrong("[[slider]] needs `nodes` or `beam`"),
    }
}
