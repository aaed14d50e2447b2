//! Whether the truth lies in the region that an estimate gives.

use nalgebra::{Point3, Vector3};
use palpate_filter::{ContactEstimate, Mode};

/// The probabilities that regions are asked for.
pub const LEVELS: [f64; 2] = [0.5, 0.9];

/// What region is meant, for tables and reports.
pub const MEANING: &str = "the region of an estimate is the covariance ellipse of its first mode in the surface's \
                           tangent plane (chi-square, two degrees of freedom), on that mode's link";

/// For each of [`LEVELS`], whether a contact at `point_in_root` (m) on `link` lies in the estimate's region.
pub fn holds(
    estimate: &ContactEstimate,
    link: usize,
    point_in_root: &Point3<f64>,
) -> [bool; LEVELS.len()] {
    match estimate.best() {
        Some(mode) if mode.link == link => {
            let squared = squared_distance(mode, point_in_root);
            LEVELS.map(|level| squared <= chi_square_2(level))
        }
        _ => [false; LEVELS.len()],
    }
}

/// Squared Mahalanobis distance within the tangent plane.
fn squared_distance(mode: &Mode, point_in_root: &Point3<f64>) -> f64 {
    /// Least standard deviation, m: below the accuracy of any mesh.
    const LEAST_STD: f64 = 1e-5;
    let normal = mode.normal_in_root.into_inner();
    let aside = if normal.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = normal.cross(&aside).normalize();
    let v = normal.cross(&u);
    let off = point_in_root - mode.point_in_root;
    let along = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&(mode.covariance_in_root * b));
    let (uu, uv, vv) = (
        along(&u, &u) + LEAST_STD * LEAST_STD,
        along(&u, &v),
        along(&v, &v) + LEAST_STD * LEAST_STD,
    );
    let (du, dv) = (off.dot(&u), off.dot(&v));
    (vv * du * du - 2.0 * uv * du * dv + uu * dv * dv) / (uu * vv - uv * uv)
}

/// Quantile of the chi-square distribution with two degrees of freedom.
fn chi_square_2(level: f64) -> f64 {
    -2.0 * (1.0 - level).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use palpate_filter::ContactStatus;

    fn estimate(covariance: Matrix3<f64>) -> ContactEstimate {
        let mode = Mode {
            link: 3,
            probability: 1.0,
            point_in_root: Point3::new(0.1, 0.2, 0.3),
            point_in_link: Point3::origin(),
            normal_in_root: Vector3::z_axis(),
            force_in_root: Vector3::zeros(),
            force: 1.0,
            stiffness: 1.0,
            covariance_in_root: covariance,
        };
        ContactEstimate {
            stamp_ns: 0,
            status: ContactStatus::Located,
            modes: vec![mode],
        }
    }

    #[test]
    fn regions_are_ellipses_about_the_first_mode() {
        let sigma = Matrix3::from_diagonal(&Vector3::new(4e-6, 1e-6, 0.0));
        let given = estimate(sigma);
        let at = |x: f64, y: f64| holds(&given, 3, &Point3::new(0.1 + x, 0.2 + y, 0.3));
        assert_eq!(at(0.0, 0.0), [true, true]);
        // 50 %: 1.18 standard deviations; 90 %: 2.15.
        assert_eq!(at(0.0022, 0.0), [true, true]);
        assert_eq!(at(0.0, 0.0022), [false, false]);
        assert_eq!(at(0.003, 0.0), [false, true]);
        assert_eq!(at(0.0, 0.002), [false, true]);
        assert_eq!(at(0.005, 0.0), [false, false]);
    }

    #[test]
    fn another_link_is_outside() {
        let given = estimate(Matrix3::identity());
        assert_eq!(
            holds(&given, 4, &Point3::new(0.1, 0.2, 0.3)),
            [false, false]
        );
    }
}
