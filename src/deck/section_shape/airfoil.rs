//! Airfoils with skins and webs.

use super::outline::read_points;
use super::walls::ThetaSenseWord;
use crate::deck::diagnostic::{Span, Spanned};
use crate::deck::reader::{Context, Item, Table};
use crate::deck::words::words;

/// Keys of a part of a skin.
pub const SKIN_KEYS: [&str; 4] = ["from", "to", "layup", "side"];

/// Keys of a web.
pub const WEB_KEYS: [&str; 3] = ["at", "layup", "normal"];

words! {
    /// `le = …`
    pub enum LeadingEdgeWord {
        /// The leading edge points to +2
        Plus = "+2",
        /// The leading edge points to -2
        Minus = "-2",
    }
}

words! {
    /// `side = …` of a part of a skin
    pub enum SkinSideWord {
        /// The first half of the profile
        Upper = "upper",
        /// The second half of the profile
        Lower = "lower",
        /// Both halves
        Both = "both",
    }
}

words! {
    /// `te = …`
    pub enum TrailingEdgeWord {
        /// The skins end where their inner faces meet, joined by a wall
        Close = "close",
        /// The room between the skins behind that is filled
        Fill = "fill",
    }
}

words! {
    /// `normal = …` of a web
    pub enum WebNormalWord {
        /// The web stands normal to the chord
        Chord = "chord",
    }
}

/// The skin of an airfoil with webs.
#[derive(Clone, Debug)]
pub struct Airfoil {
    /// Points in parts of the chord, from the trailing edge over the upper side back
    pub(crate) profile: Spanned<Vec<[f64; 2]>>,
    /// Length of the chord
    pub(crate) chord: f64,
    /// Part of the chord, from the leading edge, at which the origin lies
    pub(crate) pitch_axis: f64,
    /// Direction of the leading edge
    pub(crate) leading_edge: LeadingEdgeWord,
    /// Parts of the skin
    pub(crate) skin: Vec<SkinPart>,
    /// Webs
    pub(crate) webs: Vec<Web>,
    /// Trailing edge
    pub(crate) trailing_edge: TrailingEdgeWord,
    /// Sense of angles of fibres
    pub(crate) theta_sense: ThetaSenseWord,
}

/// A part of the skin between two parts of the chord.
#[derive(Clone, Debug)]
pub struct SkinPart {
    /// Its ends, as parts of the chord from the leading edge
    pub(crate) ends: [f64; 2],
    /// Name of its layup
    pub(crate) layup: Spanned<String>,
    /// Side of the profile
    pub(crate) side: SkinSideWord,
}

/// A web between both sides of the skin.
#[derive(Clone, Debug)]
pub struct Web {
    /// Part of the chord
    pub(crate) at: f64,
    /// Name of its layup
    pub(crate) layup: Spanned<String>,
    /// Its place in the text
    pub(crate) span: Span,
}

pub fn read_airfoil(table: &Table) -> Option<Airfoil> {
    let context = table.context;
    let profile = table.get("profile").and_then(|item| {
        let points = read_points(context, item, "`profile`")?;
        Some(Spanned { value: points, span: item.span() })
    });
    let chord = table.positive("chord");
    let pitch_axis = table.optional("pitch_axis", |context, item| context.number(item));
    let leading_edge = table.word::<LeadingEdgeWord>("le");
    let skin = read_list(table, "skin", read_skin_part);
    let webs = if table.has("webs") { read_list(table, "webs", read_web) } else { Some(Vec::new()) };
    let trailing_edge = table.word_or("te", TrailingEdgeWord::Close);
    let theta_sense = table.word_or("theta_sense", ThetaSenseWord::Wall);
    Some(Airfoil {
        profile: profile?,
        chord: chord?.value,
        pitch_axis: pitch_axis?.map_or(0.0, |at| at.value),
        leading_edge: leading_edge?.value,
        skin: skin?,
        webs: webs?,
        trailing_edge: trailing_edge?,
        theta_sense: theta_sense?,
    })
}

fn read_list<'a, T>(
    table: &Table<'a>,
    key: &str,
    read: impl Fn(&'a Context, &'a Item<'a>) -> Option<T>,
) -> Option<Vec<T>> {
    let all: Vec<Option<T>> = table.list(key).into_iter().map(|item| read(table.context, item)).collect();
    all.into_iter().collect()
}

fn read_skin_part<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<SkinPart> {
    let table = Table::new(context, item, "a part of the skin", &SKIN_KEYS)?;
    let from = table.optional("from", |context, item| context.number(item))?.map_or(0.0, |from| from.value);
    let to = table.optional("to", |context, item| context.number(item))?.map_or(1.0, |to| to.value);
    let layup = table.required_text("layup");
    let side = table.word_or("side", SkinSideWord::Both)?;
    if !(0.0..=1.0).contains(&from) || !(0.0..=1.0).contains(&to) || from >= to {
        return table.wrong("`from` and `to` are parts of the chord from 0 to 1, `from` below `to`");
    }
    Some(SkinPart { ends: [from, to], layup: layup?, side })
}

fn read_web<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Web> {
    let table = Table::new(context, item, "a web", &WEB_KEYS)?;
    let at = table.required_number("at")?;
    let layup = table.required_text("layup");
    table.word_or("normal", WebNormalWord::Chord)?;
    if at.value <= 0.0 || at.value >= 1.0 {
        return context.wrong(at.span, format!("a web is at a part of the chord between 0 and 1, found {}", at.value));
    }
    Some(Web { at: at.value, layup: layup?, span: item.span() })
}
