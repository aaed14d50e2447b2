//! Results as Markdown tables.

use std::fmt::Write as _;

use super::campaign::Campaign;
use super::condition;
use super::estimator::Estimator;
use super::experiment::{Experiment, View};
use super::score::FOUND;
use super::summary::Summary;
use super::trial::Cell;

/// A Markdown table with columns of equal width, the first `left` of them to the left.
pub fn markdown(heads: &[String], rows: &[Vec<String>], left: usize) -> String {
    let wide = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        let longest = cells.chain(&heads[column..=column]);
        longest
            .map(|cell| cell.chars().count())
            .max()
            .unwrap_or(0)
            .max(3)
    };
    let widths: Vec<_> = (0..heads.len()).map(wide).collect();
    let mut text = String::new();
    let mut line = |cells: &[String]| {
        for (column, (cell, width)) in cells.iter().zip(&widths).enumerate() {
            let padding = " ".repeat(width.saturating_sub(cell.chars().count()));
            let _ = match column < left {
                true => write!(text, "| {cell}{padding} "),
                false => write!(text, "| {padding}{cell} "),
            };
        }
        text.push_str("|\n");
    };
    line(heads);
    let rule = widths
        .iter()
        .enumerate()
        .map(|(column, width)| match column < left {
            true => "-".repeat(*width),
            false => "-".repeat(width - 1) + ":",
        });
    line(&rule.collect::<Vec<_>>());
    rows.iter().for_each(|row| line(row));
    text
}

/// Heads from words.
pub fn heads(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

/// The table of an experiment: a row for each condition and estimator, a column for each link.
pub fn of_experiment(
    campaign: &Campaign,
    experiment: &Experiment,
    links: &[usize],
    estimators: &[Estimator],
) -> String {
    let mut columns = heads(&["condition", "method"]);
    columns.extend(links.iter().map(|link| format!("link {link}")));
    let mut rows = Vec::new();
    for name in experiment.conditions {
        for &estimator in estimators {
            let mut row = vec![(*name).to_owned(), estimator.title().to_owned()];
            row.extend(links.iter().map(|&link| {
                let cell = Cell {
                    condition: name,
                    estimator,
                    link,
                };
                value(experiment.view, &Summary::of(campaign.outcomes(&cell)))
            }));
            rows.push(row);
        }
    }
    format!(
        "{}\n\n{}",
        legend(experiment.view),
        markdown(&columns, &rows, 2)
    )
}

fn legend(view: View) -> String {
    match view {
        View::Convergence => format!(
            "Median time from first contact after which the error stays below {} cm, s.",
            100.0 * FOUND
        ),
        View::Calibration => {
            "Share of trials whose true contact lies in the estimate's 50 % / 90 % credible region at the end.".to_owned()
        }
        View::RightLink => "Mean share of the last second that names the right link, %.".to_owned(),
        _ => {
            "Median over trials of the position error (median over the last second), mm.".to_owned()
        }
    }
}

fn value(view: View, summary: &Summary) -> String {
    match view {
        View::Convergence => seconds(summary.settled_secs),
        View::Calibration => {
            let [half, most] = summary.held.map(percent);
            format!("{half} / {most}")
        }
        View::RightLink => percent(summary.right_link),
        _ => millimetres(summary.error_median),
    }
}

/// All statistics of all cells of a list of conditions.
pub fn details(campaign: &Campaign, condition: &str) -> String {
    let columns = heads(&[
        "method",
        "link",
        "trials",
        "median mm",
        "mean mm",
        "90 % mm",
        "most mm",
        "< 2 cm %",
        "right link %",
        "force N",
        "settled s",
        "in 50 % region",
        "in 90 % region",
        "ambiguous %",
    ]);
    let rows: Vec<_> = (campaign.all())
        .filter(|(cell, _)| cell.condition == condition)
        .map(|(cell, outcomes)| {
            let s = Summary::of(outcomes);
            let [half, most] = s.held.map(percent);
            vec![
                cell.estimator.title().to_owned(),
                cell.link.to_string(),
                s.count.to_string(),
                millimetres(s.error_median),
                millimetres(s.error_mean),
                millimetres(s.error_p90),
                millimetres(s.error_max),
                percent(s.found),
                percent(s.right_link),
                number(s.force_error, 2),
                seconds(s.settled_secs),
                half,
                most,
                percent(s.ambiguous),
            ]
        })
        .collect();
    let title = condition::named(condition).map_or("", |condition| condition.title);
    format!("{condition}: {title}\n\n{}", markdown(&columns, &rows, 1))
}

/// Metres told in millimetres.
pub fn millimetres(metres: f64) -> String {
    let mm = 1e3 * metres;
    match mm.abs() {
        _ if !mm.is_finite() => missing(mm),
        size if size < 1.0 => format!("{mm:.2}"),
        size if size < 100.0 => format!("{mm:.1}"),
        _ => format!("{mm:.0}"),
    }
}

/// A share told in percent.
pub fn percent(share: f64) -> String {
    number(100.0 * share, 0)
}

/// Seconds; "never" where infinite.
pub fn seconds(secs: f64) -> String {
    match secs.is_infinite() {
        true => "never".to_owned(),
        false => number(secs, 2),
    }
}

fn number(value: f64, digits: usize) -> String {
    match value.is_finite() {
        true => format!("{value:.digits$}"),
        false => missing(value),
    }
}

/// For infinite errors (no estimate), and for what there is no trial of.
fn missing(value: f64) -> String {
    match value.is_infinite() {
        true => "none".to_owned(),
        false => "–".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let rows = [
            vec!["a".to_owned(), "1".to_owned()],
            vec!["größer".to_owned(), "1000".to_owned()],
        ];
        let table = markdown(&heads(&["name", "n"]), &rows, 1);
        assert_eq!(
            table,
            "| name   |    n |\n| ------ | ---: |\n| a      |    1 |\n| größer | 1000 |\n"
        );
    }

    #[test]
    fn numbers_say_as_much_as_they_know() {
        assert_eq!(millimetres(0.00034), "0.34");
        assert_eq!(millimetres(0.0123), "12.3");
        assert_eq!(millimetres(0.523), "523");
        assert_eq!(millimetres(f64::INFINITY), "none");
        assert_eq!(millimetres(f64::NAN), "–");
        assert_eq!(seconds(f64::INFINITY), "never");
    }
}
