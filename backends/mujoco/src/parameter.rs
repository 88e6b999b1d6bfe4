//! The parameters of a batch: turns values into model fields of a simulation.

use asid_core::Target;
use asid_core::{Error, Result};

use crate::compiled::Compiled;
use crate::ffi::{Batch, Expanded};
use crate::field::Field;
use crate::inertia::{BodyGeoms, BodyInertia};
use crate::target::{Column, Part, parameter};

/// A body whose mass properties depend on some columns.
#[derive(Clone, Debug)]
struct BodyPlan {
    body: usize,
    nominal: BodyInertia,
    geoms: Option<BodyGeoms>,
    parts: Vec<(usize, Part)>,
}

impl BodyPlan {
    /// Mass properties for one simulation's values of all columns.
    ///
    /// If geoms are among them, a centre of mass moves by the difference between its column and the
    /// scene, and a moment is scaled by their ratio.
    fn inertia(&self, columns: &[Column], values: &[f64]) -> BodyInertia {
        // Nominal values keep what the engine compiled, to the bit.
        if self
            .parts
            .iter()
            .all(|&(c, _)| values[c] == columns[c].nominal)
        {
            return self.nominal.clone();
        }
        let mut out = self.nominal.clone();
        // The scene's own centre and moments, to which the columns' values are relative.
        let mut was = None;
        if let Some(geoms) = &self.geoms {
            let mut masses = geoms.masses.clone();
            for &(column, part) in &self.parts {
                match part {
                    Part::GeomMass(g) => masses[g].mass = values[column],
                    Part::GeomPosition(g, axis) => masses[g].position[axis] = values[column],
                    _ => {}
                }
            }
            out = BodyInertia::of_geoms(&masses);
            was = Some(BodyInertia::of_geoms(&geoms.masses));
        }
        // The mass comes first: it scales the moments of the scene, and a moment that is itself a
        // parameter then takes its given value.
        for &(column, part) in &self.parts {
            if part == Part::Mass {
                let scale = values[column] / out.mass;
                out.mass = values[column];
                out.inertia = out.inertia.map(|moment| moment * scale);
            }
        }
        for &(column, part) in &self.parts {
            match part {
                Part::Center(axis) => {
                    out.ipos[axis] = match &was {
                        Some(was) => out.ipos[axis] + values[column] - was.ipos[axis],
                        None => values[column],
                    }
                }
                Part::Moment(axis) => match &was {
                    // Find the axis by its rank in size, because the order of the axes may change.
                    Some(was) => {
                        let axis = was.axis_of_rank(self.nominal.rank_of_axis(axis));
                        out.inertia[axis] *= values[column] / was.inertia[axis];
                    }
                    None => out.inertia[axis] = values[column],
                },
                _ => {}
            }
        }
        out
    }
}

/// A joint's axis of which some components are columns.
#[derive(Clone, Debug)]
struct AxisPlan {
    joint: usize,
    nominal: [f64; 3],
    /// Column and component.
    parts: Vec<(usize, usize)>,
}

impl AxisPlan {
    /// The unit axis for one simulation's values of all columns; `None` where it has no direction.
    fn axis(&self, values: &[f64]) -> Option<[f64; 3]> {
        let mut axis = self.nominal;
        for &(column, part) in &self.parts {
            axis[part] = values[column];
        }
        // Nominal values keep what the engine compiled, to the bit.
        if axis == self.nominal {
            return Some(axis);
        }
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        (length > 1e-9).then(|| axis.map(|x| x / length))
    }
}

/// All parameters of a batch.
#[derive(Clone, Debug)]
pub struct Plan {
    columns: Vec<Column>,
    bodies: Vec<BodyPlan>,
    axes: Vec<AxisPlan>,
}

impl Plan {
    /// Resolves the targets of a batch.
    ///
    /// # Errors
    /// As [`Column::resolve`], and where two targets set the same thing.
    pub fn new(compiled: &Compiled, targets: &[Target]) -> Result<Self> {
        let mut columns = Vec::with_capacity(targets.len());
        let mut bodies: Vec<BodyPlan> = Vec::new();
        let mut axes: Vec<AxisPlan> = Vec::new();
        for (i, target) in targets.iter().enumerate() {
            if targets[..i].contains(target) {
                return Err(parameter(target, "is named twice"));
            }
            let column = Column::resolve(compiled, target)?;
            if let Some((body, part)) = column.part {
                let found = bodies.iter().position(|b| b.body == body);
                let plan = match found {
                    Some(at) => &mut bodies[at],
                    None => {
                        bodies.push(BodyPlan {
                            body,
                            nominal: BodyInertia::of(&compiled.model, body),
                            geoms: None,
                            parts: Vec::new(),
                        });
                        let last = bodies.len() - 1;
                        &mut bodies[last]
                    }
                };
                let clash = |p: Part| p.of_geom() && part == Part::Mass;
                let clashes =
                    |&&(_, p): &&(usize, Part)| clash(p) || (p == Part::Mass && part.of_geom());
                if let Some(&(other, _)) = plan.parts.iter().find(clashes) {
                    return Err(parameter(
                        target,
                        &format!(
                            "sets the same mass properties as `{}`; use one of them",
                            targets[other]
                        ),
                    ));
                }
                plan.parts.push((i, part));
                plan.geoms = plan.geoms.take().or_else(|| column.geoms.clone());
            }
            if let Some((joint, part)) = column.axis {
                match axes.iter_mut().find(|a| a.joint == joint) {
                    Some(axis) => axis.parts.push((i, part)),
                    None => axes.push(AxisPlan {
                        joint,
                        nominal: compiled.model.jnt_axis()[joint],
                        parts: vec![(i, part)],
                    }),
                }
            }
            columns.push(column);
        }
        Ok(Self {
            columns,
            bodies,
            axes,
        })
    }

    /// Number of columns.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// The columns.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Whether a body's centre or axes may move, or a joint's axis turn. Then no shortcut for
    /// bodies of diagonal inertia is valid.
    #[must_use]
    pub fn moves_mass(&self) -> bool {
        !(self.bodies.is_empty() && self.axes.is_empty())
    }

    /// Whether model constants depend on a column.
    #[must_use]
    pub fn derives(&self) -> bool {
        self.columns.iter().any(|c| c.derives)
    }

    /// Nominal values of all columns.
    pub fn nominal(&self) -> impl Iterator<Item = f64> {
        self.columns.iter().map(|c| c.nominal)
    }

    /// Expands the fields in use, so that each simulation has its own values.
    ///
    /// # Errors
    /// When the engine lacks a field.
    pub fn expand(&self, batch: &mut Batch) -> Result<Fields> {
        let mut wanted: Vec<Field> = self
            .columns
            .iter()
            .flat_map(|c| c.entries.iter().map(|e| e.0))
            .collect();
        if !self.bodies.is_empty() {
            wanted.extend([
                Field::BodyMass,
                Field::BodyIpos,
                Field::BodyIquat,
                Field::BodyInertia,
            ]);
        }
        if !self.axes.is_empty() {
            wanted.push(Field::JntAxis);
        }
        wanted.sort_unstable();
        wanted.dedup();
        let mut handles = Vec::with_capacity(wanted.len());
        for field in wanted {
            let handle = batch.expand(field.name()).map_err(Error::Failed)?;
            handles.push((field, handle));
        }
        Ok(Fields(handles))
    }

    /// Checks one simulation's values.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a value that is not finite or not physical.
    pub fn check(&self, values: &[f64]) -> Result<()> {
        for (column, &value) in self.columns.iter().zip(values) {
            column.check(value)?;
        }
        for plan in &self.bodies {
            if !plan.inertia(&self.columns, values).is_physical() {
                let (column, _) = plan.parts[0];
                return Err(parameter(
                    &self.columns[column].target,
                    "the body would have no mass, or moments of inertia that no body can have",
                ));
            }
        }
        for plan in &self.axes {
            if plan.axis(values).is_none() {
                let (column, _) = plan.parts[0];
                return Err(parameter(
                    &self.columns[column].target,
                    "the axis would have no direction",
                ));
            }
        }
        Ok(())
    }

    /// Writes one simulation's checked values; `before` are its current values.
    ///
    /// Returns whether constants of its model must be recomputed.
    pub fn write(
        &self,
        batch: &mut Batch,
        fields: &Fields,
        sim: usize,
        before: &[f64],
        values: &[f64],
    ) -> bool {
        let mut derives = false;
        for (i, column) in self.columns.iter().enumerate() {
            if values[i] == before[i] {
                continue;
            }
            derives |= column.derives;
            for &(field, entry, factor) in &column.entries {
                if let Some(handle) = fields.get(field) {
                    batch.field(handle, sim)[entry] = factor * values[i];
                }
            }
        }
        for plan in &self.axes {
            if let (Some(handle), Some(axis)) = (fields.get(Field::JntAxis), plan.axis(values)) {
                let at = 3 * plan.joint;
                batch.field(handle, sim)[at..at + 3].copy_from_slice(&axis);
            }
        }
        for plan in &self.bodies {
            if plan.parts.iter().all(|&(c, _)| values[c] == before[c]) {
                continue;
            }
            let inertia = plan.inertia(&self.columns, values);
            let mut put = |field, width: usize, data: &[f64]| {
                if let Some(handle) = fields.get(field) {
                    let at = plan.body * width;
                    batch.field(handle, sim)[at..at + width].copy_from_slice(data);
                }
            };
            put(Field::BodyMass, 1, &[inertia.mass]);
            put(Field::BodyIpos, 3, &inertia.ipos);
            put(Field::BodyIquat, 4, &inertia.iquat);
            put(Field::BodyInertia, 3, &inertia.inertia);
        }
        derives
    }
}

/// Expanded fields of a batch.
#[derive(Clone, Debug)]
pub struct Fields(Vec<(Field, Expanded)>);

impl Fields {
    fn get(&self, field: Field) -> Option<Expanded> {
        self.0.iter().find(|(f, _)| *f == field).map(|&(_, h)| h)
    }
}
