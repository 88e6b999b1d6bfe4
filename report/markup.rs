//! Text for HTML and SVG: escaping and width estimates.
//!
//! A file without scripts cannot measure its own text, so layout works with an estimate that is
//! generous for the common sans-serif fonts.

/// `text` with the five XML special characters escaped and control characters removed.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\n' | '\t' => escaped.push(c),
            // XML 1.0 cannot represent these.
            c if c.is_control() || c == '\u{fffe}' || c == '\u{ffff}' => {}
            c => escaped.push(c),
        }
    }
    escaped
}

/// Estimated width of `text` at a font size of `size`, in the unit of `size`.
#[must_use]
pub fn text_width(text: &str, size: f64) -> f64 {
    text.chars().map(advance).sum::<f64>() * size
}

/// Width of a character as a fraction of the font size.
fn advance(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' => 0.31,
        ' ' | '\u{a0}' | '\u{202f}' | 'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' | '-' | '°' => {
            0.41
        }
        '⁰' | '¹' | '²' | '³' | '⁴' | '⁵' | '⁶' | '⁷' | '⁸' | '⁹' | '⁻' => 0.42,
        'm' | 'w' | 'M' | 'W' | '%' | '@' | '—' | '…' => 0.94,
        '0'..='9' | 'a'..='z' => 0.635,
        'A'..='Z' | '_' => 0.7,
        '−' | '±' | '×' | '=' | '+' => 0.84,
        c if c.is_ascii() => 0.65,
        // Accented Latin and Greek letters are about as wide as other letters; the rest may be
        // twice that.
        c if (c as u32) < 0x0500 => 0.68,
        _ => 1.0,
    }
}

/// `text`, truncated with an ellipsis if it would be wider than `width` at `size`.
#[must_use]
pub fn fit(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_owned();
    }
    let mut kept = String::new();
    let mut used = advance('…') * size;
    for c in text.chars() {
        used += advance(c) * size;
        if used > width {
            break;
        }
        kept.push(c);
    }
    kept.truncate(kept.trim_end().len());
    kept.push('…');
    kept
}

/// `text` with its first letter in upper case, unless it begins with an identifier such as
/// `rod_yaw`.
#[must_use]
pub fn capitalise(text: &str) -> String {
    if text
        .split_whitespace()
        .next()
        .is_some_and(|word| word.contains(['_', '.']))
    {
        return text.to_owned();
    }
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_characters_are_escaped_and_control_characters_dropped() {
        assert_eq!(
            escape("a<b & \"c\" > 'd'\u{0}\u{7}"),
            "a&lt;b &amp; &quot;c&quot; &gt; &#39;d&#39;"
        );
    }

    #[test]
    fn a_cut_text_is_no_wider_than_asked() {
        let long = "a label that nobody could fit into a narrow plot";
        let cut = fit(long, 12.0, 80.0);
        assert!(cut.ends_with('…') && text_width(&cut, 12.0) <= 80.0);
        assert_eq!(fit("short", 12.0, 80.0), "short");
    }
}
