//! The report of a run: what happened, as data and as a page.
//!
//! [`RunReport`] holds everything that the page shows. It is stored as `trace.json` beside
//! `result.json`, so that the page can be written again from files alone. All quantities are in SI
//! units, seconds and radians unless a `unit` field says otherwise; a `unit` is for display (`m`,
//! `rad`, `deg`).
//!
//! Whatever a run does not have stays empty (`None`, an empty `Vec`): its part of the page is left
//! out, with a remark where a reader would look for it.
//!
//! ```
//! use asid_report::run::RunReport;
//! let report = RunReport { task: "rod-balancing".into(), backend: "rapier".into(), ..RunReport::default() };
//! assert!(report.html().contains("rod-balancing"));
//! ```

mod closing;
mod downstream;
mod episode;
mod exploration;
mod final_density;
mod head;
mod posterior;
mod signals;
mod trace;

pub use asid_results::trace::{FileEntry, NamedText, StageCost};
pub use trace::{
    Downstream, Episode, ExpectedStd, Exploration, LearningCurve, NamedValue, Narrowing,
    ObjectTrack, ParameterReport, Phase, PlanarPath, Prior, RealWorld, Replay, RunReport, SCHEMA,
    Search, Shape, ShapeKind, SideView, Signal, Trial,
};

use std::path::Path;

use asid_core::error::{Error, Result};

use crate::page::Page;

/// Name of the file that holds a [`RunReport`] in a run's folder.
pub const TRACE_FILE: &str = "trace.json";
/// Name of the page in a run's folder.
pub const REPORT_FILE: &str = "report.html";

/// Caption of the 3-D view.
const MACHINE: &str = "The episode in 3-D. Drag to turn it. The slider moves the line in the plots below; a click in a plot \
                       moves the slider.";

impl RunReport {
    /// Whether the simulator predicted what is shown, without anything done in the real world.
    fn predicted(&self) -> bool {
        matches!(self.stage.as_str(), "explore" | "solve")
    }

    /// The report as one self-contained HTML page.
    #[must_use]
    pub fn html(&self) -> String {
        let mut page: Page = head::page(self);
        for section in [
            episode::section(self),
            crate::page::Section::machine(self.view.as_ref(), MACHINE),
            signals::section(self),
            exploration::section(self),
            posterior::section(self),
            downstream::section(self),
            closing::parameters(self),
            closing::costs(self),
            closing::repeat(self),
        ]
        .into_iter()
        .flatten()
        {
            page = page.section(section);
        }
        page.html()
    }

    /// The content of `trace.json`. A non-finite number is written as `null` and read as NaN.
    ///
    /// # Errors
    /// [`Error::Failed`] when serialisation fails, which no content of these types causes.
    pub fn to_json(&self) -> Result<String> {
        serde_json::to_string(self).map_err(|e| Error::Failed(format!("{TRACE_FILE}: {e}")))
    }

    /// Reads the content of a `trace.json`.
    ///
    /// # Errors
    /// [`Error::Failed`] when the text is not such a file, or is of a newer version.
    pub fn from_json(text: &str) -> Result<Self> {
        // Read the version first: in a newer layout the rest may be unreadable.
        #[derive(serde::Deserialize)]
        struct Version {
            schema: u32,
        }
        let failed =
            |e: serde_json::Error| Error::Failed(format!("{TRACE_FILE} is not a run's trace: {e}"));
        let Version { schema } = serde_json::from_str(text).map_err(failed)?;
        if schema > SCHEMA {
            return Err(Error::Failed(format!(
                "{TRACE_FILE} has schema {schema}, this program reads up to {SCHEMA}: use a newer one"
            )));
        }
        serde_json::from_str(text).map_err(failed)
    }

    /// Writes `trace.json` and `report.html` into `folder`, replacing existing ones.
    ///
    /// # Errors
    /// [`Error::File`] when a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        write(&folder.join(TRACE_FILE), &self.to_json()?)?;
        write(&folder.join(REPORT_FILE), &self.html())
    }

    /// Reads the `trace.json` of a finished run's folder.
    ///
    /// # Errors
    /// [`Error::File`] when it cannot be read or is not a trace.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(TRACE_FILE);
        let text = std::fs::read_to_string(&path).map_err(|e| Error::File {
            path: path.clone(),
            message: format!("{e}; a report needs the folder of a finished run"),
        })?;
        Self::from_json(&text).map_err(|e| Error::File {
            path,
            message: e.to_string(),
        })
    }
}

/// Writes a file whole or not at all: first under a temporary name, then renamed.
fn write(path: &Path, text: &str) -> Result<()> {
    let failed = |e: std::io::Error| Error::File {
        path: path.to_path_buf(),
        message: e.to_string(),
    };
    let partial = path.with_extension("partial");
    std::fs::write(&partial, text).map_err(failed)?;
    std::fs::rename(&partial, path).map_err(failed)
}
