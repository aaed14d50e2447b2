//! Plots of experiments, as SVG.

mod courses;
mod errors;
mod panel;
mod shares;

use super::campaign::Campaign;
use super::condition;
use super::estimator::Estimator;
use super::experiment::{Experiment, View};
use super::trial::Cell;
use crate::picture::svg::{Anchor, Svg};
pub use panel::{Panel, Scale};

/// Width of a plot, px.
pub const WIDTH: f64 = 1000.0;
/// Left and right edge of its panels, px.
pub const LEFT: f64 = 84.0;
pub const RIGHT: f64 = 970.0;
/// Lower edge of the title, px.
pub const TOP: f64 = 66.0;

/// Height of what is above a panel and of what is below it, px.
pub const HEAD: f64 = 48.0;
pub const FOOT: f64 = 56.0;

pub const STYLE: &str = "text{font-family:'Helvetica Neue',Helvetica,Arial,sans-serif;fill:#24292f}\
.title{font-size:20px;font-weight:600}.subtitle{font-size:14px;fill:#57606a}\
.head{font-size:15px;font-weight:600}.label{font-size:13px}.small{font-size:12px;fill:#57606a}\
.grid{stroke:#e4e7eb;stroke-width:1;fill:none}.frame{fill:none;stroke:#8c959f;stroke-width:1}\
.mark{stroke:#24292f;stroke-width:1.2;stroke-dasharray:5 4;fill:none}\
.dots{fill:none;stroke-linecap:round;opacity:.45}";

/// The plots of an experiment with their names.
pub fn of_experiment(
    campaign: &Campaign,
    experiment: &Experiment,
    links: &[usize],
    estimators: &[Estimator],
) -> Vec<(String, String)> {
    let data = Data {
        campaign,
        experiment,
        links,
        estimators,
    };
    let name = experiment.name.to_owned();
    match experiment.view {
        View::Error => vec![(name, errors::draw(&data))],
        View::Convergence => vec![(name, courses::draw(&data))],
        View::Calibration => vec![(name, shares::draw_calibration(&data))],
        View::RightLink => vec![(name, shares::draw_right_link(&data))],
        View::Progress | View::Targets => Vec::new(),
    }
}

/// What a plot shows.
struct Data<'a> {
    campaign: &'a Campaign,
    experiment: &'a Experiment,
    links: &'a [usize],
    estimators: &'a [Estimator],
}

impl Data<'_> {
    /// Draws title and panels, one below the other, each of `height` px with its room.
    fn draw(
        &self,
        subtitle: &str,
        panels: usize,
        height: f64,
        draw: impl Fn(&mut Svg, usize, [f64; 2]),
    ) -> String {
        let total = TOP + panels as f64 * height + 10.0;
        let mut svg = Svg::default();
        svg.add(format_args!(
            r##"<rect width="{WIDTH}" height="{total}" fill="#fff"/>"##
        ));
        svg.text([24.0, 32.0], Anchor::Start, "title", self.experiment.title);
        let trials = self.campaign.setup.trials;
        let told = format!("{subtitle}; {trials} trials a link, method and condition");
        svg.text([24.0, 54.0], Anchor::Start, "subtitle", &told);
        for panel in 0..panels {
            draw(&mut svg, panel, [LEFT, TOP + panel as f64 * height]);
        }
        svg.finish(WIDTH, total, STYLE)
    }

    /// What a panel compares: the methods under the one condition, or the conditions for one method.
    fn panels(&self) -> Vec<(String, Vec<Series>)> {
        match self.experiment.conditions {
            [condition] => {
                let series = (self.estimators.iter()).map(|&estimator| Series {
                    condition,
                    estimator,
                    name: estimator.title().to_owned(),
                    colour: colour_of(estimator),
                });
                let title = condition::named(condition).map_or("", |condition| condition.title);
                vec![(title.to_owned(), series.collect())]
            }
            conditions => (self.estimators.iter())
                .map(|&estimator| {
                    let series = conditions.iter().zip(SHADES.iter().cycle());
                    let series = series.map(|(condition, &colour)| Series {
                        condition,
                        estimator,
                        name: (*condition).to_owned(),
                        colour,
                    });
                    (estimator.title().to_owned(), series.collect())
                })
                .collect(),
        }
    }
}

/// Trials drawn in one colour.
struct Series {
    condition: &'static str,
    estimator: Estimator,
    name: String,
    colour: &'static str,
}

impl Series {
    fn cell(&self, link: usize) -> Cell {
        Cell {
            condition: self.condition,
            estimator: self.estimator,
            link,
        }
    }
}

/// Colours of conditions.
pub const SHADES: [&str; 5] = ["#1f6feb", "#e8a33d", "#cf222e", "#8250df", "#2da44e"];

fn colour_of(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::Link => "#1f6feb",
        Estimator::World => "#cf222e",
        Estimator::Curvature => "#e8a33d",
        Estimator::Palpate => "#2da44e",
    }
}

/// Draws a panel's title and below it the names of its series, in the room of [`HEAD`] px above the panel.
fn head(svg: &mut Svg, title: &str, series: &[Series], at: [f64; 2]) {
    let entries: Vec<_> = series.iter().map(|s| (s.name.as_str(), s.colour)).collect();
    legend(svg, title, &entries, at);
}

/// The same for names with colours.
pub fn legend(svg: &mut Svg, title: &str, entries: &[(&str, &str)], [left, top]: [f64; 2]) {
    svg.text([left, top + 18.0], Anchor::Start, "head", title);
    let (mut x, y) = (left, top + 38.0);
    for (name, colour) in entries {
        svg.add(format_args!(
            r#"<circle fill="{colour}" cx="{:.1}" cy="{:.1}" r="4.5"/>"#,
            x + 5.0,
            y - 4.5
        ));
        svg.text([x + 15.0, y], Anchor::Start, "label", name);
        x += 36.0 + 7.0 * name.chars().count() as f64;
    }
}
