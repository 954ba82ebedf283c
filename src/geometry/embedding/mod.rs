//! A fine surface that follows a coarse volume mesh.
//!
//! Every point x of the surface takes the displacements of some nodes by weights that are found once, at rest:
//!
//! ```text
//! u(x) = Σ_i φ_i(x) u_i        Σ_i φ_i = 1,  Σ_i φ_i x_i = x        [mm]
//! ```
//!
//! so that every linear field, rigid motions and uniform strains among them, is followed exactly. Two kinds of weights:
//!
//! - [`Embedding::in_elements`]: the shape functions of the element that holds the point, barycentric in a tetrahedron,
//!   trilinear in a hexahedron (by inverting its map). Continuous, with kinks at the elements' faces. A point outside every
//!   element takes the nearest one's functions, carried on.
//! - [`Embedding::moving_least_squares`]: a plane fitted anew at every point to the nodes around it, without kinks
//!   (Kaufmann, Martin, Botsch and Gross 2008, "Flexible simulation of deformable models using discontinuous Galerkin FEM", which Bickel
//!   2009 and 2010 embed their faces with); see `least_squares`.
//!
//! Valid for points in the mesh or next to it: one farther away than its reach is refused.

mod elements;
mod index;
mod least_squares;

use super::volume::VolumeMesh;
use crate::math::Vec3;
pub use elements::{Held, Locator};
use rayon::prelude::*;
use thiserror::Error;

/// The farthest that a point may lie outside the mesh by default, over the longest edge of the nearest element.
const REACH: f64 = 1.0;

/// Points, and their weights over the nodes of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Embedding {
    points: Vec<Vec3>,
    /// Where each point's weights start in `nodes` and `weights`, `(points + 1)`.
    first: Vec<usize>,
    nodes: Vec<u32>,
    weights: Vec<f64>,
    mesh_nodes: usize,
    outside: usize,
    fallbacks: usize,
}

/// How to embed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EmbeddingOptions {
    /// How far a point may lie outside the mesh \[mm\]. Default: the longest edge of the nearest element.
    pub reach_mm: Option<f64>,
    /// Moving least squares: radius around each node within which it has a say, over the mean length of its edges. Default 2;
    /// 1.2 to 5.
    pub support: Option<f64>,
}

/// Why points cannot be embedded, or not displaced.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum EmbeddingError {
    /// An option out of its range.
    #[error("embedding option `{field}` is {value}; it must be {range}")]
    Option {
        /// Its name.
        field: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// Nothing to embed into.
    #[error("the mesh has no elements to embed points in")]
    NoElements,
    /// An element that names a node that is not there, or a node that is nowhere.
    #[error("element {element} of the mesh names node {node}, which is missing or not at a finite place")]
    BadNode {
        /// The element, from 0.
        element: usize,
        /// The node, from 0.
        node: u32,
    },
    /// A point that is no place.
    #[error("point {point} is at ({}, {}, {}): expected finite coordinates in mm", place[0], place[1], place[2])]
    NotFinite {
        /// Its number, from 0.
        point: usize,
        /// Its coordinates.
        place: [f64; 3],
    },
    /// A point that the mesh says nothing about.
    #[error(
        "point {point} at ({:.3}, {:.3}, {:.3}) mm is {distance_mm:.3} mm outside the mesh, farther than {reach_mm:.3} mm; \
         check that surface and mesh have the same unit and place, or raise `reach_mm`",
        place[0], place[1], place[2]
    )]
    TooFar {
        /// Its number, from 0.
        point: usize,
        /// Where it is \[mm\].
        place: [f64; 3],
        /// How far from the nearest element \[mm\].
        distance_mm: f64,
        /// How far it may be \[mm\].
        reach_mm: f64,
    },
    /// Displacements of another mesh.
    #[error("{found} displacements for a mesh of {expected} nodes: give one to each")]
    Length {
        /// How many came.
        found: usize,
        /// How many are needed.
        expected: usize,
    },
}

/// One point's weights.
#[derive(Clone, Debug)]
struct Weights {
    nodes: Vec<u32>,
    weights: Vec<f64>,
    outside: bool,
    fallback: bool,
}

impl Embedding {
    /// Embeds `points`, `(n × 3)` \[mm\], by the shape functions of the elements that hold them.
    ///
    /// # Errors
    /// [`EmbeddingError`]: a mesh without elements or with bad ones, points that are not finite or farther from the mesh than
    /// their reach.
    pub fn in_elements(
        mesh: &VolumeMesh,
        points: &[Vec3],
        options: &EmbeddingOptions,
    ) -> Result<Embedding, EmbeddingError> {
        options.check()?;
        let locator = Locator::new(mesh)?;
        Embedding::each(mesh, points, |n, x| options.locate(&locator, n, x))
    }

    /// Embeds `points`, `(n × 3)` \[mm\], by moving least squares over the nodes around them. Where the nodes around a point lie in a
    /// plane or are too few, it falls back to its element's shape functions ([`Embedding::fallbacks`]).
    ///
    /// # Errors
    /// As for [`Embedding::in_elements`].
    pub fn moving_least_squares(
        mesh: &VolumeMesh,
        points: &[Vec3],
        options: &EmbeddingOptions,
    ) -> Result<Embedding, EmbeddingError> {
        options.check()?;
        let locator = Locator::new(mesh)?;
        let nodes = least_squares::Nodes::new(mesh, options.support.unwrap_or(2.0));
        Embedding::each(mesh, points, |n, x| {
            // Also tells whether the point is within reach.
            let held = options.locate(&locator, n, x)?;
            Ok(match nodes.weights(x) {
                Some((nodes, weights)) => Weights {
                    nodes,
                    weights,
                    ..held
                },
                None => Weights {
                    fallback: true,
                    ..held
                },
            })
        })
    }

    fn each(
        mesh: &VolumeMesh,
        points: &[Vec3],
        weights: impl Fn(usize, &Vec3) -> Result<Weights, EmbeddingError> + Sync,
    ) -> Result<Embedding, EmbeddingError> {
        let found: Vec<Result<Weights, EmbeddingError>> = points
            .par_iter()
            .enumerate()
            .map(|(n, x)| weights(n, x))
            .collect();
        let mut embedding = Embedding {
            points: points.to_vec(),
            first: vec![0],
            nodes: Vec::new(),
            weights: Vec::new(),
            mesh_nodes: mesh.nodes.len(),
            outside: 0,
            fallbacks: 0,
        };
        for weights in found {
            let weights = weights?;
            embedding.nodes.extend(weights.nodes);
            embedding.weights.extend(weights.weights);
            embedding.first.push(embedding.nodes.len());
            embedding.outside += usize::from(weights.outside);
            embedding.fallbacks += usize::from(weights.fallback);
        }
        Ok(embedding)
    }

    /// The points at rest, `(n × 3)` \[mm\].
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// How many points lie outside every element.
    pub fn outside(&self) -> usize {
        self.outside
    }

    /// How many points fell back from moving least squares to their element's shape functions.
    pub fn fallbacks(&self) -> usize {
        self.fallbacks
    }

    /// The nodes that point `p` follows, and their weights.
    pub fn weights_of(&self, p: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = self.first[p]..self.first[p + 1];
        self.nodes[range.clone()]
            .iter()
            .copied()
            .zip(self.weights[range].iter().copied())
    }

    /// The points, `(n × 3)` \[mm\], where the nodes are displaced by `u`, `(nodes × 3)` \[mm\].
    ///
    /// # Errors
    /// [`EmbeddingError::Length`] where there is not one displacement for each node of the mesh.
    pub fn displaced(&self, u: &[Vec3]) -> Result<Vec<Vec3>, EmbeddingError> {
        if u.len() != self.mesh_nodes {
            return Err(EmbeddingError::Length {
                found: u.len(),
                expected: self.mesh_nodes,
            });
        }
        let follow = |p: usize| {
            let moved = self.weights_of(p).map(|(node, weight)| u[node as usize] * weight);
            self.points[p] + moved.sum::<Vec3>()
        };
        Ok((0..self.points.len()).into_par_iter().map(follow).collect())
    }
}

impl EmbeddingOptions {
    fn check(&self) -> Result<(), EmbeddingError> {
        let option = |field, value, range| Err(EmbeddingError::Option { field, value, range });
        match (self.reach_mm, self.support) {
            (Some(reach), _) if reach.is_nan() || reach < 0.0 => option("reach_mm", reach, "zero or more"),
            (_, Some(support)) if !(1.2..=5.0).contains(&support) => {
                option("support", support, "between 1.2 and 5")
            }
            _ => Ok(()),
        }
    }

    /// The shape functions of the element that holds a point, or of the nearest one.
    fn locate(&self, locator: &Locator, point: usize, x: &Vec3) -> Result<Weights, EmbeddingError> {
        let place = (*x).into();
        if !x.iter().all(|c| c.is_finite()) {
            return Err(EmbeddingError::NotFinite { point, place });
        }
        let held = locator.nearest(x);
        let reach_mm = self.reach_mm.unwrap_or(REACH * held.longest_edge_mm);
        if held.distance_mm > reach_mm {
            return Err(EmbeddingError::TooFar {
                point,
                place,
                distance_mm: held.distance_mm,
                reach_mm,
            });
        }
        Ok(Weights {
            nodes: held.nodes,
            weights: held.weights,
            outside: held.distance_mm > 0.0,
            fallback: false,
        })
    }
}
