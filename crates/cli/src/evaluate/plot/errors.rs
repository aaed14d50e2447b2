//! Position error by link: every trial a dot, their median a bar.

use super::panel::{ERROR, ERROR_TICKS, Panel, Scale, shown_error};
use super::{Data, FOOT, HEAD, RIGHT, Series, head};
use crate::evaluate::seed::share;
use crate::evaluate::summary::Summary;
use crate::picture::svg::Svg;

const HEIGHT: f64 = 330.0;

pub fn draw(data: &Data) -> String {
    let panels = data.panels();
    let subtitle = "each dot a trial, bars the medians";
    data.draw(
        subtitle,
        panels.len(),
        HEIGHT + HEAD + FOOT,
        |svg, index, at| {
            if let Some((title, series)) = panels.get(index) {
                draw_panel(svg, data, title, series, at);
            }
        },
    )
}

fn draw_panel(svg: &mut Svg, data: &Data, title: &str, series: &[Series], [left, top]: [f64; 2]) {
    let panel = Panel {
        at: [left, top + HEAD],
        size: [RIGHT - left, HEIGHT],
        x: Scale::Linear(-0.5, data.links.len() as f64 - 0.5),
        y: ERROR,
    };
    head(svg, title, series, [left, top]);
    panel.draw_y(svg, &ERROR_TICKS, "position error, mm");
    panel.mark(svg, 20.0, "2 cm");
    let step = 0.8 / series.len().max(1) as f64;
    for (column, &link) in data.links.iter().enumerate() {
        for (index, series) in series.iter().enumerate() {
            let middle = column as f64 - 0.4 + step * (index as f64 + 0.5);
            draw_trials(svg, data, &panel, series, link, [middle, step]);
        }
    }
    let ticks: Vec<_> = (data.links.iter().enumerate())
        .map(|(column, link)| (column as f64, link.to_string()))
        .collect();
    panel.draw_x(svg, &ticks, "touched link");
}

fn draw_trials(
    svg: &mut Svg,
    data: &Data,
    panel: &Panel,
    series: &Series,
    link: usize,
    [middle, step]: [f64; 2],
) {
    let outcomes = data.campaign.outcomes(&series.cell(link));
    let errors = outcomes
        .iter()
        .flatten()
        .map(|score| shown_error(score.error));
    let dots = errors.enumerate().map(|(trial, error)| {
        // Aside by chance, so that equal ones are told apart.
        let aside = share(&[link as u64, trial as u64]) - 0.5;
        panel.place(middle + 0.55 * step * aside, error)
    });
    svg.dots(dots, 5.0, series.colour);
    let median = Summary::of(outcomes).error_median;
    if !median.is_nan() {
        let [x, y] = panel.place(middle, shown_error(median));
        let half = 0.38 * step * panel.size[0] / data.links.len() as f64;
        svg.add(format_args!(
            r#"<path stroke="{}" stroke-width="3.5" d="M{:.1} {y:.1}H{:.1}"/>"#,
            series.colour,
            x - half,
            x + half
        ));
    }
}
