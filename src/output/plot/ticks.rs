//! Ticks of an axis: round numbers with exact labels.
//!
//! A tick is an integer times a power of ten. The label is made of these two, and the value is read
//! from the label: so the label of a tick always agrees with its position.

use super::line_plot::Scale;

/// A labelled tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// The value on the axis
    pub(super) value: f64,
    /// The label, which reads back to the value
    pub(super) text: String,
}

/// Ticks of an axis.
#[derive(Clone, Debug, Default)]
pub struct Ticks {
    /// Ticks with labels
    pub(super) labelled: Vec<Tick>,
    /// Values of ticks without labels between them
    pub(super) minor: Vec<f64>,
}

/// Smallest value that is written as a plain decimal; smaller ones have an exponent.
const LEAST_PLAIN: f64 = 1e-3;
/// Values from here on have an exponent.
const LARGEST_PLAIN: f64 = 1e6;
/// Part of a step by which an end of the axis may miss a tick because of round-off.
const ROUND_OFF: f64 = 1e-9;

impl Ticks {
    /// Ticks between the two ends of an axis, which must differ, with at most `max_labels` labels
    /// but at least two.
    pub fn new(scale: Scale, low: f64, high: f64, max_labels: usize) -> Self {
        match scale {
            Scale::Linear => Self { labelled: linear(low, high, max_labels), minor: Vec::new() },
            Scale::Logarithmic => logarithmic(low, high, max_labels),
        }
    }
}

/// An integer times a power of ten.
#[derive(Clone, Copy)]
struct Decimal {
    integer: i64,
    power: i32,
}

impl Decimal {
    fn value(self) -> f64 {
        format!("{}e{}", self.integer, self.power).parse().unwrap_or(f64::NAN)
    }

    /// Digits without an exponent, such as `-0.0175`.
    fn plain(self) -> String {
        if self.power >= 0 {
            return format!("{}{}", self.integer, "0".repeat(self.power as usize));
        }
        let decimals = -self.power as usize;
        let digits = format!("{:0>width$}", self.integer.unsigned_abs(), width = decimals + 1);
        let (whole, part) = digits.split_at(digits.len() - decimals);
        let sign = if self.integer < 0 { "-" } else { "" };
        format!("{sign}{whole}.{part}")
    }

    /// Digits before an exponent, such as `25e-6`.
    fn with_exponent(self, exponent: i32) -> String {
        format!("{}e{exponent}", Self { power: self.power - exponent, ..self }.plain())
    }

    fn tick(self, exponent: Option<i32>) -> Tick {
        let text = if self.integer == 0 {
            "0".into()
        } else {
            exponent.map_or_else(|| self.plain(), |exponent| self.with_exponent(exponent))
        };
        Tick { value: self.value(), text }
    }
}

/// At least two ticks, 1, 2 or 5 times a power of ten apart. If they have an exponent, it is the same
/// for all and a multiple of three (engineering notation).
fn linear(low: f64, high: f64, max_labels: usize) -> Vec<Tick> {
    let wanted = (high - low) / max_labels.max(2) as f64;
    let mut power = wanted.log10().floor() as i32;
    let reaches = |digit: i64, power: i32| Decimal { integer: digit, power }.value() >= wanted * (1.0 - ROUND_OFF);
    let digit = [1, 2, 5].into_iter().find(|&digit| reaches(digit, power)).unwrap_or_else(|| {
        power += 1;
        1
    });
    let step = Decimal { integer: digit, power }.value();
    let first = (low / step - ROUND_OFF).ceil() as i64;
    let last = (high / step + ROUND_OFF).floor() as i64;
    if last <= first {
        return linear(low, high, 2 * max_labels);
    }
    let ticks: Vec<Decimal> = (first..=last).map(|k| Decimal { integer: k * digit, power }).collect();
    let largest = ticks.iter().fold(0.0_f64, |largest, tick| largest.max(tick.value().abs()));
    let is_plain = (LEAST_PLAIN..LARGEST_PLAIN).contains(&largest) || largest == 0.0;
    let exponent = if is_plain { None } else { Some(order(largest).div_euclid(3) * 3) };
    ticks.into_iter().map(|tick| tick.tick(exponent)).collect()
}

/// Ticks at powers of ten. If these are few, there are also ticks at 2 and 5 times them; within a
/// decade ticks are those of a linear axis.
fn logarithmic(low: f64, high: f64, max_labels: usize) -> Ticks {
    let decades = order(low)..=order(high);
    let times = |digit: i64, power: i32| Decimal { integer: digit, power };
    let is_inside = |tick: &Decimal| (low..=high).contains(&tick.value());
    let labelled = |digits: &[i64], stride: i32| -> Vec<Tick> {
        let powers = decades.clone().filter(|power| power.rem_euclid(stride) == 0);
        let all = powers.flat_map(|power| digits.iter().map(move |&digit| times(digit, power)));
        all.filter(is_inside).map(power_of_ten_notation).collect()
    };
    let all_digits: Vec<i64> = (1..10).collect();
    let minor = |digits: &[i64]| labelled(digits, 1).into_iter().map(|tick| tick.value).collect();
    let fine = labelled(&[1, 2, 5], 1);
    if fine.len() < 3 {
        return Ticks { labelled: linear(low, high, max_labels), minor: Vec::new() };
    }
    if fine.len() <= max_labels {
        return Ticks { labelled: fine, minor: minor(&all_digits) };
    }
    let mut stride = 1;
    while labelled(&[1], stride).len() > max_labels {
        stride += 1;
    }
    let minor = if stride == 1 { minor(&all_digits) } else { minor(&[1]) };
    Ticks { labelled: labelled(&[1], stride), minor }
}

/// A tick such as 0.002, 0.5, 20 or 1e-6.
fn power_of_ten_notation(tick: Decimal) -> Tick {
    let is_plain = (LEAST_PLAIN..LARGEST_PLAIN).contains(&tick.value());
    tick.tick(if is_plain { None } else { Some(tick.power) })
}

/// The exponent of the largest power of ten that is at most a positive value.
fn order(value: f64) -> i32 {
    let guess = value.log10().floor() as i32;
    let next = Decimal { integer: 1, power: guess + 1 };
    if next.value() <= value { guess + 1 } else { guess }
}
