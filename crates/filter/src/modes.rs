//! Modes of a weighted cloud: where the weight gathers, link by link.

use nalgebra::{Matrix3, Point3, Unit, Vector3};
use palpate_model::{Kinematics, Robot};

use crate::skin::Skin;
use crate::{Mode, Particle};

/// Edge of the cells that the weight is gathered in, m.
const CELL: f64 = 0.02;
/// Particles of one link within this distance of a mode's centre belong to it, m.
const REACH: f64 = 0.04;
/// Modes are looked for until they hold this share of the weight,
const ENOUGH: f64 = 0.95;
/// or there are this many,
const MOST: usize = 8;
/// or the next one would hold less than this.
const LEAST: f64 = 0.01;

/// Finds modes; keeps its grids, so that finding allocates nothing in steady state.
pub(crate) struct ModeFinder {
    grids: Vec<Option<Grid>>,
    free: Vec<bool>,
}

/// Weight gathered in the cells of a link's bounding box.
struct Grid {
    corner: Point3<f64>,
    shape: [usize; 3],
    weight: Vec<f64>,
    occupied: Vec<usize>,
}

impl ModeFinder {
    pub(crate) fn new(robot: &Robot, skin: &Skin) -> Self {
        let grid = |(index, link): (usize, &palpate_model::Link)| {
            skin.get(index)?;
            link.mesh.as_ref().map(|mesh| Grid::new(&mesh.vertices))
        };
        Self {
            grids: robot.links.iter().enumerate().map(grid).collect(),
            free: Vec::new(),
        }
    }

    /// Replaces `modes` by those of `cloud`, the heaviest first.
    pub(crate) fn find(
        &mut self,
        cloud: &[Particle],
        skin: &Skin,
        kinematics: &Kinematics,
        modes: &mut Vec<Mode>,
    ) {
        modes.clear();
        self.free.clear();
        self.free.resize(cloud.len(), true);
        self.gather(cloud);
        let mut held = 0.0;
        while modes.len() < MOST && held < ENOUGH {
            let Some((link, peak)) = self.heaviest() else {
                break;
            };
            let centre = self.climb(cloud, link, peak);
            let mode = self.take(cloud, link, &centre, skin, kinematics);
            held += mode.probability;
            if mode.probability < LEAST {
                break;
            }
            modes.push(mode);
        }
        modes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    }

    fn gather(&mut self, cloud: &[Particle]) {
        self.grids.iter_mut().flatten().for_each(Grid::clear);
        for particle in cloud {
            if let Some(grid) = &mut self.grids[particle.link] {
                grid.add(&particle.point_in_link, particle.weight);
            }
        }
    }

    /// Centre of the cell with the largest weight in and around it, over all links.
    fn heaviest(&self) -> Option<(usize, Point3<f64>)> {
        let best = (self.grids.iter().enumerate())
            .filter_map(|(link, grid)| grid.as_ref()?.peak().map(|(weight, at)| (weight, link, at)))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((best.1, best.2))
    }

    /// Two steps of mean shift (Comaniciu and Meer 2002) with a flat kernel.
    fn climb(&self, cloud: &[Particle], link: usize, start: Point3<f64>) -> Point3<f64> {
        let mut centre = start;
        for _ in 0..2 {
            let mut sum = Vector3::zeros();
            let mut total = 0.0;
            for (particle, _) in cloud
                .iter()
                .zip(&self.free)
                .filter(|(p, free)| **free && p.link == link)
            {
                if (particle.point_in_link - centre).norm_squared() < REACH * REACH {
                    sum += particle.point_in_link.coords * particle.weight;
                    total += particle.weight;
                }
            }
            if total > 0.0 {
                centre = Point3::from(sum / total);
            }
        }
        centre
    }

    /// Summarises the free particles around `centre`, and takes them and their weight out of the search.
    fn take(
        &mut self,
        cloud: &[Particle],
        link: usize,
        centre: &Point3<f64>,
        skin: &Skin,
        kinematics: &Kinematics,
    ) -> Mode {
        let mut sums = Sums::default();
        let grid = &mut self.grids[link];
        for (particle, free) in cloud.iter().zip(&mut self.free) {
            let near = (particle.point_in_link - centre).norm_squared() < REACH * REACH;
            if *free && particle.link == link && near {
                *free = false;
                sums.add(particle, centre);
                if let Some(grid) = grid {
                    grid.add(&particle.point_in_link, -particle.weight);
                }
            }
        }
        sums.mode(link, centre, skin, kinematics)
    }
}

#[derive(Default)]
struct Sums {
    weight: f64,
    offset: Vector3<f64>,
    outer: Matrix3<f64>,
    normal: Vector3<f64>,
    force: f64,
    stiffness: f64,
    /// Weight and triangle of the heaviest particle.
    heaviest: (f64, u32),
}

impl Sums {
    fn add(&mut self, particle: &Particle, centre: &Point3<f64>) {
        let offset = particle.point_in_link - centre;
        self.weight += particle.weight;
        self.offset += offset * particle.weight;
        self.outer += offset * offset.transpose() * particle.weight;
        self.normal += particle.normal_in_link.into_inner() * particle.weight;
        self.force += particle.force * particle.weight;
        self.stiffness += particle.stiffness * particle.weight;
        if particle.weight >= self.heaviest.0 {
            self.heaviest = (particle.weight, particle.triangle);
        }
    }

    fn mode(
        &self,
        link: usize,
        centre: &Point3<f64>,
        skin: &Skin,
        kinematics: &Kinematics,
    ) -> Mode {
        let total = self.weight.max(f64::MIN_POSITIVE);
        let mean = self.offset / total;
        let on_surface = (skin.surface(link)).closest_point_from(&(centre + mean), self.heaviest.1);
        let fallback = skin.surface(link).normal(on_surface.triangle);
        let normal = Unit::try_new(self.normal, 1e-12 * total).unwrap_or(fallback);
        let root_from_link = kinematics.root_from_link(link);
        let rotation = root_from_link.rotation.to_rotation_matrix();
        let covariance = self.outer / total - mean * mean.transpose();
        let (force, stiffness) = (self.force / total, self.stiffness / total);
        let normal_in_root = root_from_link.rotation * normal;
        Mode {
            link,
            probability: self.weight,
            point_in_root: root_from_link * on_surface.point,
            point_in_link: on_surface.point,
            normal_in_root,
            force_in_root: normal_in_root.into_inner() * -force,
            force,
            stiffness,
            covariance_in_root: rotation * covariance * rotation.transpose(),
        }
    }
}

impl Grid {
    fn new(vertices: &[Point3<f64>]) -> Self {
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
        // One cell more on each side, so that a neighbour of any cell exists.
        let shape = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / CELL) as usize + 3);
        let cells = shape.iter().product();
        Self {
            corner: low - Vector3::repeat(CELL),
            shape,
            weight: vec![0.0; cells],
            occupied: Vec::with_capacity(cells),
        }
    }

    fn clear(&mut self) {
        for cell in self.occupied.drain(..) {
            self.weight[cell] = 0.0;
        }
    }

    fn cell(&self, point: &Point3<f64>) -> usize {
        let at = |axis: usize| {
            let along = ((point[axis] - self.corner[axis]) / CELL) as usize;
            along.clamp(1, self.shape[axis] - 2)
        };
        (at(2) * self.shape[1] + at(1)) * self.shape[0] + at(0)
    }

    fn add(&mut self, point: &Point3<f64>, weight: f64) {
        let cell = self.cell(point);
        if self.weight[cell] == 0.0 && weight > 0.0 {
            self.occupied.push(cell);
        }
        self.weight[cell] += weight;
    }

    /// The largest weight of a cell with its 26 neighbours, and the cell's centre.
    fn peak(&self) -> Option<(f64, Point3<f64>)> {
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
        let at = |axis: usize| self.corner[axis] + (index[axis] as f64 + 0.5) * CELL;
        Some((best.0, Point3::new(at(0), at(1), at(2))))
    }
}
