//! Descriptions of keys and words: the JSON Schema of the deck is their one source.

use super::hints::{self, Hint};
use beamsim_core::warning::WarningKind;
use serde_json::Value;

/// The JSON Schema (draft 7).
pub const SCHEMA: &str = include_str!("schema.json");

/// A key, a table, or a word that is the value of a key.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Path of the key: `beam.elements`
    pub path: String,
    /// The word, in the entry of a word
    pub(crate) word: Option<String>,
    /// Its table: `[[beam]]`, `the deck`
    pub(crate) table: String,
    /// Meaning
    pub(crate) description: String,
    /// Kinds of values, or words
    pub kinds: String,
    /// Words that are values of the key
    words: Vec<String>,
    /// Unit, if it has one
    pub(crate) unit: Option<String>,
    /// Default, as TOML
    pub(crate) default: Option<String>,
    /// Examples, as TOML
    pub examples: Vec<String>,
    /// Keys of a table
    pub(crate) keys: Vec<String>,
    /// True if its table needs it
    pub(crate) required: bool,
}

/// Entries of a key (`elements`, in all tables that have it, or `beam.elements`), of a table
/// (`[[beam]]`, `beam`), and of a word that is a value of keys (`cylindrical`).
pub fn explain(name: &str) -> Vec<Entry> {
    let path = name.trim().trim_matches(['[', ']', '"']).replace(".NAME", "");
    let all = entries();
    let below = format!(".{path}");
    let mut found: Vec<Entry> =
        if path == "deck" { vec![whole()] } else { all.iter().filter(|entry| entry.path == path).cloned().collect() };
    if found.is_empty() {
        found = all.iter().filter(|entry| entry.path.ends_with(&below)).cloned().collect();
    }
    found.extend(all.iter().filter_map(|entry| entry.of_word(&path)));
    found
}

/// Help for a name that is neither in the deck nor among other known names.
pub fn similar(name: &str, others: &[&str]) -> Hint {
    let all = entries();
    let keys = all.iter().filter_map(|entry| entry.path.rsplit('.').next());
    let paths = all.iter().map(|entry| entry.path.as_str());
    let words = all.iter().flat_map(|entry| entry.words.iter().map(String::as_str));
    let known: Vec<&str> = paths.chain(keys).chain(words).chain(others.iter().copied()).collect();
    hints::for_any(name, &known)
}

/// The deck itself, whose keys are its tables.
fn whole() -> Entry {
    let schema: Value = serde_json::from_str(SCHEMA).unwrap_or_default();
    let keys = schema["properties"].as_object().map_or(Vec::new(), |keys| keys.keys().cloned().collect());
    Entry { examples: Vec::new(), keys, ..entry(&schema, &schema, "deck", "a file", false) }
}

/// Every table and key, in the order of the schema.
pub fn entries() -> Vec<Entry> {
    let schema: Value = serde_json::from_str(SCHEMA).unwrap_or_default();
    let mut all = Vec::new();
    walk(&schema, "", "the deck", &mut all);
    all
}

/// The keys of a table, and of the tables in it.
fn walk(table: &Value, path: &str, name: &str, all: &mut Vec<Entry>) {
    let Some(properties) = table["properties"].as_object() else { return };
    for (key, node) in properties {
        let below = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let (inner, inner_name) = inside(node, &below, key);
        let required = table["required"].as_array().is_some_and(|keys| keys.iter().any(|k| k == key));
        all.push(entry(node, inner, &below, name, required));
        walk(inner, &below, &inner_name, all);
    }
}

/// The table that a key holds, or the one of which it holds several; with its name in messages.
fn inside<'a>(node: &'a Value, path: &str, key: &str) -> (&'a Value, String) {
    let top = !path.contains('.');
    if node["items"]["properties"].is_object() {
        (&node["items"], format!("[[{key}]]"))
    } else if node["additionalProperties"]["properties"].is_object() {
        (&node["additionalProperties"], format!("[{key}.NAME]"))
    } else if top {
        (node, format!("[{key}]"))
    } else {
        (node, format!("`{path}`"))
    }
}

fn entry(node: &Value, inner: &Value, path: &str, table: &str, required: bool) -> Entry {
    let text = |of: &Value, key: &str| of[key].as_str().map(str::to_string);
    let mut description = text(node, "description").unwrap_or_default();
    if !std::ptr::eq(node, inner) {
        description = format!("{description} {}", text(inner, "description").unwrap_or_default());
    }
    let examples = node["examples"].as_array().map_or(&[][..], Vec::as_slice);
    let name = path.rsplit('.').next().unwrap_or(path);
    Entry {
        path: path.into(),
        word: None,
        table: table.into(),
        description: description.trim().into(),
        kinds: kinds(node),
        words: words(node),
        unit: text(node, "x-unit").filter(|unit| unit != "none"),
        default: node.get("default").map(to_toml),
        examples: examples.iter().map(|example| format!("{name} = {}", to_toml(example))).collect(),
        keys: inner["properties"].as_object().map_or(Vec::new(), |keys| keys.keys().cloned().collect()),
        required,
    }
}

impl Entry {
    /// The key, without its table.
    pub fn key(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or(&self.path)
    }

    /// The entry of a word that is a value of this key.
    fn of_word(&self, word: &str) -> Option<Self> {
        if !self.words.iter().any(|known| known == word) {
            return None;
        }
        let quoted = format!("\"{word}\"");
        let value = if self.kinds == "list" { format!("[{quoted}]") } else { quoted.clone() };
        let warning = WarningKind::of(word).filter(|_| self.path == "expect.warns");
        Some(Self {
            word: Some(word.into()),
            description: warning.map_or_else(|| self.clause(word), describe_warning),
            kinds: String::new(),
            words: Vec::new(),
            unit: None,
            default: self.default.clone().filter(|default| *default == quoted),
            examples: vec![format!("{} = {value}", self.key())],
            keys: Vec::new(),
            required: false,
            ..self.clone()
        })
    }

    /// The part of the description that is about a word (`word`: …), else all of it.
    fn clause(&self, word: &str) -> String {
        let begin = |word: &str| self.description.find(&format!("`{word}`: "));
        let Some(start) = begin(word) else { return self.description.clone() };
        let ends = self.words.iter().filter_map(|other| begin(other)).filter(|end| *end > start);
        let end = ends.min().unwrap_or(self.description.len());
        let head = format!("`{word}`: ");
        let clause = self.description[start + head.len()..end].trim();
        let mut letters = clause.chars();
        letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
    }
}

fn describe_warning(kind: WarningKind) -> String {
    format!("A warning about `{}`. {}", kind.about().name(), kind.meaning())
}

/// The words that a key takes, alone or in a list.
fn words(node: &Value) -> Vec<String> {
    let listed = [&node["enum"], &node["items"]["enum"]];
    let listed = listed.into_iter().filter_map(Value::as_array).flatten().filter_map(Value::as_str).map(str::to_string);
    let mut all: Vec<String> = listed.collect();
    let pattern = node["pattern"].as_str().and_then(|text| text.strip_prefix("^(")?.strip_suffix(")$"));
    let alternatives = pattern.into_iter().flat_map(|text| text.split('|')).map(str::to_string);
    all.extend(alternatives.filter(|word| word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')));
    all.sort();
    all.dedup();
    all
}

fn kinds(node: &Value) -> String {
    if let Some(words) = node["enum"].as_array() {
        return words.iter().map(to_toml).collect::<Vec<_>>().join(", ");
    }
    let listed = match &node["type"] {
        Value::String(one) => vec![one.as_str()],
        several => several.as_array().map_or(Vec::new(), |all| all.iter().filter_map(Value::as_str).collect()),
    };
    let numeric = listed.iter().any(|kind| ["number", "integer"].contains(kind));
    let word = |kind: &&str| {
        match *kind {
            "integer" => "whole number",
            "string" if numeric => "expression",
            "string" => "text",
            "array" => "list",
            "object" => "table",
            "boolean" => "true or false",
            other => return other.to_string(),
        }
        .to_string()
    };
    listed.iter().map(word).collect::<Vec<_>>().join(", ")
}

/// A value of JSON as TOML.
fn to_toml(value: &Value) -> String {
    match value {
        Value::Array(all) => format!("[{}]", all.iter().map(to_toml).collect::<Vec<_>>().join(", ")),
        Value::Object(all) => {
            let pairs = all.iter().map(|(key, value)| format!("{key} = {}", to_toml(value)));
            format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::{
        self, EffectWord, Frame, InterpolationWord, NormWord, Reduction, SchemeName, StationsWord, Words,
    };
    use beamsim_core::effect::joint::JointKind;
    use beamsim_core::failure::FailureKind;
    use beamsim_core::system::StageKind;
    use beamsim_core::warning::WarningKind;

    /// Keys of every table with a fixed set of them, by the path of the table in the schema.
    fn tables() -> Vec<(&'static str, Vec<&'static str>)> {
        vec![
            ("", deck::KEYS.to_vec()),
            ("beam", deck::beam::KEYS.to_vec()),
            ("beam.history", deck::history::USE_KEYS.to_vec()),
            ("beam.helix", deck::beam::HELIX_KEYS.to_vec()),
            ("beam.section", vec!["csv"]),
            ("beam.spline", vec!["csv"]),
            ("beam.through", vec!["csv"]),
            ("body", deck::body::KEYS.to_vec()),
            ("contact", deck::contact::KEYS.to_vec()),
            ("cost", deck::cost::KEYS.to_vec()),
            ("damping", deck::damping::KEYS.to_vec()),
            ("effects", EffectWord::words().collect()),
            ("expect", deck::expect::KEYS.to_vec()),
            ("expect.at", deck::expect::AT_KEYS.to_vec()),
            ("history", deck::history::KEYS.to_vec()),
            ("initial", deck::initial::KEYS.to_vec()),
            ("joint", deck::joint::KEYS.to_vec()),
            ("joint.history", deck::history::USE_KEYS.to_vec()),
            ("layup", deck::layup::KEYS.to_vec()),
            ("load", deck::load::KEYS.to_vec()),
            ("load.history", deck::history::USE_KEYS.to_vec()),
            ("material", deck::material::KEYS.to_vec()),
            ("material.strength", deck::material::STRENGTH_KEYS.to_vec()),
            ("mesh", deck::mesh_file::KEYS.to_vec()),
            ("motion", deck::motion::KEYS.to_vec()),
            ("motion.history", deck::history::USE_KEYS.to_vec()),
            ("output", deck::output::KEYS.to_vec()),
            ("section", deck::section::KEYS.to_vec()),
            ("section.mesh", deck::section_shape::MESH_KEYS.to_vec()),
            ("section.outline", vec!["csv"]),
            ("section.profile", vec!["csv"]),
            ("section.region", deck::section_shape::outline::REGION_KEYS.to_vec()),
            ("section.region.circle", deck::section_shape::outline::CIRCLE_KEYS.to_vec()),
            ("section.region.outline", vec!["csv"]),
            ("section.skin", deck::section_shape::airfoil::SKIN_KEYS.to_vec()),
            ("section.webs", deck::section_shape::airfoil::WEB_KEYS.to_vec()),
            ("slider", deck::slider::KEYS.to_vec()),
            ("slider.history", deck::history::USE_KEYS.to_vec()),
            ("spring", deck::spring::KEYS.to_vec()),
            ("stage", deck::stage::KEYS.to_vec()),
            ("stage.frame", deck::stage::FRAME_KEYS.to_vec()),
            ("stage.until", deck::stage::UNTIL_KEYS.to_vec()),
            ("support", deck::support::KEYS.to_vec()),
            ("surface", deck::surface::KEYS.to_vec()),
            ("surface.history", deck::history::USE_KEYS.to_vec()),
            ("surface.through", vec!["csv"]),
            ("units", deck::units::KEYS.to_vec()),
        ]
    }

    fn words<W: Words>() -> Vec<String> {
        W::words().map(str::to_string).collect()
    }

    /// Words of every key with a fixed set of them, by the path of the key in the schema.
    fn words_of_keys() -> Vec<(&'static str, Vec<String>)> {
        let warnings = WarningKind::ALL.iter().map(|kind| kind.name().to_string());
        vec![
            ("beam.interpolation", words::<InterpolationWord>()),
            ("contact.ends", words::<deck::EndsWord>()),
            ("surface.kind", words::<deck::SurfaceWord>()),
            ("surface.side", words::<deck::SideWord>()),
            ("beam.stations_in", words::<StationsWord>()),
            ("cost.interpolation", words::<InterpolationWord>()),
            ("cost.norm", words::<NormWord>()),
            ("cost.scheme", words::<SchemeName>()),
            ("expect.fails", words::<FailureKind>()),
            ("expect.reduce", words::<Reduction>()),
            ("expect.warns", warnings.chain(["false".to_string()]).collect()),
            ("joint.kind", words::<JointKind>()),
            ("load.frame", words::<Frame>()),
            ("section.corner", words::<deck::CornerWord>()),
            ("section.le", words::<deck::LeadingEdgeWord>()),
            ("section.shape", words::<deck::ShapeWord>()),
            ("section.side", words::<deck::WallSideWord>()),
            ("section.skin.side", words::<deck::SkinSideWord>()),
            ("section.te", words::<deck::TrailingEdgeWord>()),
            ("section.theta_sense", words::<deck::ThetaSenseWord>()),
            ("section.webs.normal", words::<deck::section_shape::airfoil::WebNormalWord>()),
            ("stage.control", words::<deck::stage::ControlWord>()),
            ("stage.kind", words::<StageKind>()),
            ("stage.scheme", words::<SchemeName>()),
            ("support.fix", words::<deck::support::DirectionWord>()),
        ]
    }

    fn sorted<T: Ord>(mut list: Vec<T>) -> Vec<T> {
        list.sort();
        list
    }

    /// Visits every node of the schema that stands for a table or a key: its path, and the node of
    /// its entries.
    fn visit(node: &Value, path: &str, see: &mut dyn FnMut(&str, &Value)) {
        let (inner, _) = inside(node, path, path);
        see(path, inner);
        for (key, below) in inner["properties"].as_object().into_iter().flatten() {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            visit(below, &path, see);
        }
    }

    #[test]
    fn the_schema_has_the_keys_of_every_reader() {
        let schema: Value = serde_json::from_str(SCHEMA).unwrap();
        let mut tables = tables();
        visit(&schema, "", &mut |path, node| {
            let Some(properties) = node["properties"].as_object() else { return };
            let found = tables.iter().position(|(table, _)| *table == path);
            let (_, keys) = tables.swap_remove(found.unwrap_or_else(|| panic!("no reader has the table `{path}`")));
            let keys: Vec<String> = keys.into_iter().map(str::to_string).collect();
            assert_eq!(sorted(properties.keys().cloned().collect()), sorted(keys), "`{path}`");
        });
        assert!(tables.is_empty(), "tables that the schema lacks: {tables:?}");
    }

    #[test]
    fn the_schema_has_the_words_of_every_reader() {
        let schema: Value = serde_json::from_str(SCHEMA).unwrap();
        let mut all = words_of_keys();
        // Columns are words of the scene.
        all.push(("output.columns", Vec::new()));
        visit(&schema, "", &mut |path, node| {
            let listed = node["enum"].as_array().or(node["items"]["enum"].as_array());
            let Some(listed) = listed else { return };
            let plain = |word: &Value| word.as_str().map_or(word.to_string(), str::to_string);
            let listed: Vec<String> = listed.iter().map(plain).collect();
            let found = all.iter().position(|(key, _)| *key == path);
            let (_, words) = all.swap_remove(found.unwrap_or_else(|| panic!("no reader has words for `{path}`")));
            assert!(words.is_empty() || sorted(listed) == sorted(words), "the words of `{path}`");
        });
        assert!(all.is_empty(), "keys whose words the schema lacks: {all:?}");
    }

    /// Words that may stand alone or in a list are in a pattern, too.
    #[test]
    fn patterns_of_words_are_those_of_the_readers() {
        let schema: Value = serde_json::from_str(SCHEMA).unwrap();
        let alternatives = |words: Vec<String>| format!("^({})$", words.join("|"));
        let pattern = |table: &str, key: &str| {
            let (table, _) = inside(&schema["properties"][table], table, table);
            table["properties"][key]["pattern"].as_str().unwrap_or_default().to_string()
        };
        let fix = [words::<deck::support::DirectionsWord>(), words::<deck::support::DirectionWord>()].concat();
        assert_eq!(pattern("support", "fix"), alternatives(fix));
        let section = &schema["properties"]["section"]["additionalProperties"]["properties"];
        let reference = section["reference"]["pattern"].as_str().unwrap_or_default();
        assert_eq!(reference, alternatives(words::<deck::ReferenceWord>()));
        assert_eq!(pattern("cost", "scheme"), alternatives(words::<SchemeName>()));
        assert_eq!(pattern("cost", "interpolation"), alternatives(words::<InterpolationWord>()));
    }

    #[test]
    fn keys_are_explained_wherever_they_stand() {
        let one = |word: &str| explain(word).remove(0);
        let elements = one("beam.elements");
        assert_eq!((elements.table.as_str(), elements.unit.as_deref()), ("[[beam]]", None));
        assert!(elements.kinds.contains("whole number") && elements.examples[0] == "elements = 10");
        assert_eq!(one("section.rhoA").unit.as_deref(), Some("mass/length"));
        assert!(one("[[stage]]").keys.contains(&"until".into()) && one("until.below").path == "stage.until.below");
        assert!(["moment", "history"].into_iter().all(|word| !explain(word).is_empty()));
        for (word, meant) in [("elemnts", Some("elements")), ("dt", Some("step")), ("hinge", Some("revolute"))] {
            assert_eq!((explain(word), similar(word, &[]).meant()), (Vec::new(), meant));
        }
        assert_eq!(similar("xylophone", &[]), Hint::None);
    }

    #[test]
    fn every_word_is_explained() {
        let mut count = 0;
        for (path, words) in words_of_keys() {
            for word in words.into_iter().filter(|word| word != "false") {
                let found = explain(&word).into_iter().find(|entry| entry.path == path && entry.word.is_some());
                let entry = found.unwrap_or_else(|| panic!("`{word}` of {path} is not explained"));
                assert!(
                    !entry.description.is_empty() && entry.examples[0].contains(&format!("\"{word}\"")),
                    "{entry:?}"
                );
                count += 1;
            }
        }
        assert!(count > 80, "{count}");
        let word = |name: &str, path: &str| explain(name).into_iter().find(|entry| entry.path == path).unwrap();
        let cylindrical = word("cylindrical", "joint.kind").description;
        assert!(cylindrical.starts_with("The sliding along `axis`") && cylindrical.ends_with("with a body between."));
        let quaternion = word("q", "output.columns");
        assert_eq!(quaternion.description, "Unit quaternion of the rotation.");
        assert_eq!(quaternion.examples, ["columns = [\"q\"]"]);
        assert!(word("limit_point", "expect.warns").description.starts_with("A warning about `path`. "));
        assert_eq!(word("newmark", "stage.scheme").default.as_deref(), Some("\"newmark\""));
    }

    #[test]
    fn everything_is_described_with_an_example() {
        for entry in entries() {
            assert!(!entry.description.is_empty() && !entry.examples.is_empty(), "{}", entry.path);
        }
    }
}
