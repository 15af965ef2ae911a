//! `elements`, `grading` and `numbering` of `[[beam]]`: how the pieces of a beam are divided.

use super::diagnostic::{Diagnostic, Span, Spanned};
use super::reader::{Context, Item, Table, literal};
use toml::de::DeValue;

/// Most elements a deck may ask for.
pub const MOST_ELEMENTS: usize = 2_000_000;

/// The shortest part of a piece over the piece: places on beams are told apart to this.
const SHORTEST_PART: f64 = 1e-9;

/// The largest grading; its inverse is the smallest.
const MOST_GRADING: f64 = 1e4;

/// The parts of a piece of a beam: its elements, or the parts that node numbers count. Places are
/// fractions of the length of the piece.
#[derive(Clone, Debug, PartialEq)]
pub enum Division {
    /// So many equal parts
    Equal(usize),
    /// Parts whose length grows geometrically
    Graded {
        /// Their number
        count: usize,
        /// The length of a part at the end over that at the start, for many parts
        ratio: f64,
    },
    /// Parts that end at these places, without 0 and 1
    At(Vec<f64>),
}

impl Division {
    /// The number of parts.
    pub fn count(&self) -> usize {
        match self {
            Self::Equal(count) | Self::Graded { count, .. } => *count,
            Self::At(ends) => ends.len() + 1,
        }
    }

    /// The place where so many parts end.
    pub fn end(&self, parts: usize) -> f64 {
        if parts == 0 {
            return 0.0;
        }
        if parts >= self.count() {
            return 1.0;
        }
        match self {
            Self::Equal(count) => parts as f64 / *count as f64,
            Self::Graded { count, ratio } => graded(*ratio, parts as f64 / *count as f64),
            Self::At(ends) => ends[parts - 1],
        }
    }

    /// The place of a node, where each part has `order` equal steps and nodes are counted from 0.
    pub fn node(&self, node: usize, order: usize) -> f64 {
        if let Self::Equal(count) = self {
            return node as f64 / (count * order) as f64;
        }
        let start = self.end(node / order);
        match node % order {
            0 => start,
            step => start + (self.end(node / order + 1) - start) * (step as f64 / order as f64),
        }
    }

    /// The number of parts before a place, the part around it included by its fraction, over the
    /// number of all parts. It stays when parts are added and the shape of the division is kept.
    pub fn along(&self, part: usize, fraction: f64) -> f64 {
        match self {
            Self::Equal(_) | Self::At(_) => (part as f64 + fraction) / self.count() as f64,
            Self::Graded { ratio, .. } => {
                let start = self.end(part);
                let place = start + (self.end(part + 1) - start) * fraction;
                libm::log1p(place * (ratio - 1.0)) / libm::log(*ratio)
            }
        }
    }

    /// A division into `count` parts of the same shape: between the ends of its parts, places are
    /// interpolated linearly.
    pub fn with_count(&self, count: usize) -> Self {
        match self {
            Self::Equal(_) => Self::Equal(count),
            Self::Graded { ratio, .. } => Self::Graded { count, ratio: *ratio },
            Self::At(ends) if ends.len() + 1 == count => self.clone(),
            Self::At(_) => Self::At((1..count).map(|part| self.interpolated(part, count)).collect()),
        }
    }

    /// The place where a fraction of all parts ends.
    fn interpolated(&self, numerator: usize, denominator: usize) -> f64 {
        let whole = numerator * self.count() / denominator;
        let rest = numerator * self.count() % denominator;
        let start = self.end(whole);
        if rest == 0 { start } else { start + (self.end(whole + 1) - start) * (rest as f64 / denominator as f64) }
    }

    /// The division into the steps between nodes of elements of an order.
    pub fn steps(&self, order: usize) -> Self {
        match self {
            Self::Equal(count) => Self::Equal(count * order),
            Self::Graded { count, .. } => Self::At((1..count * order).map(|node| self.node(node, order)).collect()),
            Self::At(_) => self.with_count(self.count() * order),
        }
    }

    /// True if it can stand in a deck.
    pub fn is_possible(&self) -> bool {
        let increases = || self.shortest().is_some_and(|shortest| shortest >= SHORTEST_PART);
        (1..=MOST_ELEMENTS).contains(&self.count()) && (matches!(self, Self::Equal(_)) || increases())
    }

    /// The length of the shortest part; `None` where a place is not a number.
    fn shortest(&self) -> Option<f64> {
        let lengths = (0..self.count()).map(|part| self.end(part + 1) - self.end(part));
        lengths.min_by(f64::total_cmp).filter(|length| !length.is_nan())
    }
}

/// The place where a fraction of the parts of a graded piece ends.
fn graded(ratio: f64, fraction: f64) -> f64 {
    libm::expm1(fraction * libm::log(ratio)) / (ratio - 1.0)
}

/// `elements` or `numbering`: a number, or one entry for each piece.
pub(super) fn read_divisions(context: &Context, item: &Item, key: &str) -> Option<Spanned<Vec<Division>>> {
    let entries: Vec<Option<Division>> = match item.get_ref() {
        DeValue::Array(array) => {
            if let Some(place) = array.iter().find(|entry| is_place(entry)) {
                let message = format!("`{key}` counts the parts of each piece");
                let help = format!("the places where parts end stand in a list of their own: {key} = [[0.2, 0.5]]");
                context.report(Diagnostic::error(message, place.span()).help(help));
                return None;
            }
            array.iter().map(|entry| read_division(context, entry)).collect()
        }
        _ => vec![read_count(context, item)],
    };
    let value: Vec<Division> = entries.into_iter().collect::<Option<_>>()?;
    if value.is_empty() {
        return context.wrong(item.span(), format!("`{key}` must not be empty"));
    }
    Some(Spanned { value, span: item.span() })
}

/// True for a literal between 0 and 1, which counts nothing.
fn is_place(item: &Item) -> bool {
    matches!(item.get_ref(), DeValue::Float(_))
        && literal(item.get_ref()).is_some_and(|value| value > 0.0 && value < 1.0)
}

fn read_division(context: &Context, item: &Item) -> Option<Division> {
    match item.get_ref() {
        DeValue::Array(_) => read_places(context, item),
        _ => read_count(context, item),
    }
}

fn read_count(context: &Context, item: &Item) -> Option<Division> {
    Some(Division::Equal(context.whole(item, 1, MOST_ELEMENTS)?.value))
}

/// Places where parts end: increasing, between 0 and 1.
fn read_places(context: &Context, item: &Item) -> Option<Division> {
    let DeValue::Array(array) = item.get_ref() else { return None };
    let places: Vec<Option<Spanned<f64>>> = array.iter().map(|entry| context.number(entry)).collect();
    let places: Vec<Spanned<f64>> = places.into_iter().collect::<Option<_>>()?;
    let mut before = 0.0;
    for Spanned { value, span } in &places {
        if *value <= 0.0 || *value >= 1.0 {
            let message = format!("{value} is not inside the piece: a part ends at a fraction between 0 and 1");
            let diagnostic = Diagnostic::error(message, span.clone());
            context.report(diagnostic.help("the start (0) and the end (1) of the piece are not listed"));
            return None;
        }
        refuse_short_part(context, before, *value, span)?;
        before = *value;
    }
    if let Some(last) = places.last() {
        refuse_short_part(context, last.value, 1.0, &last.span)?;
    }
    Some(Division::At(places.into_iter().map(|place| place.value).collect()))
}

fn refuse_short_part(context: &Context, start: f64, end: f64, span: &Span) -> Option<()> {
    if end < start {
        return context.wrong(span.clone(), format!("places must increase: {end} follows {start}"));
    }
    if end - start < SHORTEST_PART {
        let message = format!("the part from {start} to {end} has no length (the least is {SHORTEST_PART:e})");
        return context.wrong(span.clone(), message);
    }
    Some(())
}

/// `elements` with the `grading` of the pieces, where their number is known.
pub(super) fn read_elements(table: &Table, pieces: Option<usize>) -> Option<Spanned<Vec<Division>>> {
    let elements = table.required("elements").and_then(|item| read_divisions(table.context, item, "elements"));
    let grading = table.optional("grading", read_grading)?;
    let Spanned { value: elements, span } = elements?;
    let Some(grading) = grading else { return Some(Spanned { value: elements, span }) };
    let context = table.context;
    let pieces = pieces?;
    if grading.value.len() != 1 && grading.value.len() != pieces {
        let message = format!("`grading` has {} entries, the beam has {pieces} piece(s)", grading.value.len());
        return context.wrong(grading.span, message);
    }
    if elements.len() != 1 && elements.len() != pieces {
        // The message about this comes with the mesh.
        return Some(Spanned { value: elements, span });
    }
    let of_piece = |piece: usize| {
        let ratio = grading.value[piece.min(grading.value.len() - 1)];
        let own = elements[piece.min(elements.len() - 1)].clone();
        match own {
            own if ratio == 1.0 => Some(own),
            Division::At(_) => None,
            Division::Equal(count) | Division::Graded { count, .. } => Some(Division::Graded { count, ratio }),
        }
    };
    let Some(graded) = (0..pieces).map(of_piece).collect::<Option<Vec<Division>>>() else {
        let diagnostic = Diagnostic::error("`elements` lists the places already", grading.span);
        context.report(diagnostic.help("leave out `grading` (1 for such a piece), or give `elements` as numbers"));
        return None;
    };
    if let Some(short) = graded.iter().find(|division| !division.is_possible()) {
        let message = format!("elements shorter than {SHORTEST_PART:e} of their piece ({} elements)", short.count());
        return context.wrong(grading.span, message);
    }
    Some(Spanned { value: graded, span })
}

fn read_grading(context: &Context, item: &Item) -> Option<Spanned<Vec<f64>>> {
    let grading = match item.get_ref() {
        DeValue::Array(_) => context.numbers(item, None)?,
        _ => {
            let Spanned { value, span } = context.number(item)?;
            Spanned { value: vec![value], span }
        }
    };
    if grading.value.is_empty() {
        return context.wrong(grading.span, "`grading` must not be empty");
    }
    match grading.value.iter().find(|ratio| !(1.0 / MOST_GRADING..=MOST_GRADING).contains(*ratio)) {
        Some(ratio) => context.wrong(grading.span, format!("`grading` must be from 1e-4 to 1e4, found {ratio}")),
        None => Some(grading),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(division: &Division, order: usize) -> Vec<f64> {
        (0..=division.count() * order).map(|node| division.node(node, order)).collect()
    }

    #[test]
    fn nodes_lie_at_equal_steps_between_the_ends_of_parts() {
        let at = Division::At(vec![0.25, 0.75]);
        assert_eq!(places(&at, 2), [0.0, 0.125, 0.25, 0.5, 0.75, 0.875, 1.0]);
        assert_eq!(places(&Division::Equal(2), 3), [0.0, 1.0 / 6.0, 2.0 / 6.0, 0.5, 4.0 / 6.0, 5.0 / 6.0, 1.0]);
        assert_eq!(places(&at.steps(2), 1), places(&at, 2));
        let graded = Division::Graded { count: 2, ratio: 4.0 };
        assert!((graded.end(1) - 1.0 / 3.0).abs() < 1e-15);
        assert_eq!(places(&graded.steps(3), 1), places(&graded, 3));
    }

    #[test]
    fn a_division_keeps_its_shape_with_more_and_fewer_parts() {
        let at = Division::At(vec![0.1, 0.3, 0.6]);
        assert_eq!(at.with_count(2), Division::At(vec![0.3]));
        let doubled = at.with_count(8);
        assert!((1..4).all(|part| doubled.end(2 * part) == at.end(part)) && doubled.is_possible());
        assert_eq!(doubled.with_count(4), at);
        let graded = Division::Graded { count: 3, ratio: 0.2 };
        assert!((1..3).all(|part| (graded.with_count(6).end(2 * part) - graded.end(part)).abs() < 1e-15));
        let lengths: Vec<f64> = (0..3).map(|part| graded.end(part + 1) - graded.end(part)).collect();
        assert!((lengths[1] / lengths[0] - 0.2_f64.cbrt()).abs() < 1e-14);
        assert!((lengths[2] / lengths[1] - 0.2_f64.cbrt()).abs() < 1e-14);
        for division in [at, graded, Division::Equal(3)] {
            let count = division.count();
            assert!((0..count).all(|part| (division.along(part, 0.0) - part as f64 / count as f64).abs() < 1e-14));
        }
    }

    #[test]
    fn divisions_that_no_deck_may_have_are_known() {
        assert!(!Division::Equal(0).is_possible() && Division::At(Vec::new()).is_possible());
        for places in [vec![0.5, 0.5], vec![0.7, 0.2], vec![-0.1], vec![1.0], vec![f64::NAN]] {
            assert!(!Division::At(places).is_possible());
        }
    }
}
