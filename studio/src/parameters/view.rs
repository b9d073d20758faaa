//! How values of parameters are shown and typed.

use serde::{Deserialize, Serialize};

use super::types::{ParameterPlace, ParameterSetting};

/// In which units values are shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum ParameterUnits {
    /// In those of the module.
    Module,
    /// In turns and milliamperes.
    Physical,
    /// In one of the user's.
    Own(OwnUnit),
}

/// A unit of the user's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnUnit {
    /// The name of the unit.
    pub name: String,
    /// Number of microsteps that one has.
    pub microsteps: f64,
}

/// How values of an axis, or global ones, are shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterView {
    /// The product; null for one that is not known.
    pub product: Option<String>,
    /// The values of the axis that are known, on which the meaning of the others depends.
    pub known: Vec<ParameterSetting>,
    /// Full steps per turn of its motor; null for the usual one.
    pub steps: Option<u16>,
    /// The units.
    pub units: ParameterUnits,
}

/// Values that are to be shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersShow {
    /// How.
    pub view: ParameterView,
    /// The values.
    pub settings: Vec<ParameterSetting>,
}

/// A value as it is shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterText {
    /// The value.
    pub text: String,
    /// The unit of the value; empty where a number speaks for itself.
    pub unit: String,
}

/// Values as they are shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterTexts {
    /// The texts, one for each value that was to be shown.
    pub texts: Vec<ParameterText>,
}

/// A text that was typed for a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterTyped {
    /// How values are shown.
    pub view: ParameterView,
    /// Where the parameter is.
    pub place: ParameterPlace,
    /// The text.
    pub text: String,
}

#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use serde_json::json;
    let place = ParameterPlace { bank: super::types::ParameterBank::Axis, number: 4, axis: 0 };
    let setting = ParameterSetting { place, value: 1000 };
    let own = OwnUnit { name: "mm".into(), microsteps: 12_800.0 };
    let view = ParameterView {
        product: Some("1140".into()),
        known: vec![setting],
        steps: Some(200),
        units: ParameterUnits::Own(own.clone()),
    };
    let text = ParameterText { text: "1".into(), unit: "mm/s".into() };
    vec![
        ("OwnUnit", json!(own)),
        ("ParameterView", json!(view)),
        ("ParameterView", json!(ParameterView { product: None, steps: None, ..view.clone() })),
        ("ParametersShow", json!(ParametersShow { view: view.clone(), settings: vec![setting] })),
        ("ParameterText", json!(text)),
        ("ParameterTexts", json!(ParameterTexts { texts: vec![text] })),
        ("ParameterTyped", json!(ParameterTyped { view, place, text: "60 rpm".into() })),
        ("ParameterUnits", json!(ParameterUnits::Module)),
        ("ParameterUnits", json!(ParameterUnits::Physical)),
        ("ParameterUnits", json!(ParameterUnits::Own(own))),
    ]
}
