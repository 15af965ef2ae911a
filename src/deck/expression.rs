//! Arithmetic in decks: parsed once, evaluated with exact first and second derivatives over `t`.
//!
//! Functions come from the pure-Rust `libm`, so that a deck means the same numbers on every
//! machine.

use super::diagnostic::{Diagnostic, Span};
use super::words::{Words, words};
use std::f64::consts::PI;

/// A parsed expression: instructions in the order in which they are carried out, each of which
/// takes its operands from a stack. Neither evaluating nor dropping it is recursive, however long it
/// is.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    instructions: Vec<Instruction>,
}

/// One step of an expression. Offsets are bytes of its text.
#[derive(Clone, Debug, PartialEq)]
enum Instruction {
    /// Adds a number to the stack
    Number(f64),
    /// Adds the value of a name, which stands at an offset
    Name(String, usize),
    /// -a
    Negative,
    /// a (+ - * / ^) b, with the offset of the operator
    Binary(Operator, usize),
    /// f(a) or f(a, b), with the offset of its name
    Call(Function, usize),
}

/// An error in an expression.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpressionError {
    /// The message
    pub message: String,
    /// Byte offset in the expression
    pub offset: usize,
}

impl ExpressionError {
    /// The error of a text in quotes that stands at `span` in the deck, with help where it looks like a number with a unit
    /// or with a decimal comma.
    pub fn diagnostic(&self, text: &str, span: &Span) -> Diagnostic {
        let at = span.start + 1 + self.offset;
        let message = format!("in the expression `{}`: {}", shortened(text), self.message);
        let is_behind_number = text.get(..self.offset).is_some_and(|before| before.trim_end().ends_with(is_of_number));
        let found = text.get(self.offset..).and_then(|rest| rest.chars().next()).filter(|_| is_behind_number);
        let help = found.filter(|c| self.message == unexpected(*c)).and_then(help_behind_number);
        Diagnostic { help: help.map(String::from), ..Diagnostic::error(message, at..at + 1) }
    }
}

/// What helps where this character stands behind a number.
pub fn help_behind_number(found: char) -> Option<&'static str> {
    match found {
        ',' => Some("write decimals with a point: 1.5"),
        c if c.is_alphabetic() || "°%[".contains(c) => Some(
            "numbers have no units: all are in one consistent system, angles in rad (\"30*deg\" is an expression); operators \
             are + - * / ^",
        ),
        _ => None,
    }
}

fn is_of_number(c: char) -> bool {
    c.is_ascii_digit() || c == '.'
}

/// The message about a character that cannot stand there.
fn unexpected(found: char) -> String {
    format!("unexpected `{found}`")
}

/// Value, first and second derivative over `t`.
pub type Jet = [f64; 3];

words! {
    /// Operators of two numbers.
    pub enum Operator {
        /// a + b
        Plus = "+",
        /// a - b
        Minus = "-",
        /// a b
        Times = "*",
        /// a / b
        Over = "/",
        /// a to the power of b
        Power = "^",
    }
}

words! {
    /// Functions.
    pub enum Function {
        /// Sine
        Sin = "sin",
        /// Cosine
        Cos = "cos",
        /// Tangent
        Tan = "tan",
        /// Inverse sine
        Asin = "asin",
        /// Inverse cosine
        Acos = "acos",
        /// Inverse tangent
        Atan = "atan",
        /// The angle of the vector (second argument, first argument)
        Atan2 = "atan2",
        /// Hyperbolic sine
        Sinh = "sinh",
        /// Hyperbolic cosine
        Cosh = "cosh",
        /// Hyperbolic tangent
        Tanh = "tanh",
        /// Exponential function
        Exp = "exp",
        /// Natural logarithm
        Log = "log",
        /// Decimal logarithm
        Log10 = "log10",
        /// Square root
        Sqrt = "sqrt",
        /// Magnitude
        Abs = "abs",
        /// The smaller argument
        Min = "min",
        /// The larger argument
        Max = "max",
    }
}

impl Function {
    /// The number of arguments.
    fn arguments(self) -> usize {
        match self {
            Self::Atan2 | Self::Min | Self::Max => 2,
            Self::Sin
            | Self::Cos
            | Self::Tan
            | Self::Asin
            | Self::Acos
            | Self::Atan
            | Self::Sinh
            | Self::Cosh
            | Self::Tanh
            | Self::Exp
            | Self::Log
            | Self::Log10
            | Self::Sqrt
            | Self::Abs => 1,
        }
    }
}

/// Names with a fixed meaning.
pub const CONSTANTS: [(&str, f64); 2] = [("pi", PI), ("deg", PI / 180.0)];

/// Longest expression, in bytes.
const LONGEST: usize = 2_000;

/// Deepest nesting of an expression: it is parsed recursively.
const MAX_DEPTH: usize = 100;

impl Expression {
    /// The expression of a number.
    pub fn of_number(value: f64) -> Self {
        Self { instructions: vec![Instruction::Number(value)] }
    }

    /// Parses `text`.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        if text.len() > LONGEST {
            let message = format!("an expression can have at most {LONGEST} characters");
            return Err(ExpressionError { message, offset: 0 });
        }
        let mut parser = Parser { text, at: 0, depth: 0, instructions: Vec::new() };
        parser.sum()?;
        parser.skip_space();
        match parser.peek() {
            None => Ok(Self { instructions: parser.instructions }),
            Some(c) => Err(parser.error(unexpected(c))),
        }
    }

    /// Evaluates; `lookup` gives the values of names. The value of every operation must be finite,
    /// not only that of the whole expression: `min(2, sqrt(-1))` is an error.
    pub fn evaluate(&self, lookup: &mut dyn FnMut(&str) -> Option<Jet>) -> Result<Jet, ExpressionError> {
        let mut stack: Vec<Jet> = Vec::new();
        for instruction in &self.instructions {
            let value = match instruction {
                Instruction::Number(value) => [*value, 0.0, 0.0],
                Instruction::Name(name, offset) => {
                    let constant = CONSTANTS.iter().find(|(known, _)| known == name);
                    let constant = constant.map(|&(_, value)| [value, 0.0, 0.0]);
                    let unknown = || ExpressionError { message: format!("unknown name `{name}`"), offset: *offset };
                    constant.or_else(|| lookup(name)).ok_or_else(unknown)?
                }
                Instruction::Negative => operand(&mut stack).map(|x| -x),
                Instruction::Binary(operator, offset) => {
                    let b = operand(&mut stack);
                    let a = operand(&mut stack);
                    let value = binary(*operator, a, b);
                    finite(value, *offset, || format!("{} {} {}", short(a[0]), operator.word(), bracketed(b[0])))?
                }
                Instruction::Call(function, offset) => {
                    let takes_two = function.arguments() == 2;
                    let b = if takes_two { operand(&mut stack) } else { [0.0; 3] };
                    let a = operand(&mut stack);
                    let second = if takes_two { format!(", {}", short(b[0])) } else { String::new() };
                    finite(call(*function, a, b), *offset, || format!("{}({}{second})", function.word(), short(a[0])))?
                }
            };
            stack.push(value);
        }
        Ok(operand(&mut stack))
    }

    /// Calls `visit` with every name in the expression and its byte offset.
    pub fn names(&self, visit: &mut dyn FnMut(&str, usize)) {
        for instruction in &self.instructions {
            match instruction {
                Instruction::Name(name, offset) => visit(name, *offset),
                Instruction::Number(_) | Instruction::Negative | Instruction::Binary(..) | Instruction::Call(..) => {}
            }
        }
    }
}

/// Takes the last value of the stack. The parser leaves as many as the instructions take.
fn operand(stack: &mut Vec<Jet>) -> Jet {
    stack.pop().unwrap_or([f64::NAN; 3])
}

/// A value of an operation if it is finite; the derivatives may be infinite, as at the corner of a
/// root.
fn finite(value: Jet, offset: usize, operation: impl Fn() -> String) -> Result<Jet, ExpressionError> {
    if value[0].is_finite() {
        return Ok(value);
    }
    let is = if value[0].is_nan() { "is not a number" } else { "is not finite" };
    Err(ExpressionError { message: format!("`{}` {is}", operation()), offset })
}

/// An expression for messages: of a long one the beginning.
fn shortened(text: &str) -> String {
    /// Characters in a message, at most.
    const MOST: usize = 60;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

/// A number for messages: with an exponent where that is shorter.
fn short(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").unwrap_or(&text).into()
}

/// A number behind an operator.
fn bracketed(value: f64) -> String {
    if value < 0.0 { format!("({})", short(value)) } else { short(value) }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    instructions: Vec<Instruction>,
}

impl Parser<'_> {
    fn sum(&mut self) -> Result<(), ExpressionError> {
        self.descend()?;
        self.product()?;
        while let Some((operator, offset)) = self.operator("+-") {
            self.product()?;
            self.instructions.push(Instruction::Binary(operator, offset));
        }
        self.depth -= 1;
        Ok(())
    }

    fn descend(&mut self) -> Result<(), ExpressionError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.error("the expression is nested too deeply".into()));
        }
        Ok(())
    }

    fn product(&mut self) -> Result<(), ExpressionError> {
        self.signed()?;
        while let Some((operator, offset)) = self.operator("*/") {
            self.signed()?;
            self.instructions.push(Instruction::Binary(operator, offset));
        }
        Ok(())
    }

    fn signed(&mut self) -> Result<(), ExpressionError> {
        let mut negative = false;
        while let Some(sign) = self.accept("+-") {
            negative ^= sign == '-';
        }
        self.power()?;
        if negative {
            self.instructions.push(Instruction::Negative);
        }
        Ok(())
    }

    fn power(&mut self) -> Result<(), ExpressionError> {
        self.atom()?;
        let Some((operator, offset)) = self.operator("^") else { return Ok(()) };
        self.descend()?;
        self.signed()?;
        self.depth -= 1;
        self.instructions.push(Instruction::Binary(operator, offset));
        Ok(())
    }

    fn atom(&mut self) -> Result<(), ExpressionError> {
        self.skip_space();
        match self.peek() {
            Some('(') => {
                self.at += 1;
                self.sum()?;
                self.expect(')')
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.name_or_call(),
            Some(c) => Err(self.error(unexpected(c))),
            None => Err(self.error("the expression is incomplete".into())),
        }
    }

    fn number(&mut self) -> Result<(), ExpressionError> {
        let start = self.at;
        let digits = |parser: &mut Self| {
            while parser.peek().is_some_and(|c| c.is_ascii_digit() || c == '_') {
                parser.at += 1;
            }
        };
        digits(self);
        if self.peek() == Some('.') {
            self.at += 1;
            digits(self);
        }
        if matches!(self.peek(), Some('e' | 'E')) {
            let before = self.at;
            self.at += 1;
            if matches!(self.peek(), Some('+' | '-')) {
                self.at += 1;
            }
            if self.peek().is_some_and(|c| c.is_ascii_digit()) { digits(self) } else { self.at = before }
        }
        let text = self.text[start..self.at].replace('_', "");
        let wrong = |why: &str| ExpressionError { message: format!("`{text}` is {why}"), offset: start };
        let value: f64 = text.parse().map_err(|_| wrong("not a number"))?;
        if !value.is_finite() {
            return Err(wrong("too large for a floating-point number"));
        }
        self.instructions.push(Instruction::Number(value));
        Ok(())
    }

    fn name_or_call(&mut self) -> Result<(), ExpressionError> {
        let start = self.at;
        while self.peek().is_some_and(|c| c.is_ascii_alphanumeric() || c == '_') {
            self.at += 1;
        }
        let name = &self.text[start..self.at];
        self.skip_space();
        if self.peek() != Some('(') {
            self.instructions.push(Instruction::Name(name.into(), start));
            return Ok(());
        }
        self.at += 1;
        let Some(function) = Function::of(name) else {
            let known = Function::words().collect::<Vec<_>>().join(", ");
            let message = format!("unknown function `{name}`; known functions: {known}");
            return Err(ExpressionError { message, offset: start });
        };
        self.sum()?;
        let mut given = 1;
        while self.accept(",").is_some() {
            self.sum()?;
            given += 1;
        }
        self.expect(')')?;
        let count = function.arguments();
        if given != count {
            let message = format!("`{name}` takes {count} argument(s), not {given}");
            return Err(ExpressionError { message, offset: start });
        }
        self.instructions.push(Instruction::Call(function, start));
        Ok(())
    }

    /// One of some operators, with its offset.
    fn operator(&mut self, any_of: &str) -> Option<(Operator, usize)> {
        let operator = Operator::of(self.accept(any_of)?.encode_utf8(&mut [0; 4]))?;
        Some((operator, self.at - operator.word().len()))
    }

    fn accept(&mut self, any_of: &str) -> Option<char> {
        self.skip_space();
        let c = self.peek().filter(|&c| any_of.contains(c))?;
        self.at += c.len_utf8();
        Some(c)
    }

    fn expect(&mut self, wanted: char) -> Result<(), ExpressionError> {
        if self.accept(&wanted.to_string()).is_some() {
            return Ok(());
        }
        Err(self.error(match self.peek() {
            Some(c) => format!("expected `{wanted}`, found `{c}`"),
            None => format!("expected `{wanted}` before the end"),
        }))
    }

    fn skip_space(&mut self) {
        while self.peek().is_some_and(char::is_whitespace) {
            self.at += self.peek().map_or(0, char::len_utf8);
        }
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn error(&self, message: String) -> ExpressionError {
        ExpressionError { message, offset: self.at }
    }
}

fn binary(operator: Operator, a: Jet, b: Jet) -> Jet {
    match operator {
        Operator::Plus => [0, 1, 2].map(|i| a[i] + b[i]),
        Operator::Minus => [0, 1, 2].map(|i| a[i] - b[i]),
        Operator::Times => [a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]],
        Operator::Over => {
            let value = a[0] / b[0];
            let slope = (a[1] - value * b[1]) / b[0];
            [value, slope, (a[2] - 2.0 * slope * b[1] - value * b[2]) / b[0]]
        }
        Operator::Power => power(a, b),
    }
}

fn power(a: Jet, b: Jet) -> Jet {
    let value = libm::pow(a[0], b[0]);
    if b[1] != 0.0 || b[2] != 0.0 {
        // a^b = exp(b log a)
        return chain(binary(Operator::Times, b, call(Function::Log, a, a)), value, value, value);
    }
    if a[1] == 0.0 && a[2] == 0.0 {
        return [value, 0.0, 0.0];
    }
    let falling = |k: f64, factor: f64| if factor == 0.0 { 0.0 } else { factor * libm::pow(a[0], b[0] - k) };
    chain(a, value, falling(1.0, b[0]), falling(2.0, b[0] * (b[0] - 1.0)))
}

/// f(a), given f, f' and f'' at a.
fn chain(a: Jet, f: f64, slope: f64, bend: f64) -> Jet {
    // A constant argument has no derivatives, whatever f' is there.
    if a[1] == 0.0 && a[2] == 0.0 {
        return [f, 0.0, 0.0];
    }
    [f, slope * a[1], bend * a[1] * a[1] + slope * a[2]]
}

fn call(function: Function, a: Jet, b: Jet) -> Jet {
    let x = a[0];
    match function {
        Function::Sin => chain(a, libm::sin(x), libm::cos(x), -libm::sin(x)),
        Function::Cos => chain(a, libm::cos(x), -libm::sin(x), -libm::cos(x)),
        Function::Tan => {
            let f = libm::tan(x);
            chain(a, f, 1.0 + f * f, 2.0 * f * (1.0 + f * f))
        }
        Function::Asin => {
            let slope = 1.0 / (1.0 - x * x).sqrt();
            chain(a, libm::asin(x), slope, x * slope * slope * slope)
        }
        Function::Acos => {
            let slope = -1.0 / (1.0 - x * x).sqrt();
            chain(a, libm::acos(x), slope, x * slope * slope * slope)
        }
        Function::Atan => {
            let slope = 1.0 / (1.0 + x * x);
            chain(a, libm::atan(x), slope, -2.0 * x * slope * slope)
        }
        Function::Atan2 => {
            // The derivatives of atan(y/x), in a form that holds for every quadrant:
            // (y'x - y x')/(x^2 + y^2).
            let y = a;
            let x = b;
            let r2 = x[0] * x[0] + y[0] * y[0];
            let cross = y[1] * x[0] - y[0] * x[1];
            let slope = cross / r2;
            let r2_slope = 2.0 * (x[0] * x[1] + y[0] * y[1]);
            [libm::atan2(y[0], x[0]), slope, (y[2] * x[0] - y[0] * x[2] - slope * r2_slope) / r2]
        }
        Function::Sinh => chain(a, libm::sinh(x), libm::cosh(x), libm::sinh(x)),
        Function::Cosh => chain(a, libm::cosh(x), libm::sinh(x), libm::cosh(x)),
        Function::Tanh => {
            let f = libm::tanh(x);
            chain(a, f, 1.0 - f * f, -2.0 * f * (1.0 - f * f))
        }
        Function::Exp => chain(a, libm::exp(x), libm::exp(x), libm::exp(x)),
        Function::Log => chain(a, libm::log(x), 1.0 / x, -1.0 / (x * x)),
        Function::Log10 => {
            let scale = std::f64::consts::LOG10_E;
            chain(a, libm::log10(x), scale / x, -scale / (x * x))
        }
        Function::Sqrt => {
            let f = x.sqrt();
            chain(a, f, 0.5 / f, -0.25 / (f * x))
        }
        Function::Abs => {
            if falls_below(a, [0.0; 3]) {
                a.map(|v| -v)
            } else {
                a
            }
        }
        Function::Min => {
            if falls_below(b, a) {
                b
            } else {
                a
            }
        }
        Function::Max => {
            if falls_below(a, b) {
                b
            } else {
                a
            }
        }
    }
}

/// True if a is less than b, or becomes so where they meet: `min`, `max` and `abs` then have the
/// derivatives of the later branch, as tables have, in any order of arguments.
fn falls_below(a: Jet, b: Jet) -> bool {
    (0..3).find(|&k| a[k] != b[k]).is_some_and(|k| a[k] < b[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        Expression::parse(text).unwrap().evaluate(&mut |name| (name == "L").then_some([12.0, 0.0, 0.0])).unwrap()[0]
    }

    #[test]
    fn arithmetic_binds_as_in_mathematics() {
        assert_eq!(value("1 + 2*3"), 7.0);
        assert_eq!(value("-2^2"), -4.0);
        assert_eq!(value("2^3^2"), 512.0);
        assert_eq!(value("2^-1"), 0.5);
        assert_eq!(value("(1+2)*-3"), -9.0);
        assert_eq!(value("12/2/3"), 2.0);
        assert_eq!(value("1e3 + 1_000"), 2000.0);
        assert_eq!(value("max(L, 2*L)"), 24.0);
        assert!((value("sin(30*deg)") - 0.5).abs() < 1e-15);
        assert_eq!(value("atan2(1, -1)"), 0.75 * PI);
    }

    #[test]
    fn errors_tell_where() {
        let error = |text: &str| Expression::parse(text).unwrap_err();
        assert_eq!(error("1 + ").offset, 4);
        assert_eq!(error("2*(3+4").message, "expected `)` before the end");
        assert_eq!(error("si(3)").offset, 0);
        assert_eq!(error("atan2(1)").message, "`atan2` takes 2 argument(s), not 1");
        assert_eq!(error("3 $ 4").offset, 2);
        assert!(Expression::parse(&"(".repeat(1000)).is_err());
    }

    #[test]
    fn every_operation_must_give_a_finite_number() {
        let told = |text: &str| Expression::parse(text).and_then(|e| e.evaluate(&mut |_| None)).unwrap_err();
        for (text, message, offset) in [
            ("min(2, sqrt(-1))", "`sqrt(-1)` is not a number", 7),
            ("min(sqrt(-1), 2)", "`sqrt(-1)` is not a number", 4),
            ("max(2, -1/0)", "`-1 / 0` is not finite", 9),
            ("1/(1/0)", "`1 / 0` is not finite", 4),
            ("atan(10^400)", "`10 ^ 400` is not finite", 7),
            ("0^-1", "`0 ^ (-1)` is not finite", 1),
            ("atan2(log(0), 1)", "`log(0)` is not finite", 6),
            ("10^200*10^200", "`1e200 * 1e200` is not finite", 6),
            ("0 * exp(1000)", "`exp(1000)` is not finite", 4),
            ("1 / 1e999", "`1e999` is too large for a floating-point number", 4),
        ] {
            let error = told(text);
            assert_eq!((error.message.as_str(), error.offset), (message, offset), "{text}");
        }
    }

    /// The slope of a root is infinite where it begins: its value is not.
    #[test]
    fn infinite_derivatives_are_no_errors() {
        let at_zero = Expression::parse("sqrt(t)").unwrap().evaluate(&mut |_| Some([0.0, 1.0, 0.0])).unwrap();
        assert_eq!(at_zero[0], 0.0);
    }

    #[test]
    fn the_longest_expressions_are_evaluated_on_a_small_stack() {
        let sum = "1".to_string() + &"+1".repeat(LONGEST / 2 - 1);
        let nested = "(".repeat(90) + "1" + &")".repeat(90);
        let small = std::thread::Builder::new().stack_size(256 << 10);
        let values = small.spawn(move || [value(&sum), value(&nested)]).unwrap().join().unwrap();
        assert_eq!(values, [(LONGEST / 2) as f64, 1.0]);
    }

    /// A ramp and what holds it would add up at their corner if each took its side by the order of
    /// its arguments.
    #[test]
    fn corners_have_the_derivatives_of_what_follows() {
        let at_corner = |text: &str| {
            Expression::parse(text).unwrap().evaluate(&mut |name| (name == "t").then_some([2.0, 1.0, 0.0])).unwrap()
        };
        for (text, rates) in [
            ("min(t, 2)", [0.0, 0.0]),
            ("min(2, t)", [0.0, 0.0]),
            ("max(t, 2)", [1.0, 0.0]),
            ("max(2, t)", [1.0, 0.0]),
            ("abs(t - 2)", [1.0, 0.0]),
            ("abs(2 - t)", [1.0, 0.0]),
            ("max((t - 2)^2, 0)", [0.0, 2.0]),
            ("min(0, (t - 2)^2)", [0.0, 0.0]),
            ("2*(min(t/2, 1) - 0.5) + max(t - 2, 0)", [1.0, 0.0]),
            ("min(t, t)", [1.0, 0.0]),
        ] {
            assert_eq!(at_corner(text)[1..], rates, "{text}");
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let texts = [
            "sin(t)",
            "cos(2*t)",
            "tan(t)",
            "asin(t/3)",
            "acos(t/3)",
            "atan(t)",
            "atan2(t, 2-t)",
            "sinh(t)",
            "cosh(t)",
            "tanh(t)",
            "exp(-t)",
            "log(t)",
            "log10(t)",
            "sqrt(t)",
            "abs(-t)",
            "min(t, 3)",
            "max(t, t^2)",
            "t^3",
            "2^t",
            "t^t",
            "t/(1+t^2)",
            "(1-t)*t^2.5",
        ];
        for text in texts {
            let parsed = Expression::parse(text).unwrap();
            let at = |t: f64| parsed.evaluate(&mut |name| (name == "t").then_some([t, 1.0, 0.0])).unwrap();
            let t = 0.7;
            let h = 1e-5;
            let before = at(t - h);
            let here = at(t);
            let after = at(t + h);
            assert!((here[1] - (after[0] - before[0]) / (2.0 * h)).abs() < 1e-8, "{text}");
            assert!((here[2] - (after[1] - before[1]) / (2.0 * h)).abs() < 1e-8, "{text}");
        }
    }
}
