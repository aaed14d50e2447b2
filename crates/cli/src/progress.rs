//! How far long work is: a bar on a terminal, nothing on a pipe.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar for `length` steps on stderr, hidden if that is no terminal or `quiet` asks for it.
pub fn bar(length: usize, what: &'static str, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let template = "{msg} {wide_bar:.cyan} {pos}/{len}  {per_sec}, {eta} left";
    let style = ProgressStyle::with_template(template);
    ProgressBar::new(length as u64)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(what)
}
