//! The picture of a run: the arm with particles and contact, the particles' forces, and the error over time.

mod arm;
mod axes;
mod charts;
mod depth_map;
mod facet;
mod stage;
pub mod svg;
mod view;

use palpate_filter::{CloudPoint, ContactStatus, Mode};
use palpate_model::{Kinematics, Robot};
use palpate_sim::{Obstacle, TrueContact};

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
/// The charts' left and right edge, px.
const CHARTS: [f64; 2] = [748.0, 1330.0];
/// Radius of a lens, px.
const LENS: f64 = 88.0;

const STYLE: &str = "text{font-family:'Helvetica Neue',Helvetica,Arial,sans-serif;fill:#24292f}\
.title{font-size:25px;font-weight:600}.subtitle{font-size:15px;fill:#57606a}\
.head{font-size:16px;font-weight:600}.label{font-size:13px}.small{font-size:12px;fill:#57606a}\
.grid{stroke:#e4e7eb;stroke-width:1;fill:none}.frame{fill:none;stroke:#8c959f;stroke-width:1}\
.floor{stroke:#d5dae0;stroke-width:1;fill:none}.dots{fill:none;stroke-linecap:round;opacity:.8}\
.true-arrow{fill:#111827;stroke:#fff;stroke-width:1.2}\
.estimated-arrow{fill:#1f6feb;stroke:#fff;stroke-width:1.2}\
.truth-line{stroke:#111827;stroke-width:1;stroke-dasharray:4 3;fill:none}\
.truth-ring{fill:none;stroke:#111827;stroke-width:2}\
.rim{fill:none;stroke:#57606a;stroke-width:1.2}\
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
        let view = arm::draw_arm(&mut svg, self, self.moments.last()?);
        self.draw_moments(&mut svg, &view);
        let [left, right] = CHARTS;
        svg.text([left, 562.0], Anchor::Start, "head", "Over time");
        charts::errors(&mut svg, self.history, [left, 576.0], [right - left, 146.0]);
        draw_legend(&mut svg);
        Some(svg.finish(WIDTH, HEIGHT, &(STYLE.to_owned() + &stage::shades())))
    }

    /// Draws a lens and, below it, a chart of the forces for each moment.
    fn draw_moments(&self, svg: &mut Svg, view: &View) {
        let [left, right] = CHARTS;
        let columns = charts::columns(self.moments.len(), left, right - left);
        for (moment, (left, width)) in self.moments.iter().zip(&columns) {
            let at = [left + 0.5 * width, 136.0 + LENS];
            let title = format!("after {:.2} s", moment.secs);
            svg.text([at[0], 122.0], Anchor::Middle, "head", &title);
            arm::draw_lens(svg, self, moment, view, at, LENS);
        }
        charts::forces(svg, self.moments, &columns, 350.0, 140.0);
    }
}

fn draw_legend(svg: &mut Svg) {
    let y = HEIGHT - 26.0;
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
        x += 54.0 + 7.4 * name.len() as f64;
    }
    for (class, name) in [("o22", "obstacle"), ("t22", "touched link")] {
        svg.add(format_args!(
            r#"<rect class="{class}" x="{x:.1}" y="{:.1}" width="14" height="12" rx="2"/>"#,
            y - 10.5
        ));
        svg.text([x + 20.0, y], Anchor::Start, "label", name);
        x += 38.0 + 7.4 * name.len() as f64;
    }
    svg.text([x, y], Anchor::Start, "label", "particles by weight");
    x += 140.0;
    for step in 0..12 {
        let colour = stage::weight_colour(f64::from(step) / 11.0);
        let place = [x + 9.0 * f64::from(step), y - 4.5];
        svg.dots(std::iter::once(place), 7.0, &colour);
    }
}
