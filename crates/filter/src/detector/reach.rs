//! Which link can be touched, if these joints feel it.

use palpate_model::{Link, Robot};

/// The link that each joint moves.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    /// The link's index, and how many joints move it.
    moved: Vec<(usize, usize)>,
}

impl Reach {
    pub(super) fn new(robot: &Robot) -> Self {
        let moved = |joint: usize| {
            let moves = |link: &Link| link.joint == Some(joint);
            let link = robot.links.iter().position(moves).unwrap_or(0);
            (link, robot.links[link].path.len())
        };
        Self {
            moved: (0..robot.dof()).map(moved).collect(),
        }
    }

    /// The link furthest out that a joint moves which feels the contact: no link before it can be the touched one. `known`
    /// is the one that was found before, which stays if it is further out.
    pub(super) fn first_link(&self, feels: &[bool], known: Option<usize>) -> Option<usize> {
        let felt = self.moved.iter().zip(feels).filter(|(_, feels)| **feels);
        let before = self.moved.iter().filter(|(link, _)| Some(*link) == known);
        let links = before.chain(felt.map(|(moved, _)| moved));
        links.max_by_key(|(_, depth)| *depth).map(|(link, _)| *link)
    }
}
