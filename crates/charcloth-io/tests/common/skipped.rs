//! Tests that cannot run here say so.

use std::io::Write;

/// Says that the test is skipped, and why. `println!` would not do: cargo hides what a test that passes prints.
pub fn skipped(why: impl std::fmt::Display) {
    let thread = std::thread::current();
    let _ = writeln!(std::io::stderr(), "SKIPPED {}: {why}", thread.name().unwrap_or_default());
}
