//! Variants of a deck on the screen.

use crate::deck::Deck;
use crate::study::cost::{Pace, Variant};

/// A variant in words: family, elements, step.
pub fn describe(variant: &Variant) -> String {
    let elements = match variant.count() {
        0 => None,
        1 => Some("1 element".into()),
        count if variant.placement.is_some() => Some(format!("{count} placed elements")),
        count => Some(format!("{count} elements")),
    };
    let pace = match variant.pace {
        Pace::Timeless => None,
        Pace::Steps(1.0) => Some("the deck's step".into()),
        Pace::Steps(factor) => Some(format!("{factor} times the step")),
        Pace::Adapts(tolerance) => Some(format!("step_tolerance {tolerance:e}")),
    };
    [Some(variant.family.name()), elements, pace].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The settings of a variant (`KEY=VALUE`) as lines to paste into a deck, and as `--set` options.
pub fn paste_lines(deck: &Deck, settings: &[String]) -> Vec<String> {
    if settings.is_empty() {
        return vec!["with the deck unchanged".into()];
    }
    let mut lines = Vec::new();
    let mut table = "";
    for setting in settings {
        let (path, value) = setting.split_once('=').unwrap_or((setting, ""));
        let (place, key) = path.rsplit_once('.').unwrap_or(("", path));
        if place != table {
            table = place;
            let (list, number) = place.split_once('.').unwrap_or((place, "0"));
            let number: usize = number.parse().unwrap_or(0);
            let which = match deck.beams.get(number).filter(|_| list == "beam") {
                Some(beam) => format!("beam {}", beam.name.value),
                None => format!("{list} {}", number + 1),
            };
            lines.push(format!("in [[{list}]] of {which}:"));
        }
        lines.push(format!("  {key} = {value}"));
    }
    let options = settings.iter().map(|setting| {
        let bare = setting.replace('"', "");
        if bare.contains(['[', ' ']) { format!("--set '{bare}'") } else { format!("--set {bare}") }
    });
    lines.push(format!("or: {}", options.collect::<Vec<_>>().join(" ")));
    lines
}
