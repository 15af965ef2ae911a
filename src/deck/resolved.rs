//! The deck as JSON, with expressions replaced by the numbers they stood for.

use super::parameters::Parameters;
use super::reader::literal;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use toml::de::{DeTable, DeValue};

/// `numbers` tells by the start of each string what number it was read as.
pub fn to_json(table: &DeTable, numbers: &BTreeMap<usize, f64>, parameters: &Parameters) -> Value {
    let mut out = object(table, numbers);
    if let Some(Value::Object(param)) = out.get_mut("param") {
        for (name, value) in param.iter_mut() {
            if let Some([number, ..]) = parameters.get(name) {
                *value = json!(number);
            }
        }
    }
    Value::Object(out)
}

fn object(table: &DeTable, numbers: &BTreeMap<usize, f64>) -> Map<String, Value> {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries.into_iter().map(|(key, item)| (key.get_ref().to_string(), value(item, numbers))).collect()
}

fn value(item: &toml::Spanned<DeValue>, numbers: &BTreeMap<usize, f64>) -> Value {
    match item.get_ref() {
        DeValue::String(text) => numbers.get(&item.span().start).map_or_else(|| json!(text), |number| json!(number)),
        DeValue::Integer(integer) if integer.radix() == 10 && integer.as_str().parse::<i64>().is_ok() => {
            json!(integer.as_str().parse::<i64>().unwrap_or_default())
        }
        DeValue::Integer(_) | DeValue::Float(_) => json!(literal(item.get_ref())),
        DeValue::Boolean(flag) => json!(flag),
        DeValue::Datetime(date) => json!(date.to_string()),
        DeValue::Array(array) => array.iter().map(|entry| value(entry, numbers)).collect(),
        DeValue::Table(table) => Value::Object(object(table, numbers)),
    }
}
