//! The arm with obstacle, particles and contact arrows, seen from one side.

use std::fmt::Write as _;

use nalgebra::{Point3, Vector3};
use palpate_filter::CloudPoint;

use super::depth_map::DepthMap;
use super::facet::{Facet, Material};
use super::svg::Svg;
use super::view::View;

/// Shades of each material.
const SHADES: usize = 32;
/// Particles are hidden by what is this much nearer to the viewer, m.
const HIDES: f64 = 0.012;
/// Cells a pixel in which the triangles in front are found.
const FINER: f64 = 3.0;

/// What there is to see.
pub struct Stage<'a> {
    pub arm: &'a [Facet],
    pub obstacle: &'a [Facet],
    pub cloud: &'a [CloudPoint],
    pub arrows: &'a [StageArrow],
}

/// A force: its tip is at the contact.
pub struct StageArrow {
    pub tip_in_root: Point3<f64>,
    /// Direction of the force.
    pub direction: Vector3<f64>,
    pub class: &'static str,
    /// Width of the shaft, px.
    pub width: f64,
}

/// How a stage is drawn: from where, between which corners (px), arrows of which length (px), dots of which diameter
/// (px).
pub struct Frame<'a> {
    pub view: &'a View,
    pub low: [f64; 2],
    pub high: [f64; 2],
    pub arrow_length: f64,
    pub dot: f64,
}

impl Stage<'_> {
    /// Draws it from back to front.
    pub fn draw(&self, svg: &mut Svg, frame: &Frame) {
        let arm_map = depth_map(self.arm, frame);
        let obstacle_map = depth_map(self.obstacle, frame);
        let seen = arm_map.seen(self.arm.len());
        let (mut behind, mut before) = (Vec::new(), Vec::new());
        for (facet, _) in self.arm.iter().zip(&seen).filter(|(_, seen)| **seen) {
            let [x, y, near] = frame.view.project(&facet.centre());
            let hidden = obstacle_map.nearness([x, y]).is_none_or(|o| o > near);
            if hidden { &mut behind } else { &mut before }.push(facet);
        }
        let obstacle_seen = obstacle_map.seen(self.obstacle.len());
        let obstacle = (self.obstacle.iter().zip(&obstacle_seen))
            .filter(|(_, seen)| **seen)
            .map(|(facet, _)| facet);
        draw_facets(svg, frame.view, behind);
        svg.add(r#"<g opacity=".62">"#);
        draw_facets(svg, frame.view, obstacle.collect());
        svg.add("</g>");
        draw_facets(svg, frame.view, before);
        self.draw_cloud(svg, frame, &arm_map);
        for arrow in self.arrows {
            arrow.draw(svg, frame);
        }
    }

    fn draw_cloud(&self, svg: &mut Svg, frame: &Frame, arm_map: &DepthMap) {
        const MOST: usize = 2500;
        let inside = |[x, y]: [f64; 2]| {
            (frame.low[0]..frame.high[0]).contains(&x) && (frame.low[1]..frame.high[1]).contains(&y)
        };
        let stride = self.cloud.len().div_ceil(MOST).max(1);
        let shown = self.cloud.iter().step_by(stride).filter_map(|point| {
            let [x, y, near] = frame.view.project(&point.point_in_root);
            let open = arm_map
                .nearness([x, y])
                .is_none_or(|arm| arm < near + HIDES);
            (open && inside([x, y])).then_some(([x, y], point.weight))
        });
        dots_by_weight(svg, shown.collect(), heaviest(self.cloud), frame.dot);
    }
}

/// The largest weight of a cloud.
pub fn heaviest(cloud: &[CloudPoint]) -> f64 {
    cloud.iter().map(|point| point.weight).fold(0.0, f64::max)
}

/// Draws dots from red for no weight to green for `most`, the heavier over the lighter.
pub fn dots_by_weight(svg: &mut Svg, dots: Vec<([f64; 2], f64)>, most: f64, diameter: f64) {
    const STEPS: usize = 12;
    let step = |weight: f64| {
        let share = if most > 0.0 { weight / most } else { 1.0 };
        ((share * STEPS as f64) as usize).min(STEPS - 1)
    };
    for wanted in 0..STEPS {
        let of_step = dots.iter().filter(|(_, weight)| step(*weight) == wanted);
        let colour = weight_colour(wanted as f64 / (STEPS - 1) as f64);
        svg.dots(of_step.map(|(place, _)| *place), diameter, &colour);
    }
}

/// Red at 0 over yellow to green at 1.
pub fn weight_colour(share: f64) -> String {
    let (low, high, part) = if share < 0.5 {
        ([205, 45, 45], [240, 185, 50], share * 2.0)
    } else {
        ([240, 185, 50], [25, 150, 70], share * 2.0 - 1.0)
    };
    mixed(low, high, part)
}

fn mixed(low: [u8; 3], high: [u8; 3], part: f64) -> String {
    let mix = |axis: usize| f64::from(low[axis]) * (1.0 - part) + f64::from(high[axis]) * part;
    format!(
        "#{:02x}{:02x}{:02x}",
        mix(0) as u8,
        mix(1) as u8,
        mix(2) as u8
    )
}

impl StageArrow {
    fn draw(&self, svg: &mut Svg, frame: &Frame) {
        let tip = frame.view.place(&self.tip_in_root);
        let ahead = frame.view.place(&(self.tip_in_root + self.direction));
        let along = [ahead[0] - tip[0], ahead[1] - tip[1]];
        let norm = along[0].hypot(along[1]).max(1e-9);
        // As long as its direction is seen.
        let seen = (norm / frame.view.scale).clamp(0.35, 1.0);
        let unit = [along[0] / norm, along[1] / norm];
        let back = |length: f64, side: f64| {
            [
                tip[0] - unit[0] * length - unit[1] * side,
                tip[1] - unit[1] * length + unit[0] * side,
            ]
        };
        let (half, length) = (0.5 * self.width, frame.arrow_length * seen);
        let (head, wing) = (self.width * 2.4, self.width * 1.35);
        let outline = [
            back(length, half),
            back(head, half),
            back(head, wing),
            tip,
            back(head, -wing),
            back(head, -half),
            back(length, -half),
        ];
        let points: Vec<_> = outline
            .iter()
            .map(|[x, y]| format!("{x:.1} {y:.1}"))
            .collect();
        svg.add(format_args!(
            r#"<path class="{}" d="M{}z"/>"#,
            self.class,
            points.join("L")
        ));
    }
}

/// Triangles that face the viewer, within the frame.
fn depth_map(facets: &[Facet], frame: &Frame) -> DepthMap {
    let mut map = DepthMap::new(frame.low, frame.high, FINER);
    for (number, facet) in facets.iter().enumerate() {
        if facet.faces(&frame.view.out) {
            let corners = facet.corners.map(|corner| frame.view.project(&corner));
            map.draw(&corners, number as u32);
        }
    }
    map
}

/// Draws triangles from back to front, in whole tenths of pixels and each with a hairline, so that no seams show.
fn draw_facets(svg: &mut Svg, view: &View, mut facets: Vec<&Facet>) {
    let nearness = |facet: &Facet| view.project(&facet.centre())[2];
    facets.sort_by(|a, b| nearness(a).total_cmp(&nearness(b)));
    let (mut class, mut path) = (String::new(), String::new());
    svg.add(r#"<g transform="scale(.1)" class="facets">"#);
    let flush = |svg: &mut Svg, class: &str, path: &mut String| {
        if !path.is_empty() {
            svg.add(format_args!(r#"<path class="{class}" d="{path}"/>"#));
            path.clear();
        }
    };
    for facet in facets {
        let brightness = view.brightness(&facet.mean_normal());
        let shade = (brightness * (SHADES - 1) as f64).round() as usize;
        let this = format!("{}{shade}", letter(facet.material));
        if this != class {
            flush(svg, &class, &mut path);
            class = this;
        }
        let [a, b, c] = facet.corners.map(|corner| {
            let [x, y] = view.place(&corner);
            [(10.0 * x).round() as i64, (10.0 * y).round() as i64]
        });
        // Writing to a String cannot fail.
        let _ = write!(
            path,
            "M{} {}l{} {} {} {}z",
            a[0],
            a[1],
            b[0] - a[0],
            b[1] - a[1],
            c[0] - b[0],
            c[1] - b[1]
        );
    }
    flush(svg, &class, &mut path);
    svg.add("</g>");
}

fn letter(material: Material) -> char {
    match material {
        Material::Arm => 'a',
        Material::TouchedLink => 't',
        Material::Obstacle => 'o',
    }
}

/// Styles of all shades.
pub fn shades() -> String {
    let materials = [
        (Material::Arm, [52, 54, 60], [250, 249, 246]),
        (Material::TouchedLink, [24, 58, 92], [206, 229, 250]),
        (Material::Obstacle, [104, 62, 8], [255, 205, 120]),
    ];
    let mut style = ".facets{stroke-width:7;stroke-linejoin:round}".to_owned();
    for (material, dark, bright) in materials {
        for shade in 0..SHADES {
            let colour = mixed(dark, bright, shade as f64 / (SHADES - 1) as f64);
            let _ = write!(
                style,
                ".{}{shade}{{fill:{colour};stroke:{colour}}}",
                letter(material)
            );
        }
    }
    style
}
