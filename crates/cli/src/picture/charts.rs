//! The charts beside the arm: force against distance to the base, and the error over time.

use palpate_filter::ContactStatus;

use super::axes::{Axes, Scale};
use super::stage::{dots_by_weight, heaviest};
use super::svg::{Anchor, Svg};
use super::{Instant, Moment};

/// Particles in one chart, at most.
const MOST_DOTS: usize = 1500;

/// Draws a chart a moment, side by side from `at`, in `size`, px.
pub fn forces(svg: &mut Svg, moments: &[Moment], at: [f64; 2], size: [f64; 2]) {
    const GAP: f64 = 16.0;
    let width = (size[0] + GAP) / moments.len().max(1) as f64 - GAP;
    let (x, y) = (distance_scale(moments), force_scale(moments));
    for (index, moment) in moments.iter().enumerate() {
        let axes = Axes {
            at: [at[0] + index as f64 * (width + GAP), at[1]],
            size: [width, size[1]],
            x,
            y,
        };
        axes.draw(
            svg,
            "distance to base, m",
            (index == 0).then_some("force, N"),
        );
        draw_moment(svg, moment, &axes);
    }
}

fn draw_moment(svg: &mut Svg, moment: &Moment, axes: &Axes) {
    let [left, top] = axes.at;
    let title = format!("t = {:.2} s", moment.secs);
    svg.text(
        [left + 0.5 * axes.size[0], top - 8.0],
        Anchor::Middle,
        "label",
        &title,
    );
    let stride = moment.cloud.len().div_ceil(MOST_DOTS).max(1);
    let dots = moment.cloud.iter().step_by(stride).filter_map(|point| {
        let (x, y) = (point.point_in_root.coords.norm(), point.force);
        let inside = x <= axes.x.high && y <= axes.y.high;
        inside.then(|| (axes.place(x, y), point.weight))
    });
    dots_by_weight(svg, dots.collect(), heaviest(&moment.cloud), 2.6);
    if let Some(truth) = &moment.truth {
        let distance = truth.point_in_root.coords.norm();
        let [x, y] = axes.place(distance, truth.force_in_root.norm());
        let (right, bottom) = (left + axes.size[0], top + axes.size[1]);
        svg.line([left, y], [right, y], "truth-line");
        svg.line([x, top], [x, bottom], "truth-line");
        svg.add(format_args!(
            r#"<circle class="truth-ring" cx="{x:.1}" cy="{y:.1}" r="6"/>"#
        ));
    }
}

fn distance_scale(moments: &[Moment]) -> Scale {
    let distances = moments.iter().flat_map(|moment| &moment.cloud);
    Scale::from_zero(
        distances
            .map(|p| p.point_in_root.coords.norm())
            .fold(0.5, f64::max),
    )
}

/// Up to the force that few particles exceed, and above the truth.
fn force_scale(moments: &[Moment]) -> Scale {
    let clouds = moments.iter().flat_map(|moment| &moment.cloud);
    let mut forces: Vec<_> = clouds.map(|point| point.force).collect();
    forces.sort_by(f64::total_cmp);
    let usual = forces.get(forces.len() * 98 / 100).copied().unwrap_or(0.0);
    let truths = moments.iter().filter_map(|moment| moment.truth.as_ref());
    let most = truths
        .map(|truth| truth.force_in_root.norm())
        .fold(1.0, f64::max);
    Scale::from_zero(usual.min(4.0 * most).max(1.5 * most))
}

/// Draws error and standard deviation over time from `at`, in `size`, px, above a strip of the status.
pub fn errors(svg: &mut Svg, history: &[Instant], at: [f64; 2], size: [f64; 2]) {
    let end = history.last().map_or(1.0, |instant| instant.secs);
    let errors = history
        .iter()
        .filter_map(|instant| instant.error)
        .map(|error| 1e3 * error);
    let least = errors.fold(1.0, f64::min);
    let axes = Axes {
        at,
        size,
        x: Scale {
            low: 0.0,
            high: end.max(1e-3),
            logarithmic: false,
        },
        y: Scale {
            low: if least < 0.1 { 0.01 } else { 0.1 },
            high: 1000.0,
            logarithmic: true,
        },
    };
    axes.draw(svg, "time, s", Some("position, mm"));
    let place =
        |instant: &Instant, metres: Option<f64>| Some(axes.place(instant.secs, 1e3 * metres?));
    svg.polyline(history.iter().map(|i| place(i, i.std)), "std");
    svg.polyline(history.iter().map(|i| place(i, i.error)), "error");
    let wrong = |i: &Instant| i.error.filter(|_| !i.right_link);
    svg.polyline(history.iter().map(|i| place(i, wrong(i))), "wrong");
    errors_legend(svg, [at[0] + size[0] - 12.0, at[1] + 20.0]);
    strip(svg, history, &axes);
}

fn errors_legend(svg: &mut Svg, [right, top]: [f64; 2]) {
    let lines = [
        ("error", "error of the estimate"),
        ("wrong", "… while on a wrong link"),
        ("std", "its own standard deviation"),
    ];
    for (row, (class, name)) in lines.into_iter().enumerate() {
        let y = top + 17.0 * row as f64;
        svg.line([right - 26.0, y - 4.0], [right, y - 4.0], class);
        svg.text([right - 33.0, y], Anchor::End, "small", name);
    }
}

/// Draws the status along the time axis, inside the chart at its lower edge.
fn strip(svg: &mut Svg, history: &[Instant], axes: &Axes) {
    const HEIGHT: f64 = 9.0;
    let y = axes.at[1] + axes.size[1] - HEIGHT;
    for run in history.chunk_by(|a, b| a.status == b.status) {
        let (Some(first), Some(last)) = (run.first(), run.last()) else {
            continue;
        };
        let [from, _] = axes.place(first.secs, axes.y.low);
        let [to, _] = axes.place(last.secs, axes.y.low);
        svg.add(format_args!(
            r#"<rect class="{}" x="{from:.1}" y="{y:.1}" width="{:.1}" height="{HEIGHT}"/>"#,
            first.status.word(),
            (to - from).max(1.0)
        ));
    }
    let mut x = axes.at[0];
    let all = [
        ContactStatus::NoContact,
        ContactStatus::Ambiguous,
        ContactStatus::Located,
    ];
    for (status, name) in all
        .into_iter()
        .zip(["no contact", "contact, ambiguous", "located"])
    {
        let y = axes.at[1] + axes.size[1] + 46.0;
        let class = status.word();
        svg.add(format_args!(
            r#"<rect class="{class}" x="{x:.1}" y="{:.1}" width="14" height="9"/>"#,
            y - 8.5
        ));
        svg.text([x + 19.0, y], Anchor::Start, "small", name);
        x += 40.0 + 6.2 * name.len() as f64;
    }
}
