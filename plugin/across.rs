//! Wrapped objects of the other side: each call crosses the [`Border`].
//!
//! The same wrapper serves both directions: a plugin's task in this program, and this program's
//! simulator in a plugin.

mod algorithm;
mod engine;
mod identified;
mod task;

use std::mem::ManuallyDrop;

use super::border::Border;
use asid_core::error::Result;
use asid_core::simulator::{StepHook, StepView};

/// An object of the other side, or an object of this side for the other.
pub struct Across<T> {
    inner: ManuallyDrop<T>,
    border: Border,
    name: Option<&'static str>,
}

impl<T> Across<T> {
    /// Wraps an object for calls in this direction.
    pub fn new(inner: T, border: Border) -> Self {
        Self {
            inner: ManuallyDrop::new(inner),
            border,
            name: None,
        }
    }

    /// As [`Across::new`], under the registered name.
    pub fn named(inner: T, border: Border, name: &'static str) -> Self {
        let mut across = Self::new(inner, border);
        across.name = Some(name);
        across
    }

    fn run<'s, R>(&'s self, call: impl FnOnce(&'s T) -> R) -> R {
        self.border.run(|| call(&self.inner))
    }

    fn run_mut<R>(&mut self, call: impl FnOnce(&mut T) -> R) -> R {
        self.border.run(|| call(&mut self.inner))
    }

    fn try_run<R>(&self, call: impl FnOnce(&T) -> Result<R>) -> Result<R> {
        self.border.try_run(|| call(&self.inner))
    }

    fn try_run_mut<R>(&mut self, call: impl FnOnce(&mut T) -> Result<R>) -> Result<R> {
        self.border.try_run(|| call(&mut self.inner))
    }
}

impl<T> Drop for Across<T> {
    fn drop(&mut self) {
        // SAFETY: the object is not used after this.
        let inner = unsafe { ManuallyDrop::take(&mut self.inner) };
        self.border.drop(inner);
    }
}

impl<T> StepHook for Across<T>
where
    T: std::ops::Deref + Sync,
    T::Target: StepHook,
{
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        self.run(|hook| hook.before_step(row, step, view));
        let given = [view.qpos, view.qvel];
        if given.iter().all(|v| v.iter().all(|x| x.is_finite())) {
            self.border
                .check_finite(&[], view.ctrl, "the command of an effect");
            self.border
                .check_finite(&[], view.force, "the force of an effect");
        }
    }
}
