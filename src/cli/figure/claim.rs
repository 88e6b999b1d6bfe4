//! What is claimed of a figure beside the paper, and what the numbers say of it.

use asid_comparison::rows::FEWEST;
use asid_report::page::Tone;
use serde::Serialize;

/// What the numbers say of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// They agree with the paper in direction.
    Agrees,
    /// They do not.
    Differs,
    /// Fewer than [`FEWEST`] episodes are behind one of the numbers: they say neither.
    TooFewEpisodes,
}

impl Verdict {
    /// As the page has it.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Differs => "differs",
            Self::TooFewEpisodes => "too few episodes to tell",
        }
    }

    /// As the terminal has it, where a difference is not to be overlooked.
    pub const fn mark(self) -> &'static str {
        match self {
            Self::Differs => "DIFFERS",
            other => other.words(),
        }
    }

    /// How the page sets it.
    pub const fn tone(self) -> Tone {
        match self {
            Self::Agrees => Tone::Good,
            Self::Differs => Tone::Bad,
            Self::TooFewEpisodes => Tone::Plain,
        }
    }
}

/// What the paper says of the figure, and whether these numbers agree.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// The statement, with the numbers found.
    pub statement: String,
    /// What the paper reports, or what is asked for where it reports nothing.
    pub paper: String,
    /// What the numbers say of it.
    pub verdict: Verdict,
}

impl Claim {
    /// A claim that `holds` or not, if there are enough episodes behind each of its numbers to tell; `episodes`
    /// counts those of each number.
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
