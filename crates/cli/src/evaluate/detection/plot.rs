//! Plots of pushes and of receiver operating curves.

use super::pushes::{FORCES, Pushed};
use super::roc::Curve;
use super::situation::Source;
use super::{Plan, RATES};
use crate::evaluate::plot::{FOOT, HEAD, LEFT, RIGHT, SHADES, STYLE, TOP, WIDTH, legend};
use crate::evaluate::plot::{Panel, Scale};
use crate::last_second::median;
use crate::picture::svg::{Anchor, Svg};

const HEIGHT: f64 = 210.0;
const SHARES: [(f64, &str); 6] = [
    (0.0, "0"),
    (0.2, "20"),
    (0.4, "40"),
    (0.6, "60"),
    (0.8, "80"),
    (1.0, "100"),
];
const DELAYS: [(f64, &str); 5] = [
    (5.0, "5"),
    (10.0, "10"),
    (20.0, "20"),
    (100.0, "100"),
    (500.0, "500"),
];
/// Colours of links 1 to 7.
const LINKS: [&str; 7] = [
    "#8c959f", "#1f6feb", "#e8a33d", "#cf222e", "#8250df", "#2da44e", "#bf3989",
];

/// Probability of detection and median delay against force, by link, in slow and fast motion with the observer.
pub fn of_pushes(plan: &Plan, pushed: &Pushed) -> String {
    let mut svg = begin(
        "Pushes noticed, and how soon",
        "momentum observer, 1000 Hz; each line is a link",
        4,
    );
    let names: Vec<_> = plan
        .links
        .iter()
        .map(|link| format!("link {link}"))
        .collect();
    let colours = |place: usize| LINKS[(plan.links[place] - 1) % LINKS.len()];
    let entries: Vec<_> = names
        .iter()
        .enumerate()
        .map(|(i, n)| (n.as_str(), colours(i)))
        .collect();
    for (row, (situation, is_delay)) in [
        ("slow", false),
        ("slow", true),
        ("fast", false),
        ("fast", true),
    ]
    .into_iter()
    .enumerate()
    {
        let what = if is_delay { "median delay" } else { "noticed" };
        let y = match is_delay {
            true => Scale::Decades(4.0, 600.0),
            false => Scale::Linear(0.0, 1.04),
        };
        let panel = panel(row, Scale::Decades(0.8, 25.0), y);
        legend(
            &mut svg,
            &format!("{situation}: {what}"),
            &entries,
            head_of(row),
        );
        match is_delay {
            true => panel.draw_y(&mut svg, &DELAYS, "delay, ms"),
            false => panel.draw_y(&mut svg, &SHARES, "pushes, %"),
        }
        for (place, &link) in plan.links.iter().enumerate() {
            let cells = pushed.cells.iter().filter(|cell| {
                (cell.situation, cell.source, cell.link) == (situation, Source::Observer, link)
                    && cell.rate_hz == RATES[0]
                    && !(is_delay && cell.delays.is_empty())
            });
            let value = |cell: &super::pushes::Cell| match is_delay {
                true => 1e3 * median(cell.delays.iter().copied()),
                false => cell.found(),
            };
            let points: Vec<_> = cells
                .map(|cell| panel.place(cell.force, value(cell)))
                .collect();
            line(&mut svg, &points, colours(place));
        }
        let ticks: Vec<_> = FORCES
            .iter()
            .map(|force| (*force, force.to_string()))
            .collect();
        panel.draw_x(&mut svg, &ticks, "force, N");
    }
    svg.finish(WIDTH, height(4), STYLE)
}

/// Share of soft pushes that are noticed against false alarms an hour.
pub fn of_curves(curves: &[Curve]) -> String {
    let mut svg = begin(
        "Receiver operating curves",
        "soft pushes noticed against false alarms; from the left: ever looser detectors",
        2,
    );
    const NONE: f64 = 0.5;
    for (row, source) in Source::ALL.into_iter().enumerate() {
        let panel = panel(row, Scale::Decades(NONE, 5000.0), Scale::Linear(0.0, 1.04));
        let of_source: Vec<_> = curves
            .iter()
            .filter(|curve| curve.source == source)
            .collect();
        let entries: Vec<_> = (of_source.iter().zip(SHADES))
            .map(|(curve, colour)| (curve.situation, colour))
            .collect();
        legend(&mut svg, source.name(), &entries, head_of(row));
        panel.draw_y(&mut svg, &SHARES, "pushes, %");
        for (curve, colour) in of_source.iter().zip(SHADES) {
            let place =
                |point: &super::roc::Point| panel.place(point.alarms.max(NONE), point.found);
            let points: Vec<_> = curve.points.iter().map(place).collect();
            line(&mut svg, &points, colour);
        }
        let ticks = [
            (NONE, "none"),
            (10.0, "10"),
            (100.0, "100"),
            (1000.0, "1000"),
        ];
        let ticks = ticks.map(|(value, name)| (value, name.to_owned()));
        panel.draw_x(&mut svg, &ticks, "false alarms an hour");
    }
    svg.finish(WIDTH, height(2), STYLE)
}

fn height(panels: usize) -> f64 {
    TOP + panels as f64 * (HEIGHT + HEAD + FOOT) + 10.0
}

fn begin(title: &str, subtitle: &str, panels: usize) -> Svg {
    let mut svg = Svg::default();
    let height = height(panels);
    svg.add(format_args!(
        r##"<rect width="{WIDTH}" height="{height}" fill="#fff"/>"##
    ));
    svg.text([24.0, 32.0], Anchor::Start, "title", title);
    svg.text([24.0, 54.0], Anchor::Start, "subtitle", subtitle);
    svg
}

fn head_of(row: usize) -> [f64; 2] {
    [LEFT, TOP + row as f64 * (HEIGHT + HEAD + FOOT)]
}

fn panel(row: usize, x: Scale, y: Scale) -> Panel {
    let [left, top] = head_of(row);
    Panel {
        at: [left, top + HEAD],
        size: [RIGHT - left, HEIGHT],
        x,
        y,
    }
}

/// A line through points, each with a dot.
fn line(svg: &mut Svg, points: &[[f64; 2]], colour: &str) {
    let path: Vec<_> = points
        .iter()
        .map(|[x, y]| format!("{x:.1} {y:.1}"))
        .collect();
    if !path.is_empty() {
        svg.add(format_args!(
            r#"<path fill="none" stroke="{colour}" stroke-width="1.8" d="M{}"/>"#,
            path.join("L")
        ));
    }
    for [x, y] in points {
        svg.add(format_args!(
            r#"<circle fill="{colour}" cx="{x:.1}" cy="{y:.1}" r="3.5"/>"#
        ));
    }
}
