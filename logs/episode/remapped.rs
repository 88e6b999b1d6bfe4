//! Applies other mappings of the columns to a log that was already read.

use asid_core::layout::Layout;
use asid_core::{Episode, Result};

use super::mapping::{ColumnMapping, Source};
use super::reader::count_turns;
use super::turns::Angle;
use super::{delay, entry_name};

/// The log with other mappings of its columns.
///
/// Factor, offset and delay of the mappings apply to the quantities as they were read, and `from`
/// names the quantity that a column holds. The turns of these `angles` are counted.
///
/// # Errors
/// When a mapping names something that the scene does not have.
pub fn remapped(
    episode: &Episode,
    layout: &Layout,
    (mappings, angles): (&[ColumnMapping], &[Angle]),
) -> Result<Episode> {
    mappings.iter().try_for_each(|m| m.check(layout))?;
    let mut out = episode.clone();
    let width = episode.width();
    let mut late = Vec::with_capacity(width);
    let places: Vec<String> = (episode.channels.iter())
        .flat_map(|c| (0..c.len).map(|i| entry_name(&c.name, c.len, i)))
        .collect();
    let mut at = 0;
    for channel in &episode.channels {
        for i in 0..channel.len {
            let source = Source::of(mappings, &channel.name, (channel.len > 1).then_some(i));
            let from = places
                .iter()
                .position(|p| *p == source.column)
                .unwrap_or(at);
            for k in 0..episode.rows() {
                let x = episode.readings[k * width + from];
                out.readings[k * width + at] = source.factor * x + source.offset;
            }
            late.push(source.delay);
            at += 1;
        }
    }
    let nu = episode.actuators.len();
    let mut commands = Vec::with_capacity(nu);
    for (a, name) in episode.actuators.iter().enumerate() {
        let source = Source::of(mappings, &format!("ctrl.{name}"), None);
        let held = |n: &String| format!("ctrl.{n}") == source.column;
        let from = episode.actuators.iter().position(held).unwrap_or(a);
        for k in 0..episode.rows() {
            let x = episode.ctrl[k * nu + from];
            out.ctrl[k * nu + a] = source.factor * x + source.offset;
        }
        commands.push(source.delay);
    }
    count_turns(&mut out, angles);
    delay::readings(&mut out, layout, &late);
    delay::commands(&mut out, &commands);
    Ok(out)
}
