//! Opens pages in a real browser without a window, and checks their pixels.
//!
//! The browser is Chromium (or Chrome): the one in `ASID_BROWSER`, or the first one found. Without
//! a browser a test prints that it is skipped, and how to run it. No graphics card is needed:
//! SwiftShader, which is part of the browser, draws WebGL.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Names of programs to look for.
const BROWSERS: [&str; 5] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "chrome-headless-shell",
    "chrome",
];

/// Longest time for a page, s. Drawing without a graphics card takes about ten on a busy machine.
const PATIENCE: Duration = Duration::from_secs(180);

/// Script that collects errors, run before any script of the page.
const ERRORS: &str = include_str!("errors.js");
/// Script that moves the slider and checks pixels, run after all scripts of the page.
const PROBE: &str = include_str!("probe.js");

/// Returns a browser, or prints a line and returns `None` where there is none.
pub fn browser() -> Option<PathBuf> {
    let given = std::env::var_os("ASID_BROWSER").map(PathBuf::from);
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let found = given.or_else(|| {
        let named = BROWSERS.iter();
        let mut all = named.flat_map(|b| std::env::split_paths(&folders).map(move |f| f.join(b)));
        all.find(|p| p.is_file())
    });
    if found.is_none() {
        println!(
            "skipped: no Chromium was found; install it (apt-get install chromium), or name one with ASID_BROWSER"
        );
    }
    found
}

/// Opens a page from its file, light or dark, operates its view, and returns what `probe.js`
/// measured.
pub fn seen(browser: &Path, page: &Path, dark: bool) -> Value {
    let html = std::fs::read_to_string(page).unwrap();
    let html = html
        .replacen("<head>", &format!("<head><script>{ERRORS}</script>"), 1)
        .replacen("</body>", &format!("<script>{PROBE}</script></body>"), 1);
    let folder = tempfile::tempdir().unwrap();
    let probed = folder.path().join("probed.html");
    std::fs::write(&probed, html).unwrap();
    let mut command = Command::new(browser);
    command
        .args(["--headless", "--no-sandbox", "--dump-dom", "--no-first-run"])
        .args([
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
        ])
        .args(["--window-size=800,700", "--virtual-time-budget=60000"])
        .arg(format!(
            "--user-data-dir={}",
            folder.path().join("profile").display()
        ));
    if dark {
        command.arg("--blink-settings=preferredColorScheme=0");
    }
    // The page goes to a file, because nothing empties a pipe during the wait.
    let dom = folder.path().join("dom.html");
    let errors = folder.path().join("errors.txt");
    let mut child = command
        .arg(format!("file://{}", probed.display()))
        .stdin(Stdio::null())
        .stdout(std::fs::File::create(&dom).unwrap())
        .stderr(std::fs::File::create(&errors).unwrap())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!(
                "the browser is not done with {} after {PATIENCE:?}",
                page.display()
            );
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let dom = std::fs::read_to_string(&dom).unwrap();
    let told = dom
        .split("PROBED:")
        .nth(1)
        .and_then(|t| t.split(":DEBORP").next());
    let told = told.unwrap_or_else(|| {
        let said = std::fs::read_to_string(&errors).unwrap_or_default();
        panic!("the page told nothing; the browser said: {said}")
    });
    let plain = told
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    serde_json::from_str(&plain).unwrap_or_else(|e| panic!("{e}: {plain}"))
}
