//! A disk that fails on request: a library that is loaded before the C library (`LD_PRELOAD`) and stands between a program
//! and its files. Built by `tests/faults.rs` with nothing but `rustc`.
//!
//! In, from the environment: `FAULT_BELOW`, a directory; `FAULT_LOG`, a file outside of it; `FAULT_AT`, a number; and
//! `FAULT_ERRNO`. Calls about files below the directory are counted from 1, and each is a line of the log: number, name,
//! path. The one with the number fails with the error and does nothing.
#![allow(clippy::missing_safety_doc, reason = "each has the contract of the function that it stands for")]

use std::ffi::{CStr, c_char, c_int, c_long, c_uint, c_void};
use std::io::Write as _;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

unsafe extern "C" {
    fn dlsym(handle: *mut c_void, symbol: *const c_char) -> *mut c_void;
    fn readlink(path: *const c_char, buffer: *mut c_char, size: usize) -> isize;
    fn syscall(number: c_long, ...) -> c_long;
    fn __errno_location() -> *mut c_int;
}

/// The next library that has the symbol.
const NEXT: *mut c_void = -1isize as *mut c_void;

struct Plan {
    below: String,
    at: u64,
    errno: c_int,
    /// Descriptor of the log.
    log: c_int,
}

static COUNT: AtomicU64 = AtomicU64::new(0);

fn plan() -> Option<&'static Plan> {
    static PLAN: OnceLock<Option<Plan>> = OnceLock::new();
    PLAN.get_or_init(|| {
        let below = std::env::var("FAULT_BELOW").ok()?;
        let number = |name: &str| std::env::var(name).ok()?.parse::<u64>().ok();
        let log = std::ffi::CString::new(std::env::var("FAULT_LOG").ok()?).ok()?;
        // O_WRONLY, O_CREAT, O_APPEND, O_CLOEXEC.
        let log = unsafe { real_open(log.as_ptr(), 0o1 | 0o100 | 0o2000 | 0o2000000, 0o600) };
        Some(Plan { below, at: number("FAULT_AT").unwrap_or(0), errno: number("FAULT_ERRNO")? as c_int, log })
    })
    .as_ref()
}

unsafe fn real_open(path: *const c_char, flags: c_int, mode: c_uint) -> c_int {
    let open: unsafe extern "C" fn(*const c_char, c_int, c_uint) -> c_int =
        unsafe { std::mem::transmute(dlsym(NEXT, c"open".as_ptr())) };
    unsafe { open(path, flags, mode) }
}

/// Counts a call about `path`; whether it must fail, for which the error is set.
fn fails(name: &str, path: &[u8]) -> bool {
    let Some(plan) = plan().filter(|plan| path.starts_with(plan.below.as_bytes())) else { return false };
    let n = COUNT.fetch_add(1, Ordering::SeqCst) + 1;
    let mut line = Vec::new();
    let _ = writeln!(line, "{n} {name} {}", String::from_utf8_lossy(path));
    // Not through `write`, which is ours.
    const SYS_WRITE: c_long = if cfg!(target_arch = "x86_64") { 1 } else { 64 };
    unsafe { syscall(SYS_WRITE, c_long::from(plan.log), line.as_ptr(), line.len()) };
    if n == plan.at {
        unsafe { *__errno_location() = plan.errno };
    }
    n == plan.at
}

unsafe fn named(name: &str, path: *const c_char) -> bool {
    !path.is_null() && fails(name, unsafe { CStr::from_ptr(path) }.to_bytes())
}

/// The same for a path that is relative to a directory, by its descriptor.
unsafe fn named_at(name: &str, directory: c_int, path: *const c_char) -> bool {
    if path.is_null() || unsafe { *path } == b'/' as c_char || directory < 0 {
        return unsafe { named(name, path) };
    }
    let mut whole = path_of(directory);
    whole.push(b'/');
    whole.extend_from_slice(unsafe { CStr::from_ptr(path) }.to_bytes());
    fails(name, &whole)
}

fn path_of(descriptor: c_int) -> Vec<u8> {
    let link = format!("/proc/self/fd/{descriptor}\0");
    let mut buffer = vec![0u8; 4096];
    let length = unsafe { readlink(link.as_ptr().cast(), buffer.as_mut_ptr().cast(), buffer.len()) };
    buffer.truncate(usize::try_from(length).unwrap_or(0));
    buffer
}

fn open_file(name: &str, descriptor: c_int) -> bool {
    descriptor > 2 && plan().is_some() && fails(name, &path_of(descriptor))
}

/// Stands for functions of the C library: `check` says whether the call fails, and what it then returns.
macro_rules! stand_for {
    ($($name:ident($($arg:ident: $kind:ty),*) -> $out:ty, $check:expr, $failed:expr;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arg: $kind),*) -> $out {
            static REAL: OnceLock<usize> = OnceLock::new();
            let symbol = concat!(stringify!($name), "\0");
            let real = *REAL.get_or_init(|| unsafe { dlsym(NEXT, symbol.as_ptr().cast()) } as usize);
            #[allow(unused_unsafe, reason = "some checks need it")]
            if unsafe { $check } {
                return $failed;
            }
            let real: unsafe extern "C" fn($($kind),*) -> $out = unsafe { std::mem::transmute(real) };
            unsafe { real($($arg),*) }
        }
    )*};
}

const FAILED_MAP: *mut c_void = -1isize as *mut c_void;

// The mode of an `open` that creates is passed like any other argument on the systems that this runs on.
stand_for! {
    open(path: *const c_char, flags: c_int, mode: c_uint) -> c_int, named("open", path), -1;
    open64(path: *const c_char, flags: c_int, mode: c_uint) -> c_int, named("open", path), -1;
    openat(at: c_int, path: *const c_char, flags: c_int, mode: c_uint) -> c_int, named_at("openat", at, path), -1;
    openat64(at: c_int, path: *const c_char, flags: c_int, mode: c_uint) -> c_int, named_at("openat", at, path), -1;
    mkdir(path: *const c_char, mode: c_uint) -> c_int, named("mkdir", path), -1;
    rename(from: *const c_char, to: *const c_char) -> c_int, named("rename", from), -1;
    unlink(path: *const c_char) -> c_int, named("unlink", path), -1;
    unlinkat(at: c_int, path: *const c_char, flags: c_int) -> c_int, named_at("unlinkat", at, path), -1;
    read(file: c_int, to: *mut c_void, count: usize) -> isize, open_file("read", file), -1;
    pread64(file: c_int, to: *mut c_void, count: usize, at: i64) -> isize, open_file("pread", file), -1;
    write(file: c_int, from: *const c_void, count: usize) -> isize, open_file("write", file), -1;
    pwrite64(file: c_int, from: *const c_void, count: usize, at: i64) -> isize, open_file("pwrite", file), -1;
    fsync(file: c_int) -> c_int, open_file("fsync", file), -1;
    fdatasync(file: c_int) -> c_int, open_file("fdatasync", file), -1;
    ftruncate64(file: c_int, length: i64) -> c_int, open_file("ftruncate", file), -1;
    mmap(at: *mut c_void, length: usize, access: c_int, flags: c_int, file: c_int, offset: i64) -> *mut c_void,
        open_file("mmap", file), FAILED_MAP;
    mmap64(at: *mut c_void, length: usize, access: c_int, flags: c_int, file: c_int, offset: i64) -> *mut c_void,
        open_file("mmap", file), FAILED_MAP;
}
