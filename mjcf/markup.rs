//! Edits of an MJCF document that preserve all other text.
//!
//! Parsing and printing a document loses its comments, its order and its line layout. Here only the
//! tags of elements that change are written anew, in place.

use std::collections::BTreeMap;

use roxmltree::{Document, Node, NodeId};

/// Changes of one element.
#[derive(Debug, Default)]
struct Change {
    tag: Option<String>,
    /// New values by attribute; `None` removes the attribute.
    attributes: Vec<(String, Option<String>)>,
    /// XML to append to its children.
    children: String,
    /// XML to insert after it.
    after: String,
}

/// Changes of one document, collected and then written at once.
#[derive(Debug)]
pub struct Markup<'d> {
    document: &'d Document<'d>,
    changes: BTreeMap<u32, Change>,
}

impl<'d> Markup<'d> {
    /// No changes yet.
    #[must_use]
    pub fn new(document: &'d Document<'d>) -> Self {
        Self {
            document,
            changes: BTreeMap::new(),
        }
    }

    fn change(&mut self, node: Node<'_, '_>) -> &mut Change {
        self.changes.entry(node.id().get()).or_default()
    }

    /// The value that an attribute will have.
    #[must_use]
    pub fn get(&self, node: Node<'d, 'd>, attribute: &str) -> Option<String> {
        let changed = self.changes.get(&node.id().get()).and_then(|c| {
            let found = c.attributes.iter().find(|(name, _)| name == attribute);
            found.map(|(_, value)| value.clone())
        });
        changed.unwrap_or_else(|| node.attribute(attribute).map(str::to_owned))
    }

    /// Sets an attribute.
    pub fn set(&mut self, node: Node<'_, '_>, attribute: &str, value: impl Into<String>) {
        self.put(node, attribute, Some(value.into()));
    }

    /// Sets an attribute to a list of numbers.
    pub fn set_numbers(&mut self, node: Node<'_, '_>, attribute: &str, values: &[f64]) {
        self.set(node, attribute, numbers(values));
    }

    /// Removes an attribute.
    pub fn remove(&mut self, node: Node<'_, '_>, attribute: &str) {
        self.put(node, attribute, None);
    }

    fn put(&mut self, node: Node<'_, '_>, attribute: &str, value: Option<String>) {
        let attributes = &mut self.change(node).attributes;
        attributes.retain(|(name, _)| name != attribute);
        attributes.push((attribute.to_owned(), value));
    }

    /// Gives an element another tag.
    pub fn rename(&mut self, node: Node<'_, '_>, tag: &str) {
        self.change(node).tag = Some(tag.to_owned());
    }

    /// Appends XML to the children of an element.
    pub fn append(&mut self, node: Node<'_, '_>, xml: &str) {
        self.change(node).children += xml;
    }

    /// Inserts XML after an element.
    pub fn after(&mut self, node: Node<'_, '_>, xml: &str) {
        self.change(node).after += xml;
    }

    /// The document with all changes.
    #[must_use]
    pub fn text(&self) -> String {
        let text = self.document.input_text();
        // Ranges of the text and their replacements; an empty range is an insertion.
        let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
        for (&id, change) in &self.changes {
            let Some(node) = self.document.get_node(NodeId::new(id)) else {
                continue;
            };
            edits.extend(edits_of(text, node, change));
        }
        edits.sort_by_key(|(range, _)| (range.start, range.end));
        let mut out = String::with_capacity(text.len());
        let mut copied = 0;
        for (range, with) in edits {
            out.push_str(&text[copied..range.start]);
            out.push_str(&with);
            copied = range.end;
        }
        out.push_str(&text[copied..]);
        out
    }
}

/// The edits that one element needs.
fn edits_of(
    text: &str,
    node: Node<'_, '_>,
    change: &Change,
) -> Vec<(std::ops::Range<usize>, String)> {
    let whole = node.range();
    let old = node.tag_name().name();
    let tag = change.tag.as_deref().unwrap_or(old);
    // The end of the opening tag: the first `>` after the last attribute.
    let from = node.attributes().map(|a| a.range().end).max();
    let from = from.unwrap_or(whole.start + 1 + old.len());
    let close = text[from..whole.end]
        .find('>')
        .map_or(whole.end, |i| from + i + 1);
    let empty = text[..close].ends_with("/>");
    let mut opening = format!("<{tag}");
    let fresh = |name: &str| change.attributes.iter().find(|(n, _)| n == name);
    let mut put = |name: &str, value: &str| {
        opening += &format!(" {name}=\"{}\"", escaped(value));
    };
    for attribute in node.attributes() {
        match fresh(attribute.name()) {
            Some((_, None)) => {}
            Some((name, Some(value))) => put(name, value),
            None => put(attribute.name(), attribute.value()),
        }
    }
    for (name, value) in &change.attributes {
        if let (Some(value), None) = (value, node.attribute(name.as_str())) {
            put(name, value);
        }
    }
    let mut edits = Vec::new();
    if empty {
        let rest = if change.children.is_empty() {
            "/>".to_owned()
        } else {
            format!(">{}</{tag}>", change.children)
        };
        edits.push((whole.start..close, opening + &rest));
    } else {
        edits.push((whole.start..close, opening + ">"));
        let end = text[..whole.end].rfind("</").unwrap_or(whole.end);
        edits.push((end..whole.end, format!("{}</{tag}>", change.children)));
    }
    if !change.after.is_empty() {
        edits.push((whole.end..whole.end, change.after.clone()));
    }
    edits
}

/// Numbers as the text of an attribute, each the shortest that reads back as the same value.
#[must_use]
pub fn numbers(values: &[f64]) -> String {
    let texts: Vec<String> = values.iter().map(|x| format!("{x}")).collect();
    texts.join(" ")
}

/// Escapes a text as the value of an attribute.
#[must_use]
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_changes_is_written_again() {
        let text =
            "<mujoco>\n  <!-- kept -->\n  <a  name='x'   size=\"1\"/>\n  <b><c/></b>\n</mujoco>";
        let document = Document::parse(text).unwrap();
        let find = |tag: &str| {
            document
                .descendants()
                .find(|n| n.has_tag_name(tag))
                .unwrap()
        };
        let mut markup = Markup::new(&document);
        markup.set_numbers(find("a"), "size", &[0.25, -3.0]);
        markup.set(find("a"), "say", "\"<&");
        markup.rename(find("b"), "d");
        markup.append(find("b"), "<e/>");
        markup.append(find("c"), "<f/>");
        markup.after(find("a"), "<g/>");
        assert_eq!(markup.get(find("a"), "size").as_deref(), Some("0.25 -3"));
        assert_eq!(
            markup.text(),
            "<mujoco>\n  <!-- kept -->\n  <a name=\"x\" size=\"0.25 -3\" say=\"&quot;&lt;&amp;\"/><g/>\n  <d><c><f/></c><e/></d>\n</mujoco>"
        );
    }

    #[test]
    fn an_attribute_is_taken_away() {
        let document = Document::parse("<m><a x='1' y='a > b'>text</a></m>").unwrap();
        let node = document.root_element().first_child().unwrap();
        let mut markup = Markup::new(&document);
        markup.remove(node, "x");
        assert_eq!(markup.text(), "<m><a y=\"a > b\">text</a></m>");
    }

    #[test]
    fn nothing_changes_nothing() {
        let text = "<m ><a x = '1'></a ></m>";
        let document = Document::parse(text).unwrap();
        assert_eq!(Markup::new(&document).text(), text);
    }
}
