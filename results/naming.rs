//! How sets of effects read.

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
        [first @ .., last] => format!("{law} at {} and {last}", first.join(", ")),
        [] => String::new(),
    };
    laws.iter().map(told).collect()
}

#[cfg(test)]
mod tests {
    use super::grouped;

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
