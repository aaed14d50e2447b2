//! COLLADA (DAE): the triangles and polygons of its visual scene.
//!
//! As RViz does, `<unit>` is applied and `<up_axis>` is not: URDF says which way is up. Skins, splines, lines and
//! levels of detail are left out.

use std::collections::HashMap;

use nalgebra::{Matrix4, Point3, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node};

use super::dae_primitive;
use crate::{ModelError, TriangleMesh};

/// A scene may show one node many times; more nodes or vertices than this are taken for a fault.
const MOST_NODES: usize = 100_000;
const MOST_VERTICES: usize = 10_000_000;

/// Reads the visual scene in metres; a file without one gives all its geometries as they are.
pub(super) fn parse(bytes: &[u8]) -> Result<TriangleMesh, ModelError> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let document = Document::parse(text).map_err(|error| malformed(error.to_string()))?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(expected("<COLLADA>", root.tag_name().name()));
    }
    let ids = (document.descendants()).filter_map(|node| Some((node.attribute("id")?, node)));
    let scene = Scene {
        by_id: ids.collect(),
    };
    let mut mesh = TriangleMesh::default();
    let unit = unit(root)?;
    match visual_scene(root, &scene)? {
        Some(visual) => scene.collect(visual, &mut mesh)?,
        None => {
            for geometry in root.descendants().filter(|node| is(*node, "geometry")) {
                mesh.append(&dae_primitive::geometry(geometry, &scene.by_id)?);
            }
        }
    }
    mesh.scale(&Vector3::repeat(unit));
    Ok(mesh)
}

fn unit(root: Node) -> Result<f64, ModelError> {
    let unit = child(root, "asset").and_then(|asset| child(asset, "unit"));
    let Some(text) = unit.and_then(|unit| unit.attribute("meter")) else {
        return Ok(1.0);
    };
    match text.trim().parse::<f64>() {
        Ok(unit) if unit > 0.0 && unit.is_finite() => Ok(unit),
        _ => Err(expected("a unit in metres above zero", text)),
    }
}

/// The scene that the file names, or else its only one.
fn visual_scene<'a, 'x>(
    root: Node<'a, 'x>,
    scene: &Scene<'a, 'x>,
) -> Result<Option<Node<'a, 'x>>, ModelError> {
    let instance = child(root, "scene").and_then(|node| child(node, "instance_visual_scene"));
    match instance {
        Some(instance) => scene.target(instance, "url").map(Some),
        None => Ok(root.descendants().find(|node| is(*node, "visual_scene"))),
    }
}

pub(super) type ById<'a, 'x> = HashMap<&'a str, Node<'a, 'x>>;

struct Scene<'a, 'x> {
    by_id: ById<'a, 'x>,
}

impl<'a, 'x> Scene<'a, 'x> {
    fn target(&self, node: Node<'a, 'x>, attribute: &str) -> Result<Node<'a, 'x>, ModelError> {
        target(node, attribute, &self.by_id)
    }

    /// Adds what a visual scene shows, node by node, each seen from the scene.
    fn collect(&self, visual: Node<'a, 'x>, mesh: &mut TriangleMesh) -> Result<(), ModelError> {
        let mut waiting = vec![(visual, Matrix4::identity())];
        let mut nodes = 1;
        while let Some((node, scene_from_above)) = waiting.pop() {
            let scene_from_node = scene_from_above * local_transform(node)?;
            for part in node.children() {
                nodes += usize::from(part.is_element());
                if nodes > MOST_NODES || mesh.vertices.len() > MOST_VERTICES {
                    return Err(malformed(format!(
                        "expected at most {MOST_NODES} nodes and {MOST_VERTICES} vertices in the scene, found more"
                    )));
                }
                match part.tag_name().name() {
                    "node" => waiting.push((part, scene_from_node)),
                    "instance_node" => waiting.push((self.target(part, "url")?, scene_from_node)),
                    "instance_geometry" => {
                        let geometry = self.target(part, "url")?;
                        let mut part = dae_primitive::geometry(geometry, &self.by_id)?;
                        transform(&mut part, &scene_from_node);
                        mesh.append(&part);
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }
}

/// The product of a node's transformations, in their order.
fn local_transform(node: Node) -> Result<Matrix4<f64>, ModelError> {
    let mut above_from_node = Matrix4::identity();
    for part in node.children() {
        above_from_node *= match part.tag_name().name() {
            "matrix" => Matrix4::from_row_slice(&numbers::<16>(part)?),
            "translate" => Matrix4::new_translation(&numbers::<3>(part)?.into()),
            "scale" => Matrix4::new_nonuniform_scaling(&numbers::<3>(part)?.into()),
            "rotate" => {
                let [x, y, z, degrees] = numbers::<4>(part)?;
                Unit::try_new(Vector3::new(x, y, z), 0.0).map_or_else(Matrix4::identity, |axis| {
                    Rotation3::from_axis_angle(&axis, degrees.to_radians()).to_homogeneous()
                })
            }
            "skew" | "lookat" => {
                let found = format!("<{}>", part.tag_name().name());
                return Err(expected("matrix, translate, rotate or scale", &found));
            }
            _ => continue,
        };
    }
    Ok(above_from_node)
}

fn transform(mesh: &mut TriangleMesh, matrix: &Matrix4<f64>) {
    for vertex in &mut mesh.vertices {
        *vertex = Point3::from((matrix * vertex.to_homogeneous()).xyz());
    }
    if matrix.fixed_view::<3, 3>(0, 0).determinant() < 0.0 {
        mesh.flip();
    }
}

pub(super) fn is(node: Node, name: &str) -> bool {
    node.tag_name().name() == name
}

pub(super) fn child<'a, 'x>(node: Node<'a, 'x>, name: &str) -> Option<Node<'a, 'x>> {
    node.children().find(|part| is(*part, name))
}

/// The element that an attribute like `url="#id"` points to.
pub(super) fn target<'a, 'x>(
    node: Node<'a, 'x>,
    attribute: &str,
    by_id: &ById<'a, 'x>,
) -> Result<Node<'a, 'x>, ModelError> {
    let found = node.attribute(attribute).unwrap_or_default();
    (found.strip_prefix('#'))
        .and_then(|id| by_id.get(id).copied())
        .ok_or_else(|| expected("a reference to an element of the file", found))
}

/// The values in an element's text.
pub(super) fn values<T: std::str::FromStr>(node: Node, kind: &str) -> Result<Vec<T>, ModelError> {
    let mut values = Vec::new();
    for text in node.children().filter(Node::is_text) {
        for word in text.text().unwrap_or_default().split_ascii_whitespace() {
            values.push(word.parse().map_err(|_| expected(kind, word))?);
        }
    }
    Ok(values)
}

fn numbers<const N: usize>(node: Node) -> Result<[f64; N], ModelError> {
    values(node, "a number")?
        .try_into()
        .map_err(|found: Vec<f64>| {
            let name = node.tag_name().name();
            expected(
                &format!("{N} numbers in <{name}>"),
                &found.len().to_string(),
            )
        })
}

pub(super) fn malformed(reason: String) -> ModelError {
    ModelError::MeshFile {
        format: "DAE",
        reason,
    }
}

pub(super) fn expected(expected: &str, found: &str) -> ModelError {
    malformed(format!("expected {expected}, found `{found}`"))
}
