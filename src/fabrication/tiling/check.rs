//! Whether meshes tile an object: what a printer's software takes for granted.

use super::Part;
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;

/// What is wrong with a set of parts.
#[derive(Clone, Debug, PartialEq)]
pub enum TilingFault {
    /// A triangle names a vertex that is not there, or one twice.
    BadTriangle {
        /// The part's label.
        part: usize,
        /// The triangle's place in the part's list.
        triangle: usize,
    },
    /// An edge is not in exactly two triangles of opposite direction.
    BadEdge {
        /// The part's label.
        part: usize,
        /// The edge's middle \[mm\].
        place: Vec3,
        /// How many triangles run along it in its two directions.
        triangles: (usize, usize),
    },
    /// The triangles around a vertex are more than one fan, or none.
    BadVertex {
        /// The part's label.
        part: usize,
        /// Where \[mm\].
        place: Vec3,
        /// How many fans there are.
        fans: usize,
    },
    /// The volume that the mesh encloses is not positive, or not the one that the part states.
    BadVolume {
        /// The part's label.
        part: usize,
        /// What the mesh encloses \[mm³\].
        enclosed: f64,
        /// What the part states \[mm³\].
        stated: f64,
    },
    /// A triangle of one part lies on a triangle of another in the same direction: they overlap.
    Overlap {
        /// The parts' labels.
        parts: (usize, usize),
        /// The triangle's centroid \[mm\].
        place: Vec3,
    },
}

impl fmt::Display for TilingFault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let at = |p: &Vec3| format!("({:.4}, {:.4}, {:.4}) mm", p.x, p.y, p.z);
        match self {
            Self::BadTriangle { part, triangle } => {
                write!(
                    f,
                    "part {part}: triangle {triangle} names a vertex twice or one that is not there"
                )
            }
            Self::BadEdge {
                part,
                place,
                triangles: (there, back),
            } => write!(
                f,
                "part {part}: the edge at {} has {there} triangles one way and {back} the other, not 1 and 1",
                at(place)
            ),
            Self::BadVertex { part, place, fans } => {
                write!(
                    f,
                    "part {part}: the vertex at {} has {fans} fans of triangles, not 1",
                    at(place)
                )
            }
            Self::BadVolume {
                part,
                enclosed,
                stated,
            } => {
                write!(
                    f,
                    "part {part}: the mesh encloses {enclosed:.4} mm³, stated are {stated:.4} mm³"
                )
            }
            Self::Overlap { parts: (p, q), place } => {
                write!(
                    f,
                    "parts {p} and {q} lie on the same side of the triangle at {}",
                    at(place)
                )
            }
        }
    }
}

/// How parts meet, once they do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// Area shared by each pair of parts, by their labels, the smaller first \[mm²\].
    pub shared_mm2: BTreeMap<(usize, usize), f64>,
    /// Area that belongs to one part alone: the object's own surface \[mm²\].
    pub outer_mm2: f64,
    /// Whether the triangles that belong to one part alone close up: no gap between parts anywhere.
    pub outer_closed: bool,
}

/// Checks that every part is a closed oriented manifold of its stated volume, and that parts meet in identical
/// triangles of opposite direction only.
///
/// # Errors
/// All faults found.
pub fn check_tiling(parts: &[Part]) -> Result<Contacts, Vec<TilingFault>> {
    let mut faults = Vec::new();
    for part in parts {
        faults.extend(check_part(part));
    }
    if faults.is_empty() {
        let contacts = contacts(parts, &mut faults);
        if faults.is_empty() {
            return Ok(contacts);
        }
    }
    Err(faults)
}

/// The volume that a closed surface encloses \[mm³\], by the divergence theorem: `Σ a · (b × c) / 6`, from the first
/// vertex so that little cancels.
pub fn enclosed_volume(mesh: &TriMesh) -> f64 {
    let Some(origin) = mesh.vertices.first() else {
        return 0.0;
    };
    let six = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize] - origin);
        a.dot(&b.cross(&c))
    };
    mesh.triangles.iter().map(six).sum::<f64>() / 6.0
}

/// The faults of one part: that it is closed, oriented, manifold, and of its stated volume to a millionth.
pub fn check_part(part: &Part) -> Vec<TilingFault> {
    let mut faults = Vec::new();
    let (mesh, label) = (&part.mesh, part.label);
    let n = mesh.vertices.len();
    for (triangle, t) in mesh.triangles.iter().enumerate() {
        if t.iter().any(|&v| v as usize >= n) || t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
            faults.push(TilingFault::BadTriangle {
                part: label,
                triangle,
            });
        }
    }
    if !faults.is_empty() {
        return faults;
    }
    let mut edges: BTreeMap<(u32, u32), (usize, usize)> = BTreeMap::new();
    // For each vertex, the edge opposite to it in each triangle: one fan is one closed walk through them.
    let mut links: Vec<Vec<(u32, u32)>> = vec![Vec::new(); n];
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            let count = edges.entry((a.min(b), a.max(b))).or_default();
            if a < b {
                count.0 += 1;
            } else {
                count.1 += 1;
            }
            links[a as usize].push((b, c));
        }
    }
    for ((a, b), triangles) in edges {
        if triangles != (1, 1) {
            let place = (mesh.vertices[a as usize] + mesh.vertices[b as usize]) / 2.0;
            faults.push(TilingFault::BadEdge {
                part: label,
                place,
                triangles,
            });
        }
    }
    for (v, link) in links.iter().enumerate() {
        let fans = closed_walks(link);
        if fans != 1 {
            faults.push(TilingFault::BadVertex {
                part: label,
                place: mesh.vertices[v],
                fans,
            });
        }
    }
    let enclosed = enclosed_volume(mesh);
    if enclosed <= 0.0 || (enclosed - part.volume_mm3).abs() > 1e-6 * enclosed {
        faults.push(TilingFault::BadVolume {
            part: label,
            enclosed,
            stated: part.volume_mm3,
        });
    }
    faults
}

/// Into how many walks directed edges fall when each is followed by one that starts where it ends.
fn closed_walks(link: &[(u32, u32)]) -> usize {
    let mut left: Vec<(u32, u32)> = link.to_vec();
    let mut walks = 0;
    while let Some((_, mut at)) = left.pop() {
        walks += 1;
        while let Some(i) = left.iter().position(|(from, _)| *from == at) {
            at = left.swap_remove(i).1;
        }
    }
    walks
}

/// A point by its bits; `-0` as `0`.
fn bits(p: &Vec3) -> [u64; 3] {
    [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits())
}

/// Matches the parts' triangles with one another by their places, independent of vertex numbers.
fn contacts(parts: &[Part], faults: &mut Vec<TilingFault>) -> Contacts {
    type Key = [[u64; 3]; 3];
    let mut contacts = Contacts::default();
    let mut seen: HashMap<Key, (usize, bool)> = HashMap::new();
    let mut doubled = BTreeSet::new();
    let mut sides: Vec<(Key, f64, usize)> = Vec::new();
    for part in parts {
        for t in &part.mesh.triangles {
            let p = t.map(|v| part.mesh.vertices[v as usize]);
            let area = (p[1] - p[0]).cross(&(p[2] - p[0])).norm() / 2.0;
            let mut key = [bits(&p[0]), bits(&p[1]), bits(&p[2])];
            let even = sort_three(&mut key);
            match seen.get(&key) {
                None => {
                    seen.insert(key, (part.label, even));
                    sides.push((key, area, part.label));
                }
                Some(&(other, direction)) => {
                    if direction == even || !doubled.insert(key) {
                        let place = (p[0] + p[1] + p[2]) / 3.0;
                        faults.push(TilingFault::Overlap {
                            parts: (other, part.label),
                            place,
                        });
                    }
                    let pair = (other.min(part.label), other.max(part.label));
                    *contacts.shared_mm2.entry(pair).or_default() += area;
                }
            }
        }
    }
    let mut balance: HashMap<([u64; 3], [u64; 3]), i64> = HashMap::new();
    for (key, area, _) in sides.iter().filter(|(key, ..)| !doubled.contains(key)) {
        contacts.outer_mm2 += area;
        let even = seen[key].1;
        // Sorted corners run along their edges 01, 12, 20 if the sort was even and backwards if it was odd.
        for (i, j, forward) in [(0, 1, true), (1, 2, true), (0, 2, false)] {
            *balance.entry((key[i], key[j])).or_default() += if forward == even { 1 } else { -1 };
        }
    }
    contacts.outer_closed = balance.values().all(|b| *b == 0);
    contacts
}

/// Sorts three items and answers whether the permutation was even.
fn sort_three<T: Ord>(items: &mut [T; 3]) -> bool {
    let mut even = true;
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if items[i] > items[j] {
            items.swap(i, j);
            even = !even;
        }
    }
    even
}
