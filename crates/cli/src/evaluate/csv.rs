//! Results as CSV: errors in metres, forces in newtons, times in seconds.

use std::fmt::Write as _;

use super::campaign::Campaign;
use super::score::Score;
use super::summary::Summary;
use super::trial::Outcome;

/// Columns of a score.
pub const SCORE_HEADER: &str = "error_m,right_link,right_link_all,force_error_N,force_error_share,settled_s,\
                                without_estimate,ambiguous,std_m,in_50,in_90";

/// The columns of [`SCORE_HEADER`]; infinite and missing values as `inf` and `NaN`.
pub fn score_columns(score: &Score) -> String {
    let [half, most] = score.holds.map(u8::from);
    format!(
        "{:.6},{:.4},{:.4},{:.4},{:.4},{:.3},{:.4},{:.4},{:.6},{half},{most}",
        score.error,
        score.right_link,
        score.right_link_all,
        score.force_error,
        score.force_error_share,
        score.settled_secs,
        score.without,
        score.ambiguous,
        score.std
    )
}

/// One row a trial; those that the simulator refused have the reason and no score.
pub fn trials(campaign: &Campaign) -> String {
    let mut text = format!("condition,method,link,trial,refused,{SCORE_HEADER}\n");
    for (cell, outcomes) in campaign.all() {
        for (number, outcome) in outcomes.iter().enumerate() {
            let (condition, method, link) = (cell.condition, cell.estimator.name(), cell.link);
            let columns = match outcome {
                Ok(score) => format!(",{}", score_columns(score)),
                Err(reason) => quoted(reason) + &",".repeat(SCORE_HEADER.split(',').count()),
            };
            let _ = writeln!(text, "{condition},{method},{link},{number},{columns}");
        }
    }
    text
}

/// One row a cell.
pub fn cells(campaign: &Campaign) -> String {
    let mut text = "condition,method,link,trials,refused,error_median_m,error_mean_m,error_p90_m,error_max_m,\
                    below_2cm,right_link,force_error_median_N,settled_median_s,in_50,in_90,ambiguous,std_median_m\n"
        .to_owned();
    for (cell, outcomes) in campaign.all() {
        let _ = writeln!(
            text,
            "{},{},{},{}",
            cell.condition,
            cell.estimator.name(),
            cell.link,
            summary_columns(outcomes)
        );
    }
    text
}

fn summary_columns(outcomes: &[Outcome]) -> String {
    let s = Summary::of(outcomes);
    let [half, most] = s.held;
    format!(
        "{},{},{:.6},{:.6},{:.6},{:.6},{:.4},{:.4},{:.4},{:.3},{half:.4},{most:.4},{:.4},{:.6}",
        s.count,
        s.refused,
        s.error_median,
        s.error_mean,
        s.error_p90,
        s.error_max,
        s.found,
        s.right_link,
        s.force_error,
        s.settled_secs,
        s.ambiguous,
        s.std
    )
}

/// A field in quotes.
pub fn quoted(field: &str) -> String {
    format!("\"{}\"", field.replace('"', "\"\""))
}
