"""The transports the ring is measured against, and how their programs come about."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
SOURCES = ROOT / "tools/benches/host/peers"
CACHE = ROOT / "build/bench/ring"
CMAKE_NEEDED = (3, 30)

# name -> title, program, wait modes, what it needs
PEERS = {
    "whisker": ("whisker ring", "peer_whisker", ("poll", "wait")),
    "iceoryx2": ("iceoryx2", "peer_iceoryx2", ("poll", "wait")),
    "aeron": ("Aeron IPC", "peer_aeron", ("poll",)),  # has no receive that sleeps
    "zenoh": ("zenoh, shared memory", "peer_zenoh", ("poll", "wait")),
    "zeromq": ("ZeroMQ, ipc", "peer_zeromq", ("poll", "wait")),
    "lcm": ("LCM, UDP multicast", "peer_lcm", ("poll", "wait")),
    "memory": ("limit: bare shared memory", "peer_memory", ("poll",)),  # no queue: of latency alone
}


def build_c(build: Path, name: str, flags: list[str]) -> Path:
    program = CACHE / "bin" / f"peer_{name}"
    program.parent.mkdir(parents=True, exist_ok=True)
    command = ["cc", "-O2", "-std=gnu11", f"-I{ROOT}/host/libwhisker/include"]
    command += [str(SOURCES / f"peer_{name}.c"), str(SOURCES / "harness.c"), "-o", str(program), *flags]
    subprocess.run(command, check=True)
    return program


def pkg_config(module: str) -> list[str] | None:
    found = subprocess.run(["pkg-config", "--cflags", "--libs", module], capture_output=True, text=True)
    return found.stdout.split() if found.returncode == 0 else None


def cmake_folder() -> Path | None:
    """Where a CMake new enough for Aeron is: the system's, or one in a virtual environment of the bench's own."""
    text = subprocess.run(["cmake", "--version"], capture_output=True, text=True).stdout.split()
    if tuple(map(int, text[2].split(".")[:2])) >= CMAKE_NEEDED:
        return Path(shutil.which("cmake")).parent
    folder = CACHE / "venv"
    if not (folder / "bin/cmake").exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        pip = [str(folder / "bin/pip"), "install", "--quiet", "--disable-pip-version-check", "--require-hashes"]
        if subprocess.run([*pip, "-r", str(SOURCES / "requirements.lock")]).returncode != 0:
            return None
    return folder / "bin"


def build_rust() -> Path | None:
    """The folder of the Rust peers' programs; compiling takes minutes the first time."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", CACHE / "target"))
    cmake = cmake_folder()
    features = ["--features", "aeron"] if cmake and shutil.which("clang") else []
    environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
    if cmake:
        environment["PATH"] = f"{cmake}:{environment['PATH']}"
    command = ["cargo", "build", "--release", "--locked", "--quiet", *features]
    print("ring bench: compiling iceoryx2, zenoh and Aeron (about ten minutes the first time)")
    built = subprocess.run(command, cwd=SOURCES, env=environment)
    return target / "release" if built.returncode == 0 else None


def programs(build: Path) -> dict[str, Path]:
    """The programs there are. What cannot be built is named, with what would help."""
    archive = build / "host/libwhisker/libwhisker.a"
    found = {"whisker": build_c(build, "whisker", [str(archive)]), "memory": build_c(build, "memory", [])}
    for name, module, package in (("lcm", "lcm", "liblcm-dev"), ("zeromq", "libzmq", "libzmq3-dev")):
        flags = pkg_config(module)
        if flags:
            found[name] = build_c(build, name, flags)
        else:
            print(f"ring bench: {PEERS[name][0]} left out; to have it: apt-get install {package}")
    rust = build_rust() if shutil.which("cargo") else None
    for name in ("iceoryx2", "zenoh", "aeron"):
        if rust and (rust / f"peer_{name}").exists():
            found[name] = rust / f"peer_{name}"
        else:
            print(f"ring bench: {PEERS[name][0]} left out; to have it: install Rust 1.85 or newer (rustup) and clang")
    return found
