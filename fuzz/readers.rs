//! The readers: one row each, with the files from which its inputs are made.

use std::path::Path;
use std::sync::OnceLock;

use anyhow::{Context, Result, bail};
use asid_core::{Backend as _, Scene};
use asid_logs::episode::{of_table, wanted};
use asid_logs::propose::propose;
use asid_logs::ros::topics::{Described, Topics};
use asid_logs::{LogFormat, LogSettings, Opener};
use asid_mjcf::Plant;

use crate::corpus::{Corpus, root};

/// A machine with two joints; logs of it in four formats are beside it.
const MACHINE: &str = "logs/tests/fixtures/nominal.xml";
/// A log of that machine.
const LOG: &str = "logs/tests/fixtures/csv/train_0.csv";
/// Episodes of a log in table formats; each takes the same code path.
const EPISODES: usize = 3;

/// A reader of files.
pub struct Reader {
    /// Name on the command line.
    pub name: &'static str,
    /// What it reads, for the page.
    pub what: &'static str,
    /// Name of the input's file, which determines its kind.
    pub file: &'static str,
    /// Its corpus.
    pub corpus: fn() -> Result<Corpus>,
    /// Writes the files that an input needs beside it into a folder.
    pub prepare: fn(&Path) -> Result<()>,
    /// Reads an input; the error is the message for the user.
    pub read: fn(&Path) -> Result<(), String>,
}

/// All readers.
pub const READERS: &[Reader] = &[
    Reader {
        name: "mjcf",
        what: "MJCF: document, layout, masses, drives",
        file: "model.xml",
        corpus: || {
            Corpus::read(&[
                "fuzz/corpus/mjcf",
                MACHINE,
                "backends/mujoco/examples/arm.xml",
                "studies/double-pendulum/nominal.xml",
            ])
        },
        prepare: nothing,
        read: |path| told(Scene::from_file(path).and_then(|s| Plant::of(&s).map(drop))),
    },
    Reader {
        name: "mjcf-rapier",
        what: "MJCF: compiled by rapier",
        file: "model.xml",
        corpus: || {
            Corpus::read(&[
                "fuzz/corpus/mjcf",
                MACHINE,
                "studies/elbow-toss/nominal.xml",
            ])
        },
        prepare: nothing,
        read: |path| {
            let rapier = asid_rapier::Rapier;
            told(Scene::from_file(path).and_then(|s| rapier.load(&s).map(drop)))
        },
    },
    Reader {
        name: "study",
        what: "a study with its model and logs",
        file: "study.toml",
        corpus: || Corpus::read(&["fuzz/corpus/study"]),
        prepare: beside_model,
        read: |path| told(asid_diagnosis::study::Study::read(path).map(drop)),
    },
    Reader {
        name: "csv",
        what: "CSV: logs of ASID, and tables of any names",
        file: "log.csv",
        corpus: || Corpus::read(&["fuzz/corpus/csv", LOG]),
        prepare: nothing,
        read: table,
    },
    Reader {
        name: "parquet",
        what: "Parquet: logs of ASID, and tables of any names",
        file: "log.parquet",
        corpus: tables,
        prepare: nothing,
        read: table,
    },
    Reader {
        name: "lerobot",
        what: "LeRobot: `meta/info.json`",
        file: "dataset/meta/info.json",
        corpus: || Corpus::read(&["logs/tests/fixtures/lerobot/meta"]),
        prepare: |folder| {
            let data = folder.join("dataset/data/chunk-000");
            std::fs::create_dir_all(&data)?;
            let table = "data/chunk-000/file-000.parquet";
            std::fs::copy(
                root().join("logs/tests/fixtures/lerobot").join(table),
                data.join("file-000.parquet"),
            )?;
            Ok(())
        },
        read: |path| {
            let dataset = path.ancestors().nth(2).unwrap_or(path);
            import(dataset)
        },
    },
    Reader {
        name: "mcap",
        what: "MCAP",
        file: "log.mcap",
        corpus: || {
            Corpus::read(&[
                "logs/tests/fixtures/mcap",
                "logs/tests/fixtures/bag_mcap/train_0/train_0.mcap",
            ])
        },
        prepare: nothing,
        read: import,
    },
    Reader {
        name: "bag",
        what: "bags of ROS 2 in SQLite",
        file: "log.db3",
        corpus: || Corpus::read(&["logs/tests/fixtures/bag_sqlite/train_0/train_0.db3"]),
        prepare: nothing,
        read: import,
    },
    Reader {
        name: "message",
        what: "messages of ROS 2 under their definitions, CDR and JSON, inside of what checksums guard",
        file: "message",
        corpus: messages,
        prepare: nothing,
        read: message,
    },
    Reader {
        name: "refined",
        what: "refined models",
        file: "refined.toml",
        corpus: || Corpus::read(&["fuzz/corpus/refined"]),
        prepare: beside_model,
        read: |path| told(asid_effects::refined_model::RefinedModel::open(path).map(drop)),
    },
    Reader {
        name: "comparison",
        what: "`config.toml` of a comparison",
        file: "config.toml",
        corpus: || Corpus::read(&["fuzz/corpus/comparison"]),
        prepare: nothing,
        read: |path| told(asid_comparison::document::Document::read(path).map(drop)),
    },
    #[cfg(feature = "program")]
    Reader {
        name: "config",
        what: "`config.toml` of a run",
        file: "config.toml",
        corpus: || Corpus::read(&["fuzz/corpus/config"]),
        prepare: nothing,
        read: |path| asid::cli::readers::config(path).map_err(|e| format!("{e:#}")),
    },
    #[cfg(feature = "program")]
    Reader {
        name: "posterior",
        what: "`posterior.json`",
        file: "posterior.json",
        corpus: || Corpus::read(&["fuzz/corpus/posterior"]),
        prepare: nothing,
        read: |path| asid::cli::readers::posterior(path).map_err(|e| format!("{e:#}")),
    },
    #[cfg(feature = "program")]
    Reader {
        name: "trace",
        what: "`trace.json` of a run, as `asid report` reads it",
        file: "trace.json",
        corpus: || Corpus::read(&["fuzz/corpus/trace"]),
        prepare: nothing,
        read: |path| asid::cli::readers::trace(path).map_err(|e| format!("{e:#}")),
    },
];

/// The reader of this name.
///
/// # Errors
/// If there is none.
pub fn named(name: &str) -> Result<&'static Reader> {
    let Some(reader) = READERS.iter().find(|r| r.name == name) else {
        let known: Vec<&str> = READERS.iter().map(|r| r.name).collect();
        bail!("unknown reader `{name}`; known: {}", known.join(", "));
    };
    Ok(reader)
}

fn nothing(_: &Path) -> Result<()> {
    Ok(())
}

/// Copies the machine and a log of it to `model.xml`, `log.csv` and `held.csv`.
fn beside_model(folder: &Path) -> Result<()> {
    std::fs::copy(root().join(MACHINE), folder.join("model.xml"))?;
    let log = std::fs::read_to_string(root().join(LOG))?;
    let rows: Vec<&str> = log.lines().take(12).collect();
    for name in ["log.csv", "held.csv"] {
        std::fs::write(folder.join(name), rows.join("\n"))?;
    }
    Ok(())
}

fn told(read: asid_core::Result<()>) -> Result<(), String> {
    read.map_err(|e| e.to_string())
}

fn machine() -> &'static (Scene, Plant) {
    static MACHINE_READ: OnceLock<(Scene, Plant)> = OnceLock::new();
    MACHINE_READ.get_or_init(|| {
        let read = || -> asid_core::Result<(Scene, Plant)> {
            let scene = Scene::from_file(&root().join(MACHINE))?;
            let plant = Plant::of(&scene)?;
            Ok((scene, plant))
        };
        read().unwrap_or_else(|e| panic!("the repository's own machine: {e}"))
    })
}

/// Reads a table as a log of ASID, and as one of another stack.
fn table(path: &Path) -> Result<(), String> {
    let own = asid_logs::episode::read(path, &machine().1.layout);
    let other = import(path);
    told(own.map(drop)).and(other)
}

/// Reads a log of another stack with the mapping that is proposed for it.
fn import(path: &Path) -> Result<(), String> {
    let (scene, plant) = machine();
    let told = |e: asid_core::Error| e.to_string();
    let logs = Opener::default()
        .open(path, &LogSettings::default())
        .map_err(told)?;
    for log in logs.iter().take(EPISODES) {
        let proposal = propose(scene, plant, (log, LogFormat::of(path)), &[]).map_err(told)?;
        let mappings = proposal.mappings();
        let [commands, readings] = wanted(&plant.layout, &mappings);
        let angles = asid_logs::episode::angles(plant, &mappings);
        let (table, _) = log.table(&commands, &readings, &angles);
        of_table(path, &table, &plant.layout, (&mappings, &angles)).map_err(told)?;
    }
    Ok(())
}

/// A log as Parquet, plain and with two compressions, and a dataset's table with lists.
fn tables() -> Result<Corpus> {
    use parquet::basic::{Compression, ZstdLevel};
    use parquet::data_type::DoubleType;
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;
    let log = std::fs::read_to_string(root().join(LOG))?;
    let mut lines = log.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let rows: Vec<Vec<f64>> = lines
        .map(|l| l.split(',').filter_map(|cell| cell.parse().ok()).collect())
        .collect();
    let fields: String = names
        .iter()
        .map(|n| format!("optional double {n};"))
        .collect();
    let schema = std::sync::Arc::new(parse_message_type(&format!("message log {{ {fields} }}"))?);
    let mut files = Corpus::read(&["logs/tests/fixtures/lerobot/data/chunk-000"])?.files;
    let zstd = Compression::ZSTD(ZstdLevel::default());
    for (compression, dictionary) in [
        (Compression::UNCOMPRESSED, false),
        (Compression::SNAPPY, true),
        (zstd, false),
    ] {
        let properties = WriterProperties::builder()
            .set_compression(compression)
            .set_dictionary_enabled(dictionary)
            .build();
        let mut bytes = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut bytes, schema.clone(), properties.into())?;
        let mut group = writer.next_row_group()?;
        let mut column = 0;
        while let Some(mut open) = group.next_column()? {
            let values: Vec<f64> = rows.iter().filter_map(|r| r.get(column).copied()).collect();
            let levels = vec![1; values.len()];
            let typed = open.typed::<DoubleType>();
            typed.write_batch(&values, Some(&levels), None)?;
            open.close()?;
            column += 1;
        }
        group.close()?;
        writer.close()?;
        files.push(bytes);
    }
    Ok(Corpus::of_files(files))
}

/// Separator between a message and its definition, and between the definition and its type and
/// encodings.
const PART: &[u8] = b"\n\0\n";

/// Messages of the fixtures; type, encoding and definition come before each.
fn messages() -> Result<Corpus> {
    let path = root().join("logs/tests/fixtures/mcap/train_0.mcap");
    let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
    let mut files = vec![
        [b"any json x".as_slice(), PART, PART, br#"{"header": {"stamp": {"sec": 1, "nanosec": 5}}, "name": ["a", "b"], "position": [1, 2.5]}"#].concat(),
        [b"sensor_msgs/msg/JointState cdr ".as_slice(), PART, PART, &[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]].concat(),
    ];
    let mut topics: Vec<String> = Vec::new();
    for message in mcap::MessageStream::new(&bytes)? {
        let message = message?;
        let channel = &message.channel;
        if topics.contains(&channel.topic) {
            continue;
        }
        topics.push(channel.topic.clone());
        if let Some(schema) = &channel.schema {
            let head = format!(
                "{} {} {}",
                schema.name, channel.message_encoding, schema.encoding
            );
            files.push([head.as_bytes(), PART, &schema.data, PART, &message.data].concat());
        }
    }
    Ok(Corpus::of_files(files))
}

/// Decodes a message twice, one second apart.
fn message(path: &Path) -> Result<(), String> {
    let bytes = std::fs::read(path).map_err(|e| e.to_string())?;
    let split =
        |bytes: &[u8]| -> Option<usize> { bytes.windows(PART.len()).position(|w| w == PART) };
    let head = split(&bytes).unwrap_or(0);
    let rest = bytes.get(head + PART.len()..).unwrap_or_default();
    let definition = split(rest).unwrap_or(0);
    let data = rest.get(definition + PART.len()..).unwrap_or_default();
    let head = String::from_utf8_lossy(&bytes[..head]);
    let mut words = head.split(' ');
    let mut word = || words.next().unwrap_or_default();
    let described = Described {
        kind: word(),
        encoding: word(),
        schema: word(),
        text: &rest[..definition],
    };
    let mut topics = Topics::new(&[]);
    for stamp in [0, 1_000_000_000] {
        topics.push("/topic", described, stamp, data);
    }
    let log = topics.finish("log")?;
    let names: Vec<String> = log.series.iter().map(|s| s.name.clone()).collect();
    let _ = log.table(&names, &names, &[]);
    match log.remarks.first() {
        Some(remark) => Err(remark.clone()),
        None => Ok(()),
    }
}
