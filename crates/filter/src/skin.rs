//! What can be touched: the surfaces of all links whose contacts the joints can feel.

use palpate_model::{Robot, SmoothBody, Surface, SurfacePoint};

/// The robot's touchable surfaces.
pub(crate) struct Skin {
    surfaces: Vec<Option<Surface>>,
    /// The smooth bodies that they may stand for, where these were asked for.
    bodies: Vec<Option<SmoothBody>>,
    links: Vec<usize>,
    /// Area of the touchable links up to and with each one, m².
    cumulative_area: Vec<f64>,
}

impl Skin {
    /// The surfaces of every link that has a mesh and at least one movable joint on its path. None if no link has.
    pub(crate) fn new(robot: &Robot) -> Option<Self> {
        let surface = |link: &palpate_model::Link| match link.path.is_empty() {
            true => None,
            false => link.mesh.as_ref().and_then(Surface::new),
        };
        let surfaces: Vec<_> = robot.links.iter().map(surface).collect();
        let links: Vec<_> = (0..surfaces.len())
            .filter(|&link| surfaces[link].is_some())
            .collect();
        let mut total = 0.0;
        let cumulative_area = (surfaces.iter().flatten())
            .map(|surface| {
                total += surface.area();
                total
            })
            .collect();
        (!links.is_empty()).then_some(Self {
            bodies: Vec::new(),
            surfaces,
            links,
            cumulative_area,
        })
    }

    /// Adds the smooth bodies that the links' meshes may stand for.
    pub(crate) fn with_bodies(mut self, robot: &Robot) -> Self {
        let body = |(link, own): (&palpate_model::Link, &Option<Surface>)| {
            let mesh = link.mesh.as_ref().filter(|_| own.is_some())?;
            Some(SmoothBody::new(mesh))
        };
        let pairs = robot.links.iter().zip(&self.surfaces);
        self.bodies = pairs.map(body).collect();
        self
    }

    /// The smooth body of a link; none unless they were asked for.
    pub(crate) fn body(&self, link: usize) -> Option<&SmoothBody> {
        self.bodies.get(link)?.as_ref()
    }

    /// Indices of the touchable links.
    pub(crate) fn links(&self) -> &[usize] {
        &self.links
    }

    /// The surface of a link; none where it cannot be touched.
    pub(crate) fn get(&self, link: usize) -> Option<&Surface> {
        self.surfaces[link].as_ref()
    }

    /// The surface of a touchable link.
    pub(crate) fn surface(&self, link: usize) -> &Surface {
        self.surfaces[link]
            .as_ref()
            .expect("particles live on touchable links only")
    }

    /// Area of all touchable links, m².
    pub(crate) fn area(&self) -> f64 {
        self.cumulative_area.last().copied().unwrap_or(0.0)
    }

    /// A link and a point on it, uniform over the area of all touchable links, for four uniform numbers in \[0, 1).
    pub(crate) fn sample(&self, uniform: [f64; 4]) -> (usize, SurfacePoint) {
        let wanted = uniform[0] * self.area();
        let index = self.cumulative_area.partition_point(|&area| area <= wanted);
        let link = self.links[index.min(self.links.len() - 1)];
        (
            link,
            self.surface(link)
                .sample([uniform[1], uniform[2], uniform[3]]),
        )
    }
}
