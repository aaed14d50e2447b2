//! A robot and an obstacle's shape, ready for distance queries at any configuration.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector3};
use palpate_model::{Kinematics, Robot, TriangleMesh};
use parry3d_f64::shape::TriMesh;

use crate::obstacle::{Probe, Touch};
use crate::remesh::refine;
use crate::shape::tri_mesh;
use crate::{Obstacle, Scenario, SimError};

/// Free space that stays between the obstacle and every link but the touched one, m.
const CLEARANCE: f64 = 1e-3;

/// Why a draw of configuration, obstacle and motion is of no use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Refusal {
    Covered,
    Inside,
    AcrossAxis,
    Lever,
    Lost,
    Jumps,
    Wanders,
    Still,
    Limits,
    NoApproach,
}

impl Refusal {
    fn reason(self) -> &'static str {
        match self {
            Self::Covered => "another link is in the way",
            Self::Inside => "the obstacle would be in the link",
            Self::AcrossAxis => "the surface does not lie along the pole",
            Self::Lever => "the joints have no lever to press there",
            Self::Lost => "the penetration cannot be held",
            Self::Jumps => "the contact jumps along the link",
            Self::Wanders => "the contact moves too far along the link",
            Self::Still => "the contact hardly moves",
            Self::Limits => "a joint limit",
            Self::NoApproach => "the link cannot approach from free space",
        }
    }
}

/// How many draws were refused for what, as a sentence.
pub(crate) fn summary(refusals: &BTreeMap<Refusal, usize>) -> String {
    let counts: Vec<_> = (refusals.iter())
        .map(|(refusal, count)| format!("{count} as {}", refusal.reason()))
        .collect();
    counts.join(", ")
}

/// What one scenario plays in.
pub(crate) struct Scene<'a> {
    pub robot: &'a Robot,
    /// Index of the touched link.
    pub link: usize,
    /// The touched link's surface, in its frame, as the obstacle meets it.
    pub mesh: TriangleMesh,
    touched: TriMesh,
    others: Vec<(usize, TriMesh)>,
    probe: Probe,
}

impl<'a> Scene<'a> {
    pub fn new(robot: &'a Robot, scenario: &Scenario, link: usize) -> Result<Self, SimError> {
        let of_link = |index: usize, mesh: &TriangleMesh| {
            tri_mesh(mesh).map_err(|reason| SimError::Mesh {
                link: robot.links[index].name.clone(),
                reason,
            })
        };
        let own_mesh = robot.links[link].mesh.clone().unwrap_or_default();
        let mesh = refine(&own_mesh, scenario.refine_levels);
        let others = (robot.links.iter().enumerate())
            .filter(|(index, _)| *index != link)
            .filter_map(|(index, other)| Some((index, other.mesh.as_ref()?)))
            .map(|(index, mesh)| Ok((index, of_link(index, mesh)?)))
            .collect::<Result<_, SimError>>()?;
        let probe = Probe::new(&scenario.obstacle).ok_or_else(|| SimError::OutOfRange {
            field: "obstacle",
            expected: "a body with a volume".to_owned(),
            found: format!("{:?}", scenario.obstacle),
        })?;
        Ok(Self {
            robot,
            link,
            touched: of_link(link, &mesh)?,
            mesh,
            others,
            probe,
        })
    }

    /// Where the obstacle and the touched link are closest.
    pub fn touch(
        &self,
        kinematics: &Kinematics,
        root_from_obstacle: &Isometry3<f64>,
    ) -> Result<Touch, Refusal> {
        let root_from_link = kinematics.root_from_link(self.link);
        (self.probe)
            .touch(root_from_obstacle, &self.touched, root_from_link)
            .ok_or(Refusal::Inside)
    }

    /// Whether a touch comes from outside of the link: a core inside of it would push on a triangle's back.
    pub fn is_outside(&self, kinematics: &Kinematics, touch: &Touch) -> bool {
        // A closest point on an edge may lie slightly behind one of the two triangles that meet there.
        const SLACK: f64 = 0.1;
        let Some(triangle) = touch.triangle else {
            return true;
        };
        let normal_in_link = triangle_normal(&self.mesh, triangle as usize);
        let normal = kinematics.root_from_link(self.link) * normal_in_link;
        normal.dot(&touch.push_in_root) < SLACK
    }

    /// Whether every other link stays clear of the obstacle.
    pub fn is_clear(&self, kinematics: &Kinematics, obstacle: &Obstacle) -> bool {
        self.others.iter().all(|(index, mesh)| {
            let root_from_link = kinematics.root_from_link(*index);
            let pose = &obstacle.root_from_obstacle;
            !(self.probe).is_near(pose, mesh, root_from_link, CLEARANCE)
        })
    }

    /// A point of the touched link, in the root frame, in the link's frame.
    pub fn in_link(&self, kinematics: &Kinematics, point_in_root: &Point3<f64>) -> Point3<f64> {
        kinematics
            .root_from_link(self.link)
            .inverse_transform_point(point_in_root)
    }
}

/// Unit normal of a triangle, outward for counter-clockwise corners; zero if it has no area.
pub(crate) fn triangle_normal(mesh: &TriangleMesh, triangle: usize) -> Vector3<f64> {
    let [a, b, c] = mesh.corners(triangle);
    let normal = (b - a).cross(&(c - a));
    normal.try_normalize(0.0).unwrap_or_default()
}
