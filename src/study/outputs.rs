//! The outputs whose errors a study measures.

use super::outcome::find_column;
use super::scale::jumps;
use crate::deck::{Diagnostic, Spanned};

/// The advice where an output changes in jumps.
const CONTINUOUS: &str = "name a column that changes continuously, such as a displacement, and write it by [output]";

/// The numbers of named columns. Refuses names of no column, and columns that change in jumps.
pub fn named<'n>(
    columns: &[String],
    names: impl IntoIterator<Item = &'n Spanned<String>>,
) -> Result<Vec<usize>, Diagnostic> {
    let number = |name: &Spanned<String>| {
        let column = find_column(columns, name)?;
        if jumps(&columns[column]) {
            let message = format!("`{}` changes in jumps: no error of it can be estimated", name.value);
            return Err(Diagnostic::error(message, name.span.clone()).help(CONTINUOUS));
        }
        Ok(column)
    };
    names.into_iter().map(number).collect()
}

/// The numbers of all columns but those that change in jumps. Refuses a scene without others.
pub fn all(columns: &[String]) -> Result<Vec<usize>, Diagnostic> {
    let continuous: Vec<usize> = (0..columns.len()).filter(|&k| !jumps(&columns[k])).collect();
    if continuous.is_empty() {
        let message = "there is no output whose error can be estimated: all columns change in jumps, or there are none";
        return Err(Diagnostic::whole(message).help(CONTINUOUS));
    }
    Ok(continuous)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_jump_have_no_error() {
        let columns = ["tip.ux", "push.length", "push.points", "push.gap"].map(String::from);
        let name = |value: &str| Spanned { value: value.to_string(), span: 0..1 };
        assert_eq!(all(&columns).unwrap(), [0, 3]);
        assert_eq!(named(&columns, &[name("push.gap"), name("tip.ux")]).unwrap(), [3, 0]);
        assert!(named(&columns, &[name("tip.ux"), name("push.points")]).unwrap_err().message.contains("in jumps"));
        assert!(named(&columns, &[name("tip.uy")]).unwrap_err().message.contains("not a column"));
        assert!(all(&columns[1..3]).unwrap_err().message.contains("no output"));
        assert!(all(&[]).is_err());
    }
}
