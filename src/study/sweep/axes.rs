//! The varied keys and their values, and the points that they make.

use super::latin::latin_hypercube;
use crate::study::SweepError;

/// The largest number of points of a sweep.
const MOST_POINTS: usize = 10_000_000;

/// A key of the deck that is varied.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepAxis {
    /// The key, as in `--set`
    pub(crate) key: String,
    /// Its values
    pub(crate) values: Values,
}

/// Values of a key.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// A list of values, each as it stands in a deck
    List(Vec<String>),
    /// A range, from which samples are drawn
    Range(Range),
}

/// A range of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The first
    pub(crate) from: f64,
    /// The last
    pub(crate) to: f64,
    /// True if equally spaced values have equal factors
    pub(crate) logarithmic: bool,
}

/// Combinations of the values of several axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Combination {
    /// Every value with every other; the last axis changes fastest
    #[default]
    Grid,
    /// The first values of all axes, then the second ones, and so on
    Zip,
    /// Random points, spread evenly over all ranges (Latin hypercube; McKay, Beckman and Conover
    /// 1979, doi:10.1080/00401706.1979.10489755)
    Sample {
        /// The number of points
        count: usize,
        /// The random seed
        seed: u64,
    },
}

/// A number as it stands in a deck.
fn written(value: f64) -> String {
    // Whole numbers have no decimal point, since they may be numbers of elements.
    if value.fract() == 0.0 && value.abs() < 1e15 { format!("{value}") } else { format!("{value:?}") }
}

impl Range {
    /// The number at a part of the range, from 0 to 1.
    pub fn at(&self, part: f64) -> f64 {
        if part == 0.0 {
            self.from
        } else if part == 1.0 {
            self.to
        } else if self.logarithmic {
            self.from * (self.to / self.from).powf(part)
        } else {
            self.from + (self.to - self.from) * part
        }
    }
}

impl Values {
    /// Reads a list `1,2,3`; `5:20:4`, four numbers from 5 to 20; `1e3:1e6:4:log`, with equal
    /// factors; ranges `5:20` and `1e3:1e6:log`.
    pub fn parse(text: &str) -> Result<Self, SweepError> {
        let words = split(text, ',');
        match &words[..] {
            [one] if !one.starts_with(['"', '\'', '[', '{']) && one.contains(':') => Self::between(one),
            words if words.iter().any(String::is_empty) => Err(SweepError::EmptyValue(text.into())),
            _ => Ok(Self::List(words)),
        }
    }

    fn between(text: &str) -> Result<Self, SweepError> {
        let wrong = || SweepError::NoRange(text.into());
        let mut words: Vec<&str> = text.split(':').map(str::trim).collect();
        let logarithmic = words.last() == Some(&"log");
        words.truncate(words.len() - usize::from(logarithmic));
        let number = |word: &str| word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(wrong);
        let (ends, count) = match words[..] {
            [from, to] => ([from, to], None),
            [from, to, count] => ([from, to], Some(count.parse::<usize>().map_err(|_| wrong())?)),
            _ => return Err(wrong()),
        };
        let range = Range { from: number(ends[0])?, to: number(ends[1])?, logarithmic };
        Self::of_range(range, count)
    }

    /// A range, or `count` equally spaced numbers of it.
    pub fn of_range(range: Range, count: Option<usize>) -> Result<Self, SweepError> {
        let Range { from, to, logarithmic } = range;
        if logarithmic && !(from > 0.0 && to > 0.0) {
            return Err(SweepError::NotPositive { from, to });
        }
        let last = |count: usize| (count.max(2) - 1) as f64;
        match count {
            None => Ok(Self::Range(range)),
            Some(0) => Err(SweepError::NoNumbers),
            Some(count) if count > MOST_POINTS => Err(SweepError::TooManyPoints(MOST_POINTS)),
            Some(count) => Ok(Self::List((0..count).map(|k| written(range.at(k as f64 / last(count)))).collect())),
        }
    }

    /// The value at a part of the list or range, from 0 to 1.
    fn at(&self, part: f64) -> String {
        match self {
            Self::Range(range) => written(range.at(part)),
            Self::List(list) => list[((part * list.len() as f64) as usize).min(list.len() - 1)].clone(),
        }
    }
}

impl SweepAxis {
    /// Reads `KEY=VALUES`.
    pub fn parse(text: &str) -> Result<Self, SweepError> {
        let wrong = || SweepError::NoKey(text.into());
        let (key, values) = text.split_once('=').ok_or_else(wrong)?;
        if key.trim().is_empty() {
            return Err(wrong());
        }
        let values =
            Values::parse(values).map_err(|reason| SweepError::Vary { text: text.into(), reason: Box::new(reason) })?;
        Ok(Self { key: key.trim().into(), values })
    }
}

/// The values of all axes, point by point.
pub fn points(axes: &[SweepAxis], how: Combination) -> Result<Vec<Vec<String>>, SweepError> {
    if axes.is_empty() {
        return Err(SweepError::NothingVaried);
    }
    let is_empty = |axis: &&SweepAxis| matches!(&axis.values, Values::List(list) if list.is_empty());
    if let Some(axis) = axes.iter().find(is_empty) {
        return Err(SweepError::NoValues(axis.key.clone()));
    }
    for (k, axis) in axes.iter().enumerate() {
        if axes[..k].iter().any(|other| other.key == axis.key) {
            return Err(SweepError::VariedTwice(axis.key.clone()));
        }
    }
    if let Combination::Sample { count, seed } = how {
        if count > MOST_POINTS {
            return Err(SweepError::TooManyPoints(MOST_POINTS));
        }
        let parts = latin_hypercube(count, axes.len(), seed);
        return Ok(parts
            .iter()
            .map(|point| axes.iter().zip(point).map(|(axis, &part)| axis.values.at(part)).collect())
            .collect());
    }
    let lists: Vec<&Vec<String>> = axes
        .iter()
        .map(|axis| match &axis.values {
            Values::List(list) => Ok(list),
            Values::Range(_) => Err(SweepError::RangeWithoutCount(axis.key.clone())),
        })
        .collect::<Result<_, _>>()?;
    if how == Combination::Zip { zipped(axes, &lists) } else { grid(&lists) }
}

fn zipped(axes: &[SweepAxis], lists: &[&Vec<String>]) -> Result<Vec<Vec<String>>, SweepError> {
    if let Some(k) = lists.iter().position(|list| list.len() != lists[0].len()) {
        return Err(SweepError::UnequalLists {
            first: axes[0].key.clone(),
            first_count: lists[0].len(),
            other: axes[k].key.clone(),
            other_count: lists[k].len(),
        });
    }
    Ok((0..lists[0].len()).map(|point| lists.iter().map(|list| list[point].clone()).collect()).collect())
}

fn grid(lists: &[&Vec<String>]) -> Result<Vec<Vec<String>>, SweepError> {
    let count = lists.iter().try_fold(1_usize, |count, list| count.checked_mul(list.len()));
    let count = count.filter(|&count| count <= MOST_POINTS);
    let count = count.ok_or(SweepError::TooManyPoints(MOST_POINTS))?;
    let point = |mut rest: usize| {
        let mut values: Vec<String> = Vec::with_capacity(lists.len());
        for list in lists.iter().rev() {
            values.push(list[rest % list.len()].clone());
            rest /= list.len();
        }
        values.reverse();
        values
    };
    Ok((0..count).map(point).collect())
}

/// The parts of a text between separators outside of quotes and brackets.
fn split(text: &str, separator: char) -> Vec<String> {
    let mut parts = vec![String::new()];
    let mut depth = 0_usize;
    let mut quote = None;
    for c in text.chars() {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), _) if open == c => quote = None,
            (None, '[' | '{' | '(') => depth += 1,
            (None, ']' | '}' | ')') => depth = depth.saturating_sub(1),
            (None, _) if c == separator && depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = parts.last_mut() {
            last.push(c);
        }
    }
    parts.iter().map(|part| part.trim().to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(text: &str) -> SweepAxis {
        SweepAxis::parse(text).unwrap()
    }

    #[test]
    fn values_are_lists_and_ranges() {
        let list = |values: &[&str]| Values::List(values.iter().map(|v| v.to_string()).collect());
        assert_eq!(axis("a.b=1e3,2*pi, [1,2]").values, list(&["1e3", "2*pi", "[1,2]"]));
        assert_eq!(axis("a=5:20:4").values, list(&["5", "10", "15", "20"]));
        assert_eq!(axis("a=1:100:3:log").values, list(&["1", "10", "100"]));
        assert_eq!(axis("a=hypot(1,2),\"b@0.5:c\"").values, list(&["hypot(1,2)", "\"b@0.5:c\""]));
        assert_eq!(axis("a=1:9").values, Values::Range(Range { from: 1.0, to: 9.0, logarithmic: false }));
        for wrong in ["a", "=1", "a=1:x", "a=0:1:log", "a=1,,2", "a=1:2:0", "a=1:2:3:4"] {
            assert!(SweepAxis::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn axes_are_put_together_in_each_way() {
        let axes = [axis("a=1,2"), axis("b=x,y,z")];
        let all = points(&axes, Combination::Grid).unwrap();
        assert_eq!(all.len(), 6);
        assert_eq!(
            (&all[0][..], &all[1][..], &all[3][..]),
            (&["1", "x"].map(String::from)[..], &["1", "y"].map(String::from)[..], &["2", "x"].map(String::from)[..])
        );
        assert!(points(&axes, Combination::Zip).unwrap_err().to_string().contains("`a` has 2, `b` has 3"));
        assert_eq!(points(&[axis("a=1,2"), axis("b=x,y")], Combination::Zip).unwrap()[1], ["2", "y"]);
        assert!(points(&[axis("a=1:2")], Combination::Grid).is_err());
        let empty = SweepAxis { key: "a".into(), values: Values::List(Vec::new()) };
        for how in [Combination::Grid, Combination::Zip, Combination::Sample { count: 2, seed: 1 }] {
            assert!(points(std::slice::from_ref(&empty), how).is_err());
        }
        assert!(points(&[axis("a=1"), axis("a=2")], Combination::Grid).is_err());
        let drawn = points(&[axis("a=10:20"), axis("b=x,y")], Combination::Sample { count: 10, seed: 7 }).unwrap();
        let mut tenths: Vec<usize> = drawn.iter().map(|p| p[0].parse::<f64>().unwrap() as usize).collect();
        tenths.sort_unstable();
        assert!(tenths.into_iter().eq(10..20));
        assert_eq!(drawn.iter().filter(|p| p[1] == "x").count(), 5);
    }
}
