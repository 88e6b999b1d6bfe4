//! Pairs of bodies whose contacts are monitored: those that count as interaction, and those of each
//! of the task's objects.

use asid_core::task::Task;

/// Marks the channels that have a force.
pub(super) fn note(forces: &[f64], touched: &mut [bool]) {
    for (touched, force) in touched.iter_mut().zip(forces) {
        *touched |= *force > 0.0;
    }
}

/// Pairs of bodies whose contacts are monitored, and what each counts for.
pub(super) struct Pairs {
    /// Channels of contact force, without duplicates.
    pub(super) channels: Vec<String>,
    /// Indices of the channels that count as interaction, then of those of each of the task's
    /// objects.
    counted: Vec<Vec<usize>>,
    /// For each of these groups, the control steps in which one of its channels had a force.
    steps: Vec<usize>,
}

impl Pairs {
    pub(super) fn of(task: &dyn Task) -> Self {
        let objects = task.objects().into_iter().map(|o| o.contact);
        let groups = std::iter::once(task.exploration().contact.clone()).chain(objects);
        let mut channels: Vec<String> = Vec::new();
        let mut place = |[a, b]: [String; 2]| {
            let name = format!("contact.{a}/{b}");
            let found = channels.iter().position(|c| *c == name);
            found.unwrap_or_else(|| {
                channels.push(name);
                channels.len() - 1
            })
        };
        let counted: Vec<Vec<usize>> = groups
            .map(|pairs| pairs.into_iter().map(&mut place).collect())
            .collect();
        Self {
            steps: vec![0; counted.len()],
            counted,
            channels,
        }
    }

    /// Counts a control step, with one flag per channel for a force.
    pub(super) fn count(&mut self, touched: &[bool]) {
        for (steps, pairs) in self.steps.iter_mut().zip(&self.counted) {
            *steps += usize::from(pairs.iter().any(|&i| touched[i]));
        }
    }

    /// Shares of `horizon` control steps with contact: of interaction, and of each object.
    pub(super) fn shares(&self, horizon: usize) -> (f64, Vec<f64>) {
        let mut shares = self.steps.iter().map(|&n| n as f64 / horizon as f64);
        (shares.next().unwrap_or_default(), shares.collect())
    }
}
