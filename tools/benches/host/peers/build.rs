fn main() {
    println!("cargo:rerun-if-changed=harness.c");
    println!("cargo:rerun-if-changed=harness.h");
    cc::Build::new().file("harness.c").std("gnu11").compile("harness");
}
