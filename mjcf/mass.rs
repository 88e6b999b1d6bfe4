//! Mass properties of a body from its geoms.
//!
//! A compiled model has one mass for each body, but users know geoms: "the payload weighs 0.4 kg",
//! "the weight sits 6 cm off the middle". Changing a geom's mass or position changes its body's
//! mass, centre and inertia. The formulas are here once, so that all engines agree.

use mjcf_rs::body::{Geom, GeomType};
use nalgebra::{Matrix3, Quaternion, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};

/// Density that MJCF gives a geom without one, kg/m³.
const DEFAULT_DENSITY: f64 = 1000.0;

/// Mass properties of one geom.
#[derive(Clone, Debug, PartialEq)]
pub struct GeomMass {
    /// Mass, kg.
    pub mass: f64,
    /// Centre in the body's frame, m.
    pub position: Vector3<f64>,
    /// `body_from_geom`.
    pub rotation: UnitQuaternion<f64>,
    /// Principal moments about the centre for a mass of 1 kg, m².
    pub unit_inertia: Vector3<f64>,
}

/// Mass properties of a rigid body in its own frame.
#[derive(Clone, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub center: Vector3<f64>,
    /// Inertia about the centre of mass along the body's axes, kg m².
    pub inertia: Matrix3<f64>,
}

impl GeomMass {
    /// Mass properties of a primitive geom as MJCF defines them.
    ///
    /// `None` for a plane, a mesh or a height field.
    #[must_use]
    pub fn of(geom: &Geom) -> Option<Self> {
        let (pose, size) = placed(geom);
        let (volume, unit_inertia) = primitive(geom.type_, size)?;
        let mass = geom
            .mass
            .unwrap_or_else(|| geom.density.unwrap_or(DEFAULT_DENSITY) * volume);
        let (p, q) = (pose.translation, pose.rotation);
        Some(Self {
            mass,
            position: Vector3::new(p.x, p.y, p.z),
            rotation: UnitQuaternion::from_quaternion(Quaternion::new(q.w, q.x, q.y, q.z)),
            unit_inertia,
        })
    }
}

/// Frame of a geom in its body, and its size, with `fromto` resolved as MuJoCo does.
#[must_use]
pub fn placed(geom: &Geom) -> (mjcf_rs::Pose, [f64; 3]) {
    let mut size = geom.size;
    let mut pose = geom.pose;
    if let Some([x1, y1, z1, x2, y2, z2]) = geom.fromto {
        let (a, b) = (Vector3::new(x1, y1, z1), Vector3::new(x2, y2, z2));
        // As in MuJoCo, z points from the second end to the first.
        let along = a - b;
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along).unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        });
        let center = (a + b) / 2.0;
        pose.translation = mjcf_rs::glam::DVec3::new(center.x, center.y, center.z);
        pose.rotation = mjcf_rs::glam::DQuat::from_xyzw(turn.i, turn.j, turn.k, turn.w);
        let half = along.norm() / 2.0;
        size = match geom.type_ {
            GeomType::Box | GeomType::Ellipsoid => [size[0], size[0], half],
            _ => [size[0], half, 0.0],
        };
    }
    (pose, size)
}

/// Volume (m³) and principal moments for unit mass (m²) of a primitive.
fn primitive(kind: GeomType, [a, b, c]: [f64; 3]) -> Option<(f64, Vector3<f64>)> {
    use std::f64::consts::PI;
    Some(match kind {
        GeomType::Sphere => (4.0 / 3.0 * PI * a.powi(3), Vector3::repeat(0.4 * a * a)),
        GeomType::Box => (
            8.0 * a * b * c,
            Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b) / 3.0,
        ),
        GeomType::Ellipsoid => (
            4.0 / 3.0 * PI * a * b * c,
            Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b) / 5.0,
        ),
        GeomType::Cylinder => {
            let across = a * a / 4.0 + b * b / 3.0;
            (
                2.0 * PI * a * a * b,
                Vector3::new(across, across, a * a / 2.0),
            )
        }
        GeomType::Capsule => {
            // A cylinder of height 2b between two half balls of radius a.
            let (cylinder, ball) = (2.0 * PI * a * a * b, 4.0 / 3.0 * PI * a.powi(3));
            let volume = cylinder + ball;
            let along = cylinder * a * a / 2.0 + ball * 0.4 * a * a;
            let across = cylinder * (a * a / 4.0 + b * b / 3.0)
                + ball * (0.4 * a * a + b * b + 0.75 * a * b);
            (volume, Vector3::new(across, across, along) / volume)
        }
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh | GeomType::Sdf => return None,
    })
}

impl MassProperties {
    /// Mass properties of several geoms together, by the parallel axis theorem.
    #[must_use]
    pub fn of_geoms(geoms: &[GeomMass]) -> Self {
        let mass: f64 = geoms.iter().map(|g| g.mass).sum();
        if mass <= 0.0 {
            return Self {
                mass: 0.0,
                center: Vector3::zeros(),
                inertia: Matrix3::zeros(),
            };
        }
        let center = geoms
            .iter()
            .map(|g| g.position * g.mass)
            .sum::<Vector3<f64>>()
            / mass;
        let mut inertia = Matrix3::zeros();
        for g in geoms {
            let rotation = g.rotation.to_rotation_matrix().into_inner();
            let own = rotation * Matrix3::from_diagonal(&g.unit_inertia) * rotation.transpose();
            let r = g.position - center;
            let shift = Matrix3::identity() * r.norm_squared() - r * r.transpose();
            inertia += (own + shift) * g.mass;
        }
        Self {
            mass,
            center,
            inertia,
        }
    }

    /// Principal moments (kg m², largest first) and `body_from_principal`.
    #[must_use]
    pub fn principal(&self) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let off =
            self.inertia[(0, 1)].abs() + self.inertia[(0, 2)].abs() + self.inertia[(1, 2)].abs();
        if off <= 1e-14 * self.inertia.trace() {
            return (self.inertia.diagonal(), UnitQuaternion::identity());
        }
        let eigen = SymmetricEigen::new(self.inertia);
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
        let mut axes =
            Matrix3::from_columns(&order.map(|i| eigen.eigenvectors.column(i).into_owned()));
        if axes.determinant() < 0.0 {
            axes.set_column(2, &-axes.column(2).into_owned());
        }
        let moments = Vector3::from(order.map(|i| eigen.eigenvalues[i]));
        let rotation = Rotation3::from_matrix_unchecked(axes);
        (moments, UnitQuaternion::from_rotation_matrix(&rotation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid_box(mass: f64, half: [f64; 3], position: [f64; 3]) -> GeomMass {
        GeomMass {
            mass,
            position: position.into(),
            rotation: UnitQuaternion::identity(),
            unit_inertia: primitive(GeomType::Box, half).unwrap().1,
        }
    }

    #[test]
    fn two_half_boxes_make_one_box() {
        let halves = [
            solid_box(1.0, [0.5, 1.0, 1.0], [-0.5, 0.0, 0.0]),
            solid_box(1.0, [0.5, 1.0, 1.0], [0.5, 0.0, 0.0]),
        ];
        let whole = MassProperties::of_geoms(&[solid_box(2.0, [1.0, 1.0, 1.0], [0.0; 3])]);
        let joined = MassProperties::of_geoms(&halves);
        assert!((joined.inertia - whole.inertia).norm() < 1e-12);
        assert!((joined.mass - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_weight_off_the_middle_moves_the_center() {
        // 0.05 kg rod and a 0.15 kg weight at 0.08 m: the centre is at 3/4 of that.
        let geoms = [
            solid_box(0.05, [0.02, 0.15, 0.02], [0.0; 3]),
            solid_box(0.15, [0.01; 3], [0.0, 0.08, 0.0]),
        ];
        let all = MassProperties::of_geoms(&geoms);
        assert!((all.center.y - 0.06).abs() < 1e-12);
    }

    #[test]
    fn z_points_from_the_second_end_to_the_first() {
        for (ends, z) in [
            ([0.0, 0.0, 0.0, 0.3, 0.0, 0.4], [-0.6, 0.0, -0.8]),
            ([0.0, 0.0, 1.0, 0.0, 0.0, 2.0], [0.0, 0.0, -1.0]),
            ([0.0, 0.0, 2.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0]),
        ] {
            let geom = Geom {
                type_: GeomType::Capsule,
                size: [0.1, 0.0, 0.0],
                fromto: Some(ends),
                ..Geom::default()
            };
            let found = GeomMass::of(&geom).unwrap().rotation * Vector3::z();
            assert!((found - Vector3::from(z)).norm() < 1e-12, "{found}");
        }
    }

    #[test]
    fn a_capsule_of_no_length_is_a_ball() {
        let (volume, inertia) = primitive(GeomType::Capsule, [0.1, 0.0, 0.0]).unwrap();
        let (ball, expected) = primitive(GeomType::Sphere, [0.1, 0.0, 0.0]).unwrap();
        assert!((volume - ball).abs() < 1e-15 && (inertia - expected).norm() < 1e-15);
    }

    #[test]
    fn principal_axes_rebuild_the_inertia() {
        let inertia = Matrix3::new(3.0, 0.4, 0.1, 0.4, 2.0, -0.2, 0.1, -0.2, 1.0);
        let properties = MassProperties {
            mass: 1.0,
            center: Vector3::zeros(),
            inertia,
        };
        let (moments, rotation) = properties.principal();
        let r = rotation.to_rotation_matrix().into_inner();
        let rebuilt = r * Matrix3::from_diagonal(&moments) * r.transpose();
        assert!((rebuilt - inertia).norm() < 1e-12);
        assert!(moments[0] >= moments[1] && moments[1] >= moments[2]);
    }
}
