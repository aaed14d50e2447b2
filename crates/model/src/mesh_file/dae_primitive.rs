//! The geometries of a COLLADA file: positions, and the primitives over them.

use nalgebra::Point3;
use roxmltree::Node;

use super::dae::{ById, child, expected, is, target, values};
use crate::{ModelError, TriangleMesh};

/// The triangles of a `<geometry>` in its own frame and unit.
pub(super) fn geometry(geometry: Node, by_id: &ById) -> Result<TriangleMesh, ModelError> {
    let mut mesh = TriangleMesh::default();
    let parts = child(geometry, "mesh")
        .into_iter()
        .flat_map(|mesh| mesh.children());
    for primitive in parts {
        let cut: fn(&[u32], &mut Vec<[u32; 3]>) = match primitive.tag_name().name() {
            "triangles" | "polylist" | "polygons" | "trifans" => fan,
            "tristrips" => strip,
            _ => continue,
        };
        let Some(corners) = Corners::of(primitive, by_id)? else {
            continue;
        };
        let mut part = TriangleMesh {
            vertices: corners.positions.clone(),
            triangles: Vec::new(),
        };
        for polygon in polygons(primitive, &corners)? {
            cut(&polygon, &mut part.triangles);
        }
        mesh.append(&part);
    }
    Ok(mesh)
}

fn fan(corners: &[u32], out: &mut Vec<[u32; 3]>) {
    if let [first, rest @ ..] = corners {
        out.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    }
}

fn strip(corners: &[u32], out: &mut Vec<[u32; 3]>) {
    for (index, corner) in corners.windows(3).enumerate() {
        let turned = index % 2 == 1;
        let [b, c] = if turned { [2, 1] } else { [1, 2] };
        out.push([corner[0], corner[b], corner[c]]);
    }
}

/// The corners of each polygon, fan or strip of a primitive, as indices of positions.
fn polygons(primitive: Node, corners: &Corners) -> Result<Vec<Vec<u32>>, ModelError> {
    let lists = (primitive.children())
        // A polygon with holes, <ph>, counts as its outer edge.
        .filter_map(|part| {
            if is(part, "ph") {
                child(part, "p")
            } else {
                Some(part)
            }
        })
        .filter(|part| is(*part, "p"))
        .map(|list| corners.indices(list))
        .collect::<Result<Vec<_>, _>>()?;
    match primitive.tag_name().name() {
        "triangles" => Ok(lists
            .concat()
            .chunks_exact(3)
            .map(<[u32]>::to_vec)
            .collect()),
        "polylist" => by_counts(&lists.concat(), primitive),
        _ => Ok(lists),
    }
}

fn by_counts(indices: &[u32], primitive: Node) -> Result<Vec<Vec<u32>>, ModelError> {
    let counts = match child(primitive, "vcount") {
        Some(counts) => values::<usize>(counts, "a number of corners")?,
        None => Vec::new(),
    };
    let mut rest = indices;
    let mut polygons = Vec::new();
    for count in counts {
        let (polygon, after) = (rest.split_at_checked(count))
            .ok_or_else(|| expected(&format!("{count} corners"), &rest.len().to_string()))?;
        polygons.push(polygon.to_vec());
        rest = after;
    }
    Ok(polygons)
}

/// Where a primitive's corners take their positions from.
struct Corners {
    positions: Vec<Point3<f64>>,
    /// Place of the position's index among the indices of one corner.
    offset: usize,
    /// Number of indices of one corner.
    stride: usize,
}

impl Corners {
    /// None for a primitive without corners.
    fn of(primitive: Node, by_id: &ById) -> Result<Option<Self>, ModelError> {
        let mut stride = 0;
        let mut vertices = None;
        for input in primitive.children().filter(|part| is(*part, "input")) {
            let offset = whole(input, "offset", 0)?;
            stride = stride.max(offset.saturating_add(1));
            if input.attribute("semantic") == Some("VERTEX") {
                vertices = Some((target(input, "source", by_id)?, offset));
            }
        }
        let Some((vertices, offset)) = vertices else {
            return Ok(None);
        };
        let position = (vertices.children())
            .find(|part| part.attribute("semantic") == Some("POSITION"))
            .ok_or_else(|| expected("an input with semantic POSITION in <vertices>", "none"))?;
        Ok(Some(Self {
            positions: positions(target(position, "source", by_id)?, by_id)?,
            offset,
            stride,
        }))
    }

    fn indices(&self, list: Node) -> Result<Vec<u32>, ModelError> {
        let all = values::<u32>(list, "an index")?;
        let indices: Vec<_> = (all.chunks_exact(self.stride))
            .filter_map(|corner| corner.get(self.offset).copied())
            .collect();
        let outside = |index: &&u32| **index as usize >= self.positions.len();
        match indices.iter().find(outside) {
            None => Ok(indices),
            Some(index) => Err(expected(
                &format!("an index below {}", self.positions.len()),
                &index.to_string(),
            )),
        }
    }
}

/// The positions of a `<source>`.
fn positions(source: Node, by_id: &ById) -> Result<Vec<Point3<f64>>, ModelError> {
    let accessor = child(source, "technique_common")
        .and_then(|technique| child(technique, "accessor"))
        .ok_or_else(|| expected("an <accessor> in <source>", "none"))?;
    let array = values::<f64>(target(accessor, "source", by_id)?, "a number")?;
    let stride = whole(accessor, "stride", 3)?;
    if stride < 3 {
        return Err(expected("a stride of 3 or more", &stride.to_string()));
    }
    let start = whole(accessor, "offset", 0)?;
    let used = array.get(start..).unwrap_or_default().chunks(stride);
    let points = used.filter_map(|values| values.first_chunk::<3>());
    Ok(points.map(|point| Point3::from(*point)).collect())
}

fn whole(node: Node, attribute: &str, default: usize) -> Result<usize, ModelError> {
    match node.attribute(attribute) {
        None => Ok(default),
        Some(text) => (text.trim().parse()).map_err(|_| expected("a whole number", text)),
    }
}
