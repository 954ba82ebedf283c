//! Ctrl-C: the first one asks long work to end with what it has; a second one ends the program at once.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);
static INSTALLED: Once = Once::new();

/// The flag that Ctrl-C raises; the first call installs the handler.
pub fn flag() -> &'static AtomicBool {
    INSTALLED.call_once(|| {
        // Where no handler can be set, Ctrl-C ends the program as it would have without one.
        let _ = ctrlc::set_handler(|| {
            if STOP.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
        });
    });
    &STOP
}
