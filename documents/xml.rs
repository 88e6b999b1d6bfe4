//! The document as XML: includes spliced in by text, and what would end a parser refused first.

use crate::guard::one_line;

/// Why a document cannot be taken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{document}: {message}")]
pub struct Fault {
    /// Name or path of the document, or of the included one.
    pub document: String,
    /// What is wrong, with its line where known.
    pub message: String,
}

impl Fault {
    /// What is wrong with a document.
    pub fn new(document: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            document: document.into(),
            message: message.into(),
        }
    }
}

/// Deepest chain of `<include>` that is followed.
const MAX_INCLUDE_DEPTH: usize = 8;

/// Most includes of one document that are followed: a few files that include each other several times
/// over would otherwise fill the memory. MuJoCo's largest models have some dozens.
const MAX_INCLUDES: usize = 1000;

/// Levels of elements that a document may have: robots have some 30, and ropes of 200 bodies fit. Parsers and
/// engines follow them by recursion, at some kB of the stack a level.
pub const MAX_LEVELS: usize = 256;

/// Parses the document `name`.
///
/// # Errors
/// When it is not well-formed, with line and column, or its elements are nested without end.
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

/// The most elements of a document that are open at a time, found without recursion; of what is no XML any number.
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

/// Where the `>` of a tag is, outside of quotes; the end of the text where it has none.
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

/// An order of Euler's axes that is none, which parsers take for three letters, and its node.
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

/// The document `xml`, with every `<include file="…"/>` replaced by the children of the root of the file that `load`
/// reads.
///
/// # Errors
/// Where a file is not there or not well-formed, or includes have no end.
pub fn spliced(
    name: &str,
    xml: &str,
    load: &dyn Fn(&str) -> Result<String, Fault>,
) -> Result<String, Fault> {
    splice(name, xml, 0, &mut MAX_INCLUDES.clone(), load)
}

/// [`spliced`], some includes deep; `left` is how many more may be followed.
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
