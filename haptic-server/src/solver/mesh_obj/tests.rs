//! Tests of the OBJ reader: every form of a face, every refusal with its place, no panic on any text.

use super::*;
use proptest::prelude::*;

const TETRAHEDRON: &str = "# unit: cm\nmtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0 0.5 0.5 0.5\nv 0 0 1\nvn 0 0 1\n\
                           f 1 3 2\nf 1/1 2/2 4/3\nf 2//1 3//1 -1//1\nf -4/1/1 -1/1/1 -2/1/1\n";

fn read(text: &str) -> Result<TriangleMesh, ObjError> {
    read_obj(text.as_bytes(), "m.obj", 0.01, ObjLimits::default())
}

fn place(text: &str) -> (usize, usize) {
    let error = read(text).expect_err(text);
    (error.line, error.column)
}

#[test]
fn all_corner_forms_give_the_same_indices() {
    let mesh = read(TETRAHEDRON).expect("sound");
    assert_eq!(mesh.faces, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
    assert_eq!(mesh.vertices_m[1], Vec3::new(0.01, 0.0, 0.0));
    assert_eq!(mesh.vertices_m.len(), 4);
}

#[test]
fn a_polygon_is_fanned() {
    let mesh = read("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0.5 2 0\nv 0 1 0\nf 1 2 3 4 5\n").expect("sound");
    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
}

#[test]
fn refusals_name_line_and_column() {
    assert_eq!(place("v 0 0\n"), (1, 1));
    assert_eq!(place("v 0 0 zero\n"), (1, 7));
    assert_eq!(place("v 0 0 nan\n"), (1, 7));
    assert_eq!(place("v 0 0 1e9\n"), (1, 7));
    assert_eq!(place("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), (4, 7));
    assert_eq!(place("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 0 2\n"), (4, 5));
    assert_eq!(place("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 2 3\n"), (4, 3));
    assert_eq!(place("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2\n"), (4, 7));
    assert_eq!(place("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2\n"), (4, 5));
    assert_eq!(place("v 0 0 0\nv 1 0 0\nf 1 2\n"), (3, 1));
    assert_eq!(place("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/x 2 3\n"), (4, 3));
    assert_eq!(place("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1/1 2 3\n"), (4, 3));
    assert_eq!(place("curv 0 1\n"), (1, 1));
    assert_eq!(place("v 0 0 0\nv 5 5 5\nv 1 0 0\nv 0 1 0\nf 1 3 4\n"), (2, 1));
    assert_eq!(place("v 0 0 0\n\n"), (2, 1));
}

#[test]
fn text_that_is_not_utf8_is_placed() {
    let error = read_obj(b"v 0 0 0\nv \xff", "m.obj", 1.0, ObjLimits::default()).expect_err("not UTF-8");
    assert_eq!((error.line, error.column), (2, 3));
    assert!(error.to_string().starts_with("m.obj:2:3: "));
}

#[test]
fn limits_hold() {
    let limits = ObjLimits { bytes: 1000, vertices: 4, triangles: 1 };
    let quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    assert!(read_obj(format!("{quad}f 1 2 3 4\n").as_bytes(), "m", 1.0, limits).is_err());
    assert!(read_obj(format!("{quad}v 0 0 1\n").as_bytes(), "m", 1.0, limits).is_err());
    assert!(read_obj(&[b'\n'; 1001], "m", 1.0, limits).is_err());
}

#[test]
fn cut_at_every_byte_never_panics() {
    for end in 0..=TETRAHEDRON.len() {
        match read_obj(&TETRAHEDRON.as_bytes()[..end], "m.obj", 0.01, ObjLimits::default()) {
            Ok(mesh) => assert!(mesh.faces.iter().flatten().all(|&i| (i as usize) < mesh.vertices_m.len())),
            Err(error) => assert!(error.line >= 1 && error.column >= 1),
        }
    }
}

#[test]
fn the_real_liver_is_read() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/meshes/liver-smooth.obj");
    let Ok(bytes) = std::fs::read(path) else {
        println!("skipped: {path} is not there");
        return;
    };
    let mesh = read_obj(&bytes, "liver-smooth.obj", 0.01, ObjLimits::default()).expect("sound");
    assert_eq!((mesh.vertices_m.len(), mesh.faces.len()), (2194, 4384));
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_obj(&bytes, "m.obj", 0.01, ObjLimits::default());
    }

    #[test]
    fn no_statements_make_it_panic(
        lines in prop::collection::vec("(v|f|vn|g) [-0-9./ einfa]{0,16}", 0..30)
    ) {
        if let Ok(mesh) = read(&lines.join("\n")) {
            prop_assert!(mesh.faces.iter().flatten().all(|&i| (i as usize) < mesh.vertices_m.len()));
        }
    }
}
