//! Default classes of a document.

use roxmltree::Node;

/// What an element, else its default class, else a class around that, says.
///
/// An element that names no class has the `childclass` of the nearest element around it. `of` reads
/// the element, and the elements of a class, of which the last that says it counts. `root` is the
/// document's root element.
pub fn said<T>(
    root: Node<'_, '_>,
    node: Node<'_, '_>,
    of: impl Fn(Node<'_, '_>) -> Option<T>,
) -> Option<T> {
    if let Some(own) = of(node) {
        return Some(own);
    }
    let sections = root.children().filter(|n| n.has_tag_name("default"));
    let sections: Vec<Node<'_, '_>> = sections.collect();
    let given = || {
        let mut around = node.ancestors().skip(1);
        around.find_map(|n| n.attribute("childclass"))
    };
    let class = node.attribute("class").or_else(given);
    let named = class.and_then(|class| {
        let mut all = sections.iter().flat_map(|s| s.descendants());
        all.find(|n| n.has_tag_name("default") && n.attribute("class") == Some(class))
    });
    let around = named.into_iter().flat_map(|n| n.ancestors());
    let around = around.filter(|n| n.has_tag_name("default"));
    // Elements directly in a section are of the class of all; the last section that says it counts.
    let mut classes = around.chain(sections.iter().rev().copied());
    classes.find_map(|class| class.children().rev().find_map(&of))
}
