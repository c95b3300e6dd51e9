//! The measuring harness (harness.h) from Rust.

use std::ffi::{CString, c_char, c_int};
use std::process::exit;

pub const FRAME_BYTES: usize = 256;
pub type Frame = [u8; FRAME_BYTES];

#[repr(C)]
struct Opaque {
    _private: [u8; 0],
}

unsafe extern "C" {
    fn bench_open(argc: c_int, argv: *mut *mut c_char) -> *mut Opaque;
    fn bench_publishes(bench: *const Opaque) -> bool;
    fn bench_waits(bench: *const Opaque) -> bool;
    fn bench_start(bench: *mut Opaque);
    fn bench_next(bench: *mut Opaque, frame: *mut u8) -> bool;
    fn bench_finish(bench: *mut Opaque) -> c_int;
    fn bench_ready(bench: *mut Opaque);
    fn bench_take(bench: *mut Opaque, frame: *const u8);
    fn bench_over(bench: *mut Opaque) -> bool;
    fn bench_report(bench: *mut Opaque) -> c_int;
}

/// One process's part of a run. SAFETY of all calls: the pointer is the harness's own and never freed.
pub struct Bench(*mut Opaque);

impl Bench {
    pub fn from_args() -> Bench {
        let words: Vec<CString> = std::env::args().map(|word| CString::new(word).unwrap()).collect();
        let mut argv: Vec<*mut c_char> = words.into_iter().map(CString::into_raw).collect();
        let bench = unsafe { bench_open(argv.len() as c_int, argv.as_mut_ptr()) };
        if bench.is_null() {
            exit(2);
        }
        Bench(bench)
    }

    pub fn publishes(&self) -> bool {
        unsafe { bench_publishes(self.0) }
    }

    pub fn waits(&self) -> bool {
        unsafe { bench_waits(self.0) }
    }

    pub fn start(&mut self) {
        unsafe { bench_start(self.0) }
    }

    pub fn next(&mut self, frame: &mut Frame) -> bool {
        unsafe { bench_next(self.0, frame.as_mut_ptr()) }
    }

    pub fn finish(&mut self) -> i32 {
        unsafe { bench_finish(self.0) }
    }

    pub fn ready(&mut self) {
        unsafe { bench_ready(self.0) }
    }

    pub fn take(&mut self, frame: &[u8]) {
        if frame.len() == FRAME_BYTES {
            unsafe { bench_take(self.0, frame.as_ptr()) }
        }
    }

    pub fn over(&mut self) -> bool {
        unsafe { bench_over(self.0) }
    }

    pub fn report(&mut self) -> i32 {
        unsafe { bench_report(self.0) }
    }
}
