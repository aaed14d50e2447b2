//! The mass of a body and how it is spread.

use nalgebra::{Isometry3, Matrix3, Point3};

use crate::ModelError;

/// Mass, centre of mass and inertia of a link or of what it carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the link's frame, m.
    pub centre_in_link: Point3<f64>,
    /// Rotational inertia about the centre of mass, along the link's axes, kg m².
    pub inertia_in_link: Matrix3<f64>,
}

/// What a link carries beyond what the URDF says: a tool, a workpiece.
#[derive(Clone, Debug, PartialEq)]
pub struct Payload {
    /// Name of the link that carries it.
    pub link: String,
    /// Its mass, its centre and its inertia in that link's frame.
    pub inertial: Inertial,
}

impl Payload {
    /// The same body, `factor` times as dense.
    pub fn scaled(&self, factor: f64) -> Self {
        let Inertial {
            mass,
            centre_in_link,
            inertia_in_link,
        } = self.inertial;
        Self {
            link: self.link.clone(),
            inertial: Inertial {
                mass: mass * factor,
                centre_in_link,
                inertia_in_link: inertia_in_link * factor,
            },
        }
    }
}

/// Inertia matrix from the six numbers of a URDF's `<inertia>`: xx, xy, xz, yy, yz, zz.
pub fn inertia_matrix([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

impl Inertial {
    /// What a URDF's `<inertial>` says; none where it says nothing or only zeros.
    ///
    /// # Errors
    /// If a number is not finite.
    pub(crate) fn of_urdf(
        link: &str,
        inertial: &urdf_rs::Inertial,
        link_from_inertial: &Isometry3<f64>,
    ) -> Result<Option<Self>, ModelError> {
        let urdf_rs::Inertia {
            ixx,
            ixy,
            ixz,
            iyy,
            iyz,
            izz,
        } = inertial.inertia;
        let six = [ixx, ixy, ixz, iyy, iyz, izz];
        let mass = inertial.mass.value;
        if !mass.is_finite() || six.iter().any(|value| !value.is_finite()) {
            return Err(ModelError::Number {
                name: format!("inertia of link `{link}`"),
                expected: "finite numbers",
                found: format!("mass {mass}, inertia {six:?}"),
            });
        }
        if mass == 0.0 && six == [0.0; 6] {
            return Ok(None);
        }
        let turn = link_from_inertial.rotation.to_rotation_matrix();
        Ok(Some(Self {
            mass,
            centre_in_link: link_from_inertial.translation.vector.into(),
            inertia_in_link: turn * inertia_matrix(six) * turn.transpose(),
        }))
    }

    /// Refuses what no body can have. `whose` names the body in the error.
    pub(crate) fn check(&self, whose: &str) -> Result<(), ModelError> {
        /// Rounding in a file may leave an eigenvalue that should be zero this far below, as a share of the largest.
        const ROUNDING: f64 = 1e-6;
        let refuse = |what: &str, expected, found: String| {
            Err(ModelError::Number {
                name: format!("{what} of {whose}"),
                expected,
                found,
            })
        };
        if !(self.mass > 0.0 && self.mass.is_finite()) {
            return refuse("mass", "a finite mass above 0 kg", self.mass.to_string());
        }
        let centre = self.centre_in_link.coords;
        if !centre.iter().all(|value| value.is_finite()) {
            let found = format!("{} {} {}", centre.x, centre.y, centre.z);
            return refuse("centre of mass", "three finite numbers", found);
        }
        let inertia = self.inertia_in_link;
        let found = || format!("{:?}", inertia.as_slice());
        if !inertia.iter().all(|value| value.is_finite()) {
            return refuse("inertia", "finite numbers", found());
        }
        let principal = inertia.symmetric_eigenvalues();
        if principal.min() < -ROUNDING * principal.amax() {
            return refuse("inertia", "a matrix without negative eigenvalue", found());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body() -> Inertial {
        Inertial {
            mass: 2.0,
            centre_in_link: Point3::new(0.1, 0.0, -0.2),
            inertia_in_link: inertia_matrix([0.1, 0.01, 0.0, 0.2, 0.0, 0.15]),
        }
    }

    #[test]
    fn what_no_body_can_have_is_refused_by_name() {
        assert!(body().check("link `a`").is_ok());
        let point = Inertial {
            inertia_in_link: Matrix3::zeros(),
            ..body()
        };
        assert!(point.check("a point").is_ok());
        let say = |wrong: Inertial| wrong.check("link `a`").unwrap_err().to_string();
        for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let said = say(Inertial { mass, ..body() });
            assert!(said.contains("mass of link `a`"), "{said}");
            assert!(said.contains(&format!("found {mass}")), "{said}");
        }
        let centre_in_link = Point3::new(0.0, f64::NAN, 0.0);
        let said = say(Inertial {
            centre_in_link,
            ..body()
        });
        assert!(said.contains("centre of mass of link `a`"), "{said}");
        for six in [
            [0.1, 0.2, 0.0, 0.1, 0.0, 0.1],
            [0.1, 0.0, f64::NAN, 0.1, 0.0, 0.1],
        ] {
            let inertia_in_link = inertia_matrix(six);
            let said = say(Inertial {
                inertia_in_link,
                ..body()
            });
            assert!(said.contains("inertia of link `a`"), "{said}");
        }
    }
}
