//! palpate
fn main() {}
