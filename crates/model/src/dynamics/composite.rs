//! The mass matrix: the composite rigid body algorithm (Walker and Orin 1982; Featherstone 2008, table 6.2).

use nalgebra::DMatrix;

use super::{Dynamics, DynamicsWorkspace};

impl Dynamics {
    /// The mass matrix M(q), n × n for n movable joints, symmetric.
    ///
    /// # Panics
    /// As [`Dynamics::inverse_dynamics`].
    pub fn mass_matrix<'a>(
        &self,
        workspace: &'a mut DynamicsWorkspace,
        position: &[f64],
    ) -> &'a DMatrix<f64> {
        for (index, body) in self.bodies.iter().enumerate() {
            let moving = &mut workspace.moving[index];
            moving.parent_from_body = body.placement(position[index]);
            moving.composite = body.inertia;
        }
        // Joints on different branches do not feel each other.
        workspace.mass_matrix.fill(0.0);
        for index in (0..self.bodies.len()).rev() {
            self.fill_row(workspace, index);
        }
        &workspace.mass_matrix
    }

    /// Row and column of one joint: the force that accelerates all that it moves, felt by the joints before it.
    fn fill_row(&self, workspace: &mut DynamicsWorkspace, index: usize) {
        let body = &self.bodies[index];
        let moving = workspace.moving[index];
        if let Some(parent) = body.parent {
            let carried = moving.parent_from_body.inertia_in_parent(&moving.composite);
            workspace.moving[parent].composite += carried;
        }
        let mut wrench = moving.composite.of(&body.screw);
        let mut at = index;
        loop {
            let entry = self.bodies[at].screw.dot(&wrench);
            workspace.mass_matrix[(index, at)] = entry;
            workspace.mass_matrix[(at, index)] = entry;
            let Some(parent) = self.bodies[at].parent else {
                return;
            };
            wrench = workspace.moving[at]
                .parent_from_body
                .wrench_in_parent(&wrench);
            at = parent;
        }
    }
}
