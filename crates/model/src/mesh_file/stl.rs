//! STL, binary and ASCII.

use nalgebra::Point3;

use crate::{ModelError, TriangleMesh};

const HEADER: usize = 80;
const PREFIX: usize = HEADER + 4;
const RECORD: usize = 50;

/// Reads either kind. What the first bytes say is not to be trusted, as binary headers too may start with `solid`: a
/// file is ASCII if it starts with `solid` and has no byte that text cannot have.
pub(super) fn parse(bytes: &[u8]) -> Result<TriangleMesh, ModelError> {
    if is_ascii(bytes) {
        parse_ascii(bytes)
    } else {
        parse_binary(bytes)
    }
}

fn is_ascii(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    let solid = start
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    solid && !is_whole_binary(bytes) && !bytes.contains(&0)
}

/// Whether the length is exactly what the number of triangles in a binary file asks for.
fn is_whole_binary(bytes: &[u8]) -> bool {
    announced(bytes).is_some_and(|count| length(count) == bytes.len() as u64)
}

fn announced(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEADER..)?.first_chunk()?;
    Some(u32::from_le_bytes(*count))
}

fn length(count: u32) -> u64 {
    PREFIX as u64 + u64::from(count) * RECORD as u64
}

fn parse_binary(bytes: &[u8]) -> Result<TriangleMesh, ModelError> {
    let found = bytes.len() as u64;
    let too_short = |expected| ModelError::MeshLength {
        format: "STL",
        expected,
        found,
    };
    let count = announced(bytes).ok_or(too_short(PREFIX as u64))?;
    if found < length(count) {
        return Err(too_short(length(count)));
    }
    let mut mesh = TriangleMesh::default();
    let records = bytes.get(PREFIX..).unwrap_or_default().chunks_exact(RECORD);
    for record in records.take(count as usize) {
        let (numbers, _) = record.as_chunks::<4>();
        let numbers = numbers
            .iter()
            .map(|bytes| f64::from(f32::from_le_bytes(*bytes)));
        // The first three are the normal, which the corners give better.
        let corners: Vec<_> = numbers.skip(3).collect();
        push_triangle(&mut mesh, &corners);
    }
    Ok(mesh)
}

/// Adds the triangle with these nine coordinates.
fn push_triangle(mesh: &mut TriangleMesh, coordinates: &[f64]) {
    let first = mesh.vertices.len() as u32;
    let (corners, _) = coordinates.as_chunks::<3>();
    (mesh.vertices).extend(corners.iter().map(|&corner| Point3::from(corner)));
    mesh.triangles.push([first, first + 1, first + 2]);
}

fn parse_ascii(bytes: &[u8]) -> Result<TriangleMesh, ModelError> {
    let text = String::from_utf8_lossy(bytes);
    let malformed = |line: usize, expected: &str, found: &str| ModelError::MeshFile {
        format: "STL",
        reason: format!("line {}: expected {expected}, found `{found}`", line + 1),
    };
    let mut mesh = TriangleMesh::default();
    let mut coordinates = Vec::new();
    let mut closed = false;
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("vertex") => {
                let values: Vec<_> = words.map_while(|word| word.parse::<f64>().ok()).collect();
                if values.len() != 3 {
                    return Err(malformed(number, "vertex and three numbers", line.trim()));
                }
                coordinates.extend(values);
            }
            Some("endloop") => {
                if coordinates.len() != 9 {
                    let found = format!("{} vertices", coordinates.len() / 3);
                    return Err(malformed(number, "3 vertices before endloop", &found));
                }
                push_triangle(&mut mesh, &coordinates);
                coordinates.clear();
            }
            Some("endsolid") => closed = true,
            _ => {}
        }
    }
    if !closed || !coordinates.is_empty() {
        let last = text.lines().last().unwrap_or_default().trim();
        return Err(malformed(text.lines().count(), "endsolid at the end", last));
    }
    Ok(mesh)
}
