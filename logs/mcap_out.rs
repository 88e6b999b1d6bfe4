//! Writes logs as MCAP for Foxglove, Rerun and PlotJuggler: messages of ROS 2 with their
//! definitions.
//!
//! Positions and speeds of joints are `sensor_msgs/msg/JointState` with the joints' names, on
//! `/joint_states`. Every other column is `std_msgs/msg/Float64` on a topic of its name. A missing
//! reading has no message.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use crate::raw::RawLog;
use crate::ros::cdr::Encoder;
use crate::series::Series;

/// Nanoseconds in a second.
const SECOND: f64 = 1e9;
/// Definitions of the written messages, in MCAP's `ros2msg` format.
///
/// From common_interfaces of ROS 2; Apache License 2.0.
const JOINT_STATE: &str = include_str!("ros/joint_state.msg");
const FLOAT: &str = "float64 data\n";

/// The columns of a joint.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct JointColumns {
    /// Name of the joint.
    pub joint: String,
    /// Column of its position.
    pub position: Option<String>,
    /// Column of its speed.
    pub velocity: Option<String>,
}

/// Writes a log; times count from its start, which is 0 ns.
///
/// # Errors
/// When `file` cannot be written.
pub fn write(
    file: impl Write + Seek,
    log: &RawLog,
    joints: &[JointColumns],
) -> Result<(), McapError> {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .profile("ros2")
        .library("asid")
        .create(file)?;
    let mut messages: Vec<Message> = Vec::new();
    let states = states(log, joints);
    if !states.is_empty() {
        let channel = channel(
            &mut writer,
            "/joint_states",
            "sensor_msgs/msg/JointState",
            JOINT_STATE,
        )?;
        messages.extend(states.into_iter().map(|(stamp, state)| Message {
            stamp,
            channel,
            data: state.encoded(stamp),
        }));
    }
    let of_joints = |name: &str| {
        let own = |column: &Option<String>| column.as_deref() == Some(name);
        joints.iter().any(|j| own(&j.position) || own(&j.velocity))
    };
    for series in log.series.iter().filter(|s| !of_joints(&s.name)) {
        let channel = channel(
            &mut writer,
            &topic(&series.name),
            "std_msgs/msg/Float64",
            FLOAT,
        )?;
        for (time, value) in series.time.iter().zip(&series.values) {
            let mut data = Encoder::default();
            data.f64(*value);
            messages.push(Message {
                stamp: nanoseconds(*time),
                channel,
                data: data.finish(),
            });
        }
    }
    messages.sort_by_key(|m| m.stamp);
    for (i, message) in messages.iter().enumerate() {
        let header = MessageHeader {
            channel_id: message.channel,
            sequence: u32::try_from(i).unwrap_or(u32::MAX),
            log_time: message.stamp,
            publish_time: message.stamp,
        };
        writer.write_to_known_channel(&header, &message.data)?;
    }
    writer.finish()?;
    Ok(())
}

struct Message {
    stamp: u64,
    channel: u16,
    data: Vec<u8>,
}

fn channel<W: Write + Seek>(
    writer: &mut Writer<W>,
    topic: &str,
    kind: &str,
    definition: &str,
) -> Result<u16, McapError> {
    let schema = writer.add_schema(kind, "ros2msg", definition.as_bytes())?;
    writer.add_channel(schema, topic, "cdr", &BTreeMap::new())
}

/// The topic of a column: `/ctrl/belt`, `/tip/0`.
fn topic(column: &str) -> String {
    let named = column.trim_start_matches('/');
    let safe = named.chars().map(|c| match c {
        '.' => '/',
        c if c.is_alphanumeric() || c == '/' || c == '_' => c,
        _ => '_',
    });
    std::iter::once('/').chain(safe).collect()
}

fn nanoseconds(time: f64) -> u64 {
    // A log starts at 0; earlier times become 0.
    (time * SECOND).round().max(0.0) as u64
}

/// Readings of the joints at one time.
#[derive(Default)]
struct State {
    names: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
}

impl State {
    fn encoded(&self, stamp: u64) -> Vec<u8> {
        let mut message = Encoder::default();
        let second = SECOND as u64;
        message.i32(i32::try_from(stamp / second).unwrap_or(i32::MAX));
        message.u32((stamp % second) as u32);
        message.text("");
        message.u32(self.names.len() as u32);
        self.names.iter().for_each(|name| message.text(name));
        // A list is as long as the names, or empty.
        for list in [&self.position, &self.velocity] {
            let told = list.iter().any(|x| x.is_finite());
            message.f64s(if told { list } else { &[] });
        }
        message.f64s(&[]);
        message.finish()
    }
}

/// States of the joints by their stamps.
fn states(log: &RawLog, joints: &[JointColumns]) -> BTreeMap<u64, State> {
    let mut states: BTreeMap<u64, State> = BTreeMap::new();
    for joint in joints {
        let column = |name: &Option<String>| -> Option<&Series> { log.series(name.as_deref()?) };
        let (position, velocity) = (column(&joint.position), column(&joint.velocity));
        let mut own: BTreeMap<u64, [f64; 2]> = BTreeMap::new();
        for (i, series) in [position, velocity].into_iter().enumerate() {
            for (time, value) in series.iter().flat_map(|s| s.time.iter().zip(&s.values)) {
                own.entry(nanoseconds(*time)).or_insert([f64::NAN; 2])[i] = *value;
            }
        }
        for (stamp, [position, velocity]) in own {
            let state = states.entry(stamp).or_default();
            state.names.push(joint.joint.clone());
            state.position.push(position);
            state.velocity.push(velocity);
        }
    }
    states
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::open::Opener;

    fn series(name: &str, points: &[(f64, f64)]) -> Series {
        Series {
            name: name.into(),
            time: points.iter().map(|p| p.0).collect(),
            values: points.iter().map(|p| p.1).collect(),
            ..Series::default()
        }
    }

    #[test]
    fn what_is_written_reads_back_with_the_same_numbers() {
        let log = RawLog {
            series: vec![
                series("angle", &[(0.0, 0.25), (0.01, 0.5), (0.03, -1.0)]),
                series("speed", &[(0.01, 3.0)]),
                series("ctrl.servo", &[(0.0, 1.0), (0.02, 2.0)]),
                series("tip.0", &[(0.02, 7.5)]),
            ],
            ..RawLog::default()
        };
        let joint = JointColumns {
            joint: "elbow".into(),
            position: Some("angle".into()),
            velocity: Some("speed".into()),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        write(std::fs::File::create(&path).unwrap(), &log, &[joint]).unwrap();
        let read = Opener::default().open(&path, &crate::LogSettings::default());
        let read = read.unwrap().remove(0);
        assert!(read.remarks.is_empty(), "{:?}", read.remarks);
        for (name, of) in [
            ("/joint_states.position.elbow", "angle"),
            ("/joint_states.velocity.elbow", "speed"),
            ("/ctrl/servo.data", "ctrl.servo"),
            ("/tip/0.data", "tip.0"),
        ] {
            let (got, want) = (read.series(name).unwrap(), log.series(of).unwrap());
            assert_eq!(got.values, want.values, "{name}");
            assert_eq!(got.time, want.time, "{name}");
        }
    }
}
