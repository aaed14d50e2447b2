//! Which triangle is in front at each place of a picture.

/// Triangles drawn by nearness to the viewer, on a grid finer than the picture's pixels.
pub struct DepthMap {
    width: usize,
    height: usize,
    /// The picture's place of the grid's first corner, px.
    origin: [f64; 2],
    /// Cells a pixel.
    finer: f64,
    /// Nearness to the viewer and number of the triangle in front.
    cells: Vec<(f32, u32)>,
}

const NOTHING: (f32, u32) = (f32::NEG_INFINITY, u32::MAX);

impl DepthMap {
    /// An empty map of the picture's rectangle from `low` to `high`, px.
    pub fn new(low: [f64; 2], high: [f64; 2], finer: f64) -> Self {
        let cells = |axis: usize| ((high[axis] - low[axis]) * finer).ceil().max(1.0) as usize;
        let (width, height) = (cells(0), cells(1));
        Self {
            width,
            height,
            origin: low,
            finer,
            cells: vec![NOTHING; width * height],
        }
    }

    /// Draws triangle `number` with corners at (x px, y px, nearness m).
    pub fn draw(&mut self, corners: &[[f64; 3]; 3], number: u32) {
        let corners = corners.map(|[x, y, near]| {
            let [left, top] = self.origin;
            [
                (x - left) * self.finer - 0.5,
                (y - top) * self.finer - 0.5,
                near,
            ]
        });
        let [a, b, c] = corners;
        let cross = |p: [f64; 3], q: [f64; 3], x: f64, y: f64| {
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
        };
        let area = cross(a, b, c[0], c[1]);
        if area.abs() < 1e-12 {
            return;
        }
        for row in span(corners.map(|p| p[1]), self.height) {
            for column in span(corners.map(|p| p[0]), self.width) {
                let (x, y) = (column as f64, row as f64);
                let shares = [(b, c), (c, a), (a, b)].map(|(p, q)| cross(p, q, x, y) / area);
                if shares.iter().any(|share| *share < 0.0) {
                    continue;
                }
                let near = shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2];
                let cell = &mut self.cells[row * self.width + column];
                if near as f32 > cell.0 {
                    *cell = (near as f32, number);
                }
            }
        }
    }

    /// Which of the triangles numbered below `count` are in front somewhere.
    pub fn seen(&self, count: usize) -> Vec<bool> {
        let mut seen = vec![false; count];
        for (_, number) in &self.cells {
            if let Some(seen) = seen.get_mut(*number as usize) {
                *seen = true;
            }
        }
        seen
    }

    /// Nearness of what is in front at a place of the picture; none where nothing is.
    pub fn nearness(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let column = (x - self.origin[0]) * self.finer;
        let row = (y - self.origin[1]) * self.finer;
        if column < 0.0 || row < 0.0 || column as usize >= self.width {
            return None;
        }
        let (near, _) = self
            .cells
            .get(row as usize * self.width + column as usize)?;
        near.is_finite().then_some(f64::from(*near))
    }
}

/// The cells between the least and the largest of three places.
fn span(places: [f64; 3], limit: usize) -> std::ops::Range<usize> {
    let low = places.iter().copied().fold(f64::INFINITY, f64::min).ceil();
    let high = places
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max)
        .floor();
    // Casts saturate: what lies outside is cut at the border.
    low.max(0.0) as usize..((high + 1.0).max(0.0) as usize).min(limit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_triangle_hides_the_other() {
        let mut map = DepthMap::new([10.0, 10.0], [20.0, 20.0], 2.0);
        let at = |near: f64| [[8.0, 8.0, near], [40.0, 8.0, near], [8.0, 40.0, near]];
        map.draw(&at(1.0), 0);
        map.draw(&at(2.0), 1);
        map.draw(&at(1.5), 2);
        assert_eq!(map.seen(3), [false, true, false]);
        assert_eq!(map.nearness([12.0, 12.0]), Some(2.0));
        assert_eq!(map.nearness([9.0, 12.0]), None);
    }

    #[test]
    fn nearness_runs_evenly_between_the_corners() {
        let mut map = DepthMap::new([0.0, 0.0], [10.0, 10.0], 4.0);
        map.draw(&[[0.0, 0.0, 0.0], [20.0, 0.0, 2.0], [0.0, 20.0, 0.0]], 7);
        let near = map.nearness([5.05, 2.0]).unwrap();
        assert!((near - 0.505).abs() < 0.03, "{near}");
    }
}
