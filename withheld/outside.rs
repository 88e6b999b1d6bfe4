//! Machines that other authors modelled: files in a folder, as `withheld/models/fetch.py` leaves
//! them.
//!
//! Only the model of such a machine is known. Its sensors have their usual noise, and commands
//! cover a part of its actuators' range. Its owner fits nothing, and none of its contacts is a
//! site. Meshes are left out. The rules for all cases leave out a motion that diverges or cannot be
//! repeated.

mod length;
mod meshes;
mod starts;

use std::path::Path;

use crate::anatomy::Anatomy;
use crate::document::Element;
use crate::engine;
use crate::error::{Error, Result};
use crate::machine::{Command, Half, Machine};

/// Noise by sensor: angles and orientations in rad, lengths in m.
const NOISE: [(&str, f64); 3] = [
    ("jointpos", 0.003),
    ("framepos", 0.003),
    ("framequat", 0.006),
];
/// Share of an actuator's range that its commands cover.
const DRIVEN: f64 = 0.4;
/// Range of an actuator that states none.
const RANGE: [f64; 2] = [-1.0, 1.0];
/// Band of commands, Hz.
const BAND: [f64; 2] = [0.3, 2.0];
/// Rows per second.
const RATE: f64 = 100.0;

/// What a folder of models contains.
pub struct Outside {
    /// Machines, sorted by the names of their files; they live as long as the program.
    pub machines: Vec<&'static Machine>,
    /// Reasons why models cannot become machines: one sentence each, which names the element.
    pub refused: Vec<String>,
}

/// Reads the models of a half.
///
/// # Errors
/// If a file cannot be read.
pub fn read(folder: &Path, half: Half) -> Result<Outside> {
    let folder = folder.join(half.name());
    let failed = |path: &Path, message: String| Error::File {
        path: path.to_owned(),
        message,
    };
    let entries = std::fs::read_dir(&folder).map_err(|e| failed(&folder, e.to_string()))?;
    let mut paths: Vec<_> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "xml"));
    paths.sort();
    let (mut machines, mut refused) = (Vec::new(), Vec::new());
    for path in &paths {
        let text = std::fs::read_to_string(path).map_err(|e| failed(path, e.to_string()))?;
        match machine(&text, half) {
            Ok(one) => machines.push(one),
            Err(error) => refused.push(failed(path, error.to_string()).to_string()),
        }
    }
    Ok(Outside { machines, refused })
}

/// A text that lives as long as the program.
fn keep(text: &str) -> &'static str {
    Box::leak(text.to_owned().into_boxed_str())
}

/// Makes a machine of a model.
///
/// # Errors
/// If MuJoCo refuses the model, or if the generator cannot start or read one of its elements.
pub fn machine(text: &str, half: Half) -> Result<&'static Machine> {
    let unfit = |why: String| Error::Unfit { why };
    let mut document = Element::parse(text).map_err(unfit)?;
    meshes::leave_out(&mut document).map_err(unfit)?;
    check(&document).map_err(unfit)?;
    let sensors = document
        .find("sensor", None)
        .map_or(&[][..], |s| &s.children);
    let noise: Vec<(&'static str, f64)> = sensors
        .iter()
        .filter_map(|s| {
            let (_, noise) = NOISE.iter().find(|(kind, _)| *kind == s.tag)?;
            Some((keep(s.get("name")?), *noise))
        })
        .collect();
    let bare = Machine {
        name: keep(document.get("model").unwrap_or("outside")),
        about: "a model that others wrote",
        half,
        model: keep(&document.text()),
        parameters: &[],
        noise: noise.leak(),
        commands: &[],
        starts: &[],
        contacts: &[],
        seconds: 0.0,
        rate: RATE,
    };
    let anatomy = Anatomy::of(&bare)?;
    let model = engine::compile(bare.model).map_err(unfit)?;
    let starts = starts::of(&anatomy, &model);
    let actuators = document
        .find("actuator", None)
        .map_or(&[][..], |s| &s.children);
    let commands: Vec<Command> = actuators
        .iter()
        .map(|e| {
            let [low, high] = match e.numbers("ctrlrange")[..] {
                [low, high] if low < high => [low, high],
                _ => RANGE,
            };
            Command {
                actuator: keep(e.get("name").unwrap_or_default()),
                center: (low + high) / 2.0,
                amplitude: DRIVEN * (high - low) / 2.0,
                band: BAND,
            }
        })
        .collect();
    let driven = Machine {
        starts: starts.leak(),
        commands: commands.leak(),
        ..bare
    };
    let made = Machine {
        seconds: length::of(&Anatomy::of(&driven)?),
        ..driven
    };
    Ok(Box::leak(Box::new(made)))
}

/// Refuses an element that the generator does not support; the message names it.
fn check(document: &Element) -> Result<(), String> {
    let mut wrong = None;
    document.walk(&mut |e, body| {
        let name = e.get("name").unwrap_or("without a name");
        let why = match (e.tag.as_str(), e.get("type")) {
            ("joint", Some("ball")) => "is a ball joint, whose start the generator cannot write",
            ("geom", Some("hfield")) => "is a height field, whose file the generator does not copy",
            ("muscle" | "adhesion" | "plugin", _) => "is an actuator with a law of its own",
            ("flexcomp" | "composite" | "replicate" | "attach", _) => "is made by a macro",
            _ => return,
        };
        wrong.get_or_insert_with(|| format!("<{}> `{name}` in body `{body}` {why}", e.tag));
    });
    if document
        .find("sensor", None)
        .is_none_or(|s| s.children.is_empty())
    {
        wrong.get_or_insert_with(|| {
            "<sensor> lists no sensor, so that there is nothing to log".into()
        });
    }
    wrong.map_or(Ok(()), Err)
}
