//! Error over time, link by link.

use super::panel::{ERROR, ERROR_TICKS, Panel, Scale, shown_error};
use super::{Data, FOOT, RIGHT};
use crate::evaluate::condition;
use crate::evaluate::score::{COURSE_SECS, FOUND};
use crate::evaluate::trial::Cell;
use crate::last_second::median;
use crate::picture::svg::{Anchor, Svg};

const HEIGHT: f64 = 260.0;

/// Colours of links, from the base outwards.
fn colour_of(link: usize) -> &'static str {
    match link % 7 {
        1 => "#8c959f",
        2 => "#8250df",
        3 => "#1f6feb",
        4 => "#17a2b8",
        5 => "#2da44e",
        6 => "#e8a33d",
        _ => "#cf222e",
    }
}

pub fn draw(data: &Data) -> String {
    let all: Vec<_> = (data.experiment.conditions.iter())
        .flat_map(|&condition| data.estimators.iter().map(move |&e| (condition, e)))
        .collect();
    let subtitle = "median over trials of the position error, by link";
    data.draw(
        subtitle,
        all.len(),
        HEIGHT + 34.0 + FOOT,
        |svg, index, [left, top]| {
            let Some(&(name, estimator)) = all.get(index) else {
                return;
            };
            let panel = Panel {
                at: [left, top + 34.0],
                size: [RIGHT - left, HEIGHT],
                x: Scale::Linear(0.0, data.campaign.setup.secs),
                y: ERROR,
            };
            let condition = condition::named(name).map_or("", |condition| condition.title);
            let title = format!("{}: {condition}", estimator.title());
            svg.text([left, top + 22.0], Anchor::Start, "head", &title);
            panel.draw_y(svg, &ERROR_TICKS, "position error, mm");
            panel.mark(svg, shown_error(FOUND), "2 cm");
            for &link in data.links {
                let cell = Cell {
                    condition: name,
                    estimator,
                    link,
                };
                draw_course(svg, data, &panel, &cell, colour_of(link));
            }
            draw_legend(svg, data.links, [left + 12.0, top + 34.0 + HEIGHT - 10.0]);
            panel.draw_x(
                svg,
                &time_ticks(data.campaign.setup.secs),
                "time from first contact, s",
            );
        },
    )
}

fn draw_course(svg: &mut Svg, data: &Data, panel: &Panel, cell: &Cell, colour: &str) {
    let courses: Vec<_> = (data.campaign.outcomes(cell).iter().flatten())
        .map(|score| score.course.as_slice())
        .collect();
    let points = courses.iter().map(|course| course.len()).min().unwrap_or(0);
    let line = (0..points).map(|point| {
        let error = median(courses.iter().map(|course| course[point]));
        panel.place(point as f64 * COURSE_SECS, shown_error(error))
    });
    let path: Vec<_> = line.map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    if !path.is_empty() {
        svg.add(format_args!(
            r#"<path fill="none" stroke="{colour}" stroke-width="2" d="M{}"/>"#,
            path.join("L")
        ));
    }
}

fn draw_legend(svg: &mut Svg, links: &[usize], [mut x, y]: [f64; 2]) {
    for &link in links {
        let colour = colour_of(link);
        svg.add(format_args!(
            r#"<path stroke="{colour}" stroke-width="3" d="M{x:.1} {:.1}h18"/>"#,
            y - 4.0
        ));
        svg.text(
            [x + 23.0, y],
            Anchor::Start,
            "small",
            &format!("link {link}"),
        );
        x += 74.0;
    }
}

/// Whole seconds, at most about ten of them.
fn time_ticks(end_secs: f64) -> Vec<(f64, String)> {
    let step = (end_secs / 10.0).ceil().max(1.0);
    let count = (end_secs / step + 1e-9).floor() as usize;
    (0..=count)
        .map(|tick| step * tick as f64)
        .map(|secs| (secs, format!("{secs:.0}")))
        .collect()
}
