//! The paper's filter written down plainly: what the fast one is compared with. One thread, an array of structs in f64,
//! each projection anew: the nearest centroid by k-d tree, then the exact distance to every triangle that shares a
//! corner with that one.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use palpate_filter::PaperParameters;
use palpate_model::{JointSample, Kinematics, Robot, TriangleMesh};
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::Triangle;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

#[derive(Clone)]
struct Particle {
    link: usize,
    point: Point3<f64>,
    normal: Unit<Vector3<f64>>,
    force: f64,
    stiffness: f64,
    log_weight: f64,
    weight: f64,
}

/// A link's triangles, and what finds the nearest.
pub struct PlainSurface {
    centroids: ImmutableKdTree<f64, 3>,
    corners: Vec<[Point3<f64>; 3]>,
    /// For each triangle, those that share a corner with it, itself included.
    around: Vec<Vec<u32>>,
    area: f64,
}

impl PlainSurface {
    pub fn new(mesh: &TriangleMesh) -> Self {
        let corners: Vec<_> = (0..mesh.triangles.len())
            .map(|index| mesh.corners(index))
            .collect();
        let centroid = |[a, b, c]: &[Point3<f64>; 3]| -> [f64; 3] {
            ((a.coords + b.coords + c.coords) / 3.0).into()
        };
        let centroids: Vec<_> = corners.iter().map(centroid).collect();
        let mut at_vertex = vec![Vec::new(); mesh.vertices.len()];
        for (index, triangle) in (0_u32..).zip(&mesh.triangles) {
            (triangle.iter()).for_each(|&vertex| at_vertex[vertex as usize].push(index));
        }
        let around = mesh.triangles.iter().map(|triangle| {
            let all = triangle.map(|vertex| at_vertex[vertex as usize].clone());
            let mut all = all.concat();
            all.sort_unstable();
            all.dedup();
            all
        });
        Self {
            centroids: ImmutableKdTree::new_from_slice(&centroids).unwrap(),
            around: around.collect(),
            corners,
            area: mesh.area(),
        }
    }

    /// The closest point, m, and the normal there.
    pub fn project(&self, query: &Point3<f64>) -> (Point3<f64>, Unit<Vector3<f64>>) {
        let nearest = (self.centroids.query(&[query.x, query.y, query.z]))
            .nearest_one::<SquaredEuclidean<f64>>()
            .execute();
        let mut best = (f64::INFINITY, *query, 0);
        for &index in &self.around[nearest.item as usize] {
            let [a, b, c] = self.corners[index as usize].map(|corner| corner.coords);
            let triangle = Triangle::new(glam(a), glam(b), glam(c));
            let point = triangle
                .project_local_point(glam(query.coords), false)
                .point;
            let point = Point3::new(point.x, point.y, point.z);
            let squared = (point - query).norm_squared();
            if squared < best.0 {
                best = (squared, point, index);
            }
        }
        (best.1, self.normal(best.2))
    }

    fn normal(&self, triangle: u32) -> Unit<Vector3<f64>> {
        let [a, b, c] = self.corners[triangle as usize];
        Unit::new_normalize((b - a).cross(&(c - a)))
    }
}

fn glam(v: Vector3<f64>) -> parry3d_f64::math::Vector {
    parry3d_f64::math::Vector::new(v.x, v.y, v.z)
}

/// The plain filter; something touches from the first sample on.
pub struct Plain {
    robot: Robot,
    surfaces: Vec<Option<PlainSurface>>,
    parameters: PaperParameters,
    particles: Vec<Particle>,
    count: usize,
    random: Xoshiro256PlusPlus,
    before: Kinematics,
    now: Kinematics,
    position: Vec<f64>,
    travelled: f64,
}

impl Plain {
    pub fn new(robot: &Robot, parameters: PaperParameters, count: usize) -> Self {
        let surface = |link: &palpate_model::Link| {
            let mesh = link.mesh.as_ref().filter(|_| !link.path.is_empty());
            mesh.map(PlainSurface::new)
        };
        Self {
            surfaces: robot.links.iter().map(surface).collect(),
            parameters,
            particles: Vec::new(),
            count,
            random: Xoshiro256PlusPlus::seed_from_u64(1),
            before: Kinematics::new(robot),
            now: Kinematics::new(robot),
            position: Vec::new(),
            travelled: 0.0,
            robot: robot.clone(),
        }
    }

    /// The mean point of the likeliest link, in the root frame.
    pub fn update(&mut self, sample: &JointSample) -> Point3<f64> {
        self.now.update(&self.robot, &sample.position);
        if self.particles.is_empty() {
            self.before = self.now.clone();
            self.position = sample.position.clone();
            self.particles = (0..self.count).map(|_| self.fresh()).collect();
        }
        let moved = self.position.iter().zip(&sample.position);
        self.travelled += moved.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let progress = 1.0 - (-self.travelled / self.parameters.schedule_travel).exp();
        let level = |[first, last]: [f64; 2]| first * (last / first).powf(progress);
        self.propagate(level);
        self.reweight(level(self.parameters.lambda), &sample.external_torque);
        self.normalise();
        let squares: f64 = self.particles.iter().map(|at| at.weight * at.weight).sum();
        if 1.0 / squares < self.parameters.resample_below * self.count as f64 {
            self.resample();
        }
        std::mem::swap(&mut self.before, &mut self.now);
        self.position.copy_from_slice(&sample.position);
        self.estimate()
    }

    fn propagate(&mut self, level: impl Fn([f64; 2]) -> f64) {
        let location = level(self.parameters.location_noise);
        let (force, stiffness) = (
            level(self.parameters.force_noise),
            level(self.parameters.stiffness_noise),
        );
        for particle in &mut self.particles {
            let surface = self.surfaces[particle.link].as_ref().unwrap();
            let random = &mut self.random;
            let mut noise = || random.sample::<f64, _>(StandardNormal);
            let offset = Vector3::new(noise(), noise(), noise()) * location;
            let (of_force, of_stiffness) = (noise() * force, noise() * stiffness);
            let radius = 1e-3 * 1e3_f64.powf(random.random());
            let now_from_before: Isometry3<f64> = (self.now.root_from_link(particle.link))
                .inv_mul(self.before.root_from_link(particle.link));
            let centre = now_from_before * (particle.point + particle.normal.into_inner() * radius);
            let (touch, _) = surface.project(&centre);
            particle.force += (radius - (touch - centre).norm()) * particle.stiffness;
            (particle.point, particle.normal) = surface.project(&(touch + offset));
            particle.force = (particle.force + of_force).max(0.0);
            particle.stiffness *= of_stiffness.exp();
        }
    }

    fn reweight(&mut self, lambda: f64, torque: &[f64]) {
        for particle in &mut self.particles {
            let normal = particle.normal.into_inner();
            let moment = particle.point.coords.cross(&normal);
            let mut left: f64 = torque.iter().map(|torque| torque * torque).sum();
            let screws = self.now.screws_in_link(particle.link);
            let path = &self.robot.links[particle.link].path;
            for (screw, &joint) in screws.column_iter().zip(path) {
                let lever =
                    screw.fixed_rows::<3>(0).dot(&normal) + screw.fixed_rows::<3>(3).dot(&moment);
                let off = torque[joint] + particle.force * lever;
                left += off * off - torque[joint] * torque[joint];
            }
            particle.log_weight -= lambda * left;
        }
    }

    fn normalise(&mut self) {
        let logs = self.particles.iter().map(|particle| particle.log_weight);
        let largest = logs.fold(f64::NEG_INFINITY, f64::max);
        let mut sum = 0.0;
        for particle in &mut self.particles {
            particle.weight = (particle.log_weight - largest).exp();
            sum += particle.weight;
        }
        (self.particles.iter_mut()).for_each(|particle| particle.weight /= sum);
    }

    fn resample(&mut self) {
        let count = self.count as f64;
        let start: f64 = self.random.random();
        let (mut index, mut cumulative) = (0, self.particles[0].weight);
        let mut offspring = Vec::with_capacity(self.count);
        for child in 0..self.count {
            while cumulative < (child as f64 + start) / count && index + 1 < self.count {
                index += 1;
                cumulative += self.particles[index].weight;
            }
            let is_fresh = self.random.random::<f64>() < self.parameters.fresh_share;
            offspring.push(match is_fresh {
                true => self.fresh(),
                false => Particle {
                    log_weight: 0.0,
                    weight: 1.0 / count,
                    ..self.particles[index].clone()
                },
            });
        }
        self.particles = offspring;
    }

    fn fresh(&mut self) -> Particle {
        let area: f64 = (self.surfaces.iter().flatten())
            .map(|surface| surface.area)
            .sum();
        let mut wanted = self.random.random::<f64>() * area;
        let touchable = (0..self.surfaces.len()).filter(|&link| self.surfaces[link].is_some());
        let mut chosen = 0;
        for link in touchable {
            chosen = link;
            wanted -= self.surfaces[link].as_ref().unwrap().area;
            if wanted < 0.0 {
                break;
            }
        }
        let surface = self.surfaces[chosen].as_ref().unwrap();
        // The triangles are about alike.
        let triangle = self.random.random_range(0..surface.corners.len());
        let corner = surface.corners[triangle][0];
        let [low, high] = self.parameters.stiffness_range;
        Particle {
            link: chosen,
            point: corner,
            normal: surface.normal(triangle as u32),
            force: 80.0 * self.random.random::<f64>(),
            stiffness: low * (high / low).powf(self.random.random()),
            log_weight: 0.0,
            weight: 1.0 / self.count as f64,
        }
    }

    fn estimate(&self) -> Point3<f64> {
        let links = self.surfaces.len();
        let (mut weight, mut sum) = (vec![0.0; links], vec![Vector3::zeros(); links]);
        for particle in &self.particles {
            weight[particle.link] += particle.weight;
            sum[particle.link] += particle.point.coords * particle.weight;
        }
        let best = (0..links).max_by(|&a, &b| weight[a].total_cmp(&weight[b]));
        let best = best.unwrap_or_default();
        self.now.root_from_link(best) * Point3::from(sum[best] / weight[best])
    }
}
