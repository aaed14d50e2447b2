//! The arm with its contact: whole, and large around the contact.

use nalgebra::{Point3, Vector3};
use palpate_sim::{Obstacle, ObstacleKind};

use super::facet::{self, Facet};
use super::stage::{Frame, Stage, StageArrow};
use super::svg::{Anchor, Svg};
use super::view::View;
use super::{Moment, Picture};

/// Where the arm may be, px.
const LOW: [f64; 2] = [70.0, 110.0];
const HIGH: [f64; 2] = [630.0, 720.0];
/// What a lens shows about the contact, m.
const LENS_REACH: f64 = 0.06;

/// Draws the whole arm at a moment; returns the view.
pub fn draw_arm(svg: &mut Svg, picture: &Picture, moment: &Moment) -> View {
    let props = Props::new(picture, moment);
    let view = best_view(&props, best_slant(picture.obstacle));
    let frame = Frame {
        view: &view,
        low: [0.0, LOW[1] - 24.0],
        high: [HIGH[0] + 40.0, HIGH[1] + 20.0],
        arrow_length: 84.0,
        dot: 2.6,
    };
    let clip = format!(
        r#"<rect x="0" y="{}" width="{}" height="{}"/>"#,
        frame.low[1],
        frame.high[0],
        frame.high[1] - frame.low[1]
    );
    clipped(svg, "arm", &clip, |svg| {
        draw_floor(svg, &view);
        props.stage(moment).draw(svg, &frame);
    });
    let [x, y] = view.place(&props.contact);
    let radius = LENS_REACH * view.scale;
    svg.add(format_args!(
        r#"<circle class="rim" cx="{x:.1}" cy="{y:.1}" r="{radius:.1}"/>"#
    ));
    draw_scale_bar(svg, &view, 0.2, [HIGH[0], HIGH[1] + 22.0]);
    view
}

/// Draws what is around the contact in a circle, px, seen as the whole arm is.
pub fn draw_lens(
    svg: &mut Svg,
    picture: &Picture,
    moment: &Moment,
    view: &View,
    [x, y]: [f64; 2],
    radius: f64,
) {
    let mut props = Props::new(picture, moment);
    let contact = props.contact;
    props
        .arm
        .retain(|facet| (facet.centre() - contact).norm() < 4.0 * LENS_REACH);
    props.arm = props.arm.iter().flat_map(Facet::quarters).collect();
    let view = view.zoomed(contact, [x, y], radius / LENS_REACH);
    let frame = Frame {
        view: &view,
        low: [x - radius, y - radius],
        high: [x + radius, y + radius],
        arrow_length: 0.62 * radius,
        dot: 3.0,
    };
    let circle = format!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius:.1}"/>"#);
    let id = format!("lens{x:.0}");
    clipped(svg, &id, &circle, |svg| {
        props.stage(moment).draw(svg, &frame)
    });
    svg.add(circle.replace("<circle", r#"<circle class="rim""#));
    draw_scale_bar(svg, &view, 0.02, [x + radius, y + radius + 1.0]);
}

fn clipped(svg: &mut Svg, id: &str, shape: &str, draw: impl FnOnce(&mut Svg)) {
    svg.add(format_args!(r#"<clipPath id="{id}">{shape}</clipPath>"#));
    svg.add(format_args!(r#"<g clip-path="url(#{id})">"#));
    draw(svg);
    svg.add("</g>");
}

/// What stands on the stage at a moment.
struct Props {
    arm: Vec<Facet>,
    obstacle: Vec<Facet>,
    arrows: Vec<StageArrow>,
    contact: Point3<f64>,
    /// Outward normal of the arm at the contact.
    normal: Vector3<f64>,
}

impl Props {
    fn new(picture: &Picture, moment: &Moment) -> Self {
        let (contact, normal) = contact_of(moment);
        Self {
            arm: facet::of_arm(picture.robot, &moment.kinematics, picture.touched),
            obstacle: facet::of_obstacle(picture.obstacle, &contact),
            arrows: arrows_of(moment),
            contact,
            normal,
        }
    }

    fn stage<'a>(&'a self, moment: &'a Moment) -> Stage<'a> {
        Stage {
            arm: &self.arm,
            obstacle: &self.obstacle,
            cloud: &moment.cloud,
            arrows: &self.arrows,
        }
    }
}

/// Point and outward normal of the contact: the true one, else the estimated one, else any.
fn contact_of(moment: &Moment) -> (Point3<f64>, Vector3<f64>) {
    match (&moment.truth, &moment.best) {
        (Some(truth), _) => (truth.point_in_root, truth.normal_in_root.into_inner()),
        (None, Some(best)) => (best.point_in_root, best.normal_in_root.into_inner()),
        (None, None) => (Point3::new(0.0, 0.0, 0.5), Vector3::x()),
    }
}

fn arrows_of(moment: &Moment) -> Vec<StageArrow> {
    let arrow = |tip_in_root, force: &Vector3<f64>, class, width| StageArrow {
        tip_in_root,
        direction: force.try_normalize(1e-9).unwrap_or_else(Vector3::z),
        class,
        width,
    };
    let truth = moment.truth.as_ref();
    let truth = truth.map(|t| arrow(t.point_in_root, &t.force_in_root, "true-arrow", 10.0));
    let best = moment.best.as_ref();
    let best = best.map(|m| arrow(m.point_in_root, &m.force_in_root, "estimated-arrow", 5.0));
    truth.into_iter().chain(best).collect()
}

/// The best cosine between view and normal: the place is still seen, the obstacle is beside it, and the arrow long. A plane
/// is looked at from the arm's side, as it would hide everything from the other.
fn best_slant(obstacle: &Obstacle) -> f64 {
    match obstacle.kind {
        ObstacleKind::Plane {} => -0.15,
        _ => 0.35,
    }
}

/// The view that shows the contact from the side, with as little before it as can be.
fn best_view(props: &Props, best_slant: f64) -> View {
    let (arm, point, normal) = (&props.arm, &props.contact, &props.normal);
    let facing = normal.y.atan2(normal.x);
    let candidates = [0.14, 0.3].into_iter().flat_map(|elevation| {
        (-15..=15).map(move |step| View::from(facing + 0.2 * f64::from(step), elevation))
    });
    let cost = |view: &View| {
        // One pixel a millimetre.
        let view = view.zoomed(*point, [0.0; 2], 1000.0);
        let before = |facet: &&Facet| {
            let [x, y, near] = view.project(&facet.centre());
            facet.faces(&view.out) && near > 0.015 && x.hypot(y) < 15.0
        };
        let hidden = arm.iter().filter(before).count().min(20) as f64;
        let slant = normal.dot(&view.out);
        hidden + 20.0 * (slant - best_slant).abs()
    };
    let best = candidates.min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let tail = point + normal * 0.2;
    let corners = arm.iter().flat_map(|facet| facet.corners);
    let corners: Vec<_> = corners.chain([tail]).collect();
    let view = best.unwrap_or_else(|| View::from(0.0, 0.3));
    view.fitted(&corners, LOW, HIGH)
}

/// Draws a grid on the floor, 10 cm wide, about the base.
fn draw_floor(svg: &mut Svg, view: &View) {
    const REACH: f64 = 0.4;
    for step in -4..=4 {
        let side = 0.1 * f64::from(step);
        // Within a circle.
        let half = (REACH * REACH - side * side).max(0.0).sqrt();
        let place = |x: f64, y: f64| view.place(&Point3::new(x, y, 0.0));
        svg.line(place(side, -half), place(side, half), "floor");
        svg.line(place(-half, side), place(half, side), "floor");
    }
}

/// Draws a bar of a length in metres that ends at `right`, px.
fn draw_scale_bar(svg: &mut Svg, view: &View, length: f64, [right, y]: [f64; 2]) {
    let left = right - length * view.scale;
    svg.line([left, y], [right, y], "bar");
    for x in [left, right] {
        svg.line([x, y - 4.0], [x, y + 4.0], "bar");
    }
    let name = format!("{:.0} mm", 1e3 * length);
    svg.text(
        [0.5 * (left + right), y - 7.0],
        Anchor::Middle,
        "small",
        &name,
    );
}
