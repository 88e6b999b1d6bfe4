//! How numbers of things, lists of names and sets of effects read.

/// A number of things: `1 episode`, `2 episodes`. `what` is one of them, with a regular plural.
#[must_use]
pub fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// Names in a row, with the word `last` before the last: `a`, `a and b`, `a, b and c`.
///
/// Where a name holds that word itself, a comma comes before it: `a and b, and c`.
#[must_use]
pub fn joined(names: &[impl AsRef<str>], last: &str) -> String {
    let holds = |name: &str| name.split_whitespace().any(|word| word == last);
    match names {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [rest @ .., end] => {
            let comma = if names.iter().any(|name| holds(name.as_ref())) {
                ","
            } else {
                ""
            };
            let rest: Vec<&str> = rest.iter().map(AsRef::as_ref).collect();
            format!("{}{comma} {last} {}", rest.join(", "), end.as_ref())
        }
    }
}

/// Effects at their sites (`effect@site`), with those of one law together: `viscous-friction at elbow and wrist`. An effect at one
/// site, or at none, stays as it is. Laws stand in the order of their first sites.
#[must_use]
pub fn grouped(labels: &[String]) -> Vec<String> {
    let mut laws: Vec<(&str, Vec<&str>)> = Vec::new();
    for label in labels {
        let (law, site) = label.split_once('@').unwrap_or((label, ""));
        match laws.iter_mut().find(|(known, _)| *known == law) {
            Some((_, sites)) => sites.push(site),
            None => laws.push((law, vec![site])),
        }
    }
    let told = |(law, sites): &(&str, Vec<&str>)| match &sites[..] {
        [""] => (*law).to_owned(),
        [site] => format!("{law}@{site}"),
        several => format!("{law} at {}", joined(several, "and")),
    };
    laws.iter().map(told).collect()
}

#[cfg(test)]
mod tests {
    use super::{count, grouped, joined};

    #[test]
    fn a_single_thing_is_no_plural_and_a_list_ends_with_its_last_word() {
        assert_eq!(
            [0, 1, 2].map(|n| count(n, "value")),
            ["0 values", "1 value", "2 values"]
        );
        assert_eq!(joined(&["a"], "and"), "a");
        assert_eq!(joined(&["a", "b", "c"], "or"), "a, b or c");
        assert_eq!(
            joined(&["gain at a and b", "drag"], "and"),
            "gain at a and b, and drag"
        );
        assert_eq!(joined(&[] as &[&str], "and"), "");
    }

    #[test]
    fn sites_of_one_law_are_told_together() {
        let told = |labels: &[&str]| {
            let labels: Vec<String> = labels.iter().map(|&l| l.to_owned()).collect();
            grouped(&labels)
        };
        assert_eq!(told(&["drag@ball"]), ["drag@ball"]);
        assert_eq!(told(&["gravity-tilt"]), ["gravity-tilt"]);
        assert_eq!(
            told(&["gain@a", "friction@x", "gain@b", "gain@c/d"]),
            ["gain at a, b and c/d", "friction@x"]
        );
        assert_eq!(told(&[]), Vec::<String>::new());
    }
}
