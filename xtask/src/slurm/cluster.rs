//! A private Slurm: Debian's packages are unpacked; nothing is installed and no privilege is
//! needed.

use std::fs;
use std::io::Read as _;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use tempfile::TempDir;

use crate::library::repository;

/// Packages that are fetched; 3.8 MB.
const PACKAGES: [&str; 12] = [
    "slurmd",
    "slurmctld",
    "slurm-client",
    "slurm-wlm-basic-plugins",
    "munge",
    "libmunge2",
    "libhwloc15",
    "liblua5.1-0",
    "libjson-c5",
    "libyaml-0-2",
    "libnuma1",
    "libdbus-1-3",
];

/// Names of the nodes, one processor each.
pub const NODES: [&str; 2] = ["n1", "n2"];

/// Maximum time that the daemons may take to connect.
const START: Duration = Duration::from_secs(60);

/// Bytes of munge's key: the most that it accepts.
const KEY: usize = 1024;

/// The unpacked packages.
pub struct Programs {
    root: PathBuf,
    /// Folder of Slurm's plugins.
    plugins: PathBuf,
}

impl Programs {
    /// Finds the unpacked packages in `.native/slurm`, or fetches and unpacks them there.
    ///
    /// # Errors
    /// If they are not available, with the reason.
    pub fn get() -> Result<Self> {
        let folder = repository().join(".native").join("slurm");
        let root = folder.join("root");
        if !root.join("complete").is_file() {
            let _ = fs::remove_dir_all(&folder);
            let packages = folder.join("packages");
            fs::create_dir_all(&packages).context(packages.display().to_string())?;
            download(&packages)?;
            for entry in fs::read_dir(&packages)? {
                let unpacked = Command::new("dpkg")
                    .arg("-x")
                    .arg(entry?.path())
                    .arg(&root)
                    .output();
                succeeded("dpkg", unpacked)?;
            }
            fs::write(root.join("complete"), "")?;
        }
        let libraries = fs::read_dir(root.join("usr").join("lib"))?;
        let plugins = libraries
            .filter_map(|e| Some(e.ok()?.path().join("slurm-wlm")))
            .find(|p| p.is_dir())
            .context("the packages hold no plugins of Slurm")?;
        Ok(Self { root, plugins })
    }

    /// A command that runs a program of the packages, with its libraries and the cluster's
    /// settings.
    fn command(&self, program: &str, config: &Path) -> Command {
        let mut command = Command::new(self.root.join("usr").join(program));
        self.environment(&mut command, config);
        command
    }

    fn environment(&self, command: &mut Command, config: &Path) {
        let libraries = self.plugins.parent().unwrap_or(&self.root);
        let path = std::env::var("PATH").unwrap_or_default();
        let bin = self.root.join("usr").join("bin");
        command
            .env("SLURM_CONF", config)
            .env("PATH", format!("{}:{path}", bin.display()))
            .env(
                "LD_LIBRARY_PATH",
                format!("{}:{}", libraries.display(), self.plugins.display()),
            );
    }
}

/// Runs `apt-get download` with the system's package sources.
fn download(folder: &Path) -> Result<()> {
    let fetched = Command::new("apt-get")
        .args(["download", "-q"])
        .args(PACKAGES)
        .current_dir(folder)
        .output();
    succeeded("apt-get download", fetched)
}

fn succeeded(what: &str, output: std::io::Result<Output>) -> Result<()> {
    let output = output.with_context(|| format!("cannot start {what}"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let line = said
            .lines()
            .find(|l| l.starts_with("E:"))
            .or(said.lines().last());
        bail!("{what}: {}", line.unwrap_or("it said nothing"));
    }
    Ok(())
}

/// A running cluster with one controller and two nodes. Dropping it ends it.
pub struct Cluster<'p> {
    programs: &'p Programs,
    folder: TempDir,
    /// munge's socket must be in a folder that everybody can read.
    _socket: TempDir,
    daemons: Vec<Child>,
}

impl<'p> Cluster<'p> {
    /// Starts the daemons and waits until both nodes are idle.
    ///
    /// # Errors
    /// If one of them does not start.
    pub fn start(programs: &'p Programs) -> Result<Self> {
        let (folder, socket) = (tempfile::tempdir()?, tempfile::tempdir()?);
        for open in [&folder, &socket] {
            fs::set_permissions(open.path(), fs::Permissions::from_mode(0o755))?;
        }
        let at = |name: &str| folder.path().join(name);
        for name in ["run", "state", "log", "spool/n1", "spool/n2", "work"] {
            fs::create_dir_all(at(name))?;
        }
        fs::set_permissions(at("run"), fs::Permissions::from_mode(0o700))?;
        let mut key = vec![0; KEY];
        fs::File::open("/dev/urandom")?.read_exact(&mut key)?;
        fs::write(at("run/munge.key"), key)?;
        fs::set_permissions(at("run/munge.key"), fs::Permissions::from_mode(0o600))?;
        let munge = socket.path().join("munge.sock");
        let config = at("slurm.conf");
        fs::write(&config, configuration(programs, folder.path(), &munge)?)?;
        let mut cluster = Self {
            programs,
            folder,
            _socket: socket,
            daemons: Vec::new(),
        };
        let option = |name: &str, path: PathBuf| format!("--{name}={}", path.display());
        cluster.daemon(
            "sbin/munged",
            &[
                "--force".into(),
                "--foreground".into(),
                option("socket", munge.clone()),
                option("key-file", cluster.path("run/munge.key")),
                option("pid-file", cluster.path("run/munged.pid")),
                option("log-file", cluster.path("log/munged.log")),
                option("seed-file", cluster.path("run/seed")),
            ],
        )?;
        cluster.until("munged", || munge.exists())?;
        cluster.daemon("sbin/slurmctld-wlm", &["-D".into()])?;
        let stepd = programs
            .root
            .join("usr/sbin/slurmstepd-wlm")
            .display()
            .to_string();
        for node in NODES {
            let arguments = ["-D", "-N", node, "-d", &stepd].map(str::to_owned);
            cluster.daemon("sbin/slurmd-wlm", &arguments)?;
        }
        let idle = || {
            let states = cluster.slurm("sinfo", &["--noheader", "--format=%D %t"]);
            states.is_ok_and(|s| s.trim() == "2 idle")
        };
        cluster.until("two idle nodes", idle)?;
        Ok(cluster)
    }

    /// Path of a file in the cluster's folder.
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Working folder of the tests.
    pub fn work(&self) -> PathBuf {
        self.path("work")
    }

    fn daemon(&mut self, program: &str, arguments: &[String]) -> Result<()> {
        let name = program.trim_start_matches("sbin/");
        let log = self.path(&format!("log/{name}-{}.out", self.daemons.len()));
        let out = fs::File::create(log)?;
        let child = self
            .programs
            .command(program, &self.path("slurm.conf"))
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(out.try_clone()?)
            .stderr(out)
            .spawn()
            .with_context(|| format!("cannot start {program}"))?;
        self.daemons.push(child);
        Ok(())
    }

    fn until(&self, what: &str, there: impl Fn() -> bool) -> Result<()> {
        let begun = Instant::now();
        while !there() {
            if begun.elapsed() > START {
                bail!("no {what} after {} s\n{}", START.as_secs(), self.logs());
            }
            std::thread::sleep(Duration::from_millis(200));
        }
        Ok(())
    }

    /// Output of a Slurm command.
    ///
    /// # Errors
    /// If it fails.
    pub fn slurm(&self, program: &str, arguments: &[&str]) -> Result<String> {
        let mut command = self
            .programs
            .command(&format!("bin/{program}"), &self.path("slurm.conf"));
        let output = command.args(arguments).output()?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
            bail!("{program} {}: {said}", arguments.join(" "));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }

    /// A command that runs a program which finds the cluster's commands.
    pub fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        self.programs
            .environment(&mut command, &self.path("slurm.conf"));
        command.current_dir(self.work());
        command
    }

    /// The last lines of the daemons' logs.
    pub fn logs(&self) -> String {
        /// Lines of each log that are shown.
        const LINES: usize = 15;
        let entries = fs::read_dir(self.path("log")).into_iter().flatten();
        let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
        paths.sort();
        let mut text = String::new();
        for path in paths {
            let log = fs::read_to_string(&path).unwrap_or_default();
            let lines: Vec<&str> = log.lines().collect();
            let last = &lines[lines.len().saturating_sub(LINES)..];
            text += &format!("--- {}\n{}\n", path.display(), last.join("\n"));
        }
        text
    }
}

impl Drop for Cluster<'_> {
    fn drop(&mut self) {
        let _ = self.slurm("scancel", &["--state=RUNNING"]);
        let _ = self.slurm("scancel", &["--state=PENDING"]);
        // End the nodes before their controller, munge last.
        for daemon in self.daemons.iter_mut().rev() {
            let _ = Command::new("kill").arg(daemon.id().to_string()).status();
            let begun = Instant::now();
            while daemon.try_wait().is_ok_and(|s| s.is_none()) {
                if begun.elapsed() > Duration::from_secs(5) {
                    let _ = daemon.kill();
                    let _ = daemon.wait();
                    break;
                }
                std::thread::sleep(Duration::from_millis(50));
            }
        }
    }
}

/// `slurm.conf`: two nodes with one processor each on this host, on free ports.
fn configuration(programs: &Programs, folder: &Path, munge: &Path) -> Result<String> {
    let word = |program: &str, argument: &[&str]| -> Result<String> {
        let output = Command::new(program).args(argument).output()?;
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let (host, user) = (word("hostname", &[])?, word("id", &["-un"])?);
    // All listeners are held at the same time, so that their ports differ.
    let free: Vec<TcpListener> = (0..3)
        .map(|_| TcpListener::bind(("127.0.0.1", 0)))
        .collect::<std::io::Result<_>>()?;
    let ports = free.iter().map(|l| Ok(l.local_addr()?.port()));
    let ports = ports.collect::<std::io::Result<Vec<u16>>>()?;
    let at = |name: &str| folder.join(name).display().to_string();
    let mut text = format!(
        "ClusterName=test\nSlurmctldHost={host}\nSlurmUser={user}\nSlurmdUser={user}\n\
         AuthType=auth/munge\nAuthInfo=socket={munge}\nCredType=cred/munge\nPluginDir={plugins}\n\
         StateSaveLocation={state}\nSlurmdSpoolDir={spool}/%n\nSlurmctldPidFile={run}/ctld.pid\n\
         SlurmdPidFile={run}/slurmd-%n.pid\nSlurmctldLogFile={log}/slurmctld.log\n\
         SlurmdLogFile={log}/slurmd-%n.log\nSlurmctldPort={port}\n\
         ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nSwitchType=switch/none\n\
         MpiDefault=none\nSelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\n\
         ReturnToService=2\nAccountingStorageType=accounting_storage/none\n\
         JobAcctGatherType=jobacct_gather/none\n\
         SchedulerParameters=sched_interval=1,batch_sched_delay=0\n",
        munge = munge.display(),
        plugins = programs.plugins.display(),
        state = at("state"),
        spool = at("spool"),
        run = at("run"),
        log = at("log"),
        port = ports[0],
    );
    for (node, port) in NODES.iter().zip(&ports[1..]) {
        text += &format!(
            "NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 State=UNKNOWN\n"
        );
    }
    text += &format!(
        "PartitionName=all Nodes={} Default=YES MaxTime=10 State=UP\n",
        NODES.join(",")
    );
    Ok(text)
}
