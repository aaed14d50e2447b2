//! Laws of what an estimate says, from its modes.

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use palpate_filter::{ContactEstimate, ContactStatus, Mode};

fn mode(link: usize, probability: f64) -> Mode {
    Mode {
        link,
        probability,
        point_in_root: Point3::new(0.1, 0.2, 0.3),
        point_in_link: Point3::new(0.0, 0.1, 0.0),
        normal_in_root: Vector3::z_axis(),
        force_in_root: Vector3::new(0.0, 0.0, -10.0),
        force: 10.0,
        stiffness: 5000.0,
        covariance_in_root: Matrix3::from_diagonal(&Vector3::new(1.0, 4.0, 4.0)),
    }
}

fn estimate(modes: Vec<Mode>) -> ContactEstimate {
    ContactEstimate {
        stamp_ns: 1,
        status: ContactStatus::Ambiguous,
        modes,
    }
}

#[test]
fn a_links_probability_is_the_sum_over_its_modes() {
    let estimate = estimate(vec![mode(2, 0.5), mode(4, 0.25), mode(2, 0.125)]);
    let probabilities = [0, 2, 4, 9].map(|link| estimate.link_probability(link));
    assert_eq!(probabilities, [0.0, 0.625, 0.25, 0.0]);
    assert_eq!(estimate.best(), estimate.modes.first());
}

#[test]
fn without_contact_there_is_no_best_mode_and_no_links_probability() {
    let nothing = estimate(Vec::new());
    assert_eq!(nothing.best(), None);
    assert_eq!(nothing.link_probability(0), 0.0);
}

#[test]
fn a_modes_std_is_the_root_of_the_trace_and_no_frame_changes_it() {
    assert_eq!(mode(1, 1.0).std(), 3.0);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.2, 0.7));
    let rotation = turn.to_rotation_matrix();
    let turned = Mode {
        covariance_in_root: rotation * mode(1, 1.0).covariance_in_root * rotation.transpose(),
        ..mode(1, 1.0)
    };
    assert!((turned.std() - 3.0).abs() < 1e-12);
}

#[test]
fn a_covariance_below_zero_by_rounding_has_the_std_zero() {
    let rounded = Mode {
        covariance_in_root: Matrix3::identity() * -1e-20,
        ..mode(1, 1.0)
    };
    assert_eq!(rounded.std(), 0.0);
}

#[test]
fn each_status_has_its_own_word() {
    use ContactStatus::{Ambiguous, Located, NoContact};
    let words = [NoContact, Ambiguous, Located].map(ContactStatus::word);
    assert_eq!(words, ["none", "ambiguous", "located"]);
}
