use std::fmt::Write;

use nalgebra::Vector3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::parse;
use crate::TriangleMesh;
use crate::clean::clean;
use crate::shape::cuboid;

/// A box whose numbers single precision holds exactly.
fn brick() -> TriangleMesh {
    cuboid(&Vector3::new(0.25, 0.5, 1.0))
}

fn binary_stl(mesh: &TriangleMesh, header: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in 0..mesh.triangles.len() {
        bytes.extend([0; 12]);
        for value in mesh
            .corners(triangle)
            .iter()
            .flat_map(|corner| corner.iter())
        {
            bytes.extend((*value as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii_stl(mesh: &TriangleMesh) -> String {
    let mut text = "solid brick\n".to_owned();
    for triangle in 0..mesh.triangles.len() {
        text += "  facet normal 0 0 0\n    outer loop\n";
        for corner in mesh.corners(triangle) {
            writeln!(
                text,
                "      vertex {} {:e} {}",
                corner.x, corner.y, corner.z
            )
            .unwrap();
        }
        text += "    endloop\n  endfacet\n";
    }
    text + "endsolid brick\n"
}

const OBJ: &str = "# a brick as quadrilaterals
mtllib absent.mtl
o brick
v -0.125 -0.25 -0.5 1 0 0
v 0.125 -0.25 -0.5 1 0 0
v -0.125 0.25 -0.5
v 0.125 0.25 -0.5
v -0.125 -0.25 0.5
v 0.125 -0.25 0.5
v -0.125 0.25 0.5
v 0.125 0.25 0.5
vn 0 0 1
g left
usemtl absent
f 1//1 5//1 7//1 3//1
g right
f 2/9/9 4/9/9 8/9/9 6/9/9
f 1 2 6 5
f 3 7 8 4
l 1 2
f -8 -6 -5 \\
-7
f 5 6 8 7
";

/// The same brick, as the file says it in units of a hundredth, in two halves of which one is a turned copy.
const DAE: &str = r##"<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="centimetre" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
  <library_geometries><geometry id="half"><mesh>
    <source id="positions">
      <float_array id="numbers" count="24">
        -12.5 -25 0  12.5 -25 0  -12.5 25 0  12.5 25 0
        -12.5 -25 50  12.5 -25 50  -12.5 25 50  12.5 25 50
      </float_array>
      <technique_common><accessor source="#numbers" count="8" stride="3"/></technique_common>
    </source>
    <vertices id="corners"><input semantic="POSITION" source="#positions"/></vertices>
    <triangles count="4">
      <input semantic="NORMAL" source="#absent" offset="1"/>
      <input semantic="VERTEX" source="#corners" offset="0"/>
      <p>0 9 4 9 6 9  0 9 6 9 2 9  1 9 3 9 7 9  1 9 7 9 5 9</p>
    </triangles>
    <polylist count="2">
      <input semantic="VERTEX" source="#corners" offset="0"/>
      <vcount>4 4</vcount><p>0 1 5 4  2 6 7 3</p>
    </polylist>
    <polygons><input semantic="VERTEX" source="#corners" offset="0"/><p>4 5 7 6</p></polygons>
    <lines count="1"><input semantic="VERTEX" source="#corners" offset="0"/><p>0 1</p></lines>
  </mesh></geometry></library_geometries>
  <library_nodes><node id="part"><instance_geometry url="#half"/></node></library_nodes>
  <library_visual_scenes><visual_scene id="scene">
    <node><translate>0 0 100</translate>
      <node><translate>0 0 -100</translate><instance_node url="#part"/></node>
    </node>
    <node><rotate>0 0 1 180</rotate><scale>1 1 -1</scale><instance_geometry url="#half"/></node>
  </visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>"##;

fn assert_is_brick(uri: &str, bytes: &[u8]) {
    let (mesh, _) = clean(&parse(uri, bytes).unwrap());
    let edges = mesh.edges();
    assert_eq!((edges.open, edges.inconsistent), (0, 0), "{uri}");
    assert!((mesh.signed_volume() - 0.125).abs() < 1e-12, "{uri}");
    assert!((mesh.extent() - brick().extent()).abs() < 1e-12, "{uri}");
    for vertex in &mesh.vertices {
        // The halves of one file meet in the middle.
        assert!((vertex.x.abs() - 0.125).abs() < 1e-12, "{uri}");
        assert!((vertex.y.abs() - 0.25).abs() < 1e-12, "{uri}");
        assert!((vertex.z.abs() - 0.25).abs() < 0.25 + 1e-12, "{uri}");
    }
}

fn error(uri: &str, bytes: &[u8]) -> String {
    parse(uri, bytes).unwrap_err().to_string()
}

#[test]
fn every_format_gives_the_same_brick() {
    let brick = brick();
    assert_is_brick("a.obj", OBJ.as_bytes());
    assert_is_brick("a.OBJ", OBJ.replace('\n', "\r\n").as_bytes());
    assert_is_brick("a.stl", ascii_stl(&brick).as_bytes());
    assert_is_brick("a.STL", ascii_stl(&brick).to_uppercase().as_bytes());
    assert_is_brick("a.stl", &binary_stl(&brick, b"Exported"));
    assert_is_brick("a.stl", &binary_stl(&brick, &[0; 80]));
    assert_is_brick("a.stl", &binary_stl(&brick, b"solid brick"));
    assert_is_brick("a.stl", &binary_stl(&brick, &[b' '; 80]));
    assert_is_brick("a.dae", DAE.as_bytes());
    assert_is_brick("a.b.Dae", format!("\u{feff}{DAE}").as_bytes());
}

#[test]
fn an_unknown_format_is_said_with_those_known() {
    let message = error("meshes/a.ply", b"ply");
    assert!(
        message.contains(".stl") && message.contains("a.ply"),
        "{message}"
    );
    assert!(error("noextension", b"").contains("noextension"));
}

#[test]
fn truncated_stl_is_said_with_both_sizes() {
    for header in [&b"Exported"[..], b"solid brick"] {
        let bytes = binary_stl(&brick(), header);
        let message = error("a.stl", &bytes[..bytes.len() - 7]);
        let expected = "STL file too short: expected 684 bytes, found 677";
        assert_eq!(message, expected);
    }
    assert!(error("a.stl", b"short").contains("expected 84 bytes, found 5"));
    let text = ascii_stl(&brick());
    let message = error("a.stl", &text.as_bytes()[..text.len() / 2]);
    assert!(message.contains("endsolid"), "{message}");
}

#[test]
fn a_huge_announced_number_of_triangles_is_refused_by_the_length() {
    let mut bytes = binary_stl(&brick(), b"Exported");
    bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let message = error("a.stl", &bytes);
    assert!(
        message.contains("expected 214748364834 bytes, found 684"),
        "{message}"
    );
}

#[test]
fn faults_in_text_are_placed() {
    let text = ascii_stl(&brick()).replacen("vertex -0.125", "vertex x", 1);
    assert!(error("a.stl", text.as_bytes()).contains("line 4"));
    let message = error("a.obj", OBJ.replace("f 5 6 8 7", "f 5 6 88 7").as_bytes());
    assert!(
        message.contains("out of bounds") && message.contains("8 vertices"),
        "{message}"
    );
    let message = error("a.dae", DAE.replace("4 5 7 6<", "4 5 8 6<").as_bytes());
    assert!(message.contains("an index below 8, found `8`"), "{message}");
    let message = error(
        "a.dae",
        DAE.replace("url=\"#half\"", "url=\"#whole\"").as_bytes(),
    );
    assert!(message.contains("#whole"), "{message}");
}

#[test]
fn a_scene_that_shows_itself_ends_in_an_error() {
    let endless = DAE.replace(
        "<node id=\"part\">",
        "<node id=\"part\"><instance_node url=\"#part\"/><instance_node url=\"#part\"/>",
    );
    assert!(error("a.dae", endless.as_bytes()).contains("at most"));
}

#[test]
fn deep_nesting_ends_in_an_answer() {
    let deep = "<node>".repeat(50_000) + &"</node>".repeat(50_000);
    let text = format!("<COLLADA><visual_scene>{deep}</visual_scene></COLLADA>");
    assert_eq!(
        parse("a.dae", text.as_bytes()).unwrap(),
        TriangleMesh::default()
    );
}

#[test]
fn damaged_files_never_panic() {
    let brick = brick();
    let files = [
        ("a.obj", OBJ.as_bytes().to_vec()),
        ("a.stl", binary_stl(&brick, b"Exported")),
        ("a.stl", ascii_stl(&brick).into_bytes()),
        ("a.dae", DAE.as_bytes().to_vec()),
    ];
    let mut random = StdRng::seed_from_u64(7);
    let (mut accepted, mut refused) = (0, 0);
    for (uri, whole) in &files {
        for _ in 0..1500 {
            match parse(uri, &damage(whole, &mut random)) {
                Ok(mesh) => {
                    let (mesh, _) = clean(&mesh);
                    assert!(
                        mesh.vertices
                            .iter()
                            .all(|vertex| vertex.coords.norm().is_finite())
                    );
                    accepted += 1;
                }
                Err(error) => {
                    assert!(!error.to_string().is_empty());
                    refused += 1;
                }
            }
        }
    }
    // Damage that nothing refuses, or that nothing survives, would test little.
    assert!(accepted > 500 && refused > 500, "{accepted} {refused}");
}

/// The file with a few bytes changed, removed, repeated or cut off.
fn damage(whole: &[u8], random: &mut StdRng) -> Vec<u8> {
    const TELLING: &[u8] = b"\0\n -+./<>#\"0123456789eE\xff";
    let mut bytes = whole.to_vec();
    for _ in 0..random.random_range(1..4) {
        if bytes.len() < 2 {
            break;
        }
        let place = random.random_range(0..bytes.len());
        let end = (place + random.random_range(1..40)).min(bytes.len());
        match random.random_range(0..6) {
            0 => bytes[place] = random.random(),
            1 | 2 => bytes[place] = TELLING[random.random_range(0..TELLING.len())],
            3 => drop(bytes.drain(place..end)),
            4 => {
                let copy = bytes[place..end].to_vec();
                bytes.splice(place..place, copy);
            }
            _ if random.random_bool(0.2) => bytes.truncate(place.max(2)),
            _ => bytes.insert(place, random.random()),
        }
    }
    bytes
}
