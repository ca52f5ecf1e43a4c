//! A whole file: opened, all blocks and positions read, in both ways of reading, which agree. Whatever is handed out is
//! in range, and nothing is allocated that the bytes do not pay for.
#![no_main]

mod place;
#[path = "../../../tests/support/walk.rs"]
mod walk;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // A mesh or an error, as long as it says so.
    let _ = walk::walk(&place::written("mesh.ply", bytes));
});
