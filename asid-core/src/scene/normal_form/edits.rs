//! Edits of the text of a document, which leave all else as it is.

use std::borrow::Cow;
use std::ops::Range;

use roxmltree::Node;

/// Ranges of a text and their replacements; an empty range is an insertion.
#[derive(Debug, Default)]
pub(super) struct Edits(Vec<(Range<usize>, String)>);

impl Edits {
    /// Gives an element an attribute that is a list of numbers.
    pub(super) fn set_numbers(&mut self, node: Node<'_, '_>, attribute: &str, values: &[f64]) {
        let texts: Vec<String> = values.iter().map(|x| format!("{x}")).collect();
        self.set(node, attribute, &texts.join(" "));
    }

    /// Gives an element an attribute.
    pub(super) fn set(&mut self, node: Node<'_, '_>, attribute: &str, value: &str) {
        let value = value.replace('&', "&amp;").replace('<', "&lt;");
        let value = value.replace('"', "&quot;").replace('\'', "&apos;");
        self.0.push(match node.attribute_node(attribute) {
            Some(own) => (own.range_value(), value),
            None => {
                let at = after_name(node);
                (at..at, format!(" {attribute}=\"{value}\""))
            }
        });
    }

    /// Removes an attribute that an element has.
    pub(super) fn remove(&mut self, node: Node<'_, '_>, attribute: &str) {
        if let Some(own) = node.attribute_node(attribute) {
            self.0.push((own.range(), String::new()));
        }
    }

    /// Removes the tags around the content of an element.
    pub(super) fn strip(&mut self, node: Node<'_, '_>) {
        let (text, whole) = (node.document().input_text(), node.range());
        let attributes = node.attributes().map(|a| a.range().end);
        let from = attributes.max().unwrap_or_else(|| after_name(node));
        let open = text[from..whole.end].find('>');
        let open = open.map_or(whole.end, |i| from + i + 1);
        self.0.push((whole.start..open, String::new()));
        if let Some(close) = text[open..whole.end].rfind("</") {
            self.0.push((open + close..whole.end, String::new()));
        }
    }

    /// The text with all edits; the text itself without any.
    pub(super) fn applied(mut self, text: &str) -> Cow<'_, str> {
        if self.0.is_empty() {
            return Cow::Borrowed(text);
        }
        self.0.sort_by_key(|(range, _)| (range.start, range.end));
        let mut out = String::with_capacity(text.len());
        let mut copied = 0;
        for (range, with) in self.0 {
            out.push_str(&text[copied..range.start]);
            out.push_str(&with);
            copied = range.end;
        }
        out.push_str(&text[copied..]);
        Cow::Owned(out)
    }
}

/// Place in the text after the name in the tag of an element.
fn after_name(node: Node<'_, '_>) -> usize {
    let start = node.range().start;
    let tag = &node.document().input_text()[start..];
    let end = tag.find(|c: char| c.is_whitespace() || c == '/' || c == '>');
    start + end.unwrap_or(tag.len())
}
