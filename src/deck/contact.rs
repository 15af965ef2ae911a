//! `[[contact]]`: beams and bodies that touch surfaces, beams that touch each other.

use super::diagnostic::{Span, Spanned};
use super::point::check_name;
use super::reader::{Context, Item, Table};
use super::stage::read_stages;
use super::words::words;
use toml::de::DeValue;

/// `[[contact]]`
#[derive(Clone, Debug)]
pub struct Contact {
    /// Its name
    pub(crate) name: Spanned<String>,
    /// The beams
    pub(crate) beams: Vec<Spanned<String>>,
    /// Nodes with a sphere
    pub(crate) nodes: Vec<Spanned<String>>,
    /// The surfaces
    pub(crate) surfaces: Vec<Spanned<String>>,
    /// Beams that the beams may touch
    pub(crate) with: Vec<Spanned<String>>,
    /// True if each beam may touch itself
    pub(crate) touches_itself: bool,
    /// The radius
    pub(crate) radius: ContactRadius,
    /// Coefficients of friction at the start and at the end of beams
    pub(crate) friction: [f64; 2],
    /// The largest penetration; left out: a thousandth of the radius
    pub(crate) penetration: Option<f64>,
    /// Force per penetration of a point; left out: by the stiffness of beams
    pub(crate) stiffness: Option<f64>,
    /// Tangential over normal stiffness
    pub(crate) stick: f64,
    /// Damping in dynamic stages
    pub(crate) damping: ContactDamping,
    /// Ends of beams
    pub(crate) ends: EndsWord,
    /// Stages from 1; left out: all
    pub(crate) stages: Option<Vec<usize>>,
    /// Place of the table
    pub(crate) span: Span,
}

/// Radii of beams and bodies in contact.
#[derive(Clone, Debug)]
pub enum ContactRadius {
    /// That of the sections
    OfSections,
    /// One for all
    One(f64),
    /// By beams and nodes
    Each(Vec<(Spanned<String>, f64)>),
}

/// Damping of a contact in dynamic stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactDamping {
    /// c, time per length
    Factor(f64),
    /// By the rebound
    Restitution {
        /// Speed after over speed before
        restitution: f64,
        /// Speed before
        speed: f64,
    },
}

words! {
    /// `ends = …`
    pub enum EndsWord {
        /// Half spheres
        Round = "round",
        /// End faces do not touch
        None = "none",
    }
}

/// Keys of `[[contact]]`.
pub(super) const KEYS: [&str; 17] = [
    "name",
    "beams",
    "nodes",
    "surfaces",
    "with",
    "self",
    "radius",
    "friction",
    "penetration",
    "stiffness",
    "stick",
    "damping",
    "restitution",
    "speed",
    "ends",
    "start",
    "stages",
];

/// Keys that the contract of decks has, and this version cannot do yet.
const LATER: [(&str, &str); 1] = [("start", "`start` is not available: place beams and surfaces without penetration")];

pub(super) fn read_contact<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Contact> {
    let table = Table::new(context, item, "[[contact]]", &KEYS)?;
    for (key, message) in LATER {
        if table.has(key) {
            return table.wrong_key(key, message);
        }
    }
    let name = table.required_text("name").and_then(|name| check_name(context, name));
    let beams = table.optional("beams", |context, item| context.texts(item));
    let nodes = table.optional("nodes", |context, item| context.texts(item));
    let surfaces = table.optional("surfaces", |context, item| context.texts(item));
    let with = table.optional("with", |context, item| context.texts(item));
    let touches_itself = table.flag_or("self", false);
    let radius = read_radius(&table);
    let friction = table.optional("friction", read_friction);
    let penetration = table.optional("penetration", |_, _| table.positive("penetration"));
    let stiffness = table.optional("stiffness", |_, _| table.positive("stiffness"));
    let stick = table.positive_or("stick", 1.0);
    let damping = read_damping(&table);
    let ends = table.word_or("ends", EndsWord::Round);
    let stages = read_stages(&table);
    let contact = Contact {
        name: name?,
        beams: beams?.unwrap_or_default(),
        nodes: nodes?.unwrap_or_default(),
        surfaces: surfaces?.unwrap_or_default(),
        with: with?.unwrap_or_default(),
        touches_itself: touches_itself?,
        radius: radius?,
        friction: friction?.unwrap_or([0.0; 2]),
        penetration: penetration?.map(|number| number.value),
        stiffness: stiffness?.map(|number| number.value),
        stick: stick?,
        damping: damping?,
        ends: ends?,
        stages: stages?,
        span: table.span.clone(),
    };
    check_parties(&table, contact)
}

/// Refuses contacts without two parties, and names that are given twice.
fn check_parties(table: &Table, contact: Contact) -> Option<Contact> {
    let lists = [
        ("beams", &contact.beams),
        ("nodes", &contact.nodes),
        ("surfaces", &contact.surfaces),
        ("with", &contact.with),
    ];
    for (key, names) in lists {
        let is_again = |k: usize| names[..k].iter().any(|other| other.value == names[k].value);
        if let Some(twice) = (0..names.len()).find(|&k| is_again(k)).map(|k| &names[k]) {
            let message = format!("`{key}` names `{}` twice: its contact would count double", twice.value);
            return table.context.wrong(twice.span.clone(), message);
        }
    }
    if contact.beams.is_empty() && contact.nodes.is_empty() {
        return table.wrong("[[contact]] needs `beams` or `nodes`");
    }
    let meets_beams = !contact.with.is_empty() || contact.touches_itself;
    if contact.surfaces.is_empty() && !meets_beams {
        return table.wrong("[[contact]] needs `surfaces`, `with` (other beams) or `self = true`");
    }
    let both = contact.with.iter().find(|name| contact.beams.iter().any(|beam| beam.value == name.value));
    if let Some(both) = both {
        let message = format!("`{}` is in `beams` and in `with`: a beam touches itself by `self = true`", both.value);
        return table.context.wrong(both.span.clone(), message);
    }
    if meets_beams && !contact.nodes.is_empty() {
        let message = "`with` and `self` are for beams alone: give `nodes` a contact of their own, with `surfaces`";
        return table.wrong_key("nodes", message);
    }
    Some(contact)
}

fn read_radius(table: &Table) -> Option<ContactRadius> {
    let Some(item) = table.get("radius") else { return Some(ContactRadius::OfSections) };
    if !matches!(item.get_ref(), DeValue::Table(_)) {
        return Some(ContactRadius::One(table.positive("radius")?.value));
    }
    let each = Table::of_names(table.context, item, "`radius`")?;
    let read = |(name, item): (Spanned<String>, &Item)| {
        let radius = table.context.number(item)?;
        if radius.value > 0.0 {
            return Some((name, radius.value));
        }
        table.context.wrong(radius.span, format!("the radius of `{}` must be positive", name.value))
    };
    let radii: Vec<Option<(Spanned<String>, f64)>> = each.entries().map(read).collect();
    Some(ContactRadius::Each(radii.into_iter().collect::<Option<_>>()?))
}

/// One number, or two: at the start and at the end of beams.
fn read_friction(context: &Context, item: &Item) -> Option<[f64; 2]> {
    let pair = match item.get_ref() {
        DeValue::Array(_) => context.vector::<2>(item)?,
        _ => context.number(item)?.map(|friction| [friction; 2]),
    };
    if pair.value.iter().any(|&friction| friction < 0.0) {
        return context.wrong(pair.span, "`friction` must not be negative");
    }
    Some(pair.value)
}

fn read_damping(table: &Table) -> Option<ContactDamping> {
    match (table.has("damping"), table.has("restitution")) {
        (true, true) => table.wrong_key("restitution", "give either `damping`, or `restitution` with `speed`"),
        (false, true) => {
            let speed = table.required_positive("speed");
            let restitution = table.positive("restitution")?;
            if restitution.value > 1.0 {
                return table.context.wrong(restitution.span, "`restitution` is from 0 (exclusive) to 1");
            }
            Some(ContactDamping::Restitution { restitution: restitution.value, speed: speed?.value })
        }
        (_, false) => {
            table.refuse("speed", "`speed` is only allowed with `restitution`");
            Some(ContactDamping::Factor(table.non_negative_or("damping", 0.0)?))
        }
    }
}
