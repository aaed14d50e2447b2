//! The charts beside the arm: force against distance to the base, and the error over time.

use palpate_filter::ContactStatus;

use super::axes::{Axes, Scale};
use super::stage::{dots_by_weight, heaviest};
use super::svg::{Anchor, Svg};
use super::{Instant, Moment};

/// Particles in one chart, at most.
const MOST_DOTS: usize = 1500;

/// Left edge and width of `count` columns in `width` from `left` on, px.
pub fn columns(count: usize, left: f64, width: f64) -> Vec<(f64, f64)> {
    const GAP: f64 = 26.0;
    let each = (width + GAP) / count.max(1) as f64 - GAP;
    (0..count)
        .map(|index| (left + index as f64 * (each + GAP), each))
        .collect()
}

/// Draws a chart a moment in the given columns, px.
pub fn forces(svg: &mut Svg, moments: &[Moment], columns: &[(f64, f64)], top: f64, height: f64) {
    let (x, y) = (distance_scale(moments), force_scale(moments));
    for (index, (moment, &(left, width))) in moments.iter().zip(columns).enumerate() {
        let axes = Axes {
            at: [left, top],
            size: [width, height],
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
    axes.draw(svg, "time, s", Some("error, mm"));
    let place =
        |instant: &Instant, metres: Option<f64>| Some(axes.place(instant.secs, 1e3 * metres?));
    svg.polyline(history.iter().map(|i| place(i, i.std)), "std");
    svg.polyline(history.iter().map(|i| place(i, i.error)), "error");
    let wrong = |i: &Instant| i.error.filter(|_| !i.right_link);
    svg.polyline(history.iter().map(|i| place(i, wrong(i))), "wrong");
    errors_legend(svg, [at[0] + size[0], at[1] - 12.0]);
    strip(svg, history, &axes);
}

/// Names the lines in one row that ends at `right`, px.
fn errors_legend(svg: &mut Svg, [mut right, y]: [f64; 2]) {
    let lines = [
        ("std", "its standard deviation"),
        ("wrong", "… wrong link"),
        ("error", "error of the estimate"),
    ];
    for (class, name) in lines {
        svg.text([right, y], Anchor::End, "small", name);
        right -= 6.2 * name.chars().count() as f64 + 8.0;
        svg.line([right - 22.0, y - 4.0], [right, y - 4.0], class);
        right -= 34.0;
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
    let mut x = axes.at[0] + 170.0;
    let all = [
        ContactStatus::NoContact,
        ContactStatus::Ambiguous,
        ContactStatus::Located,
    ];
    for (status, name) in all
        .into_iter()
        .zip(["no contact", "contact, ambiguous", "located"])
    {
        let y = axes.at[1] + axes.size[1] + 52.0;
        let class = status.word();
        svg.add(format_args!(
            r#"<rect class="{class}" x="{x:.1}" y="{:.1}" width="14" height="9"/>"#,
            y - 8.5
        ));
        svg.text([x + 19.0, y], Anchor::Start, "small", name);
        x += 42.0 + 6.8 * name.len() as f64;
    }
}
