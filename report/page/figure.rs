//! A plot with a title above it and a caption below that explains how to read it.

use crate::markup::escape;
use crate::plot::{NARROW, Plot, WIDE};

/// A figure: title, plot, caption.
pub struct Figure {
    title: String,
    caption: String,
    plots: Vec<Box<dyn Plot + Send + Sync>>,
}

impl std::fmt::Debug for Figure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Figure")
            .field("title", &self.title)
            .field("caption", &self.caption)
            .finish_non_exhaustive()
    }
}

impl Figure {
    /// A figure; `title` says what it shows, `caption` how to read it.
    pub fn new(
        title: impl Into<String>,
        plot: impl Plot + Send + Sync + 'static,
        caption: impl Into<String>,
    ) -> Self {
        Self {
            title: title.into(),
            caption: caption.into(),
            plots: vec![Box::new(plot)],
        }
    }

    /// Adds a plot beneath the existing ones, under the same title.
    #[must_use]
    pub fn beneath(mut self, plot: impl Plot + Send + Sync + 'static) -> Self {
        self.plots.push(Box::new(plot));
        self
    }

    /// The figure as HTML; one with a row to itself has a second layout for wide screens.
    pub(super) fn html(&self, id: &str, alone: bool) -> String {
        let draw = |(i, plot): (usize, &(dyn Plot + Send + Sync))| {
            let (id, class) = match i {
                0 => (id.to_owned(), ""),
                i => (format!("{id}-{i}"), "beneath"),
            };
            let narrow = plot.svg(&id, NARROW);
            let drawing = if alone {
                let wide = plot.svg(&format!("{id}w"), WIDE);
                format!(
                    "<div class=\"on-narrow\">{narrow}</div><div class=\"on-wide\">{wide}</div>"
                )
            } else {
                narrow
            };
            match class {
                "" => drawing,
                class => format!("<div class=\"{class}\">{drawing}</div>"),
            }
        };
        let drawing: String = self
            .plots
            .iter()
            .map(|plot| &**plot)
            .enumerate()
            .map(draw)
            .collect();
        let class = if alone { "alone" } else { "" };
        let caption = if self.caption.is_empty() {
            String::new()
        } else {
            format!("<figcaption>{}</figcaption>", escape(&self.caption))
        };
        format!(
            "<figure class=\"{class}\"><h3>{}</h3>{drawing}{caption}</figure>\n",
            escape(&self.title)
        )
    }
}
