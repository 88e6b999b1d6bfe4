//! Names and numbers separated by colons, as in options and settings.

use anyhow::Result;
use asid_results::naming::count;

use crate::cli::settings::wrong;

fn number(key: &str, text: &str) -> Result<f64> {
    let parsed: Option<f64> = text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    parsed.ok_or_else(|| wrong(key, format!("`{text}` is not a finite number")))
}

/// Parses a name, which may hold colons, followed by `N` numbers.
pub fn name_and<const N: usize>(key: &str, text: &str) -> Result<(String, [f64; N])> {
    let parts: Vec<&str> = text.rsplitn(N + 1, ':').collect();
    let form = || {
        wrong(
            key,
            format!(
                "`{text}` is not a name and {}, with colons between",
                count(N, "number")
            ),
        )
    };
    let Some((name, numbers)) = parts.split_last().filter(|(_, n)| n.len() == N) else {
        return Err(form());
    };
    let mut values = [0.0; N];
    for (to, part) in values.iter_mut().rev().zip(numbers) {
        *to = number(key, part)?;
    }
    Ok(((*name).to_owned(), values))
}

/// Parses an optional name and a number above zero.
pub fn maybe_name(key: &str, text: &str) -> Result<(String, f64)> {
    let (name, value) = text.rsplit_once(':').unwrap_or(("", text));
    let value = number(key, value)?;
    if value <= 0.0 {
        return Err(wrong(key, format!("`{text}`: must be above 0")));
    }
    Ok((name.to_owned(), value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_may_hold_colons() {
        let (name, range) = name_and::<2>("k", "joint/robot:elbow/damping:0.1:2").unwrap();
        assert_eq!((&*name, range), ("joint/robot:elbow/damping", [0.1, 2.0]));
        assert!(name_and::<2>("k", "a:1").is_err());
        assert!(name_and::<1>("k", "a:x").is_err());
        assert_eq!(maybe_name("k", "2.5").unwrap(), (String::new(), 2.5));
        assert!(maybe_name("k", "a:-1").is_err());
    }
}
