//! The tree that a URDF's links and joints form.

use std::collections::{HashMap, HashSet};

use crate::ModelError;

/// The links of a URDF, checked to be one tree.
pub(crate) struct Tree<'a> {
    root: &'a urdf_rs::Link,
    links: HashMap<&'a str, &'a urdf_rs::Link>,
    /// Joints below each link, in the URDF's order.
    below: HashMap<&'a str, Vec<&'a urdf_rs::Joint>>,
}

impl<'a> Tree<'a> {
    pub(crate) fn new(urdf: &'a urdf_rs::Robot) -> Result<Self, ModelError> {
        check_unique("link", urdf.links.iter().map(|link| link.name.as_str()))?;
        check_unique("joint", urdf.joints.iter().map(|joint| joint.name.as_str()))?;
        let links: HashMap<_, _> = (urdf.links.iter())
            .map(|link| (link.name.as_str(), link))
            .collect();
        let mut below: HashMap<_, Vec<_>> = HashMap::new();
        let mut above: HashMap<&str, &str> = HashMap::new();
        for joint in &urdf.joints {
            for (role, link) in [("parent", &joint.parent.link), ("child", &joint.child.link)] {
                if !links.contains_key(link.as_str()) {
                    return Err(ModelError::UnknownLink {
                        joint: joint.name.clone(),
                        role,
                        link: link.clone(),
                    });
                }
            }
            below
                .entry(joint.parent.link.as_str())
                .or_default()
                .push(joint);
            if let Some(other) = above.insert(&joint.child.link, &joint.name) {
                return Err(ModelError::Tree {
                    expected: "at most one joint above each link",
                    found: format!(
                        "`{other}` and `{}` above `{}`",
                        joint.name, joint.child.link
                    ),
                });
            }
        }
        let roots = urdf
            .links
            .iter()
            .filter(|link| !above.contains_key(link.name.as_str()));
        let tree = Self {
            root: only_root(&roots.collect::<Vec<_>>())?,
            links,
            below,
        };
        tree.check_reaches_all(urdf)?;
        Ok(tree)
    }

    /// Links with the joint above them, depth first, so that the joints of a chain come in its order.
    pub(crate) fn parents_first(&self) -> Vec<(&'a urdf_rs::Link, Option<&'a urdf_rs::Joint>)> {
        let mut order = Vec::with_capacity(self.links.len());
        let mut waiting = vec![(self.root, None)];
        while let Some((link, joint_above)) = waiting.pop() {
            order.push((link, joint_above));
            let below = self
                .below
                .get(link.name.as_str())
                .map_or(&[][..], Vec::as_slice);
            for joint in below.iter().rev() {
                if let Some(child) = self.links.get(joint.child.link.as_str()) {
                    waiting.push((child, Some(*joint)));
                }
            }
        }
        order
    }

    /// With one root and at most one joint above each link, what the root does not reach is a cycle.
    fn check_reaches_all(&self, urdf: &urdf_rs::Robot) -> Result<(), ModelError> {
        let order = self.parents_first();
        let reached: HashSet<_> = order.iter().map(|(link, _)| link.name.as_str()).collect();
        let unreached: Vec<_> = (urdf.links.iter())
            .map(|link| link.name.as_str())
            .filter(|name| !reached.contains(name))
            .collect();
        if unreached.is_empty() {
            return Ok(());
        }
        Err(ModelError::Tree {
            expected: "every link below the root",
            found: format!("a cycle of joints with {}", unreached.join(", ")),
        })
    }
}

fn only_root<'a>(roots: &[&'a urdf_rs::Link]) -> Result<&'a urdf_rs::Link, ModelError> {
    match roots {
        [root] => Ok(root),
        _ => Err(ModelError::Tree {
            expected: "exactly one root, a link with no joint above it",
            found: if roots.is_empty() {
                "none".to_owned()
            } else {
                let names: Vec<_> = roots.iter().map(|link| link.name.as_str()).collect();
                names.join(", ")
            },
        }),
    }
}

fn check_unique<'a>(
    kind: &'static str,
    names: impl Iterator<Item = &'a str>,
) -> Result<(), ModelError> {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(ModelError::DuplicateName {
                kind,
                name: name.to_owned(),
            });
        }
    }
    Ok(())
}
