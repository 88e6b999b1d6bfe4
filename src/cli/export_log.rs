//! `asid export-log`: the logs of a study or of a result as MCAP, for Foxglove, Rerun and
//! PlotJuggler.

use std::path::PathBuf;

use anyhow::Result;

/// Arguments of `export-log`.
#[derive(clap::Args)]
#[command(after_help = "\
Each episode becomes NAME.mcap with messages of ROS 2: the joints that the model reads as sensor_msgs/JointState on \
/joint_states, every other column as std_msgs/Float64 on a topic of its name (/ctrl/belt, /tip/0). Times count from the \
episode's start. Foxglove opens a file as it is; Rerun by `rerun FILE.mcap`.")]
pub struct Arguments {
    /// A study (a folder or TOML file), or the folder of a run or diagnosis
    dir: PathBuf,
    /// The model whose joints are named, of a folder without one
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Write into this folder, new or empty [default: the next free one below runs/]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Writes the logs.
#[cfg(not(feature = "logs"))]
pub fn export_log(arguments: &Arguments) -> Result<()> {
    let Arguments { dir, model, out } = arguments;
    let named = [Some(dir), model.as_ref(), out.as_ref()];
    Err(asid_core::Error::Missing {
        what: "writing of MCAP".into(),
        message: format!(
            "{} stays as it is: build with `--features logs`",
            named.into_iter().flatten().next().unwrap_or(dir).display()
        ),
    }
    .into())
}

/// Writes the logs.
#[cfg(feature = "logs")]
pub fn export_log(arguments: &Arguments) -> Result<()> {
    with_mcap::export(arguments)
}

#[cfg(feature = "logs")]
mod with_mcap {
    use std::io::Write as _;
    use std::path::Path;

    use anyhow::Result;
    use asid_core::{Episode, Error};
    use asid_diagnosis::study::Study;
    use asid_effects::RefinedModel;
    use asid_logs::mcap_out::{JointColumns, write};
    use asid_logs::{LogFormat, LogSettings, Opener, RawLog, Series};
    use asid_mjcf::Plant;
    use asid_mjcf::plant::Reads;

    use super::Arguments;
    use crate::cli::output::OutFolder;

    pub(super) fn export(arguments: &Arguments) -> Result<()> {
        let dir = &arguments.dir;
        let is_study =
            dir.extension().is_some_and(|e| e == "toml") || dir.join("study.toml").exists();
        let (mut logs, own) = if is_study {
            let study = Study::read(dir)?;
            let all = study.train.iter().chain(&study.test);
            let logs: Vec<RawLog> = all.map(|(name, episode)| raw(name, episode)).collect();
            (logs, Some(Plant::of(&study.scene)?))
        } else {
            let model = dir.join("model.xml");
            let own = model.exists().then(|| RefinedModel::open(&model));
            let plant = own.transpose()?.map(|m| Plant::of(&m.scene)).transpose()?;
            (of_folder(dir)?, plant)
        };
        tell_apart(&mut logs);
        let plant = match &arguments.model {
            Some(model) => Some(Plant::of(&RefinedModel::open(model)?.scene)?),
            None => own,
        };
        let joints = plant.as_ref().map(joints).unwrap_or_default();
        let stem = dir
            .file_stem()
            .map_or_else(|| "log".into(), |s| s.to_string_lossy());
        let out = OutFolder::claim(arguments.out.as_deref(), &format!("{stem}-mcap"))?;
        out.write(|folder| {
            for log in &logs {
                let path = folder.join(format!("{}.mcap", log.name));
                let failed = |message: String| Error::File {
                    path: path.clone(),
                    message,
                };
                let file = std::fs::File::create_new(&path).map_err(|e| failed(e.to_string()))?;
                let file = std::io::BufWriter::new(file);
                write(file, log, &joints).map_err(|e| failed(e.to_string()))?;
            }
            Ok(())
        })?;
        let (count, path) = (logs.len(), out.path());
        writeln!(
            std::io::stdout(),
            "wrote {count} MCAP files: {}",
            path.display()
        )?;
        Ok(())
    }

    /// The tables of a result's folder, by name.
    fn of_folder(dir: &Path) -> Result<Vec<RawLog>> {
        let failed = |message: String| Error::File {
            path: dir.to_owned(),
            message,
        };
        let entries = std::fs::read_dir(dir).map_err(|e| failed(e.to_string()))?;
        let mut files: Vec<_> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
        files.retain(|p| p.is_file() && p.extension().is_some_and(|e| e == "csv"));
        files.sort();
        let settings = LogSettings {
            kind: Some(LogFormat::Csv),
            ..LogSettings::default()
        };
        let mut logs = Vec::new();
        for file in files {
            logs.extend(Opener::default().open(&file, &settings)?);
        }
        // A planned motion, such as `next.csv`, has commands and was not recorded.
        let is_reading = |s: &Series| !s.name.starts_with("ctrl.");
        logs.retain(|log| log.series.iter().any(is_reading));
        if logs.is_empty() {
            let message = "holds no study.toml and no logs (CSV files): give a study, or the folder of a run or diagnosis";
            return Err(failed(message.into()).into());
        }
        Ok(logs)
    }

    /// An episode as series by name; missing readings are left out.
    fn raw(name: &str, episode: &Episode) -> RawLog {
        let mut series: Vec<Series> = Vec::new();
        let first = episode.time.first().copied().unwrap_or(0.0);
        let mut add = |name: String, values: &mut dyn Iterator<Item = f64>| {
            let points = episode.time.iter().map(|t| t - first).zip(values);
            let (time, values) = points.filter(|(_, x)| x.is_finite()).unzip();
            series.push(Series {
                name,
                time,
                values,
                ..Series::default()
            });
        };
        let (nu, width) = (episode.actuators.len(), episode.width());
        for (a, actuator) in episode.actuators.iter().enumerate() {
            let values = &mut episode.ctrl.iter().skip(a).step_by(nu).copied();
            add(format!("ctrl.{actuator}"), values);
        }
        let names = episode.channels.iter().flat_map(|c| {
            (0..c.len).map(move |i| match c.len {
                1 => c.name.clone(),
                _ => format!("{}.{i}", c.name),
            })
        });
        for (column, name) in names.enumerate() {
            add(
                name,
                &mut episode.readings.iter().skip(column).step_by(width).copied(),
            );
        }
        RawLog {
            name: short(name),
            series,
            ..RawLog::default()
        }
    }

    /// Name of a log's file: the stem of `../sub/train_0.csv`, `set_3` for `set#3`.
    fn short(name: &str) -> String {
        let file = Path::new(name).file_name();
        let file = file.map_or_else(|| name.into(), |f| f.to_string_lossy());
        file.trim_end_matches(".csv")
            .trim_end_matches(".mcap")
            .trim_end_matches(".db3")
            .replace('#', "_")
    }

    /// Numbers names that occur more than once.
    fn tell_apart(logs: &mut [RawLog]) {
        let mut names: Vec<String> = logs.iter().map(|l| l.name.clone()).collect();
        let own = names.clone();
        for (i, log) in logs.iter_mut().enumerate() {
            if own.iter().filter(|n| **n == own[i]).count() > 1 {
                let numbered = (i + 1..).map(|number| format!("{}_{number}", own[i]));
                let free = numbered.into_iter().find(|name| !names.contains(name));
                log.name = free.unwrap_or_default();
                names.push(log.name.clone());
            }
        }
    }

    /// The columns of each joint that the model reads.
    fn joints(plant: &Plant) -> Vec<JointColumns> {
        let column = |joint: usize, kind: &str| {
            let mut sensors = plant.layout.sensors.iter().zip(&plant.sensors);
            let found = sensors.find(|(s, reads)| s.kind == kind && **reads == Reads::Joint(joint));
            found.map(|(s, _)| s.name.clone())
        };
        let joints = plant.layout.joints.iter().enumerate();
        joints
            .map(|(j, joint)| JointColumns {
                joint: joint.name.clone(),
                position: column(j, "jointpos"),
                velocity: column(j, "jointvel"),
            })
            .filter(|c| c.position.is_some() || c.velocity.is_some())
            .collect()
    }
}
