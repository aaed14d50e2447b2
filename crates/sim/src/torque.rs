//! Joint torques of a force: the sum of cross products on the joint axes. Independent of the model's screws.

use nalgebra::{Point3, Vector3};
use palpate_model::{JointKind, Kinematics, Robot};

/// Torque (Nm; N for a prismatic joint) that a force on a link applies on each of the robot's joints.
///
/// For joint j with axis a through point o: τ_j = a · ((p − o) × f) if it turns, a · f if it slides, and 0 if it is not on
/// the link's path to the root.
pub(crate) fn joint_torques(
    robot: &Robot,
    kinematics: &Kinematics,
    link: usize,
    point_in_root: &Point3<f64>,
    force_in_root: &Vector3<f64>,
) -> Vec<f64> {
    let mut torques = vec![0.0; robot.dof()];
    let mut ancestor = Some(link);
    while let Some(index) = ancestor {
        let child = &robot.links[index];
        if let Some(joint) = child.joint {
            let root_from_joint = kinematics.root_from_link(index);
            let axis = root_from_joint * robot.joints[joint].axis_in_joint;
            let arm = point_in_root.coords - root_from_joint.translation.vector;
            torques[joint] = match robot.joints[joint].kind {
                JointKind::Prismatic => axis.dot(force_in_root),
                JointKind::Revolute | JointKind::Continuous => axis.dot(&arm.cross(force_in_root)),
            };
        }
        ancestor = child.parent;
    }
    torques
}

/// Velocity (m/s) of the link's material point at `point_in_root` for joint speeds `speed`: each component is the power
/// that a unit force there would have.
pub(crate) fn point_velocity(
    robot: &Robot,
    kinematics: &Kinematics,
    link: usize,
    point_in_root: &Point3<f64>,
    speed: &[f64],
) -> Vector3<f64> {
    let power = |force: &Vector3<f64>| -> f64 {
        let torques = joint_torques(robot, kinematics, link, point_in_root, force);
        torques.iter().zip(speed).map(|(t, s)| t * s).sum()
    };
    Vector3::new(
        power(&Vector3::x()),
        power(&Vector3::y()),
        power(&Vector3::z()),
    )
}

/// Force on the robot: normal force along `push`, and friction against the slip, regularised below 1 mm/s.
pub(crate) fn contact_force(
    push: &Vector3<f64>,
    normal_force: f64,
    friction: f64,
    velocity: &Vector3<f64>,
) -> Vector3<f64> {
    const REST_SPEED: f64 = 1e-3;
    let slip = velocity - push * push.dot(velocity);
    let slip_direction = slip / (slip.norm_squared() + REST_SPEED * REST_SPEED).sqrt();
    (push - slip_direction * friction) * normal_force
}

#[cfg(test)]
mod tests {
    use palpate_model::{EmbeddedMeshes, LoadOptions};

    use super::*;

    /// A turning, a sliding and a fixed joint, and a branch that must feel nothing.
    const URDF: &str = r#"<robot name="r">
        <link name="base"/><link name="a"/><link name="b"/><link name="tool"/><link name="branch"/>
        <joint name="turn" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0.6 0 0.8"/>
            <origin xyz="0.1 0.2 0.3" rpy="0.4 -0.3 1.1"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
        <joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
            <origin xyz="0.3 0 0.1" rpy="1 0.5 0"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
        <joint name="weld" type="fixed"><parent link="b"/><child link="tool"/><origin xyz="0 0.1 0.2" rpy="0 1 0"/></joint>
        <joint name="other" type="continuous"><parent link="a"/><child link="branch"/><axis xyz="1 0 0"/></joint>
    </robot>"#;

    #[test]
    fn torque_is_the_virtual_work_of_the_force() -> Result<(), Box<dyn std::error::Error>> {
        let (robot, _) = Robot::from_urdf(URDF, &EmbeddedMeshes(&[]), &LoadOptions::default())?;
        let link = robot.link_index("tool").ok_or("tool")?;
        let position: Vec<f64> = (0..robot.dof())
            .map(|joint| 0.3 + 0.2 * joint as f64)
            .collect();
        let (point_in_link, force) = (Point3::new(0.05, -0.1, 0.2), Vector3::new(3.0, -5.0, 2.0));
        let point_at = |position: &[f64]| {
            let mut kinematics = Kinematics::new(&robot);
            kinematics.update(&robot, position);
            (kinematics.root_from_link(link) * point_in_link, kinematics)
        };
        let (point, kinematics) = point_at(&position);
        let torques = joint_torques(&robot, &kinematics, link, &point, &force);
        for joint in 0..robot.dof() {
            const STEP: f64 = 1e-6;
            let moved = |by: f64| {
                let mut position = position.clone();
                position[joint] += by;
                point_at(&position).0
            };
            let velocity = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
            assert!((torques[joint] - velocity.dot(&force)).abs() < 1e-8);
            let mut speed = vec![0.0; robot.dof()];
            speed[joint] = 1.0;
            let found = point_velocity(&robot, &kinematics, link, &point, &speed);
            assert!((found - velocity).norm() < 1e-8);
        }
        let branch = robot.joint_index("other").ok_or("other")?;
        assert_eq!(torques[branch], 0.0);
        Ok(())
    }

    #[test]
    fn friction_opposes_the_slip_and_vanishes_at_rest() {
        let push = Vector3::z();
        let slipping = contact_force(&push, 10.0, 0.3, &Vector3::new(0.5, 0.0, -2.0));
        assert!((slipping - Vector3::new(-3.0, 0.0, 10.0)).norm() < 1e-4);
        let resting = contact_force(&push, 10.0, 0.3, &Vector3::new(0.0, 0.0, -2.0));
        assert_eq!(resting, push * 10.0);
    }
}
