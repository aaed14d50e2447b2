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

/// A sign of life on stderr for work of unknown length, hidden as the bar is.
pub fn spinner(what: &'static str, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let spinner = ProgressBar::new_spinner().with_message(what);
    spinner.enable_steady_tick(std::time::Duration::from_millis(100));
    spinner
}
