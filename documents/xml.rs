//! The document as XML: replaces includes by their text, and refuses input that would crash a
//! parser.

use crate::guard::one_line;

/// Reason why a document is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{document}: {message}")]
pub struct Fault {
    /// Name or path of the document, or of the included one.
    pub document: String,
    /// The problem, with its line if known.
    pub message: String,
}

impl Fault {
    /// Describes a problem of a document.
    pub fn new(document: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            document: document.into(),
            message: message.into(),
        }
    }
}

/// Maximum depth of a chain of `<include>`.
const MAX_INCLUDE_DEPTH: usize = 8;

/// Maximum number of includes of one document.
///
/// A few files that include each other several times could otherwise fill the memory. MuJoCo's
/// largest models have some dozens.
const MAX_INCLUDES: usize = 1000;

/// Maximum nesting of elements: robots have about 30 levels, and ropes of 200 bodies fit.
///
/// Parsers and engines follow levels by recursion and use some kB of the stack per level.
pub const MAX_LEVELS: usize = 256;

/// Parses the document `name`.
///
/// # Errors
/// If it is not well-formed, with line and column, or if its elements are nested endlessly.
pub fn parse<'a>(name: &str, xml: &'a str) -> Result<roxmltree::Document<'a>, Fault> {
    if levels(xml) > MAX_LEVELS {
        let message =
            format!("its elements are nested deeper than {MAX_LEVELS}: is an end tag missing?");
        return Err(Fault::new(name, message));
    }
    roxmltree::Document::parse(xml).map_err(|e| {
        let message = format!("is not well-formed XML: {}", one_line(&e.to_string()));
        Fault::new(name, message)
    })
}

/// Maximum number of simultaneously open elements, found without recursion; any number if the text
/// is no XML.
fn levels(xml: &str) -> usize {
    let (mut open, mut most) = (0_usize, 0);
    let mut rest = xml;
    while let Some(at) = rest.find('<') {
        rest = &rest[at..];
        let passed = |end: &str| rest.find(end).map_or("", |i| &rest[i + end.len()..]);
        rest = if rest.starts_with("<!--") {
            passed("-->")
        } else if rest.starts_with("<![CDATA[") {
            passed("]]>")
        } else if rest.starts_with("<?") {
            passed("?>")
        } else if rest.starts_with("</") {
            open = open.saturating_sub(1);
            passed(">")
        } else {
            let end = end_of_tag(rest);
            if !rest[..end].ends_with('/') {
                open += 1;
                most = most.max(open);
            }
            &rest[end..]
        };
    }
    most
}

/// Position of the `>` of a tag, outside of quotes; the end of the text if there is none.
fn end_of_tag(tag: &str) -> usize {
    let mut quote = None;
    for (i, b) in tag.bytes().enumerate() {
        match (quote, b) {
            (None, b'>') => return i,
            (None, b'"' | b'\'') => quote = Some(b),
            (Some(q), b) if q == b => quote = None,
            _ => {}
        }
    }
    tag.len()
}

/// The first `eulerseq` that is no order of three axes, and its node. Parsers assume three letters.
#[must_use]
pub fn wrong_eulerseq<'a>(
    document: &'a roxmltree::Document<'_>,
) -> Option<(roxmltree::Node<'a, 'a>, &'a str)> {
    let mut given = document
        .descendants()
        .filter_map(|n| Some((n, n.attribute("eulerseq")?)));
    let axes = |text: &str| text.len() == 3 && text.chars().all(|c| "xyzXYZ".contains(c));
    given.find(|(_, text)| !axes(text))
}

/// The first number that no machine has, its node, and what is wrong with it: one that is not
/// finite, a mass or density below zero, a time step of zero or less. Engines compute with some of
/// these without a word.
#[must_use]
pub fn wrong_number<'a>(
    document: &'a roxmltree::Document<'_>,
) -> Option<(roxmltree::Node<'a, 'a>, String)> {
    // A thing may be called `inf`; references to it are no numbers.
    let named = |text: &str| {
        let names = document.descendants().filter_map(|n| n.attribute("name"));
        names
            .chain(document.descendants().filter_map(|n| n.attribute("class")))
            .any(|n| n == text)
    };
    let wrong = |key: &str, text: &str| {
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|x| x.parse().ok()).collect();
        let numbers = numbers?;
        if numbers.iter().any(|x| !x.is_finite()) {
            return (!named(text)).then_some("is not finite");
        }
        let below = |least: f64| numbers.iter().any(|x| *x < least);
        match key {
            "mass" | "density" if below(0.0) => Some("is below 0"),
            "timestep" if below(f64::MIN_POSITIVE) => Some("is no positive number of seconds"),
            _ => None,
        }
    };
    document.descendants().find_map(|node| {
        node.attributes().find_map(|given| {
            let (key, text) = (given.name(), given.value());
            Some((node, format!("{key}=\"{text}\" {}", wrong(key, text)?)))
        })
    })
}

/// The document `xml` with every `<include file="…"/>` replaced.
///
/// The replacement is the children of the root of the file, which `load` reads.
///
/// # Errors
/// If a file is missing or not well-formed, or if includes are endless.
pub fn spliced(
    name: &str,
    xml: &str,
    load: &dyn Fn(&str) -> Result<String, Fault>,
) -> Result<String, Fault> {
    splice(name, xml, 0, &mut MAX_INCLUDES.clone(), load)
}

/// [`spliced`] at some depth of includes; `left` is how many more may be followed.
fn splice(
    name: &str,
    xml: &str,
    depth: usize,
    left: &mut usize,
    load: &dyn Fn(&str) -> Result<String, Fault>,
) -> Result<String, Fault> {
    let fault = |message: String| Fault::new(name, message);
    if depth > MAX_INCLUDE_DEPTH {
        return Err(fault(format!(
            "includes are nested deeper than {MAX_INCLUDE_DEPTH}: is there a cycle?"
        )));
    }
    let document = parse(name, xml)?;
    let mut out = String::with_capacity(xml.len());
    let mut copied = 0;
    for node in document.descendants().filter(|n| n.has_tag_name("include")) {
        let file = node.attribute("file").ok_or_else(|| {
            let line = document.text_pos_at(node.range().start).row;
            fault(format!("line {line}: <include> has no `file`"))
        })?;
        *left = left
            .checked_sub(1)
            .ok_or_else(|| fault(format!("more than {MAX_INCLUDES} files are included")))?;
        let text = splice(file, &load(file)?, depth + 1, left, load)?;
        let included = parse(file, &text)?;
        let root = included.root_element();
        out.push_str(&xml[copied..node.range().start]);
        if let (Some(first), Some(last)) = (root.first_child(), root.last_child()) {
            out.push_str(&text[first.range().start..last.range().end]);
        }
        copied = node.range().end;
    }
    out.push_str(&xml[copied..]);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_those_of_elements_alone() {
        let xml = "<?xml version='1.0'?><a b='>'><!-- <c><d> --><e f=\"/>\"/><g>x</g><![CDATA[<h><i>]]></a>";
        assert_eq!(levels(xml), 2);
        assert_eq!(levels("<a><b"), 2);
    }
}
