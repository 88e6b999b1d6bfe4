//! Tables in an abstract form, before they are formatted as Markdown or HTML.

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Entry {
    /// Text.
    pub text: String,
    /// Whether it is the best of its column, with an interval apart from the others'.
    pub best: bool,
}

impl<T: Into<String>> From<T> for Entry {
    fn from(text: T) -> Self {
        Self {
            text: text.into(),
            best: false,
        }
    }
}

/// Head of a column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// Title.
    pub title: String,
    /// Whether the column holds numbers.
    pub number: bool,
}

/// A table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Grid {
    /// Title.
    pub title: String,
    /// Explanation of its columns, in a sentence or two.
    pub caption: String,
    /// Heads of the columns.
    pub head: Vec<Head>,
    /// Rows, each as long as the head.
    pub rows: Vec<Vec<Entry>>,
}

impl Grid {
    /// Creates a table without rows and columns.
    #[must_use]
    pub fn new(title: &str, caption: &str) -> Self {
        Self {
            title: title.to_owned(),
            caption: caption.to_owned(),
            ..Self::default()
        }
    }

    /// Adds a column of text.
    #[must_use]
    pub fn text(mut self, title: &str) -> Self {
        self.head.push(Head {
            title: title.to_owned(),
            number: false,
        });
        self
    }

    /// Adds a column of numbers.
    #[must_use]
    pub fn number(mut self, title: &str) -> Self {
        self.head.push(Head {
            title: title.to_owned(),
            number: true,
        });
        self
    }

    /// Removes columns that are empty in every row.
    pub fn without_empty_columns(&mut self) {
        for i in (0..self.head.len()).rev() {
            if self.rows.iter().all(|r| r[i].text.is_empty()) {
                self.head.remove(i);
                self.rows.iter_mut().for_each(|r| {
                    r.remove(i);
                });
            }
        }
    }

    /// Formats the table as Markdown: title, table, caption.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mark = |e: &Entry| {
            let text = e.text.replace('|', r"\|");
            if e.best { format!("**{text}**") } else { text }
        };
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut text = format!("## {}\n\n", self.title);
        text += &line(self.head.iter().map(|h| h.title.clone()).collect());
        let rule = self
            .head
            .iter()
            .map(|h| if h.number { "--:|" } else { "---|" });
        text += &format!("|{}\n", rule.collect::<String>());
        for row in &self.rows {
            text += &line(row.iter().map(mark).collect());
        }
        if !self.caption.is_empty() {
            text += &format!("\n{}\n", self.caption);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markdown_sets_the_best_in_bold_and_leaves_empty_columns_out() {
        let mut grid = Grid::new("T", "Why.").text("a").number("b").text("c");
        let best = Entry {
            text: "1".into(),
            best: true,
        };
        grid.rows = vec![vec!["x|y".into(), best, "".into()]];
        grid.without_empty_columns();
        assert_eq!(
            grid.markdown(),
            "## T\n\n| a | b |\n|---|--:|\n| x\\|y | **1** |\n\nWhy.\n"
        );
    }
}
