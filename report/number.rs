//! Readable numbers: few digits, real minus signs, units.

/// Text for a non-finite number.
pub const NOT_A_NUMBER: &str = "n/a";

/// `value` with `digits` significant digits; powers of ten outside `1e-4..1e6`.
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return NOT_A_NUMBER.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = digits.clamp(1, 15);
    // Take the exponent after rounding: 9.99 at two digits is 10.
    let scientific = format!("{:.*e}", digits - 1, value);
    let (mantissa, exponent) = split_exponent(&scientific);
    if (-4..6).contains(&exponent) {
        decimals(value, decimals_for(digits, exponent))
    } else {
        format!("{}×10{}", minus(mantissa), superscript(exponent))
    }
}

/// Like [`significant`], without trailing zeros in the decimals: for round numbers such as limits
/// and ranges.
#[must_use]
pub fn round(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    if text.contains('.') && !text.contains('×') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// `value` with a fixed number of decimals and a real minus sign; never a negative zero.
#[must_use]
pub fn decimals(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return NOT_A_NUMBER.to_owned();
    }
    let plain = format!("{value:.decimals$}");
    match plain.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| c == '0' || c == '.') => zero.to_owned(),
        _ => minus(&plain),
    }
}

/// Number of digits of a quantity, so that estimate, truth and interval compare at a glance.
///
/// ```
/// use asid_report::number::Precision;
/// let precision = Precision::of(0.061_23, 0.002_1);
/// assert_eq!(precision.show(0.061_23), "0.0612");
/// assert_eq!(precision.with_uncertainty(0.061_23, 0.002_1), "0.0612\u{a0}±\u{a0}0.0021");
/// assert_eq!(Precision::of(2e-5, 2.4e-6).with_uncertainty(2e-5, 2.4e-6), "(20.0\u{a0}±\u{a0}2.4)×10⁻⁶");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// Decimals after division by `10^exponent`; `None` (four significant digits) without an
    /// uncertainty.
    places: Option<usize>,
    /// A multiple of three; 0 for numbers of moderate size.
    exponent: i32,
}

impl Precision {
    /// Precision for two significant digits of `uncertainty`, which may be NaN if unknown.
    #[must_use]
    pub fn of(value: f64, uncertainty: f64) -> Self {
        if !(uncertainty.is_finite() && uncertainty > 0.0 && value.is_finite()) {
            return Self {
                places: None,
                exponent: 0,
            };
        }
        let last = split_exponent(&format!("{uncertainty:.1e}")).1;
        let size = value.abs().max(uncertainty).log10().floor() as i32;
        let exponent = if (-3..6).contains(&size) {
            0
        } else {
            size.div_euclid(3) * 3
        };
        Self {
            places: Some(decimals_for(2, last - exponent).min(12)),
            exponent,
        }
    }

    /// `value` with its power of ten.
    #[must_use]
    pub fn show(self, value: f64) -> String {
        self.powered(&self.scaled(value), value.is_finite())
    }

    /// `low to high`.
    #[must_use]
    pub fn interval(self, [low, high]: [f64; 2]) -> String {
        let text = format!("{} to {}", self.scaled(low), self.scaled(high));
        if self.exponent == 0 {
            text
        } else {
            self.powered(&format!("({text})"), true)
        }
    }

    /// `value ± uncertainty`, or only the value without an uncertainty.
    #[must_use]
    pub fn with_uncertainty(self, value: f64, uncertainty: f64) -> String {
        if self.places.is_none() {
            return self.show(value);
        }
        let text = format!(
            "{}\u{a0}±\u{a0}{}",
            self.scaled(value),
            self.scaled(uncertainty)
        );
        if self.exponent == 0 {
            text
        } else {
            self.powered(&format!("({text})"), true)
        }
    }

    fn scaled(self, value: f64) -> String {
        match self.places {
            Some(places) => decimals(value / 10f64.powi(self.exponent), places),
            None => round(value, 4),
        }
    }

    fn powered(self, text: &str, finite: bool) -> String {
        if self.exponent == 0 || !finite {
            text.to_owned()
        } else {
            format!("{text}×10{}", superscript(self.exponent))
        }
    }
}

/// A whole number in groups of three digits, separated by a narrow no-break space.
#[must_use]
pub fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::with_capacity(digits.len() * 2);
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    out
}

/// A number and its unit: `0.061 m`, `0.3°`. `deg` is shown as `°`; `1` and an empty unit are
/// omitted.
#[must_use]
pub fn quantity(number: &str, unit: &str) -> String {
    match unit_symbol(unit) {
        "" => number.to_owned(),
        "°" => format!("{number}°"),
        "%" => format!("{number}\u{a0}%"),
        symbol => format!("{number}\u{a0}{symbol}"),
    }
}

/// The symbol that a unit is shown with.
#[must_use]
pub fn unit_symbol(unit: &str) -> &str {
    match unit {
        "deg" | "degree" | "degrees" => "°",
        "1" | "-" => "",
        other => other,
    }
}

/// A duration in seconds as `0.42 s`, `43 s` or `2 min 05 s`.
#[must_use]
pub fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return NOT_A_NUMBER.to_owned();
    }
    if seconds < 100.0 {
        let places = if seconds < 1.0 {
            2
        } else {
            usize::from(seconds < 10.0)
        };
        return format!("{seconds:.places$}\u{a0}s");
    }
    let whole = seconds.round();
    let minutes = (whole / 60.0).floor();
    if minutes < 100.0 {
        format!(
            "{minutes:.0}\u{a0}min {:02.0}\u{a0}s",
            whole - 60.0 * minutes
        )
    } else {
        format!("{:.1}\u{a0}h", seconds / 3600.0)
    }
}

/// An exponent in superscript digits.
#[must_use]
pub fn superscript(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            digit => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
        })
        .collect()
}

fn split_exponent(scientific: &str) -> (&str, i32) {
    match scientific.split_once('e') {
        Some((mantissa, exponent)) => (mantissa, exponent.parse().unwrap_or(0)),
        None => (scientific, 0),
    }
}

fn decimals_for(digits: usize, exponent: i32) -> usize {
    usize::try_from(digits as i64 - 1 - i64::from(exponent)).unwrap_or(0)
}

fn minus(plain: &str) -> String {
    plain.replacen('-', "−", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits_survive_rounding_up() {
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(0.061_234, 3), "0.0612");
        assert_eq!(significant(-1234.6, 3), "−1235");
        assert_eq!(significant(3.2e-7, 2), "3.2×10⁻⁷");
        assert_eq!(significant(f64::NAN, 3), NOT_A_NUMBER);
        assert_eq!(decimals(-0.0001, 2), "0.00");
        assert_eq!(
            (round(5.0, 3), round(-0.1, 3), round(100.0, 2)),
            ("5".to_owned(), "−0.1".to_owned(), "100".to_owned())
        );
    }

    #[test]
    fn value_and_uncertainty_share_their_last_decimal() {
        let show = |value: f64, std: f64| Precision::of(value, std).with_uncertainty(value, std);
        assert_eq!(show(0.061_23, 0.002_1), "0.0612\u{a0}±\u{a0}0.0021");
        assert_eq!(show(12.34, 0.999), "12.3\u{a0}±\u{a0}1.0");
        assert_eq!(show(0.5, f64::NAN), "0.5");
        assert_eq!(show(0.0, 0.002_1), "0.0000\u{a0}±\u{a0}0.0021");
        assert_eq!(show(f64::NAN, 1.0), NOT_A_NUMBER);
        assert_eq!(show(3.0e-5, 1.0), "0.0\u{a0}±\u{a0}1.0");
        assert_eq!(
            Precision::of(2e-5, 2.4e-6).interval([1.58e-5, 2.53e-5]),
            "(15.8 to 25.3)×10⁻⁶"
        );
    }

    #[test]
    fn quantities_carry_their_unit() {
        assert_eq!(quantity("0.3", "deg"), "0.3°");
        assert_eq!(quantity("2", "1"), "2");
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(duration(125.2), "2\u{a0}min 05\u{a0}s");
        assert_eq!(superscript(-13), "⁻¹³");
    }
}
