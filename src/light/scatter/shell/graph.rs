//! Neighbours of a shell's vertices, and how well light passes between them along the surface.

use crate::mapping::shell::Shell;

/// A way between two columns.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// The other vertex.
    pub to: u32,
    /// Width over length of the way, times the mean thickness of both columns, metres.
    pub area: f32,
    /// Width over length of the way.
    pub width: f32,
}

/// Columns and the ways between them.
pub struct Graph {
    /// Area of each vertex, m²: a third of that of its triangles, between the two surfaces.
    pub areas: Vec<f32>,
    /// Thickness at each vertex, metres.
    pub thickness: Vec<f32>,
    /// First way of each vertex, and the end of the last.
    firsts: Vec<u32>,
    ways: Vec<Way>,
}

impl Graph {
    /// Graph of a shell. A way along an edge is as wide as finite elements on triangles have it: half the sum
    /// of the cotangents of the angles opposite the edge. Where that is negative it is 0, so that no place
    /// becomes darker by light beside it.
    pub fn new(shell: &Shell) -> Graph {
        let middle = |vertex: u32| {
            let [outer, inner] = [0, 1].map(|end| shell.points[2 * vertex as usize + end].as_dvec3());
            (outer + inner) * 0.5
        };
        let thickness: Vec<f32> =
            shell.points.as_chunks::<2>().0.iter().map(|[outer, inner]| outer.distance(*inner)).collect();
        let mut areas = vec![0.0f64; thickness.len()];
        let mut edges: Vec<([u32; 2], f64)> = Vec::with_capacity(3 * shell.prisms.len());
        for prism in &shell.prisms {
            let corners = prism.vertices.map(middle);
            let twice = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
            for k in 0..3 {
                let [own, a, b] = [k, (k + 1) % 3, (k + 2) % 3];
                areas[prism.vertices[own] as usize] += twice / 6.0;
                if twice > 0.0 {
                    let cotangent = (corners[a] - corners[own]).dot(corners[b] - corners[own]) / twice;
                    let [a, b] = [a, b].map(|corner| prism.vertices[corner]);
                    edges.push(([a.min(b), a.max(b)], 0.5 * cotangent));
                }
            }
        }
        // A stable sort keeps the order of the prisms, and with it that of the sums.
        edges.sort_by_key(|(ends, _)| *ends);
        let mut joined: Vec<([u32; 2], f64)> = Vec::with_capacity(edges.len() / 2);
        for (ends, width) in edges {
            match joined.last_mut() {
                Some((last, sum)) if *last == ends => *sum += width,
                _ => joined.push((ends, width)),
            }
        }
        joined.retain(|(_, width)| *width > 0.0);
        let mut firsts = vec![0u32; thickness.len() + 1];
        joined.iter().flat_map(|(ends, _)| *ends).for_each(|vertex| firsts[vertex as usize + 1] += 1);
        for i in 1..firsts.len() {
            firsts[i] += firsts[i - 1];
        }
        let mut next = firsts.clone();
        let mut ways = vec![Way { to: 0, area: 0.0, width: 0.0 }; 2 * joined.len()];
        for ([a, b], width) in joined {
            let width = width as f32;
            let area = width * 0.5 * (thickness[a as usize] + thickness[b as usize]);
            for [from, to] in [[a, b], [b, a]] {
                let at = &mut next[from as usize];
                ways[*at as usize] = Way { to, area, width };
                *at += 1;
            }
        }
        Graph { areas: areas.into_iter().map(|area| area as f32).collect(), thickness, firsts, ways }
    }

    /// Ways from a vertex.
    #[inline]
    pub fn ways(&self, vertex: usize) -> &[Way] {
        &self.ways[self.firsts[vertex] as usize..self.firsts[vertex + 1] as usize]
    }

    /// Mean thickness over the area, metres.
    pub fn mean_thickness(&self) -> f32 {
        let pairs = || self.areas.iter().zip(&self.thickness);
        let sum: f64 = pairs().map(|(area, thickness)| f64::from(area * thickness)).sum();
        let area: f64 = pairs().map(|(area, _)| f64::from(*area)).sum();
        if area > 0.0 { (sum / area) as f32 } else { 0.0 }
    }
}
