//! Writes mass properties of bodies: into their `<inertial>`, or in place of their geoms'.

use asid_core::Target;
use asid_core::error::Result;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use roxmltree::Node;

use super::Writer;
use crate::mass::{GeomMass, MassProperties};

impl Writer<'_, '_> {
    pub(super) fn write_bodies(&mut self) -> Result<()> {
        if !self.native.gravity_compensation.is_empty()
            && self.entries("option", "", "gravity", 3)?.is_some()
        {
            self.leave_out(
                "constant forces are written as shares of weights, which another gravity changes with the weights"
                    .into(),
            );
        }
        for i in 1..self.native.plant.layout.bodies.len() {
            let name = self.native.plant.layout.bodies[i].clone();
            let node = self.elements.bodies[i];
            if let Some(pos) = self.entries("body", &name, "pos", 3)? {
                self.write_place(&format!("body `{name}`"), node, "pos", &pos);
            }
            if let Some(&share) = self.native.gravity_compensation.get(&i) {
                let own: f64 = node
                    .attribute("gravcomp")
                    .and_then(|x| x.parse().ok())
                    .unwrap_or(0.0);
                // The share is of the weight in the document.
                let share = share * self.native.plant.bodies[i].mass / self.mass_of(i, &name)?;
                self.markup.set_numbers(node, "gravcomp", &[own + share]);
            }
            let mass = self.entries("body", &name, "mass", 1)?.map(|m| m[0]);
            let center = self.entries("body", &name, "ipos", 3)?;
            let moments = self.entries("body", &name, "inertia", 3)?;
            if mass.is_none() && center.is_none() && moments.is_none() {
                continue;
            }
            let stated = |option: &str| self.elements.compiler(option).map(str::trim);
            if stated("inertiafromgeom") == Some("true") {
                self.leave_out(format!(
                    "the compiler takes the mass of body `{name}` from its geoms (inertiafromgeom=\"true\"): its new mass \
                     properties are not written"
                ));
                continue;
            }
            let total = stated("settotalmass").and_then(|x| x.parse::<f64>().ok());
            if let Some(total) = total.filter(|x| *x > 0.0) {
                self.leave_out(format!(
                    "the compiler scales all masses to {total} kg in all (settotalmass): the new mass properties of body `{name}` \
                     are not written"
                ));
                continue;
            }
            match node.children().find(|n| n.has_tag_name("inertial")) {
                Some(inertial) => self.write_inertial(&name, inertial, mass, center)?,
                None => self.write_inertial_of_geoms(i, &name, node, mass, center, moments)?,
            }
        }
        Ok(())
    }

    /// Mass that a body will have, kg.
    fn mass_of(&self, i: usize, name: &str) -> Result<f64> {
        if let Some(mass) = self.entries("body", name, "mass", 1)? {
            return Ok(mass[0]);
        }
        let plant = self.native.plant;
        let own = self.model.nominal(&Target::new("body", name, "mass", 0));
        // An engine may have no mass of a body whose geoms have one.
        let mut mass = own.unwrap_or(plant.bodies[i].mass);
        for geom in plant.geoms_with_mass(name) {
            let target = Target::new("geom", &plant.layout.geoms[geom], "mass", 0);
            if let Some(value) = self.changed(&target)? {
                mass += value - self.model.nominal(&target)?;
            }
        }
        Ok(mass)
    }

    /// Changes the body's existing `<inertial>`.
    fn write_inertial(
        &mut self,
        name: &str,
        node: Node<'_, '_>,
        mass: Option<f64>,
        center: Option<Vec<f64>>,
    ) -> Result<()> {
        if let Some(center) = center {
            self.markup.set_numbers(node, "pos", &center);
        }
        let old_mass = self.model.nominal(&Target::new("body", name, "mass", 0))?;
        let scale = mass.map_or(1.0, |m| m / old_mass);
        if let Some(mass) = mass {
            self.markup.set_numbers(node, "mass", &[mass]);
        }
        // Moments scale with the mass unless they are given themselves.
        let mut factors = [scale; 3];
        let mut now = [0.0; 3];
        for (k, factor) in factors.iter_mut().enumerate() {
            let moment = Target::new("body", name, "inertia", k);
            let old = self.model.nominal(&moment)?;
            if self.native.values.iter().any(|(t, _)| *t == moment) {
                *factor = self.value(&moment)? / old;
            }
            now[k] = old * *factor;
        }
        if factors == [1.0; 3] {
            return Ok(());
        }
        match node.attribute("fullinertia") {
            None => self.markup.set_numbers(node, "diaginertia", &now),
            Some(text) => {
                let full: Vec<f64> = text
                    .split_whitespace()
                    .filter_map(|x| x.parse().ok())
                    .collect();
                if let [xx, yy, zz, xy, xz, yz] = full[..] {
                    let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                    let tensor = with_moments(&tensor, now);
                    self.markup.set_numbers(node, "fullinertia", &six(&tensor));
                }
            }
        }
        Ok(())
    }

    /// Adds an `<inertial>` to the body that replaces the mass properties of its geoms.
    fn write_inertial_of_geoms(
        &mut self,
        i: usize,
        name: &str,
        node: Node<'_, '_>,
        mass: Option<f64>,
        center: Option<Vec<f64>>,
        moments: Option<Vec<f64>>,
    ) -> Result<()> {
        let document = self.scene.description()?;
        let geoms = document.bodies.get(i).map(|b| &b.body.geoms);
        let own: Option<Vec<GeomMass>> = geoms.and_then(|g| g.iter().map(GeomMass::of).collect());
        let (Some(mut masses), Some(geoms)) = (own.filter(|m| !m.is_empty()), geoms) else {
            self.leave_out(format!(
                "body `{name}` has its mass from meshes and no <inertial>: its new mass properties are not written"
            ));
            return Ok(());
        };
        let was = MassProperties::of_geoms(&masses);
        let names = &self.native.plant.layout.geoms;
        let first = self.native.plant.geoms.iter().position(|g| g.body == i);
        for k in 0..geoms.len() {
            let geom = names[first.unwrap_or(0) + k].clone();
            if let Some(value) = self.entries("geom", &geom, "mass", 1)? {
                masses[k].mass = value[0];
            }
            if let Some(value) = self.entries("geom", &geom, "pos", 3)? {
                masses[k].position = Vector3::from_column_slice(&value);
            }
        }
        let mut now = MassProperties::of_geoms(&masses);
        if let Some(mass) = mass {
            now.inertia *= mass / now.mass;
            now.mass = mass;
        }
        if let Some(center) = center {
            now.center += Vector3::from_column_slice(&center) - was.center;
        }
        if let Some(moments) = moments {
            // Match moments by size: the largest of one is the largest of the other.
            let old =
                [0, 1, 2].map(|k| self.model.nominal(&Target::new("body", name, "inertia", k)));
            let mut factors = Vec::with_capacity(3);
            for (old, new) in old.into_iter().zip(&moments) {
                let old = old?;
                factors.push((old, new / old));
            }
            factors.sort_by(|a, b| b.0.total_cmp(&a.0));
            let (principal, _) = now.principal();
            let mut sorted: Vec<f64> = principal.iter().copied().collect();
            sorted.sort_by(|a, b| b.total_cmp(a));
            let wanted: Vec<f64> = sorted
                .iter()
                .zip(&factors)
                .map(|(m, (_, f))| m * f)
                .collect();
            now.inertia = with_moments(&now.inertia, [wanted[0], wanted[1], wanted[2]]);
        }
        let text = crate::markup::numbers;
        self.markup.append(
            node,
            &format!(
                "<inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{}\"/>",
                text(now.center.as_slice()),
                text(&[now.mass]),
                text(&six(&now.inertia))
            ),
        );
        Ok(())
    }
}

/// The tensor with the same axes and other moments, matched by size.
fn with_moments(tensor: &Matrix3<f64>, moments: [f64; 3]) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(*tensor);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let mut wanted = moments;
    wanted.sort_by(|a, b| b.total_cmp(a));
    let mut out = Matrix3::zeros();
    for (&axis, moment) in order.iter().zip(wanted) {
        let v = eigen.eigenvectors.column(axis);
        out += v * v.transpose() * moment;
    }
    (out + out.transpose()) * 0.5
}

/// The entries of MJCF's `fullinertia`.
fn six(t: &Matrix3<f64>) -> [f64; 6] {
    [
        t[(0, 0)],
        t[(1, 1)],
        t[(2, 2)],
        t[(0, 1)],
        t[(0, 2)],
        t[(1, 2)],
    ]
}
