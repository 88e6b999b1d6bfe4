//! Hypotheses about the wiring: other views of the columns that are compared with the given one.

use asid_core::layout::JointKind;
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

use super::view::{ColumnView, View};

/// Largest delay of readings relative to commands that is searched for, s.
///
/// It is that of a control stack with network buffers. A clock that fits later readings better is
/// not named.
pub const LATEST: f64 = 0.2;
/// Step between the delays that are tried, s.
const DELAY_STEP: f64 = 0.02;
/// Smallest delay, s: it is negative because the stamps of commands may be late as well.
pub const EARLIEST: f64 = -0.06;

/// A degree, rad.
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Kinds of wiring faults, by the names of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Two columns are swapped.
    Swapped,
    /// A column has the wrong sign.
    Sign,
    /// A column is in another unit.
    Unit,
    /// A column has another zero.
    Offset,
    /// Commands and readings are stamped by clocks that differ.
    Clock,
}

impl Fault {
    /// Name in the result.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Swapped => "wiring-swapped",
            Self::Sign => "wiring-sign",
            Self::Unit => "wiring-unit",
            Self::Offset => "wiring-offset",
            Self::Clock => "wiring-clock",
        }
    }

    /// Whether effects can look like this fault.
    ///
    /// Friction holds a drive back as a late clock does, and a load shifts it as another zero does.
    /// Nothing looks like a wrong sign, a unit or a swap.
    #[must_use]
    pub fn is_imitable(self) -> bool {
        matches!(self, Self::Offset | Self::Clock)
    }
}

/// One column of readings or commands.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Name of the sensor or `ctrl.<actuator>`, with `.i` for an entry of a vector.
    pub name: String,
    /// Name without the entry.
    pub whole: String,
    /// Whether it is a command.
    pub command: bool,
    /// Index in a row of readings or commands.
    pub place: usize,
    /// Joint that it reads or drives, if it belongs to one.
    pub joint: Option<usize>,
    /// Kind of quantity: columns of the same kind can be swapped.
    pub kind: String,
    /// Units in which it may be recorded, each with its factor to the model's unit.
    pub units: Vec<(&'static str, f64)>,
}

/// A hypothesis: a view, and the fault that it stands for.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    /// Kind of fault.
    pub fault: Fault,
    /// Indices of the quantities concerned.
    pub quantities: Vec<usize>,
    /// Whether hardly any log has this fault.
    pub rare: bool,
    /// Whether it combines several faults, each of which alone makes no sense.
    pub compound: bool,
    /// How the columns are read.
    pub view: View,
}

/// Units in which a quantity of an SI unit may be recorded, with their factors, the usual one
/// first.
///
/// The name is empty if no unit has the factor.
fn units(si: &str) -> Vec<(&'static str, f64)> {
    match si {
        // Radians may have been converted from degrees a second time.
        "rad" => vec![
            ("deg", DEGREE),
            ("", 1.0 / DEGREE),
            ("rev", std::f64::consts::TAU),
        ],
        "rad/s" => vec![
            ("deg/s", DEGREE),
            ("", 1.0 / DEGREE),
            ("rpm", std::f64::consts::TAU / 60.0),
        ],
        "m" => vec![("mm", 1e-3), ("cm", 1e-2)],
        "m/s" => vec![("mm/s", 1e-3), ("cm/s", 1e-2)],
        "m/s²" => vec![("g", 9.806_65)],
        "N" => vec![("mN", 1e-3)],
        "N m" => vec![("mN m", 1e-3)],
        _ => Vec::new(),
    }
}

/// Returns the quantities of a row of readings of some sensors, and of a row of commands.
#[must_use]
pub fn quantities(plant: &Plant, sensors: &[String]) -> Vec<Quantity> {
    let layout = &plant.layout;
    let mut all = Vec::new();
    let mut place = 0;
    for name in sensors {
        let Some(index) = layout.sensors.iter().position(|s| s.name == *name) else {
            continue;
        };
        let sensor = &layout.sensors[index];
        let slide = matches!(plant.sensors[index], Reads::Joint(j)
            if layout.joints[j].kind == JointKind::Slide);
        let si = match (&*sensor.kind, slide) {
            ("jointpos", true) => "m",
            ("jointpos", false) => "rad",
            ("jointvel", true) => "m/s",
            ("jointvel", false) => "rad/s",
            _ => sensor.unit(),
        };
        for i in 0..sensor.len {
            let entry = if sensor.len == 1 {
                name.clone()
            } else {
                format!("{name}.{i}")
            };
            // Entries of one vector may be swapped among themselves; entries of two vectors seldom
            // are.
            let kind = if sensor.len == 1 {
                format!("{} {si}", sensor.kind)
            } else {
                format!("{} of {name}", sensor.kind)
            };
            all.push(Quantity {
                name: entry,
                whole: name.clone(),
                command: false,
                place: place + i,
                joint: match plant.sensors[index] {
                    Reads::Joint(j) => Some(j),
                    _ => None,
                },
                kind,
                units: if sensor.len == 4 {
                    Vec::new()
                } else {
                    units(si)
                },
            });
        }
        place += sensor.len;
    }
    for (a, actuator) in layout.actuators.iter().enumerate() {
        let si = plant.drives[a].filter(|d| d.is_position_servo()).map(|d| {
            match layout.joints[d.joint].kind {
                JointKind::Slide => "m",
                _ => "rad",
            }
        });
        let name = format!("ctrl.{}", actuator.name);
        all.push(Quantity {
            whole: name.clone(),
            name,
            command: true,
            place: a,
            joint: plant.drives[a].map(|d| d.joint),
            kind: format!("command {}", si.unwrap_or_default()),
            units: si.map_or_else(Vec::new, units),
        });
    }
    all
}

/// Returns the view of one quantity within a view of all.
#[must_use]
pub fn view_of(view: &View, quantity: &Quantity) -> ColumnView {
    if quantity.command {
        view.commands[quantity.place]
    } else {
        view.readings[quantity.place]
    }
}

/// Returns the view with one quantity's view replaced.
#[must_use]
pub fn with(view: &View, quantity: &Quantity, of: ColumnView) -> View {
    let mut view = view.clone();
    if quantity.command {
        view.commands[quantity.place] = of;
    } else {
        view.readings[quantity.place] = of;
    }
    view
}

/// Hypotheses about signs, units and names of columns, at least one of them among `suspects`.
#[must_use]
pub fn of_columns(all: &[Quantity], view: &View, suspects: &[bool]) -> Vec<Hypothesis> {
    let mut found = Vec::new();
    for (i, a) in all.iter().enumerate() {
        let own = view_of(view, a);
        if suspects[i] {
            let mut one = |fault, of| {
                found.push(Hypothesis {
                    fault,
                    quantities: vec![i],
                    rare: false,
                    compound: false,
                    view: with(view, a, of),
                });
            };
            one(Fault::Sign, own.times(-1.0));
            // All entries of a vector have the same unit.
            let vector: Vec<usize> = (0..all.len())
                .filter(|&j| all[j].whole == a.whole)
                .collect();
            for (k, (_, factor)) in a.units.iter().enumerate().filter(|_| vector[0] == i) {
                let scaled = vector.iter().fold(view.clone(), |view, &j| {
                    let own = view_of(&view, &all[j]);
                    with(&view, &all[j], own.times(*factor))
                });
                found.push(Hypothesis {
                    fault: Fault::Unit,
                    quantities: vector.clone(),
                    // The usual unit comes first.
                    rare: k > 0,
                    compound: false,
                    view: scaled,
                });
            }
        }
        for (j, b) in all.iter().enumerate().skip(i + 1) {
            if a.kind == b.kind && (suspects[i] || suspects[j]) {
                found.push(swapped(view, [(i, a), (j, b)], [1.0, 1.0]));
                // One of two swapped encoders may be mounted the other way round: then neither
                // fault alone makes sense.
                if !a.command && suspects[i] && suspects[j] {
                    let signs = [[1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
                    found.extend(signs.map(|signs| swapped(view, [(i, a), (j, b)], signs)));
                }
            }
        }
    }
    found
}

/// Swaps the columns of two quantities, each times a sign.
fn swapped(view: &View, [(i, a), (j, b)]: [(usize, &Quantity); 2], signs: [f64; 2]) -> Hypothesis {
    let (from_a, from_b) = (view_of(view, a), view_of(view, b));
    let first = with(view, a, from_b.times(signs[0]));
    let compound = signs != [1.0, 1.0];
    Hypothesis {
        fault: Fault::Swapped,
        quantities: vec![i, j],
        rare: compound,
        compound,
        view: with(&first, b, from_a.times(signs[1])),
    }
}

/// Returns the view with all readings delayed by some time, s.
#[must_use]
pub fn delayed(view: &View, delay: f64) -> View {
    let mut view = view.clone();
    view.readings.iter_mut().for_each(|v| v.delay += delay);
    view
}

/// Returns the view with all commands delayed by some time, s.
#[must_use]
pub fn commanded_later(view: &View, delay: f64) -> View {
    let mut view = view.clone();
    view.commands.iter_mut().for_each(|v| v.delay += delay);
    view
}

/// Delays of readings relative to commands that are tried, s.
#[must_use]
pub fn delays() -> Vec<f64> {
    let steps = |to: f64| (to / DELAY_STEP).round() as i32;
    (steps(EARLIEST)..=steps(LATEST))
        .filter(|k| *k != 0)
        .map(|k| f64::from(k) * DELAY_STEP)
        .collect()
}
