//! Mapping a file into memory, and what happens when the file goes away underneath. The only unsafe code of the crate.
//!
//! In: an open regular file. Out: its bytes. The promise that makes a map sound is the user's: nobody changes or truncates
//! the file while the run goes on. It cannot be enforced, so it is watched. A page that is no longer there, because the
//! file was cut off or the disk failed, raises the signal SIGBUS; the handler writes a message that was prepared before
//! and ends the process. Bytes that changed are found by [`MeshSource::unchanged`](super::MeshSource::unchanged).
//!
//! Invariant: the handler calls `write`, `_exit`, `pause`, `signal` and `raise` and reads atomics; it allocates nothing,
//! locks nothing and frees nothing.
#![allow(unsafe_code)]

use libc::{c_int, c_void, siginfo_t};
use memmap2::{Mmap, UncheckedAdvice};
use std::fs::File;
use std::io;
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicPtr, Ordering};

/// Maps the whole file, read only.
pub(super) fn map(file: &File) -> io::Result<Mmap> {
    // SAFETY: the mapping is read only and private to this process; that nobody changes or truncates the file
    // underneath it is the documented condition for `IoMode::Map` and `IoMode::Auto`.
    unsafe { Mmap::map(file) }
}

/// Takes the pages of a map out of the resident set of this process; the next reader gets them back from the page cache.
/// A system that refuses loses nothing by it.
pub(super) fn release(map: &Mmap) {
    // SAFETY: what this advice endangers is what was written to the pages. The map is shared, read only and backed by a
    // file: nothing was, and who reads them meanwhile or later reads the same bytes of the file.
    let _ = unsafe { map.unchecked_advise(UncheckedAdvice::DontNeed) };
}

/// What the handler writes. Never freed: a handler may be reading it.
static MESSAGE: AtomicPtr<Vec<u8>> = AtomicPtr::new(ptr::null_mut());
/// How the handler ends the process.
static CODE: AtomicI32 = AtomicI32::new(1);
/// Whether a thread is writing the message already.
static TOLD: AtomicBool = AtomicBool::new(false);

/// Makes the whole process end with exit code `code` when a mapped file has lost a page that is read, after it wrote what
/// [`say_on_bus_error`] was given to standard error. For programs; a library leaves signals to whoever embeds it.
///
/// # Errors
/// If the system refuses.
pub fn exit_on_bus_error(code: u8) -> io::Result<()> {
    CODE.store(code.into(), Ordering::Relaxed);
    // SAFETY: an all-zero `sigaction` is a valid one; the mask is emptied before it is used; the handler has the signature
    // that SA_SIGINFO asks for and calls nothing that a signal handler may not call.
    let installed = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigemptyset(&mut action.sa_mask);
        action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        action.sa_sigaction = on_bus_error as *const () as libc::sighandler_t;
        libc::sigaction(libc::SIGBUS, &action, ptr::null_mut())
    };
    if installed == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

/// Prepares what is written to standard error on a bus error, with its line ends. The message before stays in memory, so
/// this is for a few of them: one for each stage of a run.
pub fn say_on_bus_error(message: String) {
    MESSAGE.store(Box::into_raw(Box::new(message.into_bytes())), Ordering::Release);
}

/// A page could not be had: says so and ends the process. Signals that somebody sent, and those that are not about pages
/// of files, end it as they would without us.
extern "C" fn on_bus_error(signal: c_int, info: *mut siginfo_t, _context: *mut c_void) {
    let message = MESSAGE.load(Ordering::Acquire);
    // SAFETY: the system hands over a valid `siginfo_t`; a message that is not null came from a box that is never freed;
    // the functions called may be called from signal handlers.
    unsafe {
        if (*info).si_code != libc::BUS_ADRERR || message.is_null() {
            libc::signal(signal, libc::SIG_DFL);
            libc::raise(signal);
            return;
        }
        // Threads that meet the hole at the same time wait for the one that speaks.
        while TOLD.swap(true, Ordering::Relaxed) {
            libc::pause();
        }
        let message: &[u8] = &*message;
        // Nothing can be done if nobody is listening.
        libc::write(libc::STDERR_FILENO, message.as_ptr().cast(), message.len());
        libc::_exit(CODE.load(Ordering::Relaxed));
    }
}
