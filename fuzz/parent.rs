//! Starts a child for each reader, continues after a child that died, and sums up.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use crate::child::{AT, HUNG, streams};
use crate::corpus::root;
use crate::damage;
use crate::finding::Finding;
use crate::readers::{READERS, Reader, named};

/// Address space of a child, KiB. It includes memory of C libraries; the program and its stacks
/// take 0.3 GiB.
const ADDRESS_SPACE_KIB: u64 = 2 << 20;
/// Number of inputs per fault that are kept; more give no new information.
const KEPT_OF_FAULT: u64 = 3;
/// Time between two lines of progress.
const PROGRESS: Duration = Duration::from_secs(10);

/// Arguments of `read`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Readers [default: all]
    readers: Vec<String>,
    /// List the readers and end
    #[arg(long)]
    list: bool,
    /// Inputs of each reader
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    inputs: u64,
    /// Seed of the inputs
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Number of the first input
    #[arg(long, value_name = "N", default_value_t = 0)]
    from: u64,
    /// Most minutes of each reader
    #[arg(long, value_name = "M", default_value_t = 60.0)]
    minutes: f64,
    /// Folder of the findings [default: target/fuzz]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Result of one reader.
#[derive(Default)]
struct Summary {
    inputs: u64,
    accepted: u64,
    most_memory: u64,
    slowest_us: u64,
    slowest_index: u64,
    cpu_us: u64,
    /// Findings by fault: how many, and the first one.
    faults: BTreeMap<String, (u64, Finding)>,
}

/// Reads damaged files; true if nothing was found.
///
/// # Errors
/// If a child cannot be started or a file cannot be written.
pub fn read(arguments: &Arguments) -> Result<bool> {
    if arguments.list {
        for reader in READERS {
            println!("{:<12} {}", reader.name, reader.what);
        }
        return Ok(true);
    }
    let chosen: Vec<&Reader> = if arguments.readers.is_empty() {
        READERS.iter().collect()
    } else {
        arguments
            .readers
            .iter()
            .map(|n| named(n))
            .collect::<Result<_>>()?
    };
    println!(
        "| reader | inputs | read as valid | inputs/s of CPU time | most memory, MB | slowest, ms (input) | faults |\n\
         |---|--:|--:|--:|--:|--:|--:|"
    );
    let mut clean = true;
    for reader in chosen {
        let summary = Watch::new(reader, arguments)?.run()?;
        clean &= summary.faults.is_empty();
        println!("{}", row(reader.name, &summary));
        for (fault, (count, first)) in &summary.faults {
            eprintln!(
                "{}: {fault}: {count} inputs, first {}: {}",
                reader.name, first.index, first.message
            );
        }
    }
    Ok(clean)
}

fn row(name: &str, s: &Summary) -> String {
    let inputs = s.inputs.max(1) as f64;
    format!(
        "| `{name}` | {} | {:.1} % | {:.0} | {:.1} | {:.1} ({}) | {} |",
        s.inputs,
        100.0 * s.accepted as f64 / inputs,
        1e6 * inputs / s.cpu_us.max(1) as f64,
        s.most_memory as f64 / f64::from(1 << 20),
        s.slowest_us as f64 / 1e3,
        s.slowest_index,
        s.faults.len()
    )
}

/// A reader under test.
struct Watch<'a> {
    reader: &'static Reader,
    arguments: &'a Arguments,
    scratch: tempfile::TempDir,
    out: PathBuf,
    start: Instant,
    told: Instant,
    /// Figures of the children that have ended and of the running one.
    summary: Summary,
    running: [u64; 3],
}

impl<'a> Watch<'a> {
    fn new(reader: &'static Reader, arguments: &'a Arguments) -> Result<Self> {
        // Inputs are written a thousand times a second, so they go to memory if there is such a
        // folder.
        let memory = Path::new("/dev/shm");
        let scratch = if memory.is_dir() {
            tempfile::tempdir_in(memory)
        } else {
            tempfile::tempdir()
        };
        Ok(Self {
            reader,
            arguments,
            scratch: scratch.context("cannot make a scratch folder")?,
            out: arguments
                .out
                .clone()
                .unwrap_or_else(|| root().join("target/fuzz")),
            start: Instant::now(),
            told: Instant::now(),
            summary: Summary::default(),
            running: [0; 3],
        })
    }

    fn run(mut self) -> Result<Summary> {
        let mut from = self.arguments.from;
        let to = from + self.arguments.inputs;
        while from < to && self.seconds_left() > 0.0 {
            let (ended, status, found) = self.child(from, to)?;
            let [inputs, accepted, cpu] = self.running;
            self.summary.inputs += inputs;
            self.summary.accepted += accepted;
            self.summary.cpu_us += cpu;
            self.running = [0; 3];
            if ended {
                break;
            }
            // The child died while it read one input; the next child continues after that input.
            let index = self.at().unwrap_or(from);
            if !found {
                let message = format!("the process ended by {status}");
                self.found(Finding {
                    kind: "abort".into(),
                    index,
                    message,
                })?;
            }
            // The child's last line does not include what it has read since.
            self.summary.inputs = index + 1 - self.arguments.from;
            from = index + 1;
        }
        Ok(self.summary)
    }

    fn seconds_left(&self) -> f64 {
        60.0 * self.arguments.minutes - self.start.elapsed().as_secs_f64()
    }

    /// Number of the input that the last child was reading.
    fn at(&self) -> Option<u64> {
        let bytes = std::fs::read(self.scratch.path().join(AT)).ok()?;
        Some(u64::from_le_bytes(bytes.try_into().ok()?))
    }

    /// Runs one child until it ends.
    ///
    /// Returns whether it came to its end, its status, and whether it reported itself what killed
    /// it.
    fn child(&mut self, from: u64, to: u64) -> Result<(bool, ExitStatus, bool)> {
        let own = std::env::current_exe().context("cannot tell where this program lies")?;
        let mut child = Command::new("sh")
            .arg("-c")
            .arg(format!(
                "ulimit -c 0; ulimit -v {ADDRESS_SPACE_KIB}; exec \"$0\" \"$@\""
            ))
            .arg(own)
            .args(["child", "--reader", self.reader.name])
            .arg(format!("--seed={}", self.arguments.seed))
            .args([format!("--from={from}"), format!("--to={to}")])
            .arg(format!("--seconds={}", self.seconds_left()))
            .arg("--scratch")
            .arg(self.scratch.path())
            .stdout(Stdio::piped())
            .spawn()
            .context("cannot start a child")?;
        let out = child.stdout.take().context("the child has no output")?;
        let (mut ended, mut hung) = (false, false);
        for line in BufReader::new(out).lines() {
            let line = line?;
            if let Some(finding) = Finding::of_line(&line) {
                hung |= finding.kind == "hang";
                self.found(finding)?;
            } else if let Some(state) = line.strip_prefix("state ") {
                self.state(state);
            }
            ended |= line == "end";
        }
        let status = child.wait()?;
        Ok((ended, status, hung && status.code() == Some(HUNG)))
    }

    fn state(&mut self, line: &str) {
        let n: Vec<u64> = line.split(' ').filter_map(|w| w.parse().ok()).collect();
        let &[inputs, accepted, memory, slowest, index, cpu] = &n[..] else {
            return;
        };
        let seconds_left = self.seconds_left();
        let s = &mut self.summary;
        s.most_memory = s.most_memory.max(memory);
        if slowest > s.slowest_us {
            (s.slowest_us, s.slowest_index) = (slowest, index);
        }
        self.running = [inputs, accepted, cpu];
        if self.told.elapsed() > PROGRESS {
            self.told = Instant::now();
            let done = s.inputs + inputs;
            let per_s = done as f64 / self.start.elapsed().as_secs_f64();
            let left =
                (self.arguments.inputs.saturating_sub(done) as f64 / per_s).min(seconds_left);
            eprintln!(
                "{}: {done} of {}, {per_s:.0}/s, {:.0} min left, {} faults",
                self.reader.name,
                self.arguments.inputs,
                left / 60.0,
                s.faults.len()
            );
        }
    }

    fn found(&mut self, finding: Finding) -> Result<()> {
        let fault = finding.fault();
        let entry = self
            .summary
            .faults
            .entry(fault)
            .or_insert_with(|| (0, finding.clone()));
        entry.0 += 1;
        if entry.0 <= KEPT_OF_FAULT {
            let corpus = (self.reader.corpus)()?;
            let seed = self.arguments.seed;
            let mut rng = streams(seed, self.reader.name).indexed("input", finding.index);
            let bytes = damage::input(&corpus, &mut rng);
            let file = finding.keep(&self.out, self.reader.name, seed, &bytes)?;
            eprintln!(
                "{}: {}: {} ({})",
                self.reader.name,
                finding.kind,
                finding.message,
                file.display()
            );
        }
        Ok(())
    }
}
