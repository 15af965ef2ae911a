//! What is varied, and the points that this makes.

use super::latin::latin_hypercube;

/// Points of a sweep, at most.
const MOST_POINTS: usize = 10_000_000;

/// A key of the deck that is varied.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// As in `--set`
    pub key: String,
    /// Its values
    pub values: Values,
}

/// Values of a key.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// These, each as it stands in a deck
    List(Vec<String>),
    /// Any between two numbers, which samples are drawn from
    Range(Range),
}

/// From one number to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The first
    pub from: f64,
    /// The last
    pub to: f64,
    /// Whether equal steps are equal factors
    pub logarithmic: bool,
}

/// How axes are put together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Combination {
    /// Each value with each of the others; the last axis changes fastest
    #[default]
    Grid,
    /// The first values of all, then the second
    Zip,
    /// So many points, spread over all ranges (Latin hypercube; McKay, Beckman and Conover 1979, doi:10.1080/00401706.1979.10489755)
    Sample {
        /// How many
        count: usize,
        /// What the random numbers begin with
        seed: u64,
    },
}

/// A number as it would stand in a deck.
fn written(value: f64) -> String {
    // Display keeps whole numbers whole: counts of elements come from ranges too.
    if value.fract() == 0.0 && value.abs() < 1e15 { format!("{value}") } else { format!("{value:?}") }
}

impl Range {
    /// The number this far between its ends, from 0 to 1.
    pub fn at(&self, part: f64) -> f64 {
        match part {
            0.0 => self.from,
            1.0 => self.to,
            _ if self.logarithmic => self.from * (self.to / self.from).powf(part),
            _ => self.from + (self.to - self.from) * part,
        }
    }
}

impl Values {
    /// `1,2,3`; `5:20:4`, four numbers from 5 to 20; `1e3:1e6:4:log`, with equal factors; `5:20` and `1e3:1e6:log`, ranges.
    pub fn parse(text: &str) -> Result<Self, String> {
        let words = split(text, ',');
        match &words[..] {
            [one] if !one.starts_with(['"', '\'', '[', '{']) && one.contains(':') => Self::between(one),
            words if words.iter().any(String::is_empty) => Err(format!("there is an empty value in `{text}`")),
            _ => Ok(Self::List(words)),
        }
    }

    fn between(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is no range: write FROM:TO, FROM:TO:COUNT, and `:log` behind it for equal factors");
        let mut words: Vec<&str> = text.split(':').map(str::trim).collect();
        let logarithmic = words.last() == Some(&"log");
        words.truncate(words.len() - usize::from(logarithmic));
        let number = |word: &str| word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(wrong);
        let (from, to, count) = match words[..] {
            [from, to] => (number(from)?, number(to)?, None),
            [from, to, count] => (number(from)?, number(to)?, Some(count.parse::<usize>().map_err(|_| wrong())?)),
            _ => return Err(wrong()),
        };
        Self::of_range(Range { from, to, logarithmic }, count)
    }

    /// A range, or so many numbers of it.
    pub fn of_range(range: Range, count: Option<usize>) -> Result<Self, String> {
        let Range { from, to, logarithmic } = range;
        if logarithmic && !(from > 0.0 && to > 0.0) {
            return Err(format!("equal factors lead from {from} to {to} only where both are positive"));
        }
        let last = |count: usize| (count.max(2) - 1) as f64;
        match count {
            None => Ok(Self::Range(range)),
            Some(0) => Err("a range of no numbers".into()),
            Some(count) if count > MOST_POINTS => Err(format!("more than the largest supported {MOST_POINTS} points")),
            Some(count) => Ok(Self::List((0..count).map(|k| written(range.at(k as f64 / last(count)))).collect())),
        }
    }

    /// The value this far through, from 0 to 1.
    fn at(&self, part: f64) -> String {
        match self {
            Self::Range(range) => written(range.at(part)),
            Self::List(list) => list[((part * list.len() as f64) as usize).min(list.len() - 1)].clone(),
        }
    }
}

impl Axis {
    /// `KEY=VALUES`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("--vary {text}: expected KEY=V1,V2,… or KEY=FROM:TO:COUNT");
        let (key, values) = text.split_once('=').ok_or_else(wrong)?;
        if key.trim().is_empty() {
            return Err(wrong());
        }
        let values = Values::parse(values).map_err(|why| format!("--vary {text}: {why}"))?;
        Ok(Self { key: key.trim().into(), values })
    }
}

/// The values of all axes, point by point.
pub fn points(axes: &[Axis], how: Combination) -> Result<Vec<Vec<String>>, String> {
    if axes.is_empty() {
        return Err("nothing is varied: give --vary KEY=V1,V2,…".into());
    }
    let is_empty = |axis: &&Axis| matches!(&axis.values, Values::List(list) if list.is_empty());
    if let Some(axis) = axes.iter().find(is_empty) {
        return Err(format!("`{}` has no values", axis.key));
    }
    if let Some(axis) = axes.iter().enumerate().find(|(k, axis)| axes[..*k].iter().any(|other| other.key == axis.key)) {
        return Err(format!("`{}` is varied twice", axis.1.key));
    }
    if let Combination::Sample { count, seed } = how {
        if count > MOST_POINTS {
            return Err(format!("more than the largest supported {MOST_POINTS} points"));
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
            Values::Range(_) => {
                Err(format!("`{}` has a range: say how many of it (FROM:TO:COUNT), or --sample", axis.key))
            }
        })
        .collect::<Result<_, _>>()?;
    if how == Combination::Zip { zipped(axes, &lists) } else { grid(&lists) }
}

fn zipped(axes: &[Axis], lists: &[&Vec<String>]) -> Result<Vec<Vec<String>>, String> {
    if let Some(k) = lists.iter().position(|list| list.len() != lists[0].len()) {
        let [(a, n), (b, m)] = [0, k].map(|k| (&axes[k].key, lists[k].len()));
        return Err(format!("--zip takes as many values of each key: `{a}` has {n}, `{b}` has {m}"));
    }
    Ok((0..lists[0].len()).map(|point| lists.iter().map(|list| list[point].clone()).collect()).collect())
}

fn grid(lists: &[&Vec<String>]) -> Result<Vec<Vec<String>>, String> {
    let count = lists.iter().try_fold(1_usize, |count, list| count.checked_mul(list.len()));
    let count = count.filter(|&count| count <= MOST_POINTS);
    let count = count.ok_or(format!("more than the largest supported {MOST_POINTS} points"))?;
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

/// The parts of a text between separators that stand in no quotes and no brackets.
fn split(text: &str, separator: char) -> Vec<String> {
    let (mut parts, mut depth, mut quote) = (vec![String::new()], 0_usize, None);
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

    fn axis(text: &str) -> Axis {
        Axis::parse(text).unwrap()
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
            assert!(Axis::parse(wrong).is_err(), "{wrong}");
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
        assert!(points(&axes, Combination::Zip).unwrap_err().contains("`a` has 2, `b` has 3"));
        assert_eq!(points(&[axis("a=1,2"), axis("b=x,y")], Combination::Zip).unwrap()[1], ["2", "y"]);
        assert!(points(&[axis("a=1:2")], Combination::Grid).is_err());
        let empty = Axis { key: "a".into(), values: Values::List(Vec::new()) };
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
