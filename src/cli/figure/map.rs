//! A value over the plane as coloured squares, from zero to the largest.

use asid_core::Task;
use asid_report::plot::{Axis, Colour, Outline, Plan};

/// Squares of a grid over a rectangle of the plane.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Lower corner, m.
    pub low: [f64; 2],
    /// Side of a square, m.
    pub side: f64,
    /// Squares along x and y.
    pub size: [usize; 2],
}

impl Grid {
    /// A grid that covers the rectangle between two corners.
    pub fn over([low, high]: [[f64; 2]; 2], side: f64) -> Self {
        let count = |i: usize| ((high[i] - low[i]) / side - 1e-9).ceil().max(1.0) as usize;
        Self {
            low,
            side,
            size: [count(0), count(1)],
        }
    }

    /// Number of squares.
    pub fn len(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The square that contains a place.
    pub fn square(&self, place: [f64; 2]) -> Option<usize> {
        let at = [0, 1].map(|i| ((place[i] - self.low[i]) / self.side).floor());
        let inside = (0..2).all(|i| at[i] >= 0.0 && at[i] < self.size[i] as f64);
        inside.then(|| at[1] as usize * self.size[0] + at[0] as usize)
    }

    /// Middle of a square, m.
    pub fn middle(&self, square: usize) -> [f64; 2] {
        let at = [square % self.size[0], square / self.size[0]];
        [0, 1].map(|i| self.low[i] + (at[i] as f64 + 0.5) * self.side)
    }

    /// A plan with one value a square, on a scale from 0 to `full`.
    pub fn plan(&self, title: &str, values: &[f64], full: f64, colour: Colour) -> Plan {
        let half = 0.5 * self.side;
        let mut plan = Plan::new(title, Axis::new("x", "m"), Axis::new("y", "m"));
        for (square, value) in values.iter().enumerate() {
            let share = (value / full).clamp(0.0, 1.0);
            if share > 0.0 {
                let [x, y] = self.middle(square);
                let corners = vec![
                    [x - half, y - half],
                    [x + half, y - half],
                    [x + half, y + half],
                    [x - half, y + half],
                ];
                let shade = Outline::polygon(corners).colour(colour);
                plan = plan.outline(shade.strength(0.08 + 0.87 * share, 0.0));
            }
        }
        plan
    }
}

/// Adds the fixtures of a task's scene.
pub fn with_fixtures(mut plan: Plan, task: &dyn Task) -> Plan {
    for fixture in &task.spec().top_view.fixtures {
        let outline = Outline::polygon(fixture.corners.clone()).colour(Colour::Muted);
        plan = plan.outline(outline.strength(0.05, 0.8));
    }
    plan
}

/// An empty rectangle between two corners.
pub fn frame([low, high]: [[f64; 2]; 2], label: &str, colour: Colour) -> Outline {
    let corners = vec![low, [high[0], low[1]], high, [low[0], high[1]]];
    Outline::polygon(corners)
        .colour(colour)
        .strength(0.0, 1.0)
        .dashed()
        .label(label)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_square_is_in_it_and_outside_is_nowhere() {
        let grid = Grid::over([[0.2, -0.5], [0.8, 0.4]], 0.05);
        assert_eq!(grid.size, [12, 18]);
        for square in 0..grid.len() {
            assert_eq!(grid.square(grid.middle(square)), Some(square));
        }
        assert_eq!(grid.square([0.19, 0.0]), None);
        assert_eq!(grid.square([0.5, 0.41]), None);
    }
}
