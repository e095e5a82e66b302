//! Ctrl-C and SIGTERM: the first ends the work in hand well, the second ends it now.

use anyhow::Context;
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED_TO_STOP: AtomicBool = AtomicBool::new(false);

/// From now on, an interruption is noted and does not end the program.
pub fn watch() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if ASKED_TO_STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        eprintln!("\nstopping after this frame; once more stops now");
    })
    .context("cannot watch for Ctrl-C")
}

/// Whether there was an interruption.
pub fn asked_to_stop() -> bool {
    ASKED_TO_STOP.load(Ordering::Relaxed)
}
