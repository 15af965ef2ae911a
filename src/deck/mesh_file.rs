//! Triangle meshes beside the deck, and `[mesh.NAME]`: their triangles in the text.
//!
//! [`super::import`] writes the triangles of a file that a surface names at the end of the text, so
//! that all later steps have one whole text: the numbers of vertices and triangles, coordinates and
//! numbers of corners, as bytes in Base64.

use super::diagnostic::{Diagnostic, Severity, Spanned};
use super::files::{Unreadable, fingerprint};
use super::reader::{Context, Item, Table};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::collections::HashMap;
use std::io::Cursor;
use std::sync::Arc;
use tobj::LoadError;

/// Triangles of a mesh, at most.
const MOST_TRIANGLES: usize = 1_000_000;

/// The largest coordinate in a file, of either sign.
const LARGEST: f64 = 1e100;

/// Bytes of a binary STL file before its triangles, and of each triangle.
const STL_HEAD: usize = 84;
const STL_TRIANGLE: usize = 50;

/// `[mesh.NAME]`
#[derive(Clone, Debug)]
pub struct MeshTable {
    /// The name of the file
    pub(crate) name: Spanned<String>,
    /// Its triangles
    data: Arc<str>,
}

/// Triangles with shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Coordinates of the vertices
    pub(crate) vertices: Vec<[f64; 3]>,
    /// Numbers of the corners of each triangle
    pub corners: Vec<[u32; 3]>,
}

/// Triangles that are being read.
#[derive(Default)]
struct Builder {
    triangles: Triangles,
    /// The number of each vertex by the bits of its coordinates
    known: HashMap<[u64; 3], u32>,
}

/// Keys of `[mesh.NAME]`.
pub(super) const KEYS: [&str; 1] = ["data"];

pub(super) fn read_mesh<'a>(context: &'a Context, name: Spanned<String>, item: &'a Item<'a>) -> Option<MeshTable> {
    if item.get_ref().as_table().is_none() {
        let help = "a mesh of triangles is the `file` of a [[surface]] of kind = \"mesh\"; for elements use `elements` of [[beam]]";
        context
            .report(Diagnostic::error("`mesh` contains the triangles of files: [mesh.NAME]", item.span()).help(help));
        return None;
    }
    let table = Table::new(context, item, format!("[mesh.{}]", name.value), &KEYS)?;
    let data = table.required_text("data")?;
    Some(MeshTable { name, data: data.value.into() })
}

impl MeshTable {
    /// A short text that differs for other triangles.
    pub fn fingerprint(&self) -> String {
        fingerprint(self.data.as_bytes())
    }

    /// The triangles; `None` if the data are not those of a mesh.
    pub fn triangles(&self) -> Option<Triangles> {
        let bytes = STANDARD.decode(self.data.as_bytes()).ok()?;
        let (counts, rest) = bytes.split_at_checked(8)?;
        let count = |k: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| counts[4 * k + byte])) as usize;
        let (places, numbers) = rest.split_at_checked(24 * count(0))?;
        if numbers.len() != 12 * count(1) {
            return None;
        }
        let number = |bytes: &[u8]| bytes.try_into().map_or(f64::NAN, f64::from_le_bytes);
        let corner = |bytes: &[u8]| bytes.try_into().map_or(u32::MAX, u32::from_le_bytes);
        let vertex = |bytes: &[u8]| [0, 8, 16].map(|at| number(&bytes[at..at + 8]));
        let triangle = |bytes: &[u8]| [0, 4, 8].map(|at| corner(&bytes[at..at + 4]));
        Some(Triangles {
            vertices: places.chunks_exact(24).map(vertex).collect(),
            corners: numbers.chunks_exact(12).map(triangle).collect(),
        })
    }
}

impl Triangles {
    /// The triangles of a file: STL (binary or text) or OBJ, by the end of its name.
    pub(super) fn read(name: &str, content: &[u8]) -> Result<Self, Unreadable> {
        let wrong = |message: String| Unreadable { message, severity: Severity::Error };
        let extension = name.rsplit_once('.').map_or(String::new(), |(_, end)| end.to_ascii_lowercase());
        let found = match extension.as_str() {
            "stl" => Self::of_stl(content),
            "obj" => Self::of_obj(content),
            _ => Err("a mesh is read from a file whose name ends in .stl or .obj".into()),
        };
        let found = found.map_err(wrong)?;
        if found.corners.is_empty() {
            return Err(wrong("the file contains no triangles".into()));
        }
        if found.corners.len() > MOST_TRIANGLES {
            let message = format!("more triangles than the limit of {MOST_TRIANGLES}");
            return Err(Unreadable { message, severity: Severity::Limit });
        }
        Ok(found)
    }

    /// The text that [`MeshTable::triangles`] reads.
    pub(super) fn encoded(&self) -> String {
        let counts = [self.vertices.len(), self.corners.len()].map(|count| (count as u32).to_le_bytes());
        let mut bytes = counts.concat();
        self.vertices.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        self.corners.iter().flatten().for_each(|corner| bytes.extend(corner.to_le_bytes()));
        STANDARD.encode(bytes)
    }

    fn of_stl(content: &[u8]) -> Result<Self, String> {
        let whole = whole_stl(content)?;
        let mut reader = Cursor::new(whole);
        let triangles = stl_io::create_stl_reader(&mut reader).map_err(|error| error.to_string())?;
        let mut out = Builder::default();
        for (k, triangle) in triangles.enumerate().take(MOST_TRIANGLES + 1) {
            let of_triangle = |message: String| format!("triangle {}: {message}", k + 1);
            let triangle = triangle.map_err(|error| of_triangle(error.to_string()))?;
            let places = triangle.vertices.map(|vertex| [0, 1, 2].map(|axis| f64::from(vertex[axis])));
            out.push(places).map_err(of_triangle)?;
        }
        Ok(out.triangles)
    }

    fn of_obj(content: &[u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(content).map_err(|error| format!("not a text: {error}"))?;
        let shapes = shapes_of_obj(text)?;
        let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
        let no_materials = |_: &std::path::Path| Err(LoadError::GenericFailure);
        let read = tobj::load_obj_buf(&mut shapes.as_bytes(), &options, no_materials);
        let (models, _) = read.map_err(|error| error.to_string())?;
        let mut out = Builder::default();
        for mesh in models.iter().map(|model| &model.mesh) {
            for corners in mesh.indices.chunks_exact(3) {
                let place = |corner: u32| [0, 1, 2].map(|axis| mesh.positions[3 * corner as usize + axis]);
                let number = out.triangles.corners.len() + 1;
                let places = [corners[0], corners[1], corners[2]].map(place);
                out.push(places).map_err(|message| format!("triangle {number}: {message}"))?;
            }
        }
        Ok(out.triangles)
    }
}

impl Builder {
    /// Adds a triangle; corners at the same place are one vertex.
    fn push(&mut self, places: [[f64; 3]; 3]) -> Result<(), String> {
        let mut corners = [0; 3];
        for (corner, place) in corners.iter_mut().zip(places) {
            if let Some(x) = place.into_iter().find(|x| x.is_nan() || x.abs() > LARGEST) {
                return Err(format!("a corner has the coordinate {x:?}"));
            }
            // Zero has one sign.
            let place = place.map(|x| x + 0.0);
            let new = self.triangles.vertices.len() as u32;
            *corner = *self.known.entry(place.map(f64::to_bits)).or_insert(new);
            if *corner == new {
                self.triangles.vertices.push(place);
            }
        }
        self.triangles.corners.push(corners);
        Ok(())
    }
}

/// An STL file as its reader wants it: it takes a file for text if that begins with `solid` and a
/// blank, and knows only small letters.
fn whole_stl(content: &[u8]) -> Result<Vec<u8>, String> {
    let count = content.get(80..STL_HEAD).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes);
    let binary_length = count.map(|count| STL_HEAD + STL_TRIANGLE * count as usize);
    if binary_length == Some(content.len()) {
        let mut whole = content.to_vec();
        whole[..80].fill(b' ');
        return Ok(whole);
    }
    let start = content.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(content.len());
    let text = &content[start..];
    if text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        return all_solids(&String::from_utf8_lossy(text).to_ascii_lowercase());
    }
    match (count, binary_length) {
        (Some(count), Some(length)) => Err(format!(
            "neither a text that begins with `solid`, nor a binary STL file: with {count} triangles it would have \
             {length} bytes, it has {}",
            content.len()
        )),
        _ => Err(format!("an STL file has {STL_HEAD} bytes or more, this one has {}", content.len())),
    }
}

/// The facets of all solids of a text as one solid: the reader ends with the first.
fn all_solids(text: &str) -> Result<Vec<u8>, String> {
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty());
    if !lines().next_back().is_some_and(|line| line.starts_with("endsolid")) {
        return Err("the file ends before `endsolid`".into());
    }
    let facets = lines().filter(|line| !line.starts_with("solid") && !line.starts_with("endsolid"));
    let facets: String = facets.flat_map(|line| [line, "\n"]).collect();
    Ok(format!("solid mesh\n{facets}endsolid mesh\n").into_bytes())
}

/// The lines with vertices and faces, the corners of which are reduced to their vertices: nothing else of an OBJ file
/// belongs to the shape. A line that ends with `\` goes on in the next one.
fn shapes_of_obj(text: &str) -> Result<String, String> {
    let mut shapes = String::new();
    let mut vertices = 0;
    let mut lines = text.lines().zip(1..);
    while let Some((line, number)) = lines.next() {
        let mut whole = line.to_string();
        let is_shape = matches!(line.split_whitespace().next(), Some("v" | "f"));
        while is_shape && whole.ends_with('\\') {
            whole.pop();
            whole.push(' ');
            whole.push_str(lines.next().map_or("", |(line, _)| line));
        }
        let wrong = |message: String| format!("line {number}: {message}");
        let mut words = whole.split_whitespace();
        let (kind, parts) = match words.next() {
            Some("v") => ("v", words.take(3).map(coordinate).collect::<Result<Vec<_>, _>>()),
            Some("f") => ("f", words.map(|corner| vertex_of(corner, vertices)).collect()),
            Some(_) | None => continue,
        };
        let parts = parts.map_err(wrong)?;
        if parts.len() < 3 {
            return Err(wrong("a vertex has three coordinates, and a face three corners or more".into()));
        }
        vertices += i64::from(kind == "v");
        shapes += &format!("{kind} {}\n", parts.join(" "));
    }
    Ok(shapes)
}

/// A coordinate of a vertex.
fn coordinate(word: &str) -> Result<&str, String> {
    word.parse::<f64>().map(|_| word).map_err(|_| format!("`{word}` is not a number"))
}

/// The vertex of a corner of a face: `5`, `5/2`, `5//3` or, counted back, `-1`, of those so far.
fn vertex_of(corner: &str, vertices: i64) -> Result<&str, String> {
    let word = corner.split('/').next().unwrap_or_default();
    let number = word.parse::<i64>().map_err(|_| format!("`{corner}` is not a corner of a face"))?;
    if number == 0 || number < -vertices {
        return Err(format!("there is no vertex {number}"));
    }
    Ok(word)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "# a comment of C:\\\no part\nv 0 \\\n0 0\nv 1 0 0 1.0\nv 0 1 \\\r\n 0\nv 0 0 1\nvn 0 0 1\nusemtl red\n\
                               f 1//1 3//1 2//1\nf -4 -3 -1\nf 2/7 3/7 4\nf 3 1 4\n";

    fn triangle(corners: [[f32; 3]; 3]) -> Vec<u8> {
        let numbers = [[0.0; 3]].iter().chain(&corners).flatten().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        [numbers, vec![0, 0]].concat()
    }

    /// The binary STL file of triangles.
    fn binary(head: &[u8], triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = head.to_vec();
        bytes.resize(80, b' ');
        bytes.extend((triangles.len() as u32).to_le_bytes());
        triangles.iter().for_each(|corners| bytes.extend(triangle(*corners)));
        bytes
    }

    fn solids() -> [[[f32; 3]; 3]; 4] {
        let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -0.0, 1.0]];
        [[o, y, x], [o, x, z], [x, y, z], [y, o, z]]
    }

    fn text_stl() -> String {
        let vertex = |[x, y, z]: [f32; 3]| format!("vertex {x} {y} {z}\n");
        let facet = |corners: [[f32; 3]; 3]| {
            format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", corners.map(vertex).concat())
        };
        format!("solid\n{}endsolid\n", solids().map(facet).concat())
    }

    #[test]
    fn all_kinds_of_files_give_the_same_triangles() {
        let obj = Triangles::read("a.obj", TETRAHEDRON.as_bytes()).unwrap();
        assert_eq!((obj.vertices.len(), obj.corners.len()), (4, 4));
        for content in [binary(b"solid of another program", &solids()), binary(b"", &solids())] {
            let stl = Triangles::read("A.STL", &content).unwrap();
            assert_eq!((&stl.vertices[..1], &stl.corners[..1]), (&[[0.0; 3]][..], &[[0, 1, 2]][..]));
            assert_eq!((stl.vertices.len(), stl.corners.len()), (4, 4));
            let text = Triangles::read("a.stl", text_stl().as_bytes()).unwrap();
            assert_eq!(stl, text);
            assert_eq!(stl, Triangles::read("a.stl", text_stl().to_uppercase().as_bytes()).unwrap());
        }
        // A file of two solids.
        let text = text_stl();
        let (first, second) = text.split_at(text.match_indices("endfacet\n").nth(1).unwrap().0 + 9);
        let two = format!("{first}endsolid a\n\nsolid b\n{second}");
        assert_eq!(Triangles::read("a.stl", two.as_bytes()).unwrap().corners.len(), 4);
        let places = |triangles: &Triangles| -> Vec<[[f64; 3]; 3]> {
            triangles.corners.iter().map(|corners| corners.map(|k| triangles.vertices[k as usize])).collect()
        };
        assert_eq!(places(&obj), places(&Triangles::read("a.stl", text_stl().as_bytes()).unwrap()));
    }

    #[test]
    fn triangles_stand_in_the_text() {
        let read = Triangles::read("a.obj", TETRAHEDRON.as_bytes()).unwrap();
        let name = Spanned { value: "a.obj".into(), span: 0..0 };
        let table = MeshTable { name, data: read.encoded().into() };
        let back = table.triangles().unwrap();
        assert_eq!((&back.vertices, &back.corners), (&read.vertices, &read.corners));
        for data in ["", "AAAA", "no base 64", &read.encoded()[4..], &table.data[..40]] {
            assert!(MeshTable { data: data.into(), ..table.clone() }.triangles().is_none(), "{data}");
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        let mut nan = solids();
        nan[2][1][0] = f32::NAN;
        let long = [binary(b"", &solids()), vec![0]].concat();
        for (name, content, told) in [
            ("a.ply", b"ply".to_vec(), "ends in .stl or .obj"),
            ("a.stl", b"".to_vec(), "84 bytes or more"),
            ("a.stl", binary(b"", &[]), "no triangles"),
            ("a.stl", binary(b"", &nan), "triangle 3: a corner has the coordinate NaN"),
            ("a.stl", binary(b"", &solids())[..200].to_vec(), "with 4 triangles it would have 284 bytes, it has 200"),
            ("a.stl", long, "it has 285"),
            ("a.stl", text_stl().replacen("vertex 1 0 0", "vertex 1 o 0", 1).into_bytes(), "triangle 1: "),
            ("a.stl", text_stl().as_bytes()[..200].to_vec(), "ends before `endsolid`"),
            ("a.stl", text_stl().replacen("endloop", "", 1).into_bytes(), "triangle 1: "),
            ("a.obj", TETRAHEDRON.replace("f 3 1 4", "f 3 1 9").into_bytes(), "ace"),
            ("a.obj", TETRAHEDRON.replace("v 0 0 1\n", "v 0 0 1e200\n").into_bytes(), "coordinate 1e200"),
            ("a.obj", TETRAHEDRON.replace("v 0 0 1\n", "v 0 0 nan\n").into_bytes(), "coordinate NaN"),
            ("a.obj", TETRAHEDRON.replace("v 0 0 1\n", "v 0 0\n").into_bytes(), ""),
            ("a.obj", vec![0xff, 0xfe], "not a text"),
            ("a.obj", b"v 0 0 0\n".to_vec(), "no triangles"),
        ] {
            let error = Triangles::read(name, &content).unwrap_err();
            assert!(error.message.contains(told), "{name}: {}", error.message);
        }
    }
}
