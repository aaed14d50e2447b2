//! Results as a table.

use std::io::{self, Write};

use comfy_table::presets::UTF8_BORDERS_ONLY;
use comfy_table::{CellAlignment, ContentArrangement, Table};

/// A table with these heads, its columns after the first aligned to the right.
pub fn columns(heads: &[&str]) -> Table {
    let mut table = Table::new();
    table
        .load_style(UTF8_BORDERS_ONLY)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_header(heads);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// A table of names and what belongs to them.
pub fn facts(facts: &[(&str, String)]) -> Table {
    let mut table = Table::new();
    table
        .load_style(UTF8_BORDERS_ONLY)
        .set_content_arrangement(ContentArrangement::Dynamic);
    for (name, value) in facts {
        table.add_row([name, value.as_str()]);
    }
    table
}

/// Prints to stdout; unlike `println!` it does not panic when the reader has gone.
pub fn print(text: &impl std::fmt::Display) -> io::Result<()> {
    writeln!(io::stdout(), "{text}")
}
