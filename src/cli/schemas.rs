//! The layouts of `result.json`, one for each kind of result. Types of other languages are
//! generated from them.

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};

use asid_comparison::rows::ComparisonResult;
use asid_results::diagnosis::DiagnosisResult;

use super::{explore, identify, machine, result};

/// The layouts as JSON schemas: of `run`, of `explore` and `identify` for a task and for a machine,
/// of `diagnose` and of `compare`.
///
/// The title of each is the name of its type, which no other type in any of them shares.
#[must_use]
pub fn all() -> Vec<Schema> {
    vec![
        layout::<result::RunResult>(),
        layout::<explore::ExploreResult>(),
        layout::<machine::explore::ExploreResult>(),
        layout::<identify::IdentifyResult>(),
        layout::<machine::identify::IdentifyResult>(),
        layout::<DiagnosisResult>(),
        layout::<ComparisonResult>(),
    ]
}

/// The schema of a type in its serialised form.
fn layout<T: JsonSchema>() -> Schema {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    settings.into_generator().into_root_schema_for::<T>()
}
