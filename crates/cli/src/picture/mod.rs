//! The picture of a run: the arm with particles and contact, the particles' forces, and the error over time.

mod axes;
mod charts;
mod depth_map;
mod facet;
mod stage;
mod svg;
mod view;

use nalgebra::{Point3, Vector3};
use palpate_filter::{CloudPoint, ContactStatus, Mode};
use palpate_model::{Kinematics, Robot};
use palpate_sim::{Obstacle, TrueContact};

use facet::Facet;
use stage::{Frame, Stage, StageArrow};
use svg::{Anchor, Svg};
use view::View;

/// What a picture tells.
pub struct Picture<'a> {
    pub title: String,
    pub subtitle: String,
    pub robot: &'a Robot,
    /// Index of the link that is touched.
    pub touched: usize,
    pub obstacle: &'a Obstacle,
    /// Moments of the run, of which the last one shows the arm.
    pub moments: &'a [Moment],
    pub history: &'a [Instant],
}

/// All that is known at one moment.
pub struct Moment {
    /// Time from the start, s.
    pub secs: f64,
    pub kinematics: Kinematics,
    pub cloud: Vec<CloudPoint>,
    pub best: Option<Mode>,
    pub truth: Option<TrueContact>,
}

/// How well the contact is known at one instant.
pub struct Instant {
    /// Time from the start, s.
    pub secs: f64,
    pub status: ContactStatus,
    /// Distance from the estimated to the true contact, m; none where there is not both.
    pub error: Option<f64>,
    /// Standard deviation of the estimate, m.
    pub std: Option<f64>,
    pub right_link: bool,
}

const WIDTH: f64 = 1360.0;
const HEIGHT: f64 = 800.0;
/// Where the arm may be, px.
const ARM_LOW: [f64; 2] = [30.0, 100.0];
const ARM_HIGH: [f64; 2] = [640.0, 720.0];
/// The charts' left and right edge, px.
const CHARTS: [f64; 2] = [748.0, 1330.0];
/// Radius of the magnifier in the picture, px, and on the arm, m.
const LENS: f64 = 128.0;
const LENS_REACH: f64 = 0.07;

const STYLE: &str = "text{font-family:'Helvetica Neue',Helvetica,Arial,sans-serif;fill:#24292f}\
.title{font-size:25px;font-weight:600}.subtitle{font-size:15px;fill:#57606a}\
.head{font-size:16px;font-weight:600}.label{font-size:13px}.small{font-size:12px;fill:#57606a}\
.grid{stroke:#e4e7eb;stroke-width:1;fill:none}.frame{fill:none;stroke:#8c959f;stroke-width:1}\
.floor{stroke:#d5dae0;stroke-width:1;fill:none}.dots{fill:none;stroke-linecap:round;opacity:.8}\
.true-arrow{fill:#111827;stroke:#fff;stroke-width:1.2}\
.estimated-arrow{fill:#1f6feb;stroke:#fff;stroke-width:1.2}\
.truth-line{stroke:#111827;stroke-width:1;stroke-dasharray:4 3;fill:none}\
.truth-ring{fill:none;stroke:#111827;stroke-width:2}\
.lens{fill:#fff;stroke:#57606a;stroke-width:1.5}.lens-rim{fill:none;stroke:#57606a;stroke-width:1.5}\
.bar{stroke:#24292f;stroke-width:2;fill:none}\
.error{stroke:#1f6feb;stroke-width:2;fill:none}.wrong{stroke:#cf222e;stroke-width:2;fill:none}\
.std{stroke:#8c959f;stroke-width:1.5;stroke-dasharray:5 3;fill:none}\
.none{fill:#d0d7de}.ambiguous{fill:#e8a33d}.located{fill:#2da44e}";

impl Picture<'_> {
    /// The picture as SVG; none without a moment to show.
    pub fn draw(&self) -> Option<String> {
        let mut svg = Svg::default();
        svg.add(format_args!(
            r##"<rect width="{WIDTH}" height="{HEIGHT}" rx="8" fill="#fff"/>"##
        ));
        svg.text([30.0, 44.0], Anchor::Start, "title", &self.title);
        svg.text([30.0, 70.0], Anchor::Start, "subtitle", &self.subtitle);
        self.draw_arm(&mut svg, self.moments.last()?);
        let [left, right] = CHARTS;
        let head = "Particles: force against distance to the base";
        svg.text([left, 112.0], Anchor::Start, "head", head);
        charts::forces(&mut svg, self.moments, [left, 146.0], [right - left, 220.0]);
        svg.text([left, 446.0], Anchor::Start, "head", "Error over time");
        charts::errors(&mut svg, self.history, [left, 462.0], [right - left, 250.0]);
        Some(svg.finish(WIDTH, HEIGHT, &(STYLE.to_owned() + &stage::shades())))
    }

    fn draw_arm(&self, svg: &mut Svg, moment: &Moment) {
        let arm = facet::of_arm(self.robot, &moment.kinematics, self.touched);
        let contact = contact_of(moment);
        let obstacle = facet::of_obstacle(self.obstacle, &contact.0);
        let view = best_view(&arm, &obstacle, &contact);
        let arrows = arrows_of(moment);
        let stage = Stage {
            arm: &arm,
            obstacle: &obstacle,
            cloud: &moment.cloud,
            arrows: &arrows,
        };
        draw_floor(svg, &view);
        let clip = format!(
            r#"<clipPath id="arm"><rect x="0" y="{}" width="{}" height="{}"/></clipPath>"#,
            ARM_LOW[1] - 14.0,
            ARM_HIGH[0] + 30.0,
            ARM_HIGH[1] - ARM_LOW[1] + 24.0
        );
        svg.add(clip);
        svg.add(r#"<g clip-path="url(#arm)">"#);
        let frame = Frame {
            view: &view,
            low: [0.0, ARM_LOW[1] - 14.0],
            high: [ARM_HIGH[0] + 30.0, ARM_HIGH[1] + 10.0],
            arrow_length: 84.0,
            dot: 2.6,
        };
        stage.draw(svg, &frame);
        svg.add("</g>");
        draw_scale_bar(svg, &view, 0.2, [ARM_HIGH[0] - 20.0, ARM_HIGH[1] + 2.0]);
        self.draw_lens(svg, &stage, &view, &contact.0);
        draw_legend(svg);
    }

    /// Draws what is around the contact once more, larger.
    fn draw_lens(&self, svg: &mut Svg, stage: &Stage, view: &View, contact: &Point3<f64>) {
        let on_arm = view.place(contact);
        let at = lens_corner(stage.arm, view, on_arm);
        let radius = LENS_REACH * view.scale;
        svg.add(format_args!(
            r#"<circle class="lens-rim" cx="{:.1}" cy="{:.1}" r="{radius:.1}"/>"#,
            on_arm[0], on_arm[1]
        ));
        for [from, to] in tangents(on_arm, radius, at, LENS) {
            svg.line(from, to, "lens-rim");
        }
        let [x, y] = at;
        let circle = format!(r#"cx="{x:.1}" cy="{y:.1}" r="{LENS}""#);
        svg.add(format_args!(r#"<circle class="lens" {circle}/>"#));
        svg.add(format_args!(
            r#"<clipPath id="lens"><circle {circle}/></clipPath>"#
        ));
        svg.add(r#"<g clip-path="url(#lens)">"#);
        let zoomed = view.zoomed(*contact, at, LENS / LENS_REACH);
        let frame = Frame {
            view: &zoomed,
            low: [x - LENS, y - LENS],
            high: [x + LENS, y + LENS],
            arrow_length: 96.0,
            dot: 3.6,
        };
        let fine: Vec<_> = (stage.arm.iter())
            .filter(|facet| (facet.centre() - contact).norm() < 4.0 * LENS_REACH)
            .flat_map(Facet::quarters)
            .collect();
        Stage {
            arm: &fine,
            ..*stage
        }
        .draw(svg, &frame);
        svg.add("</g>");
        svg.add(format_args!(r#"<circle class="lens-rim" {circle}/>"#));
        draw_scale_bar(svg, &zoomed, 0.02, [x + 26.0, y + LENS - 22.0]);
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

/// The view that shows the contact from the side, with as little before it as can be.
fn best_view(
    arm: &[Facet],
    obstacle: &[Facet],
    (point, normal): &(Point3<f64>, Vector3<f64>),
) -> View {
    let facing = normal.y.atan2(normal.x);
    let candidates = [0.14, 0.3].into_iter().flat_map(|elevation| {
        (-8..=8).map(move |step| View::from(facing + 0.2 * f64::from(step), elevation))
    });
    let outwards = point + normal * 0.004;
    let cost = |view: &View| {
        let view = view.zoomed(*point, [100.0, 100.0], 200.0);
        let hides = |facet: &&Facet| {
            let [x, y, near] = view.project(&facet.centre());
            facet.faces(&view.out) && near > 0.02 && (x - 100.0).hypot(y - 100.0) < 9.0
        };
        let hidden = arm.iter().filter(hides).count().min(20) as f64;
        let covered = obstacle.iter().filter(hides).count().min(4) as f64;
        let [_, _, near] = view.project(&outwards);
        // Best at sixty degrees from the normal: the place is seen, and the arrow is long.
        hidden + 0.3 * covered + 8.0 * (near / 0.004 - 0.45).abs()
    };
    let best = candidates.min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let corners: Vec<_> = arm.iter().flat_map(|facet| facet.corners).collect();
    let view = best.unwrap_or_else(|| View::from(0.0, 0.3));
    view.fitted(&corners, [ARM_LOW[0] + 40.0, ARM_LOW[1] + 10.0], ARM_HIGH)
}

/// Where the lens covers the least of the arm.
fn lens_corner(arm: &[Facet], view: &View, on_arm: [f64; 2]) -> [f64; 2] {
    let (x, y) = (
        [ARM_LOW[0] + LENS, ARM_HIGH[0] - LENS + 20.0],
        [ARM_LOW[1] + LENS, 400.0, ARM_HIGH[1] - LENS - 40.0],
    );
    let corners = y.into_iter().flat_map(|y| x.map(|x| [x, y]));
    let covered = |corner: &[f64; 2]| {
        let inside =
            |place: [f64; 2]| (place[0] - corner[0]).hypot(place[1] - corner[1]) < LENS + 10.0;
        let hidden = arm
            .iter()
            .filter(|facet| inside(view.place(&facet.centre())))
            .count();
        let near = (on_arm[0] - corner[0]).hypot(on_arm[1] - corner[1]);
        hidden as f64 + near / 20.0 + if near < LENS + 60.0 { 1e6 } else { 0.0 }
    };
    let best = corners.min_by(|a, b| covered(a).total_cmp(&covered(b)));
    best.unwrap_or([ARM_HIGH[0], ARM_LOW[1]])
}

/// The two outer tangents of two circles.
fn tangents(a: [f64; 2], a_radius: f64, b: [f64; 2], b_radius: f64) -> [[[f64; 2]; 2]; 2] {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let apart = dx.hypot(dy).max(1e-9);
    let heading = dy.atan2(dx);
    let open = ((a_radius - b_radius) / apart).clamp(-1.0, 1.0).acos();
    [heading + open, heading - open].map(|angle| {
        let (sin, cos) = angle.sin_cos();
        [(a, a_radius), (b, b_radius)].map(|(c, r)| [c[0] + r * cos, c[1] + r * sin])
    })
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

fn draw_legend(svg: &mut Svg) {
    let y = HEIGHT - 30.0;
    let mut x = 30.0;
    for (class, name) in [
        ("true-arrow", "true force"),
        ("estimated-arrow", "estimated force"),
    ] {
        svg.add(format_args!(
            r#"<path class="{class}" d="M{x:.1} {:.1}h18v-4.5l14 7.5-14 7.5v-4.5h-18z"/>"#,
            y - 7.5
        ));
        svg.text([x + 38.0, y], Anchor::Start, "label", name);
        x += 52.0 + 7.0 * name.len() as f64;
    }
    for (class, name) in [("o22", "obstacle"), ("t22", "touched link")] {
        svg.add(format_args!(
            r#"<rect class="{class}" x="{x:.1}" y="{:.1}" width="14" height="12" rx="2"/>"#,
            y - 10.5
        ));
        svg.text([x + 20.0, y], Anchor::Start, "label", name);
        x += 38.0 + 7.0 * name.len() as f64;
    }
    svg.text([x, y], Anchor::Start, "label", "particles, by weight: 0");
    x += 145.0;
    for step in 0..12 {
        let colour = stage::weight_colour(f64::from(step) / 11.0);
        let place = [x + 9.0 * f64::from(step), y - 4.5];
        svg.dots(std::iter::once(place), 7.0, &colour);
    }
    svg.text([x + 110.0, y], Anchor::Start, "label", "most");
}
