//! Triangle meshes as surfaces.

use crate::deck::{Deck, Diagnostic, MeshTable, Spanned};
use beamsim_core::kernel::contact::{MeshError, TriangleMesh};
use beamsim_core::tensor::{Mat3, Vec3};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Triangles of the meshes that are kept, at most; of a larger mesh the last one is kept.
const MOST_KEPT: usize = 500_000;

/// The mesh of a file whose origin is at `at`; `axes` are the unit vectors of the file's coordinates,
/// with its scale.
pub fn mesh(deck: &Deck, file: &Spanned<String>, at: Vec3, axes: Mat3) -> Result<Arc<TriangleMesh>, Diagnostic> {
    let name = &file.value;
    let Some(table) = deck.meshes.iter().find(|mesh| mesh.name.value == *name) else {
        let message = format!("the mesh `{name}` was not read: `file` is a path relative to a deck that is a file");
        return Err(Diagnostic::error(message, file.span.clone()));
    };
    match kept(table, at, axes) {
        None => {
            Err(Diagnostic::error(format!("[mesh.\"{name}\"] does not contain triangles"), table.name.span.clone()))
        }
        Some(found) => found.map_err(|error| refuse(file, error)),
    }
}

/// A mesh that bounds a body, or the reason why it does not; `None` without triangles.
type Built = Option<Result<Arc<TriangleMesh>, MeshError>>;

/// A mesh: those that were asked for last are kept, so that the points of a sweep share them.
fn kept(table: &MeshTable, at: Vec3, axes: Mat3) -> Built {
    static KEPT: Mutex<VecDeque<(String, Built)>> = Mutex::new(VecDeque::new());
    // Numbers in it are written with all their digits.
    let key = format!("{} {at:?} {axes:?}", table.fingerprint());
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, known)) = kept.iter().find(|(known, _)| *known == key) {
        return known.clone();
    }
    let place = |vertex: &[f64; 3]| at + axes * Vec3(*vertex);
    let built = table.triangles().map(|triangles| {
        TriangleMesh::new(triangles.vertices.iter().map(place).collect(), &triangles.corners).map(Arc::new)
    });
    kept.push_back((key, built.clone()));
    let faces = |built: &Built| built.iter().flatten().map(|mesh| mesh.face_count()).sum::<usize>();
    let mut all: usize = kept.iter().map(|(_, built)| faces(built)).sum();
    while all > MOST_KEPT && kept.len() > 1 {
        all -= kept.pop_front().map_or(0, |(_, built)| faces(&built));
    }
    built
}

/// The error of triangles that bound no body.
fn refuse(file: &Spanned<String>, error: MeshError) -> Diagnostic {
    let name = &file.value;
    let point = |place: Vec3| {
        let [x, y, z] = place.0;
        format!("[{x}, {y}, {z}]")
    };
    let edge = |[a, b]: [Vec3; 2]| format!("the edge from {} to {}", point(a), point(b));
    let (fault, help) = match error {
        MeshError::Few => ("it has fewer than four triangles".into(), "a closed body has four or more"),
        MeshError::NotFinite(vertex) => {
            (format!("vertex {} is not finite", vertex + 1), "make `scale` smaller, or mend the file")
        }
        MeshError::NoVertex(triangle) => {
            (format!("triangle {} has a corner that does not exist", triangle + 1), "export the file again")
        }
        MeshError::Degenerate(triangle, place) => (
            format!("triangle {} at {} has no area", triangle + 1, point(place)),
            "remove triangles without area, and merge vertices, in the program that wrote the file",
        ),
        MeshError::Open(ends) => (
            format!("{} belongs to one triangle only: the mesh has a hole", edge(ends)),
            "close the holes and merge vertices in the program that wrote the file",
        ),
        MeshError::Branched(ends) => (
            format!("{} belongs to more than two triangles", edge(ends)),
            "leave out inner walls, and let bodies not share edges",
        ),
        MeshError::Turned(triangle, ends) => (
            format!(
                "triangle {} is turned over: its neighbour at {} has the opposite orientation",
                triangle + 1,
                edge(ends)
            ),
            "let the program that wrote the file make all normals point outward",
        ),
        MeshError::Folded(ends) => (
            format!("two triangles lie on one another at {}", edge(ends)),
            "divide faces that are not convex into triangles in the program that wrote the file",
        ),
        MeshError::InsideOut => {
            ("all of its normals point inward".into(), "flip them; for beams inside of the body use side = \"inside\"")
        }
    };
    Diagnostic::error(format!("{name} does not bound a body: {fault}"), file.span.clone()).help(help)
}
