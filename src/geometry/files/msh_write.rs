//! Writing Gmsh's MSH 4.1 as text (Gmsh reference manual, "MSH file format"): the elements in one volume entity for each
//! combination of groups, and each set of nodes as a physical group of points.

use super::volume::Group;
use crate::geometry::volume::{Elements, VolumeMesh};
use std::collections::BTreeMap;
use std::io::{self, Write};

/// Writes a mesh \[mm\] with named groups of its elements and named sets of its nodes. Gmsh numbers both from 1; a Kuhn
/// cell is written as the hexahedron that it is cut from.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] for a group that names what the mesh does not hold, or a name with a
/// quote or a line break.
pub fn write_msh(
    mut out: impl Write,
    mesh: &VolumeMesh,
    element_groups: &[Group],
    node_sets: &[Group],
) -> io::Result<()> {
    check(element_groups, mesh.elements.len())?;
    check(node_sets, mesh.nodes.len())?;
    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames")?;
    writeln!(out, "{}", element_groups.len() + node_sets.len())?;
    for (dimension, groups) in [(0, node_sets), (3, element_groups)] {
        for (i, group) in groups.iter().enumerate() {
            writeln!(out, "{dimension} {} \"{}\"", i + 1, group.name)?;
        }
    }
    writeln!(out, "$EndPhysicalNames")?;
    let volumes = volumes(mesh, element_groups);
    let bounds = bounds(mesh);
    writeln!(out, "$Entities\n{} 0 0 {}", node_sets.len(), volumes.len())?;
    for i in 1..=node_sets.len() {
        writeln!(out, "{i} 0 0 0 1 {i}")?;
    }
    for (i, groups) in volumes.keys().enumerate() {
        write!(out, "{} {bounds} {}", i + 1, groups.len())?;
        for group in groups {
            write!(out, " {}", group + 1)?;
        }
        writeln!(out, " 0")?;
    }
    writeln!(out, "$EndEntities")?;
    write_nodes(&mut out, mesh)?;
    write_elements(&mut out, mesh, &volumes, node_sets)?;
    out.flush()
}

fn check(groups: &[Group], most: usize) -> io::Result<()> {
    for group in groups {
        let plain = !group.name.contains(['"', '\n', '\r']);
        if !plain || group.members.iter().any(|&m| m as usize >= most) {
            let message = format!(
                "group {:?}: a name without quotes and members below {most} are expected",
                group.name
            );
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
    }
    Ok(())
}

/// The elements of each combination of groups.
fn volumes(mesh: &VolumeMesh, groups: &[Group]) -> BTreeMap<Vec<usize>, Vec<usize>> {
    let mut of_element = vec![Vec::new(); mesh.elements.len()];
    for (g, group) in groups.iter().enumerate() {
        for &e in &group.members {
            of_element[e as usize].push(g);
        }
    }
    let mut volumes: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
    for (e, own) in of_element.into_iter().enumerate() {
        volumes.entry(own).or_default().push(e);
    }
    volumes
}

fn bounds(mesh: &VolumeMesh) -> String {
    let mut nodes = mesh.nodes.iter();
    let first = nodes.next().copied().unwrap_or_default();
    let (low, high) = nodes.fold((first, first), |(low, high), x| (low.inf(x), high.sup(x)));
    let numbers: Vec<String> = low.iter().chain(high.iter()).map(f64::to_string).collect();
    numbers.join(" ")
}

fn write_nodes(out: &mut impl Write, mesh: &VolumeMesh) -> io::Result<()> {
    let n = mesh.nodes.len();
    writeln!(out, "$Nodes\n1 {n} 1 {n}\n3 1 0 {n}")?;
    for i in 1..=n {
        writeln!(out, "{i}")?;
    }
    for x in &mesh.nodes {
        writeln!(out, "{} {} {}", x.x, x.y, x.z)?;
    }
    writeln!(out, "$EndNodes")
}

fn write_elements(
    out: &mut impl Write,
    mesh: &VolumeMesh,
    volumes: &BTreeMap<Vec<usize>, Vec<usize>>,
    node_sets: &[Group],
) -> io::Result<()> {
    let points: usize = node_sets.iter().map(|s| s.members.len()).sum();
    let m = mesh.elements.len();
    let blocks = volumes.len() + node_sets.len();
    writeln!(out, "$Elements\n{blocks} {} 1 {}", m + points, m + points)?;
    let element_type = match mesh.elements {
        Elements::Tetrahedra(_) => 4,
        Elements::Hexahedra(_) | Elements::KuhnCells(_) => 5,
    };
    for (i, elements) in volumes.values().enumerate() {
        writeln!(out, "3 {} {element_type} {}", i + 1, elements.len())?;
        for &e in elements {
            write!(out, "{}", e + 1)?;
            for node in mesh.elements.nodes_of(e) {
                write!(out, " {}", node + 1)?;
            }
            writeln!(out)?;
        }
    }
    let mut number = m;
    for (i, set) in node_sets.iter().enumerate() {
        writeln!(out, "0 {} 15 {}", i + 1, set.members.len())?;
        for node in &set.members {
            number += 1;
            writeln!(out, "{number} {}", node + 1)?;
        }
    }
    writeln!(out, "$EndElements")
}
