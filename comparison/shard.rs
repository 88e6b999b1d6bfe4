//! A share of a comparison's cells, for one machine of several.

use std::fmt;
use std::str::FromStr;

/// The `index`-th of `count` shares, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// Whether the cell at this position of the plan belongs to the share.
    ///
    /// Cells are dealt out in turn. Seeds are the innermost order of a plan, so each share gets
    /// part of every row, and all shares cost about the same.
    #[must_use]
    pub fn holds(self, place: usize) -> bool {
        place % self.count + 1 == self.index
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not i/n with 1 <= i <= n, such as 1/4");
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let number = |t: &str| t.trim().parse::<usize>().map_err(|_| wrong());
        let (index, count) = (number(index)?, number(count)?);
        if (1..=count).contains(&index) {
            Ok(Self { index, count })
        } else {
            Err(wrong())
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_hold_every_cell_once_and_differ_by_one_at_most() {
        for count in 1..6 {
            let mut sizes = vec![0; count];
            for place in 0..17 {
                let holders: Vec<usize> = (1..=count)
                    .filter(|index| {
                        Shard {
                            index: *index,
                            count,
                        }
                        .holds(place)
                    })
                    .collect();
                assert_eq!(holders.len(), 1);
                sizes[holders[0] - 1] += 1;
            }
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
        }
    }

    #[test]
    fn a_share_is_counted_from_one() {
        assert_eq!("2/3".parse::<Shard>().unwrap().to_string(), "2/3");
        for text in ["0/3", "4/3", "1", "a/2", "1/0"] {
            assert!(text.parse::<Shard>().unwrap_err().contains("i/n"), "{text}");
        }
    }
}
