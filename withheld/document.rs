//! An MJCF document as a tree that can be edited and written again.
//!
//! A world differs from its study's model in attributes of the text. MuJoCo compiles the edited
//! text as it compiles any model. MuJoCo has shortcuts for bodies whose centre and axes are those
//! of the frame; none of them is thus chosen from the model before the edit.

use std::fmt::Write as _;

/// An element with its attributes, in the order of the text.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Tag.
    pub tag: String,
    /// Attributes.
    pub attributes: Vec<(String, String)>,
    /// Child elements.
    pub children: Vec<Element>,
}

impl Element {
    /// An element without attributes.
    #[must_use]
    pub fn new(tag: &str) -> Self {
        Self {
            tag: tag.to_owned(),
            attributes: Vec::new(),
            children: Vec::new(),
        }
    }

    /// Reads a document.
    ///
    /// # Errors
    /// Returns the parser's message if the text is not XML.
    pub fn parse(text: &str) -> Result<Self, String> {
        let document = roxmltree::Document::parse(text).map_err(|e| e.to_string())?;
        Ok(Self::from_node(document.root_element()))
    }

    fn from_node(node: roxmltree::Node<'_, '_>) -> Self {
        let attributes = node.attributes();
        Self {
            tag: node.tag_name().name().to_owned(),
            attributes: attributes
                .map(|a| (a.name().to_owned(), a.value().to_owned()))
                .collect(),
            children: node
                .children()
                .filter(roxmltree::Node::is_element)
                .map(Self::from_node)
                .collect(),
        }
    }

    /// The document as text.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.write(&mut out, 0);
        out
    }

    fn write(&self, out: &mut String, depth: usize) {
        let indent = "  ".repeat(depth);
        let _ = write!(out, "{indent}<{}", self.tag);
        for (name, value) in &self.attributes {
            let value = value
                .replace('&', "&amp;")
                .replace('<', "&lt;")
                .replace('"', "&quot;");
            let _ = write!(out, " {name}=\"{value}\"");
        }
        if self.children.is_empty() {
            out.push_str("/>\n");
            return;
        }
        out.push_str(">\n");
        for child in &self.children {
            child.write(out, depth + 1);
        }
        let _ = writeln!(out, "{indent}</{}>", self.tag);
    }

    /// The text of an attribute.
    #[must_use]
    pub fn get(&self, attribute: &str) -> Option<&str> {
        let mut all = self.attributes.iter();
        all.find(|(n, _)| n == attribute).map(|(_, v)| v.as_str())
    }

    /// The numbers of an attribute; empty if the attribute is missing.
    #[must_use]
    pub fn numbers(&self, attribute: &str) -> Vec<f64> {
        let text = self.get(attribute).unwrap_or_default();
        text.split_whitespace()
            .filter_map(|w| w.parse().ok())
            .collect()
    }

    /// The first number of an attribute.
    #[must_use]
    pub fn number(&self, attribute: &str) -> Option<f64> {
        self.numbers(attribute).first().copied()
    }

    /// Writes an attribute.
    pub fn set(&mut self, attribute: &str, value: impl Into<String>) {
        let value = value.into();
        match self.attributes.iter_mut().find(|(n, _)| n == attribute) {
            Some((_, old)) => *old = value,
            None => self.attributes.push((attribute.to_owned(), value)),
        }
    }

    /// Writes the numbers of an attribute so that reading them back gives the same bits.
    pub fn set_numbers(&mut self, attribute: &str, values: &[f64]) {
        let words: Vec<String> = values.iter().map(f64::to_string).collect();
        self.set(attribute, words.join(" "));
    }

    /// The first element of a tag, this element included; the name must match if one is given.
    #[must_use]
    pub fn find(&self, tag: &str, name: Option<&str>) -> Option<&Self> {
        if self.is(tag, name) {
            return Some(self);
        }
        self.children.iter().find_map(|c| c.find(tag, name))
    }

    /// Mutable version of [`Self::find`].
    pub fn find_mut(&mut self, tag: &str, name: Option<&str>) -> Option<&mut Self> {
        if self.is(tag, name) {
            return Some(self);
        }
        self.children.iter_mut().find_map(|c| c.find_mut(tag, name))
    }

    /// The first element named `name` inside the element `section`, whatever its tag.
    pub fn find_in_mut(&mut self, section: &str, name: &str) -> Option<&mut Self> {
        let inside = self.find_mut(section, None)?;
        let mut all = inside.children.iter_mut();
        all.find(|c| c.get("name") == Some(name))
    }

    fn is(&self, tag: &str, name: Option<&str>) -> bool {
        self.tag == tag && (name.is_none() || self.get("name") == name)
    }

    /// Calls `visit` on this element and all descendants, each with the name of the body that
    /// contains it.
    pub fn walk<'a>(&'a self, visit: &mut dyn FnMut(&'a Self, &'a str)) {
        self.walk_in("world", visit);
    }

    fn walk_in<'a>(&'a self, body: &'a str, visit: &mut dyn FnMut(&'a Self, &'a str)) {
        visit(self, body);
        let body = match self.tag.as_str() {
            "body" => self.get("name").unwrap_or(body),
            _ => body,
        };
        for child in &self.children {
            child.walk_in(body, visit);
        }
    }
}
