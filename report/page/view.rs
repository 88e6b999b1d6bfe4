//! The machine in 3-D: a canvas that plays an episode, and its scripts.
//!
//! The page contains the data ([`View`]) as JSON. The scripts draw them with WebGL 2, without any
//! library and without fetching anything. They are files beside this one, concatenated into one
//! script of the page:
//!
//! | file | holds |
//! |---|---|
//! | `space.js` | vectors, quaternions, matrices |
//! | `solids.js` | triangles of the shapes and arrows |
//! | `replay.js` | the parsed data; where every part is at a time |
//! | `shaders.js` | what the graphics card computes |
//! | `scene.js` | draws a moment |
//! | `camera.js` | a camera that is turned by dragging |
//! | `player.js` | slider, legend, episodes |
//!
//! Without scripts or WebGL 2 a sentence replaces it; the plots show the same motions.

use asid_results::view::View;

use super::Section;
use crate::markup::escape;

/// The scripts, in an order in which each one's initial run uses only those before it.
const SCRIPTS: [&str; 7] = [
    include_str!("view/space.js"),
    include_str!("view/solids.js"),
    include_str!("view/replay.js"),
    include_str!("view/shaders.js"),
    include_str!("view/scene.js"),
    include_str!("view/camera.js"),
    include_str!("view/player.js"),
];

/// Replacement text where the view cannot be drawn.
const NOT_HERE: &str = "The machine in 3-D needs a browser that runs scripts and has WebGL 2. The plots show the same motions.";

/// The scripts, concatenated.
pub(super) fn scripts() -> String {
    SCRIPTS.concat()
}

/// The HTML of a view, with its data.
pub(super) fn html(view: &View) -> String {
    // Values of these types can always be serialised. A name must not end the script or the page.
    let data = serde_json::to_string(view).unwrap_or_default();
    let data = data
        .replace('&', "\\u0026")
        .replace('<', "\\u003c")
        .replace('>', "\\u003e");
    format!(
        "<div class=\"view\"><p class=\"note\">{}</p><script type=\"application/json\">{data}</script></div>\n",
        escape(NOT_HERE)
    )
}

impl Section {
    /// A section with the machine in 3-D and remarks on it; `None` where there is nothing to see.
    #[must_use]
    pub fn machine(view: Option<&View>, lead: &str) -> Option<Self> {
        let view = view.filter(|v| !v.takes.is_empty() && !v.shapes.is_empty())?;
        let mut section = Self::new("The machine").lead(lead).view(view.clone());
        for note in &view.notes {
            section = section.note(note.clone());
        }
        Some(section)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_results::view::{Shape, Take};

    #[test]
    fn names_cannot_end_the_script_and_come_back() {
        let hostile = "</script><script>alert(1)</script>&\"]]>";
        let view = View {
            parts: vec![hostile.into()],
            shapes: vec![Shape::default()],
            takes: vec![Take::default()],
            ..View::default()
        };
        let html = html(&view);
        assert_eq!(html.matches("</script>").count(), 1);
        let document = roxmltree::Document::parse(&html).unwrap();
        let script = document
            .descendants()
            .find(|n| n.has_tag_name("script"))
            .unwrap();
        let read: View = serde_json::from_str(script.text().unwrap()).unwrap();
        assert_eq!(read, view);
    }

    #[test]
    fn nothing_to_see_is_no_section() {
        assert!(Section::machine(None, "").is_none());
        assert!(Section::machine(Some(&View::default()), "").is_none());
    }
}
