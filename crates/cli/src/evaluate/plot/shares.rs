//! Shares by link: truth within the region, and right link.

use super::panel::{Panel, Scale};
use super::{Data, FOOT, HEAD, RIGHT, Series, head};
use crate::evaluate::summary::Summary;
use crate::picture::svg::Svg;

const TICKS: [(f64, &str); 6] = [
    (0.0, "0"),
    (0.2, "20"),
    (0.4, "40"),
    (0.6, "60"),
    (0.8, "80"),
    (1.0, "100"),
];
const HEIGHT: f64 = 230.0;

/// For each method and region, the share of trials whose truth it holds.
pub fn draw_calibration(data: &Data) -> String {
    let panels = data.panels();
    let subtitle = "share of trials whose truth lies in the estimate's region, with 95 % intervals";
    data.draw(
        subtitle,
        2 * panels.len(),
        HEIGHT + HEAD + FOOT,
        |svg, index, at| {
            let Some((title, series)) = panels.get(index / 2) else {
                return;
            };
            let level = index % 2;
            let nominal = crate::evaluate::region::LEVELS[level];
            let title = format!("{title}: {:.0} % region", 100.0 * nominal);
            let value = |summary: &Summary| {
                (
                    summary.held[level],
                    interval(summary.held[level], summary.count),
                )
            };
            let panel = draw_panel(svg, data, (&title, series), at, "trials, %", &value);
            panel.mark(svg, nominal, &format!("{:.0} %", 100.0 * nominal));
        },
    )
}

/// For each method, the share of the last second with the right link.
pub fn draw_right_link(data: &Data) -> String {
    let panels = data.panels();
    let subtitle = "mean share of the last second that names the right link";
    data.draw(
        subtitle,
        panels.len(),
        HEIGHT + HEAD + FOOT,
        |svg, index, at| {
            if let Some((title, series)) = panels.get(index) {
                let value = |summary: &Summary| (summary.right_link, [summary.right_link; 2]);
                draw_panel(svg, data, (title, series), at, "last second, %", &value);
            }
        },
    )
}

fn draw_panel(
    svg: &mut Svg,
    data: &Data,
    (title, series): (&str, &[Series]),
    [left, top]: [f64; 2],
    name: &str,
    value: &dyn Fn(&Summary) -> (f64, [f64; 2]),
) -> Panel {
    let panel = Panel {
        at: [left, top + HEAD],
        size: [RIGHT - left, HEIGHT],
        x: Scale::Linear(-0.5, data.links.len() as f64 - 0.5),
        y: Scale::Linear(0.0, 1.04),
    };
    head(svg, title, series, [left, top]);
    panel.draw_y(svg, &TICKS, name);
    let step = 0.8 / series.len().max(1) as f64;
    for (column, &link) in data.links.iter().enumerate() {
        for (index, series) in series.iter().enumerate() {
            let x = column as f64 - 0.4 + step * (index as f64 + 0.5);
            let summary = Summary::of(data.campaign.outcomes(&series.cell(link)));
            let (share, [low, high]) = value(&summary);
            if summary.count > 0 {
                draw_share(svg, &panel, series.colour, x, [share, low, high]);
            }
        }
    }
    let ticks: Vec<_> = (data.links.iter().enumerate())
        .map(|(column, link)| (column as f64, link.to_string()))
        .collect();
    panel.draw_x(svg, &ticks, "touched link");
    panel
}

fn draw_share(svg: &mut Svg, panel: &Panel, colour: &str, x: f64, [share, low, high]: [f64; 3]) {
    let [px, bottom] = panel.place(x, low);
    let [_, top] = panel.place(x, high);
    let [_, y] = panel.place(x, share);
    svg.add(format_args!(
        r#"<path stroke="{colour}" stroke-width="1.6" d="M{px:.1} {bottom:.1}V{top:.1}"/>"#
    ));
    svg.add(format_args!(
        r#"<circle fill="{colour}" cx="{px:.1}" cy="{y:.1}" r="4.5"/>"#
    ));
}

/// The 95 % interval of a share found in `count` trials (Wilson 1927).
fn interval(share: f64, count: usize) -> [f64; 2] {
    const Z: f64 = 1.96;
    let n = count.max(1) as f64;
    let middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    [middle - half, middle + half]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_stay_within_and_shrink_with_trials() {
        let [low, high] = interval(0.9, 30);
        // Wilson's interval for 27 of 30.
        assert!(
            (low - 0.7438).abs() < 1e-3 && (high - 0.9654).abs() < 1e-3,
            "{low} {high}"
        );
        let [low, high] = interval(1.0, 30);
        assert!(low > 0.88 && high <= 1.0 + 1e-12);
    }
}
