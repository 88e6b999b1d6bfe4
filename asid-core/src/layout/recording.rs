//! What a simulator records, by name and by index.

use super::Layout;
use crate::error::{Error, Result};

impl Layout {
    /// Resolves channel names into a recording; see [`Channel`].
    ///
    /// # Errors
    /// When a name belongs to nothing in the scene.
    pub fn recording<S: AsRef<str>>(&self, names: &[S]) -> Result<Recording> {
        let mut channels = Vec::with_capacity(names.len());
        let mut offsets = vec![0];
        let mut width = 0;
        for name in names {
            let (channel, len) = self.channel(name.as_ref())?;
            channels.push(channel);
            width += len;
            offsets.push(width);
        }
        Ok(Recording { channels, offsets })
    }

    /// Channels of the whole state: positions of all joints (`nq` entries), then velocities (`nv`),
    /// in the order of [`Simulator::set_state`](crate::Simulator::set_state).
    #[must_use]
    pub fn state_channels(&self) -> Vec<String> {
        let positions = self.joints.iter().map(|j| format!("qpos.{}", j.name));
        let velocities = self.joints.iter().map(|j| format!("qvel.{}", j.name));
        positions.chain(velocities).collect()
    }

    fn channel(&self, name: &str) -> Result<(Channel, usize)> {
        if let Some(joint) = name.strip_prefix("qpos.") {
            let j = self.joint(joint)?;
            let len = j.kind.qpos_len();
            return Ok((Channel::Position { start: j.qpos, len }, len));
        }
        if let Some(joint) = name.strip_prefix("qvel.") {
            let j = self.joint(joint)?;
            let len = j.kind.qvel_len();
            return Ok((Channel::Velocity { start: j.qvel, len }, len));
        }
        if let Some(pair) = name.strip_prefix("contact.") {
            let (a, b) = pair.split_once('/').ok_or_else(|| Error::Config {
                key: name.to_owned(),
                message: "a contact channel is written contact.<body>/<body>".into(),
            })?;
            let channel = Channel::ContactForce {
                bodies: [self.body(a)?, self.body(b)?],
            };
            return Ok((channel, 1));
        }
        let index = self
            .sensors
            .iter()
            .position(|s| s.name == name)
            .ok_or_else(|| Error::unknown("sensor", name, self.sensors.iter().map(|s| &*s.name)))?;
        Ok((Channel::Sensor { index }, self.sensors[index].len))
    }
}

/// Something that a simulator can record.
///
/// By name: a sensor's name; `qpos.<joint>` and `qvel.<joint>`; or `contact.<body>/<body>`, the sum
/// of the normal forces between the geoms of two bodies (N; their descendants are not counted).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// All entries of a sensor.
    Sensor {
        /// Index in [`Layout::sensors`].
        index: usize,
    },
    /// Entries of `qpos`.
    Position {
        /// First entry.
        start: usize,
        /// Entries.
        len: usize,
    },
    /// Entries of `qvel`.
    Velocity {
        /// First entry.
        start: usize,
        /// Entries.
        len: usize,
    },
    /// Normal force between two bodies, N.
    ContactForce {
        /// Indices in [`Layout::bodies`].
        bodies: [usize; 2],
    },
}

/// Channels to record, concatenated in a row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    channels: Vec<Channel>,
    offsets: Vec<usize>,
}

impl Recording {
    /// A recording of channels given by index.
    ///
    /// # Errors
    /// [`Error::Shape`] when one lies outside the layout.
    pub fn of(layout: &Layout, channels: &[Channel]) -> Result<Self> {
        let mut offsets = vec![0];
        let mut width = 0;
        for channel in channels {
            let within = |start: usize, len: usize, all: usize| {
                start.checked_add(len).is_some_and(|end| end <= all)
            };
            let (fits, len) = match *channel {
                Channel::Sensor { index } => (
                    index < layout.sensors.len(),
                    layout.sensors.get(index).map_or(0, |s| s.len),
                ),
                Channel::Position { start, len } => (within(start, len, layout.nq), len),
                Channel::Velocity { start, len } => (within(start, len, layout.nv), len),
                Channel::ContactForce { bodies } => {
                    (bodies.iter().all(|&b| b < layout.bodies.len()), 1)
                }
            };
            if !fits {
                return Err(Error::Shape(format!(
                    "channel {channel:?} lies outside the scene"
                )));
            }
            width += len;
            offsets.push(width);
        }
        Ok(Self {
            channels: channels.to_vec(),
            offsets,
        })
    }

    /// The channels in order.
    #[must_use]
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Number of entries in a row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.offsets.last().copied().unwrap_or(0)
    }

    /// Range of channel `i` in a row.
    #[must_use]
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }
}
