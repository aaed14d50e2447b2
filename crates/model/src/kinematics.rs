//! Where the links are and how their joints act on them, for one configuration.

use nalgebra::{DMatrix, Isometry3, Matrix6xX, Point3, Vector3, Vector6};

use crate::{JointKind, Robot};

/// Link poses and joint screws of a [`Robot`] at one configuration q.
///
/// The screw of joint j seen from link n is the spatial velocity (linear part first, then angular; Featherstone's
/// motion vector with the parts swapped) of the link per unit of joint speed, taken at the link's origin and expressed
/// in the link's frame. The torque that a force f at point p applies on the joint is then the product of the screw
/// with \[f; p × f\].
#[derive(Clone, Debug)]
pub struct Kinematics {
    root_from_link: Vec<Isometry3<f64>>,
    screws_in_link: Vec<Matrix6xX<f64>>,
}

impl Kinematics {
    /// Kinematics of `robot` with every joint at zero.
    pub fn new(robot: &Robot) -> Self {
        let mut kinematics = Self {
            root_from_link: vec![Isometry3::identity(); robot.links.len()],
            screws_in_link: robot
                .links
                .iter()
                .map(|link| Matrix6xX::zeros(link.path.len()))
                .collect(),
        };
        kinematics.update(robot, &vec![0.0; robot.dof()]);
        kinematics
    }

    /// Moves to configuration `position` (one entry a joint, rad or m). Allocates nothing.
    ///
    /// # Panics
    /// If `position` is shorter than the robot's number of joints, or `robot` is another robot.
    pub fn update(&mut self, robot: &Robot, position: &[f64]) {
        for (index, link) in robot.links.iter().enumerate() {
            let rest = link.parent.map_or(link.parent_from_rest, |parent| {
                self.root_from_link[parent] * link.parent_from_rest
            });
            self.root_from_link[index] = match link.joint {
                Some(joint) => rest * robot.joints[joint].rest_from_moved(position[joint]),
                None => rest,
            };
            self.update_screws(robot, index);
        }
    }

    fn update_screws(&mut self, robot: &Robot, index: usize) {
        let link = &robot.links[index];
        let (before, rest) = self.screws_in_link.split_at_mut(index);
        let screws = &mut rest[0];
        if let Some(parent) = link.parent {
            let link_from_parent = self.root_from_link[index].inv_mul(&self.root_from_link[parent]);
            for (column, screw) in before[parent].column_iter().enumerate() {
                let moved = transform_screw(&link_from_parent, &screw.into_owned());
                screws.set_column(column, &moved);
            }
        }
        if let Some(joint) = link.joint {
            let axis = robot.joints[joint].axis_in_joint.into_inner();
            let screw = match robot.joints[joint].kind {
                JointKind::Prismatic => stack(&axis, &Vector3::zeros()),
                JointKind::Revolute | JointKind::Continuous => stack(&Vector3::zeros(), &axis),
            };
            screws.set_column(link.path.len() - 1, &screw);
        }
    }

    /// Pose of a link's frame in the root frame.
    pub fn root_from_link(&self, link: usize) -> &Isometry3<f64> {
        &self.root_from_link[link]
    }

    /// Screws (6 × k) in the link's frame of the k joints on its path, in the order of [`Link::path`](crate::Link::path).
    pub fn screws_in_link(&self, link: usize) -> &Matrix6xX<f64> {
        &self.screws_in_link[link]
    }

    /// Geometric Jacobian (3 × k, linear part) in the root frame of a point fixed to a link, for the k joints on the
    /// link's path: the point's velocity is J q̇.
    pub fn jacobian_in_root(&self, link: usize, point_in_link: &Point3<f64>) -> DMatrix<f64> {
        let screws = &self.screws_in_link[link];
        let mut jacobian = DMatrix::zeros(3, screws.ncols());
        for (column, screw) in screws.column_iter().enumerate() {
            let linear: Vector3<f64> = screw.fixed_rows::<3>(0).into_owned();
            let angular: Vector3<f64> = screw.fixed_rows::<3>(3).into_owned();
            let velocity_in_link = linear + angular.cross(&point_in_link.coords);
            jacobian.set_column(
                column,
                &(self.root_from_link[link].rotation * velocity_in_link),
            );
        }
        jacobian
    }
}

/// The same screw, seen from another frame and taken at that frame's origin.
fn transform_screw(a_from_b: &Isometry3<f64>, screw_in_b: &Vector6<f64>) -> Vector6<f64> {
    let linear: Vector3<f64> = screw_in_b.fixed_rows::<3>(0).into_owned();
    let angular: Vector3<f64> = screw_in_b.fixed_rows::<3>(3).into_owned();
    let angular_in_a = a_from_b.rotation * angular;
    let linear_in_a = a_from_b.rotation * linear + a_from_b.translation.vector.cross(&angular_in_a);
    stack(&linear_in_a, &angular_in_a)
}

fn stack(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}
