//! Claims of the paper about a figure, and whether the numbers agree.

use asid_comparison::rows::FEWEST;
use asid_report::page::Tone;
use serde::Serialize;

/// Whether the numbers agree with a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The numbers agree with the paper in direction.
    Agrees,
    /// The numbers do not agree.
    Differs,
    /// One of the numbers rests on fewer than [`FEWEST`] episodes, so they decide nothing.
    TooFewEpisodes,
}

impl Verdict {
    /// Text on the page.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Differs => "differs",
            Self::TooFewEpisodes => "too few episodes to tell",
        }
    }

    /// Text on the terminal, where a disagreement must stand out.
    pub const fn mark(self) -> &'static str {
        match self {
            Self::Differs => "DIFFERS",
            other => other.words(),
        }
    }

    /// Tone of the text on the page.
    pub const fn tone(self) -> Tone {
        match self {
            Self::Agrees => Tone::Good,
            Self::Differs => Tone::Bad,
            Self::TooFewEpisodes => Tone::Plain,
        }
    }
}

/// A claim of the paper about the figure, and whether these numbers agree.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// The statement, with the numbers found.
    pub statement: String,
    /// What the paper reports; where it reports nothing, what is required.
    pub paper: String,
    /// Whether the numbers agree.
    pub verdict: Verdict,
}

impl Claim {
    /// A claim that `holds` or not, if each of its numbers rests on enough episodes.
    ///
    /// `episodes` counts those of each number.
    pub fn new(
        statement: String,
        paper: impl Into<String>,
        episodes: impl IntoIterator<Item = usize>,
        holds: bool,
    ) -> Self {
        let verdict = match (episodes.into_iter().all(|n| n >= FEWEST), holds) {
            (false, _) => Verdict::TooFewEpisodes,
            (true, true) => Verdict::Agrees,
            (true, false) => Verdict::Differs,
        };
        Self {
            statement,
            paper: paper.into(),
            verdict,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_is_judged_only_from_enough_episodes_of_every_number() {
        let of = |episodes: &[usize], holds| {
            Claim::new(String::new(), "", episodes.iter().copied(), holds).verdict
        };
        for holds in [true, false] {
            assert_eq!(of(&[40, FEWEST - 1], holds), Verdict::TooFewEpisodes);
        }
        assert_eq!(of(&[FEWEST, FEWEST], true), Verdict::Agrees);
        assert_eq!(of(&[FEWEST, FEWEST], false), Verdict::Differs);
        let written = serde_json::to_string(&Verdict::TooFewEpisodes).unwrap();
        assert_eq!(written, "\"too-few-episodes\"");
    }
}
