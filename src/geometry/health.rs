//! What is wrong with a surface that should bound a solid.

use super::surface::TriMesh;

/// The defects of a surface. A surface with none of them is closed, manifold and outward.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Health {
    /// Triangles of the file, before any was dropped.
    pub triangles: usize,
    /// Pieces that hang together over edges with exactly two triangles.
    pub components: usize,
    /// Edges with one triangle: the rims of holes.
    pub open_edges: usize,
    /// Length of the open edges as a share of the length of all edges, 0 to 1.
    pub open_share: f64,
    /// Edges with three triangles or more.
    pub non_manifold_edges: usize,
    /// Triangles turned over to agree with their neighbours.
    pub flipped: usize,
    /// Pieces turned over as a whole, because they were inside out.
    pub inverted_components: usize,
    /// Edges whose two triangles cannot be made to agree (a one-sided surface).
    pub contradictions: usize,
    /// Triangles without area. Those with a repeated corner were dropped.
    pub degenerate: usize,
    /// Repeated triangles. Those of equal orientation were dropped.
    pub duplicate: usize,
}

impl Health {
    /// Whether every edge has exactly two triangles that agree.
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0 && self.non_manifold_edges == 0 && self.contradictions == 0
    }

    /// A sentence for each kind of defect; empty for a clean surface. Several pieces are no defect.
    pub fn warnings(&self) -> Vec<String> {
        let mut list = Vec::new();
        let mut say = |count: usize, one: &str, many: &str, then: &str| {
            if count > 0 {
                list.push(format!("{count} {} {then}", if count == 1 { one } else { many }));
            }
        };
        let open = format!(
            "({:.2} % of the edge length): the surface has holes, and inside and outside are decided by the winding number",
            100.0 * self.open_share
        );
        say(self.open_edges, "open edge", "open edges", &open);
        say(
            self.non_manifold_edges,
            "edge",
            "edges",
            "with three or more triangles: parts touch or walls are doubled",
        );
        say(
            self.contradictions,
            "edge",
            "edges",
            "whose triangles face opposite ways, and cannot be made to agree",
        );
        say(
            self.flipped,
            "triangle",
            "triangles",
            "turned over to agree with the neighbours",
        );
        say(
            self.inverted_components,
            "piece",
            "pieces",
            "inside out: turned over",
        );
        say(self.degenerate, "triangle", "triangles", "without area");
        say(self.duplicate, "repeated triangle", "repeated triangles", "found");
        list
    }
}

/// One side of a triangle, running from `from` to `to`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// The edge's two vertices, the smaller one first.
    pub edge: [u32; 2],
    pub triangle: u32,
    /// Whether the triangle runs through the edge from the smaller to the larger vertex.
    pub forward: bool,
}

/// All sides of all triangles, sorted so that the sides of one edge stand together.
pub(super) fn sides(mesh: &TriMesh) -> Vec<Side> {
    let mut sides: Vec<Side> = Vec::with_capacity(3 * mesh.triangles.len());
    for (number, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (from, to) = (t[k], t[(k + 1) % 3]);
            sides.push(Side {
                edge: [from.min(to), from.max(to)],
                triangle: number as u32,
                forward: from < to,
            });
        }
    }
    sides.sort_unstable();
    sides
}

/// Drops triangles with a repeated corner and all but the first of repeated ones that face the same way, and counts them
/// in the health, together with slivers and with repeated triangles that face opposite ways (which stay: they add nothing to
/// the winding number).
pub(super) fn drop_degenerate(mesh: TriMesh, health: &mut Health) -> TriMesh {
    health.triangles = mesh.triangles.len();
    let mut faces: Vec<([u32; 3], bool, u32)> = Vec::with_capacity(mesh.triangles.len());
    for (number, t) in mesh.triangles.iter().enumerate() {
        if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
            health.degenerate += 1;
            continue;
        }
        let mut sorted = *t;
        sorted.sort_unstable();
        // An even permutation of the sorted corners is one of its three rotations.
        let even = (0..3).any(|k| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]] == sorted);
        faces.push((sorted, even, number as u32));
    }
    faces.sort_unstable();
    let mut kept: Vec<u32> = Vec::with_capacity(faces.len());
    for group in faces.chunk_by(|f, g| f.0 == g.0) {
        health.duplicate += group.len() - 1;
        for one_way in group.chunk_by(|f, g| f.1 == g.1) {
            kept.push(one_way[0].2);
        }
    }
    kept.sort_unstable();
    let triangles: Vec<[u32; 3]> = kept.iter().map(|&t| mesh.triangles[t as usize]).collect();
    let mesh = TriMesh {
        vertices: mesh.vertices,
        triangles,
    }
    .without_loose_vertices();
    health.degenerate += (0..mesh.triangles.len()).filter(|&t| is_sliver(&mesh, t)).count();
    mesh
}

/// Whether the triangle's height is lost in rounding.
fn is_sliver(mesh: &TriMesh, t: usize) -> bool {
    let [a, b, c] = mesh.corners(t);
    let longest = (b - a)
        .norm_squared()
        .max((c - b).norm_squared())
        .max((a - c).norm_squared());
    (b - a).cross(&(c - a)).norm() <= 1e-12 * longest
}

/// Counts open and non-manifold edges into the health.
pub(super) fn count_edges(mesh: &TriMesh, health: &mut Health) {
    let sides = sides(mesh);
    let (mut length, mut open) = (0.0, 0.0);
    for edge in sides.chunk_by(|s, t| s.edge == t.edge) {
        let [from, to] = edge[0].edge.map(|v| mesh.vertices[v as usize]);
        length += (to - from).norm();
        match edge.len() {
            1 => {
                health.open_edges += 1;
                open += (to - from).norm();
            }
            2 => {}
            _ => health.non_manifold_edges += 1,
        }
    }
    health.open_share = if length > 0.0 { open / length } else { 0.0 };
}
