//! Meshes in: each format, what is put right, and what is refused with which words.

mod common;

use charcloth::frame::Frame;
use charcloth::mesh::SurfaceMesh;
use charcloth::scene::LengthUnit;
use charcloth::sheet::bounds;
use charcloth_io::IoError;
use charcloth_io::cache::{CacheReader, CacheWriter, RunInfo};
use charcloth_io::exporters::{ExportOptions, export};
use charcloth_io::importers::{IMPORTERS, coarse, inspect, likely_unit, read_mesh};
use common::skipped::skipped;
use common::{Folder, mesh_file, sheet};
use glam::{DVec3, Vec2};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

fn read(path: &Path) -> Result<SurfaceMesh, IoError> {
    read_mesh(path, LengthUnit::M)
}

fn size(mesh: &SurfaceMesh) -> DVec3 {
    let (low, high) = bounds(&mesh.positions);
    high - low
}

/// Number of closed loops that the free edges make, for surfaces where each free point has two of them.
fn boundary_loops(mesh: &SurfaceMesh) -> usize {
    let mut uses: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for corners in &mesh.triangles {
        for k in 0..3 {
            let (i, j) = (corners[k], corners[(k + 1) % 3]);
            *uses.entry((i.min(j), i.max(j))).or_default() += 1;
        }
    }
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for ((i, j), _) in uses.iter().filter(|(_, n)| **n == 1) {
        next.entry(*i).or_default().push(*j);
        next.entry(*j).or_default().push(*i);
    }
    let mut loops = 0;
    while let Some((start, _)) = next.iter().next() {
        loops += 1;
        let mut waiting = vec![*start];
        while let Some(i) = waiting.pop() {
            waiting.extend(next.remove(&i).unwrap_or_default());
        }
    }
    loops
}

const OBJ: &str = "# two quads with a seam between\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\nvt 0.75 0.5\nvt 0.75 0.75\nvt 0.5 0.75\n\
    f 1/1 2/2 3/3 4/4\nf 2/5 5/6 6/7 3/8\n";

#[test]
fn obj_keeps_point_order_faces_and_seams() {
    let folder = Folder::new("obj");
    let mesh = read(&folder.file("a.obj", OBJ)).unwrap();
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.positions[4], DVec3::new(2.0, 0.0, 0.0));
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]]);
    assert_eq!(mesh.source_face, [0, 0, 1, 1]);
    // The points 1 and 2 have other texture coordinates on either side of the seam.
    assert_eq!(mesh.corner_uv[0][1], Vec2::new(1.0, 0.0));
    assert_eq!(mesh.corner_uv[2][0], Vec2::new(0.5, 0.5));
    assert_eq!((mesh.shell_count(), mesh.remarks.len()), (1, 0));
}

#[test]
fn obj_takes_negative_indices_groups_joined_lines_and_colors() {
    let text = "v 0 0 0 1 0 0\r\nv 1 0 0 0 1 0\r\nv 1 1 0 0 0 1\r\ng a\r\nf -3// \\\r\n -2// -1//\r\nusemtl b\r\nv 0 1 0 1 1 1\nf 1 3 4\n";
    let folder = Folder::new("obj-odd");
    let mesh = read(&folder.file("A.OBJ", text)).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert!(mesh.corner_uv.is_empty());
    assert_eq!(mesh.painted["color.g"], [0.0, 1.0, 0.0, 1.0]);
    assert!((mesh.painted["color"][3] - 1.0).abs() < 1e-6);
    assert_eq!(mesh.painted["color"][1], 0.7152);
}

fn ply(format: &str, rows: &[u8]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment a\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\n\
         property float u\nproperty float v\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         property float ignite\nelement face 1\nproperty list uchar int vertex_index\nend_header\n"
    )
    .into_bytes();
    bytes.extend_from_slice(rows);
    bytes
}

#[test]
fn ply_reads_the_same_from_ascii_and_both_binary_orders() {
    let points: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let (mut ascii, mut little, mut big) = (String::new(), Vec::new(), Vec::new());
    for [x, y] in points {
        let red = if x > 0.5 { 255_u8 } else { 0 };
        ascii += &format!("{x} {y} 0 {x} {y} {red} 0 0 {}\n", 0.5 * y);
        little.extend(x.to_le_bytes());
        big.extend(x.to_be_bytes());
        for value in [y, 0.0, x, y] {
            little.extend((value as f32).to_le_bytes());
            big.extend((value as f32).to_be_bytes());
        }
        little.extend([red, 0, 0]);
        big.extend([red, 0, 0]);
        little.extend((0.5 * y as f32).to_le_bytes());
        big.extend((0.5 * y as f32).to_be_bytes());
    }
    ascii += "4 0 1 2 3\n";
    little.push(4);
    big.push(4);
    for i in 0..4_i32 {
        little.extend(i.to_le_bytes());
        big.extend(i.to_be_bytes());
    }
    let folder = Folder::new("ply");
    let files = [("ascii", ascii.into_bytes()), ("binary_little_endian", little), ("binary_big_endian", big)];
    let meshes = files.map(|(format, rows)| read(&folder.file("a.ply", ply(format, &rows))).unwrap());
    assert_eq!(meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(meshes[0].corner_uv[1], [Vec2::ZERO, Vec2::ONE, Vec2::Y]);
    assert_eq!(meshes[0].painted["color.r"], [0.0, 1.0, 1.0, 0.0]);
    assert_eq!(meshes[0].painted["ignite"], [0.0, 0.0, 0.5, 0.5]);
    assert_eq!(meshes[0], meshes[1]);
    assert_eq!(meshes[0], meshes[2]);
}

fn binary_stl(header: &[u8], triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        triangle.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const SQUARE: [[[f32; 3]; 3]; 2] =
    [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]];

fn ascii_stl() -> String {
    let mut text = String::from("solid a sheet\n");
    for [a, b, c] in SQUARE {
        text += "facet normal 0 0 1\nouter loop\n";
        for [x, y, z] in [a, b, c] {
            text += &format!("vertex {x} {y} {z:e}\n");
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid a sheet\n"
}

#[test]
fn stl_joins_its_corners_also_where_a_binary_file_says_solid() {
    let folder = Folder::new("stl");
    let binary = read(&folder.file("a.stl", binary_stl(b"made by", &SQUARE))).unwrap();
    assert_eq!(binary.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(read(&folder.file("b.stl", ascii_stl())).unwrap(), binary);
    assert_eq!(read(&folder.file("c.stl", binary_stl(b"solid lie\n", &SQUARE))).unwrap(), binary);
}

/// A GLB or glTF of a square, mirrored by its node and moved by its parent.
fn gltf(mode: u32, indices: &[u16], uri: Option<&str>) -> (String, Vec<u8>) {
    let mut bytes = Vec::new();
    for [x, y] in [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
        [x, y, 0.0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    for [u, v] in [[0.0_f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]] {
        [u, v].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    for k in 0..4_u16 {
        [u16::MAX * (k % 2), 0, 0, u16::MAX].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    for weight in [0.0_f32, 0.25, 0.5, 1.0] {
        bytes.extend(weight.to_le_bytes());
    }
    indices.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    let length = bytes.len();
    let uri = uri.map(|uri| format!("\"uri\":\"{uri}\",")).unwrap_or_default();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"children":[1],"translation":[10,0,0]}},{{"mesh":0,"scale":[-1,1,1]}}],
        "meshes":[{{"primitives":[{{"mode":{mode},"indices":4,
            "attributes":{{"POSITION":0,"TEXCOORD_0":1,"COLOR_0":2,"_IGNITE":3}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
            {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
            {{"bufferView":2,"componentType":5123,"normalized":true,"count":4,"type":"VEC4"}},
            {{"bufferView":3,"componentType":5126,"count":4,"type":"SCALAR"}},
            {{"bufferView":4,"componentType":5123,"count":{},"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},
            {{"buffer":0,"byteOffset":80,"byteLength":32}},{{"buffer":0,"byteOffset":112,"byteLength":16}},
            {{"buffer":0,"byteOffset":128,"byteLength":{}}}],
        "buffers":[{{{uri}"byteLength":{length}}}]}}"#,
        indices.len(),
        length - 128
    );
    (json, bytes)
}

fn glb(mode: u32, indices: &[u16]) -> Vec<u8> {
    let (json, mut binary) = gltf(mode, indices, None);
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    for word in [2, (28 + json.len() + binary.len()) as u32, json.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(&json);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(&binary);
    bytes
}

fn base64(bytes: &[u8]) -> String {
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0_u32, |w, b| (w << 8) | u32::from(*b)) << (8 * (3 - chunk.len()));
        for k in 0..4 {
            let symbol = alphabet[(word >> (18 - 6 * k)) as usize & 63] as char;
            text.push(if k <= chunk.len() { symbol } else { '=' });
        }
    }
    text
}

#[test]
fn gltf_follows_nodes_and_reads_lists_strips_and_fans() {
    let folder = Folder::new("gltf");
    let list = read(&folder.file("a.glb", glb(4, &[0, 1, 2, 0, 2, 3]))).unwrap();
    assert_eq!(list.positions[1], DVec3::new(9.0, 0.0, 0.0));
    // The mirror turns the triangles over, so that the same side stays out.
    assert_eq!(list.triangles, [[0, 2, 1], [0, 3, 2]]);
    assert_eq!(list.corner_uv[0], [Vec2::ZERO, Vec2::ONE, Vec2::X]);
    assert_eq!(list.painted["color.r"], [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(list.painted["ignite"], [0.0, 0.25, 0.5, 1.0]);
    let fan = read(&folder.file("b.glb", glb(6, &[0, 1, 2, 3]))).unwrap();
    assert_eq!(fan.triangles, list.triangles);
    let strip = read(&folder.file("c.glb", glb(5, &[0, 1, 3, 2]))).unwrap();
    assert_eq!(strip.triangles, [[0, 3, 1], [3, 2, 1]]);
    assert!(strip.remarks.is_empty(), "{:?}", strip.remarks);

    let (_, binary) = gltf(4, &[0, 1, 2, 0, 2, 3], None);
    folder.file("the data.bin", &binary);
    let (json, _) = gltf(4, &[0, 1, 2, 0, 2, 3], Some("the%20data.bin"));
    assert_eq!(read(&folder.file("d.gltf", json)).unwrap(), list);
    let inside = format!("data:application/octet-stream;base64,{}", base64(&binary));
    let (json, _) = gltf(4, &[0, 1, 2, 0, 2, 3], Some(&inside));
    assert_eq!(read(&folder.file("e.gltf", json)).unwrap(), list);
}

#[test]
fn units_are_scaled_and_an_unlikely_size_is_remarked_on() {
    let folder = Folder::new("units");
    let path = folder.file("a.stl", binary_stl(b"", &SQUARE.map(|t| t.map(|p| p.map(|x| 210.0 * x)))));
    let mesh = read_mesh(&path, LengthUnit::Mm).unwrap();
    assert!((size(&mesh).x - 0.21).abs() < 1e-12);
    assert!(mesh.remarks.is_empty());
    let huge = read(&path).unwrap();
    assert!(huge.remarks[0].contains("is its unit right?"), "{:?}", huge.remarks);
}

#[test]
fn faces_too_large_for_a_fire_are_remarked_on() {
    let folder = Folder::new("coarse");
    // Two triangles of an A4 sheet's width: no burn level makes that fine enough. Of 30 mm: the third does, to 4 mm.
    let of_width = |width: f32| {
        let path = folder.file("a.stl", binary_stl(b"", &SQUARE.map(|t| t.map(|p| p.map(|x| width * x)))));
        read(&path).unwrap()
    };
    let words = |width, level| coarse(&of_width(width), level).unwrap_or_default();
    assert!(words(0.21, 0).contains("239 mm apart") && words(0.21, 0).ends_with(": subdivide the mesh"));
    assert!(words(0.03, 0).ends_with("sheet.burn_level=3"), "{}", words(0.03, 0));
    assert!(words(0.03, 2).contains("9 mm apart"), "{}", words(0.03, 2));
    assert_eq!(words(0.03, 3), "");
    assert_eq!(words(0.005, 0), "");
    // A run says it too, where there is fire.
    let text = |fire: &str| format!("sheet.mesh = \"a.stl\"\n{fire}");
    let warnings = |fire: &str| {
        of_width(0.03);
        let path = folder.file("scene.toml", text(fire));
        let case = charcloth_io::scene_file::load(&path, &[]).unwrap().cases.remove(0);
        case.read_inputs(&Meshes).unwrap().1.join("; ")
    };
    assert!(warnings("[[ignite]]\ncorner = \"bottom_left\"\n").contains("millimetres wide"));
    assert_eq!(warnings(""), "");
}

/// Reads meshes as the program does.
struct Meshes;

impl charcloth_io::scene_file::Loader for Meshes {
    fn mesh(&self, path: &Path, unit: LengthUnit) -> Result<SurfaceMesh, String> {
        read_mesh(path, unit).map_err(|error| error.to_string())
    }
    fn image(&self, path: &Path) -> Result<charcloth::simulation::GreyImage, String> {
        Err(format!("{} is not to be read here", path.display()))
    }
}

#[test]
fn only_points_that_coincide_are_joined() {
    let square = |z: f32| SQUARE.map(|t| t.map(|[x, y, _]| [x, y, z]));
    let folder = Folder::new("weld");
    // A hundred thousandth of the size apart: two shells.
    let near = [square(0.0), square(2e-5)].concat();
    let mesh = read(&folder.file("near.stl", binary_stl(b"", &near))).unwrap();
    assert_eq!((mesh.shell_count(), mesh.positions.len()), (2, 8));
    // A ten millionth: rounding, one shell, and its copy is a duplicate.
    let same = [square(0.0), square(1e-7)].concat();
    let mesh = read(&folder.file("same.stl", binary_stl(b"", &same))).unwrap();
    assert_eq!((mesh.shell_count(), mesh.positions.len(), mesh.triangles.len()), (1, 4, 2));
    assert!(mesh.remarks[0].starts_with("2 duplicate triangles"), "{:?}", mesh.remarks);
}

#[test]
fn faults_that_can_be_put_right_are_counted() {
    let folder = Folder::new("faults");
    // A face with a corner twice, a flat one, a face turned over, a face twice, and a point nobody uses.
    let text = "v 5 5 5\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 3 0 0\n\
        f 2 3 4\nf 2 3 3\nf 2 3 6\nf 2 5 4\nf 3 6 4\nf 4 2 3\n";
    let mesh = read(&folder.file("a.obj", text)).unwrap();
    assert_eq!(mesh.positions.len(), 5);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 2]]);
    assert_eq!(mesh.source_face, [0, 3, 4]);
    let remarks = mesh.remarks.join("\n");
    for words in ["2 degenerate", "1 duplicate", "1 triangles faced the other way"] {
        assert!(remarks.contains(words), "{remarks}");
    }
}

#[test]
fn a_moebius_strip_is_left_alone() {
    let mut text = String::new();
    let n = 24;
    for k in 0..n {
        let angle = f64::from(k) / f64::from(n) * std::f64::consts::TAU;
        for side in [-0.02, 0.02] {
            let radius = 0.1 + side * (angle / 2.0).cos();
            let (x, y, z) = (radius * angle.cos(), radius * angle.sin(), side * (angle / 2.0).sin());
            text += &format!("v {x} {y} {z}\n");
        }
    }
    for k in 0..n {
        let (a, b) = (2 * k + 1, 2 * k + 2);
        let (c, d) = if k + 1 < n { (a + 2, b + 2) } else { (2, 1) };
        text += &format!("f {a} {b} {d} {c}\n");
    }
    let folder = Folder::new("moebius");
    let mesh = read(&folder.file("a.obj", text)).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.shell_count()), (48, 1));
    assert!(mesh.remarks[0].contains("only one side"), "{:?}", mesh.remarks);
}

#[test]
fn painted_values_of_joined_points_are_averaged() {
    let text = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
        property float r\nproperty float g\nproperty float b\nproperty float ignite\nelement face 2\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 1 1 1 0\n1 0 0 1 1 1 0\n1 1 0 1 1 1 0\n\
        0 0 0 1 1 1 1\n1 1 0 1 1 1 1\n0 1 0 0 0 0 1\n3 0 1 2\n3 3 4 5\n";
    let folder = Folder::new("painted");
    let mesh = read(&folder.file("a.ply", text)).unwrap();
    assert_eq!(mesh.painted["ignite"], [0.5, 0.0, 0.5, 1.0]);
    assert_eq!(mesh.painted["color.b"], [1.0, 1.0, 1.0, 0.0]);
}

#[test]
fn bad_files_are_refused_in_the_right_words() {
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let fan = "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n";
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("empty.obj", b"".to_vec(), &["empty.obj: the file is empty"]),
        ("empty.ply", b"".to_vec(), &["the file is empty"]),
        ("empty.stl", b"".to_vec(), &["the file is empty"]),
        ("empty.glb", b"".to_vec(), &["the file is empty"]),
        ("points.obj", b"v 0 0 0\nv 1 0 0\n".to_vec(), &["no faces"]),
        ("nothing.obj", b"# hello\n".to_vec(), &["no points"]),
        ("none.stl", binary_stl(b"", &[]), &["no faces"]),
        ("word.obj", b"v 0 0 0\nv 1 x 0\n".to_vec(), &["word.obj:2: \"x\" is not a number"]),
        ("short.obj", b"v 0 0\n".to_vec(), &["short.obj:1: a point has 2 coordinates"]),
        ("line.obj", b"v 0 0 0\nv 1 0 0\nf 1 2\n".to_vec(), &["line.obj:3: a face has 2 corners"]),
        (
            "index.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n".to_vec(),
            &["index.obj:4: a face names point 4", "3 so far"],
        ),
        ("zero.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n".to_vec(), &["names point 0"]),
        ("nan.obj", b"v 0 0 0\nv 1 0 0\nv 0 NaN 0\nf 1 2 3\n".to_vec(), &["point 2 is not at a finite place"]),
        ("inf.obj", b"v 0 0 0\nv 1 0 0\nv 0 1e999 0\nf 1 2 3\n".to_vec(), &["not at a finite place"]),
        ("uv.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nf 1/1 2/1 3/1\n".to_vec(), &["face 0", "texture"]),
        ("size.obj", b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n".to_vec(), &["zero size"]),
        ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".to_vec(), &["no face with an area"]),
        ("fan.obj", fan.as_bytes().to_vec(), &["fan.obj: 1 edges are shared by more than two faces", "split it"]),
        ("index.ply", format!("{head}0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n").into_bytes(), &["face 0 names point 7"]),
        ("minus.ply", format!("{head}0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n").into_bytes(), &["face 0 names point -1"]),
        ("word.ply", format!("{head}0 0 0\n1 q 0\n0 1 0\n3 0 1 2\n").into_bytes(), &["word.ply:11:"]),
        ("short.ply", format!("{head}0 0 0\n1 0 0\n").into_bytes(), &["not a sound PLY file"]),
        ("not.ply", b"hello".to_vec(), &["not a sound PLY file"]),
        ("not.glb", b"hello".to_vec(), &["not a sound glTF file"]),
        ("far.gltf", gltf(4, &[0], None).0.replace("\"POSITION\":0", "\"POSITION\":9").into_bytes(), &["accessor 9"]),
        (
            "draco.gltf",
            gltf(4, &[0], None)
                .0
                .replace("\"scene\":0", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]")
                .into_bytes(),
            &["KHR_draco_mesh_compression", "use compression"],
        ),
        ("old.gltf", gltf(4, &[0], None).0.replace("2.0", "1.0").into_bytes(), &["version \"1.0\""]),
        ("kind.glb", glb(9, &[0, 1, 2]), &["unknown kind 9"]),
        ("far.glb", glb(4, &[0, 1, 9]), &["names point 9"]),
        ("mesh.fbx", b"x".to_vec(), &[".fbx cannot be read", ".obj, .ply, .stl, .gltf, .glb"]),
        ("mesh", b"x".to_vec(), &["no ending"]),
    ];
    let folder = Folder::new("bad");
    for (name, bytes, words) in cases {
        let message = read(&folder.file(name, bytes)).expect_err(name).to_string();
        for word in words {
            assert!(message.contains(word), "{name}: {message}");
        }
    }
    let message = read(&folder.0.join("missing.obj")).unwrap_err().to_string();
    assert!(message.starts_with("cannot read") && message.contains("missing.obj"), "{message}");
    let (json, _) = gltf(4, &[0, 1, 2], Some("gone.bin"));
    let message = read(&folder.file("a.gltf", json)).unwrap_err().to_string();
    assert!(message.contains("gone.bin"), "{message}");
    let (json, _) = gltf(4, &[0, 1, 2], Some("data:;base64,AAAA"));
    let message = read(&folder.file("a.gltf", json)).unwrap_err().to_string();
    assert!(message.contains("buffer 0 has 3 bytes"), "{message}");
}

#[test]
fn no_cut_or_changed_file_makes_a_reader_panic() {
    let folder = Folder::new("cut");
    let rows = "0 0 0 0 0 255 0 0 1\n1 0 0 1 0 0 0 0 0\n1 1 0 1 1 0 0 0 0\n0 1 0 0 1 0 0 0 0\n4 0 1 2 3\n";
    let samples: Vec<(&str, Vec<u8>)> = vec![
        ("a.obj", OBJ.into()),
        ("a.ply", ply("ascii", rows.as_bytes())),
        ("b.ply", ply("binary_little_endian", &[1; 170])),
        ("a.stl", binary_stl(b"x", &SQUARE)),
        ("b.stl", ascii_stl().into_bytes()),
        ("a.glb", glb(4, &[0, 1, 2, 0, 2, 3])),
        ("a.gltf", gltf(4, &[0, 1, 2], Some("data:;base64,AAAA")).0.into_bytes()),
    ];
    for (name, bytes) in samples {
        for length in (0..bytes.len()).step_by(2) {
            let _ = read(&folder.file(name, &bytes[..length]));
        }
        for place in (0..bytes.len()).step_by(3) {
            for value in [0, b'9', 0xff] {
                let mut changed = bytes.clone();
                changed[place] = value;
                let _ = read(&folder.file(name, &changed));
            }
        }
    }
    for name in ["lampshade_mm.ply", "book_pages.glb", "letter_crumpled.stl", "letter_painted.ply", "letter_hole.obj"] {
        let bytes = std::fs::read(mesh_file(name)).unwrap();
        for length in (0..bytes.len()).step_by(bytes.len() / 40) {
            let _ = read(&folder.file(name, &bytes[..length]));
        }
    }
}

#[test]
fn meshes_from_a_modelling_program_come_in_as_they_are() {
    // Name, unit, shells, loops of free edges, size in metres, whether it has texture coordinates.
    let cases = [
        ("lampshade_mm.ply", LengthUnit::Mm, 1, 2, None, true),
        ("book_pages.glb", LengthUnit::M, 12, 12, Some([0.286, 0.137, 0.21]), true),
        ("curtain_quads.obj", LengthUnit::M, 1, 1, None, true),
        ("mask_shells.obj", LengthUnit::M, 3, 0, None, true),
        ("letter_crumpled.stl", LengthUnit::M, 1, 1, None, false),
        ("letter_hole.obj", LengthUnit::M, 1, 2, None, true),
        ("letter_painted.ply", LengthUnit::M, 1, 1, None, true),
    ];
    for (name, unit, shells, loops, expected, uv) in cases {
        let mesh = read_mesh(&mesh_file(name), unit).unwrap();
        assert_eq!(mesh.shell_count(), shells, "{name}");
        assert_eq!(!mesh.corner_uv.is_empty(), uv, "{name}");
        assert!(mesh.remarks.is_empty(), "{name}: {:?}", mesh.remarks);
        if loops > 0 {
            assert_eq!(boundary_loops(&mesh), loops, "{name}");
        }
        let extent = size(&mesh);
        assert!((0.03..0.8).contains(&extent.max_element()), "{name}: {extent}");
        if let Some(expected) = expected {
            assert!(extent.abs_diff_eq(DVec3::from_array(expected), 1e-3), "{name}: {extent}");
        }
    }
    let letter = read_mesh(&mesh_file("letter_painted.ply"), LengthUnit::M).unwrap();
    let painted = letter.painted["ignite"].iter().filter(|v| **v > 0.5).count();
    assert!((10..200).contains(&painted), "{painted}");
}

/// The full-size meshes that the small ones were cut from, where a folder of them is named.
#[test]
fn full_size_meshes_come_in_where_there_are_any() {
    let Some(folder) = std::env::var_os("CHARCLOTH_MESHES") else {
        return skipped("CHARCLOTH_MESHES names no folder with them");
    };
    let cases = [
        ("curtain_quads.obj", LengthUnit::M, 1, 24576),
        ("mask_shells.obj", LengthUnit::M, 3, 15744),
        ("book_pages.glb", LengthUnit::M, 12, 13440),
        ("lampshade_mm.ply", LengthUnit::Mm, 1, 4500),
        ("letter_crumpled.stl", LengthUnit::M, 1, 13860),
        ("letter_hole.obj", LengthUnit::M, 1, 19084),
        ("letter_hole_painted.ply", LengthUnit::M, 1, 19084),
    ];
    for (name, unit, shells, triangles) in cases {
        let mesh = read_mesh(&Path::new(&folder).join(name), unit).unwrap();
        println!(
            "{name}: {} points, {} triangles, size {}, loops {}, painted {:?}, {:?}",
            mesh.positions.len(),
            mesh.triangles.len(),
            size(&mesh),
            boundary_loops(&mesh),
            mesh.painted.keys().collect::<Vec<_>>(),
            mesh.remarks
        );
        assert_eq!((mesh.shell_count(), mesh.triangles.len()), (shells, triangles), "{name}");
    }
}

/// A quad and a triangle in centimetres, z-up, moved by two prims, with a texture, a painted attribute and whatever
/// else such files have.
const USDA: &str = r#"#usda 1.0
(
    "a comment" doc = """of
    two lines"""
    customLayerData = { string made = "by hand"; dictionary more = { int n = 3 } }
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "world" (
    kind = "component"
    variants = { string look = "plain" }
)
{
    double3 xformOp:translate = (10, 0, 0) # moved
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Mesh "sheet" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        uniform bool doubleSided = 1
        int[] faceVertexCounts = [4, 3]
        int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 2]
        point3f[] points.timeSamples = {
            2: [(9, 9, 9)],
            1: [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0.5)],
        }
        float[] primvars:pin = [0, 1, 0, 0, 0.25] (interpolation = "vertex")
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1)] ( interpolation = "faceVarying" )
        int[] primvars:st:indices = [0, 1, 2, 2, 1, 0, 2]
        rel material:binding = </world/paper>
        quatf xformOp:orient = (0.7071067811865476, 0, 0, 0.7071067811865476)
        float3 xformOp:scale = (2, 1, 1)
        uniform token[] xformOpOrder = ["xformOp:orient", "xformOp:scale"]
        def GeomSubset "left" { int[] indices = [0] }
    }
    def Material "paper" { token outputs:surface.connect = </world/paper/s.outputs:surface> }
    variantSet "look" = { "plain" { def Sphere "ball" { double radius = 3 } } }
}
"#;

#[test]
fn usda_is_read_where_its_prims_put_it() {
    let folder = Folder::new("usda");
    let mesh = read(&folder.file("a.usda", USDA)).unwrap();
    // Twice as wide, turned by a right angle about z, moved along x; then y is up, and centimetres are metres.
    let expected = [(10.0, 0.0, 0.0), (10.0, 2.0, 0.0), (9.0, 2.0, 0.0), (9.0, 0.0, 0.0), (10.0, 4.0, 0.5)];
    for (place, (x, y, z)) in mesh.positions.iter().zip(expected) {
        assert!(place.distance(0.01 * DVec3::new(x, z, -y)) < 1e-12, "{place}");
    }
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 2]]);
    assert_eq!(mesh.source_face, [0, 0, 1]);
    assert_eq!(mesh.corner_uv[2], [Vec2::new(1.0, 0.0), Vec2::ZERO, Vec2::ONE]);
    assert_eq!(mesh.painted["pin"], [0.0, 1.0, 0.0, 0.0, 0.25]);
    let remarks = mesh.remarks.join("; ");
    assert!(remarks.contains("z-up") && remarks.contains("first time sample"), "{remarks}");

    let other = USDA.replace("def Sphere", "def Mesh").replace("GeomSubset", "Mesh");
    for (text, words) in [
        (other, &["2 meshes", "/world/sheet, /world/sheet/left", "join"][..]),
        (USDA.replace("def Mesh", "over Mesh"), &["no mesh that is shown"]),
        (USDA.replace("def Mesh", "def \"x\" (references = @b.usd@</a>) {} over Mesh"), &["references", "flatten"]),
        (USDA.replace("4, 3]", "4, 4]"), &["/world/sheet", "count 8 corners, but there are 7"]),
        (USDA.replace("1, 4, 2]", "1, 9, 2]"), &["names point 9"]),
        (USDA.replace("xformOp:scale", "xformOp:shear"), &["xformOp:shear at /world/sheet is not understood"]),
        (USDA.replace("[4, 3]", "[4, x]"), &["a.usda:19:", "\"x\" is not a value"]),
        ("hello".to_string(), &["not a USD file"]),
    ] {
        let message = read(&folder.file("a.usda", text)).unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    }
}

#[test]
fn usd_and_alembic_that_were_exported_come_back_and_damage_never_panics() {
    let folder = Folder::new("usd-back");
    let state = sheet(9);
    let info = RunInfo { fps: 24.0, ..RunInfo::default() };
    let mut writer = CacheWriter::create(&folder.0, &info).unwrap();
    let frame = Frame::of(&state, 0, 0.0);
    writer.write(&frame, &[], &state).unwrap();
    let cache = CacheReader::open(&folder.0).unwrap();
    let mut files = vec![folder.file("a.usda", USDA)];
    for format in ["usd", "usdz", "abc"] {
        let options = ExportOptions::default();
        let written = export(&cache, format, &options, &folder.0, &mut |_| ControlFlow::Continue(())).unwrap();
        let mesh = read(&written.files[0]).unwrap();
        assert_eq!(mesh.triangles, frame.triangles.corners[..127], "{format}");
        assert_eq!(mesh.corner_uv, frame.triangles.uv[..127], "{format}");
        for (place, of_frame) in mesh.positions.iter().zip(&frame.motion.position) {
            assert!(place.distance(*of_frame) < 1e-7, "{format}");
        }
        assert!((mesh.painted["temperature"][5] - state.burn.temperature[5] as f32).abs() < 1e-3, "{format}");
        assert!(mesh.remarks.is_empty(), "{:?}", mesh.remarks);
        files.extend(written.files);
    }
    // Cut short at every length and with single bits turned over: an error or a mesh, and no panic.
    for file in files {
        let bytes = std::fs::read(&file).unwrap();
        let name = format!("bad.{}", file.extension().unwrap().to_string_lossy());
        let mut refused = 0;
        let step = (bytes.len() / 200).max(1);
        for length in (0..bytes.len()).step_by(step) {
            refused += usize::from(read(&folder.file(&name, &bytes[..length])).is_err());
        }
        assert!(refused > 190, "{name}: {refused}");
        // The head and the tables at the end, where what is wrong leads furthest, and some in between.
        let tail = bytes.len().saturating_sub(2500)..bytes.len();
        for at in (0..bytes.len().min(100)).chain(tail).chain((0..bytes.len()).step_by(step)) {
            let mut bad = bytes.clone();
            bad[at] ^= 1 << (at % 8);
            let _ = read(&folder.file(&name, &bad));
        }
    }
}

#[test]
fn alembic_that_is_not_read_says_why() {
    let folder = Folder::new("abc-bad");
    let state = sheet(4);
    let mut writer = CacheWriter::create(&folder.0, &RunInfo { fps: 24.0, ..RunInfo::default() }).unwrap();
    for number in 0..2 {
        let mut frame = Frame::of(&state, number, f64::from(number) / 24.0);
        frame.motion.position[0].x -= 0.1 * f64::from(number);
        writer.write(&frame, &[], &state).unwrap();
    }
    let cache = CacheReader::open(&folder.0).unwrap();
    let options = ExportOptions::default();
    let written = export(&cache, "abc", &options, &folder.0, &mut |_| ControlFlow::Continue(())).unwrap();
    let bytes = std::fs::read(&written.files[0]).unwrap();
    let mesh = read(&written.files[0]).unwrap();
    assert_eq!(mesh.positions[0].x as f32, state.motion.position[0].x as f32);
    assert_eq!(mesh.remarks, ["the mesh is animated: its first sample was taken"]);
    let report = inspect(&written.files[0], None).unwrap();
    assert_eq!((report.format, report.file_points, report.file_faces), ("alembic", 16, 17));

    let replaced = |from: &[u8], to: &[u8]| {
        let mut bytes = bytes.clone();
        let places: Vec<usize> = (0..bytes.len() - from.len()).filter(|k| bytes[*k..].starts_with(from)).collect();
        assert!(!places.is_empty());
        places.iter().for_each(|k| bytes[*k..*k + to.len()].copy_from_slice(to));
        bytes
    };
    for (bytes, words) in [
        (b"\x89HDF\r\n\x1a\n and more".to_vec(), &["HDF5", "Ogawa"][..]),
        (b"hello".to_vec(), &["not an Alembic file"]),
        (replaced(b"Ogawa\xff", b"Ogawa\0"), &["not a sound .abc file", "did not come to the end"]),
        (bytes[..bytes.len() / 2].to_vec(), &["not a sound .abc file", "cut short"]),
        (replaced(b"PolyMesh_v1", b"Cameras__v1"), &["no mesh that is shown"]),
        (replaced(b".faceCounts", b".faceCount_"), &["/sheet: its faces count 0 corners, but there are 51"]),
        (replaced(b".geom", b".gone"), &["/sheet: it has no geometry"]),
    ] {
        let message = read(&folder.file("bad.abc", bytes)).unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    }
}

#[test]
fn every_importer_has_a_file_and_every_file_an_importer() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/importers");
    for row in IMPORTERS {
        assert!(folder.join(format!("{}.rs", row.name)).is_file(), "{}", row.name);
        assert!(!row.about.is_empty() && !row.item.extensions.is_empty(), "{}", row.name);
    }
    let shared = [
        "mod",
        "clean",
        "gltf_document",
        "ogawa",
        "orientation",
        "polygons",
        "raw",
        "report",
        "usd_crate",
        "usd_layer",
        "usd_text",
    ];
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().to_string();
        assert!(shared.contains(&name.as_str()) || IMPORTERS.iter().any(|row| row.name == name), "{name}");
    }
}

#[test]
fn a_report_says_what_a_file_holds() {
    let lampshade = inspect(&mesh_file("lampshade_mm.ply"), None).unwrap();
    assert_eq!((lampshade.unit, lampshade.file_faces), (LengthUnit::Mm, 4500));
    assert_eq!(lampshade.mesh, read_mesh(&mesh_file("lampshade_mm.ply"), LengthUnit::Mm).unwrap());
    // Open above and below.
    assert_eq!(lampshade.shells.iter().map(|shell| shell.borders).collect::<Vec<_>>(), [2]);
    let [shortest, median, longest] = lampshade.edges;
    assert!(0.004 < shortest && shortest < median && median < longest && longest < 0.02);

    let book = inspect(&mesh_file("book_pages.glb"), None).unwrap();
    assert!(book.unit == LengthUnit::M && book.shells.len() == 12 && book.shells.iter().all(|page| page.holes() == 0));
    assert_eq!(book.uv, Some([Vec2::ZERO, Vec2::ONE]));
    assert_eq!(inspect(&mesh_file("letter_hole.obj"), None).unwrap().shells[0].holes(), 1);
    let letter = inspect(&mesh_file("letter_crumpled.stl"), Some(LengthUnit::Ft)).unwrap();
    assert!(letter.unit == LengthUnit::Ft && letter.uv.is_none());

    // A sheet of A4 by what a file in each unit says of its length.
    for (size, unit) in [(0.297, "m"), (29.7, "cm"), (297.0, "mm"), (11.7, "in")] {
        assert_eq!(likely_unit(size).0, unit, "{size}");
    }
    // Blender's plane.
    assert_eq!(likely_unit(2.0).0, "m");
}

#[test]
fn a_closed_shell_has_no_border() {
    let folder = Folder::new("tetrahedron");
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    let report = inspect(&folder.file("a.obj", text), None).unwrap();
    assert_eq!(report.shells.len(), 1);
    assert_eq!((report.shells[0].borders, report.shells[0].holes(), report.shells[0].triangles), (0, 0, 4));
}
