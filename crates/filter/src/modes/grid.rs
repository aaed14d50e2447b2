//! Weight gathered in cells, which tells where to look for modes.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use crate::cloud::{BLOCK, Block, Column};

/// Edge of the cells that the weight is gathered in, m.
const CELL: f64 = 0.02;
/// Most cells along an axis of a link, but for two or three; longer links have larger ones. Numbers of cells stay below
/// 2²³, so that they fit into single precision.
const MOST: f64 = 200.0;

/// Weight gathered in the cells of a link's bounding box.
pub(super) struct Grid {
    corner: Point3<f64>,
    /// Edge of a cell, m.
    edge: f64,
    shape: [usize; 3],
    weight: Vec<f64>,
    occupied: Vec<usize>,
}

impl Grid {
    pub(super) fn new(vertices: &[Point3<f64>]) -> Self {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| {
            vertices
                .iter()
                .fold(Point3::new(start, start, start), |bound, vertex| {
                    Point3::from(bound.coords.zip_map(&vertex.coords, pick))
                })
        };
        let (low, high) = (
            fold(f64::INFINITY, f64::min),
            fold(f64::NEG_INFINITY, f64::max),
        );
        let edge = CELL.max((high - low).max() / MOST);
        // One cell more on each side, so that a neighbour of any cell exists.
        let shape = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / edge) as usize + 3);
        let cells = shape.iter().product();
        Self {
            corner: low - Vector3::repeat(edge),
            edge,
            shape,
            weight: vec![0.0; cells],
            occupied: Vec::with_capacity(cells),
        }
    }

    pub(super) fn clear(&mut self) {
        for cell in self.occupied.drain(..) {
            self.weight[cell] = 0.0;
        }
    }

    /// Adds the weights of a block's particles, `scale` times each.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        block: &Block,
        range: &Range<usize>,
        weights: &Column,
        scale: f32,
    ) {
        let range = range.start..range.end.min(BLOCK);
        let cells = self.cells(block, range.clone());
        for at in range {
            self.put(cells[at] as usize, weights[at] * scale);
        }
    }

    /// The cells that particles are in.
    #[inline(always)]
    fn cells(&self, block: &Block, range: Range<usize>) -> [u32; BLOCK] {
        /// Adding this to a positive number rounds it to a whole one, which then stands in the lowest bits of the sum.
        const ROUND: f32 = 8_388_608.0;
        let [low_x, low_y, low_z] = self.corner.coords.cast::<f32>().into();
        let [columns, rows] = [self.shape[0], self.shape[1]].map(|cells| cells as f32);
        let most = self.shape.map(|cells| (cells - 2) as f32);
        let per_metre = (1.0 / self.edge) as f32;
        let along = |place: f32, low: f32, most: f32| {
            let cell = (place - low) * per_metre - 0.5;
            let cell = if cell > 1.0 { cell } else { 1.0 };
            (if cell < most { cell } else { most }) + ROUND - ROUND
        };
        let mut cells = [0; BLOCK];
        for at in range {
            let x = along(block.point[0][at], low_x, most[0]);
            let y = along(block.point[1][at], low_y, most[1]);
            let z = along(block.point[2][at], low_z, most[2]);
            let cell = (z * rows + y) * columns + x;
            cells[at] = (cell + ROUND).to_bits() - ROUND.to_bits();
        }
        cells
    }

    #[inline(always)]
    fn put(&mut self, cell: usize, weight: f32) {
        let sum = &mut self.weight[cell];
        if *sum == 0.0 && weight > 0.0 {
            self.occupied.push(cell);
        }
        *sum += f64::from(weight);
    }

    /// The largest weight of a cell with its 26 neighbours, and the cell's centre.
    pub(super) fn peak(&self) -> Option<(f64, Point3<f64>)> {
        let (row, layer) = (self.shape[0], self.shape[0] * self.shape[1]);
        let block = |cell: usize| -> f64 {
            let mut sum = 0.0;
            for z in [cell - layer, cell, cell + layer] {
                for y in [z - row, z, z + row] {
                    sum += self.weight[y - 1] + self.weight[y] + self.weight[y + 1];
                }
            }
            sum
        };
        let best = (self.occupied.iter())
            .filter(|&&cell| self.weight[cell] > 0.0)
            .map(|&cell| (block(cell), cell))
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        let cell = best.1;
        let index = [cell % row, cell / row % self.shape[1], cell / layer];
        let at = |axis: usize| self.corner[axis] + (index[axis] as f64 + 0.5) * self.edge;
        Some((best.0, Point3::new(at(0), at(1), at(2))))
    }
}
