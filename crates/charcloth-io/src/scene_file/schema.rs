//! The JSON Schema of scene files, by which editors check and complete them.

use charcloth::scene::{Expect, Probe, Scene};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, SchemaGenerator};
use serde_json::Value;
use std::collections::BTreeMap;

/// Values by dotted key, such as `"sheet.spacing"`; numbers index arrays.
type Overrides = BTreeMap<String, Value>;

/// One of several variants of a scene in one file.
#[derive(JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)] // the reader works on the tree; this is its shape for the schema
struct CaseRow {
    /// Name of the case.
    name: Option<String>,
    /// What differs from the rest of the file, by dotted key.
    set: Option<Overrides>,
    /// Expectations of this case, besides those of the file.
    expect: Option<Vec<Expect>>,
    /// Probes of this case, besides those of the file.
    probe: Option<Vec<Probe>>,
    /// What makes the checks of this case fail, by dotted key.
    falsify: Option<Overrides>,
}

/// What a file may have besides the scene.
#[derive(JsonSchema)]
#[allow(dead_code)]
struct Besides {
    /// Variants of the scene; without any, the file is one case.
    case: Option<Vec<CaseRow>>,
    /// What must make the checks fail, by dotted key; `charcloth check --falsify` applies it.
    falsify: Option<Overrides>,
}

/// The JSON Schema (draft 7, which TOML editors read) of a scene file.
pub fn schema() -> String {
    let mut generator: SchemaGenerator = SchemaSettings::draft07().into_generator();
    let besides = serde_json::to_value(generator.subschema_for::<Besides>()).unwrap_or_default();
    debug_assert!(besides.get("$ref").is_some(), "besides is a definition of its own");
    let mut schema = serde_json::to_value(generator.into_root_schema_for::<Scene>()).unwrap_or_default();
    let besides = schema.pointer("/definitions/Besides/properties").cloned();
    if let (Some(Value::Object(besides)), Some(Value::Object(properties))) = (besides, schema.get_mut("properties")) {
        properties.extend(besides);
    }
    if let Some(Value::Object(definitions)) = schema.get_mut("definitions") {
        definitions.remove("Besides");
    }
    schema["title"] = Value::from("Charcloth scene");
    serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
}
