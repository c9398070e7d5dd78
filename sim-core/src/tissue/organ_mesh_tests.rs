//! A volumetric organ from a real liver's surface: a mesh as imported, with slivers and folds.

use super::test_support::{encloses, liver};
use super::triangle_mesh::TriangleMesh;
use super::vosm::{OrganSurface, VosmParams, WoundSite};
use crate::vector::Vec3;

/// Metres per unit of the liver mesh: at its nominal centimetre it is the size of a child's fist
/// (39 ml); so it has the 1.4 l of a grown man's.
const METRES_PER_UNIT: f64 = 0.033;

/// Vertices and faces of an OBJ text; corners may carry `/texture/normal`.
fn read_obj(text: &str) -> TriangleMesh {
    let mut mesh = TriangleMesh { vertices_m: Vec::new(), faces: Vec::new() };
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |i: usize| words[i].parse::<f64>().unwrap() * METRES_PER_UNIT;
        let corner = |i: usize| words[i].split('/').next().unwrap().parse::<u32>().unwrap() - 1;
        match words.first() {
            Some(&"v") => mesh.vertices_m.push(Vec3::new(number(1), number(2), number(3))),
            Some(&"f") => {
                mesh.faces.extend((2..words.len() - 1).map(|i| [corner(1), corner(i), corner(i + 1)]));
            }
            _ => {}
        }
    }
    mesh
}

#[test]
fn a_real_liver_can_be_cut_and_sutured() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/meshes/liver-smooth.obj");
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("skipped: {path} is not there");
        return;
    };
    let mesh = read_obj(&text);
    // A flat place on the front; the vertex farthest out in z lies on a lip.
    let site = WoundSite { near_m: Vec3::new(-2.49, 3.52, 2.25) * METRES_PER_UNIT, along: Vec3::x() };
    let params = VosmParams { surface: OrganSurface::Mesh(mesh.clone()), site, ..liver() };
    let tissue = super::vosm::build(&params).unwrap();
    println!("{:?}, spacing {}, length {}", tissue.shell, tissue.spacing_m, tissue.wound_length_m);
    assert_eq!(tissue.pairs.len(), 4);
    let inner: Vec<Vec3> = tissue.network.rest_m[tissue.network.node_count() / 2..].to_vec();
    // The outer shell as built, closed over the wound by its left edge.
    let count = mesh.vertices_m.len();
    let shell = TriangleMesh { vertices_m: tissue.network.rest_m[..count].to_vec(), faces: mesh.faces };
    let outside = inner.iter().filter(|x| x.x.abs() > 0.003 && !encloses(&shell, **x)).count();
    assert_eq!(outside, 0);
}
