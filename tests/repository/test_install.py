"""What `cmake --install` puts down: a library others can build against, and files that systemd and udev understand."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from chainrun import BUILD, END_S, ROOT, running, simulation, write_flat_scene

from whisker_protocol import LIMITS

EXAMPLES = ROOT / "host/libwhisker/examples"
PRINTING = {"printf", "puts", "putchar", "fwrite", "fputs", "fputc", "fprintf", "vfprintf", "perror", "syslog"}
ENDING = {"abort", "exit", "_exit", "__assert_fail"}
EXPOSURE_MAX = 1.5  # of 10, by systemd-analyze security


def run(*words, **options) -> str:
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=END_S, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def tool(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not on this machine")
    return path


@pytest.fixture(scope="module")
def prefix(tmp_path_factory) -> Path:
    where = tmp_path_factory.mktemp("installed") / "usr"
    run("cmake", "--install", BUILD, "--prefix", where)
    return where


@pytest.fixture(scope="module")
def examples(prefix, tmp_path_factory) -> Path:
    """The examples, built by CMake against the installed library."""
    where = tmp_path_factory.mktemp("examples")
    run("cmake", "-S", EXAMPLES, "-B", where, f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", where)
    return where


def test_pkg_config_and_plain_cc_build_the_example(prefix, tmp_path):
    environment = {"PATH": "/usr/bin:/bin", "PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
    assert run("pkg-config", "--modversion", "whisker", env=environment).strip() == "0.1.0"
    for options in (["--cflags", "--libs"], ["--cflags", "--libs", "--static"]):
        flags = run("pkg-config", *options, "whisker", env=environment).split()
        run("cc", EXAMPLES / "read_ring.c", *flags, "-o", tmp_path / "read_ring", env=environment)
    words = [str(tmp_path / "read_ring"), "no-such-ring"]
    missing = subprocess.run(words, capture_output=True, text=True, env={"LD_LIBRARY_PATH": str(prefix / "lib")})
    assert missing.returncode == 1
    assert missing.stderr == "read_ring: no-such-ring: there is no ring of this name; start whiskerd with this --ring\n"


def test_example_streams_from_the_device(examples, tmp_path):
    scene, _ = write_flat_scene(tmp_path, 1)
    command = simulation(tmp_path, scene, 600, 1, "unused")
    words = [*command[: command.index("--") + 1], str(examples / "open_device")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=END_S)
    first, second = done.stdout.splitlines()
    assert first == f"bridge 0001, gateware {LIMITS['gateware_version']}"
    frames, good = map(int, re.fullmatch(r"(\d+) frames, (\d+) good readings", second).groups())
    assert frames > 2000 and good == 6 * frames


def test_example_reads_the_ring(examples, tmp_path):
    scene, _ = write_flat_scene(tmp_path, 1)
    with running(simulation(tmp_path, scene, 2, 1, "whisker-install")) as process:
        out = run(examples / "read_ring", "whisker-install")
        process.wait(END_S)
    ticks = [int(line.split()[1]) for line in out.splitlines()]
    assert ticks == list(range(ticks[0], 4000, 200)) and len(ticks) > 15
    assert re.fullmatch(r"tick \d+ at [\d.]+ s: alpha [-+][\d.]+ deg, beta [-+][\d.]+ deg", out.splitlines()[-1])


def test_library_exports_its_names_only_and_never_prints_or_ends(prefix):
    library = prefix / "lib/libwhisker.so"
    assert Path(library).resolve().name == "libwhisker.so.0.1.0"
    assert "SONAME               libwhisker.so.0" in run("objdump", "-p", library)
    exported = [line.split()[-1] for line in run("nm", "-D", "--defined-only", library).splitlines()]
    assert exported and all(re.fullmatch(r"whisker_[a-z0-9]+_[a-z0-9_]+", name) for name in exported), exported
    used = {re.sub("^__(.*)_chk$", r"\1", name) for name in undefined(library)}
    assert not used & (PRINTING | ENDING)


def undefined(path: Path) -> set[str]:
    """Names that a program or library takes from others."""
    return {line.split()[-1].split("@")[0] for line in run("nm", "-D", "--undefined-only", path).splitlines()}


HARDENED = ("bin/whiskerd", "bin/whisker-log", "bin/whisker-flash", "bin/whisker-base", "lib/libwhisker.so")


def test_everything_installed_is_in_the_list_of_what_is_hardened(prefix):
    found = [path for path in prefix.rglob("*") if path.is_file() and path.read_bytes()[:4] == b"\x7fELF"]
    assert {path.resolve() for path in found} == {(prefix / name).resolve() for name in HARDENED}


@pytest.mark.parametrize("name", HARDENED)
def test_programs_and_libraries_are_hardened(prefix, name):
    header = run("readelf", "-W", "--file-header", "--program-headers", "--dynamic", prefix / name)
    assert re.search(r"Type: +DYN ", header), "not position independent"
    assert "GNU_RELRO" in header and re.search(r"FLAGS.* (BIND_)?NOW", header), "its table of functions can be written"
    assert re.search(r"GNU_STACK .* RW +0x", header), "its stack can be executed"
    used = undefined(prefix / name)
    assert "__stack_chk_fail" in used, "built without -fstack-protector-strong"
    assert any(re.fullmatch("__.*_chk", one) for one in used), "built without _FORTIFY_SOURCE"


def test_python_module_is_hardened():
    for module in (ROOT / "host/python/crunchbot").glob("_native*.so"):
        header = run("readelf", "-W", "--program-headers", "--dynamic", module)
        assert "GNU_RELRO" in header and re.search(r"FLAGS.* (BIND_)?NOW", header), module
        assert "__stack_chk_fail" in undefined(module)


UNITS = {
    "whiskerd.service": "whiskerd --ring whisker --wait",
    "whisker-base@.service": "whisker-base --port /dev/%I --socket ${RUNTIME_DIRECTORY}/base.sock --wait",
}


@pytest.mark.parametrize("name", UNITS)
def test_units_are_sound_and_hardened(prefix, name):
    unit = prefix / "lib/systemd/system" / name
    assert f"ExecStart={prefix}/bin/{UNITS[name]}\n" in unit.read_text()
    analyze = tool("systemd-analyze")
    run(analyze, "verify", unit)
    verdict = run(analyze, "security", "--offline=true", "--no-pager", f"--threshold={EXPOSURE_MAX * 10:.0f}", unit)
    assert "Overall exposure level" in verdict


def test_services_run_as_users_that_sysusers_makes(prefix):
    made = set(re.findall(r"^u (\S+) ", (prefix / "lib/sysusers.d/whisker.conf").read_text(), re.MULTILINE))
    units = "".join((prefix / "lib/systemd/system" / name).read_text() for name in UNITS)
    assert made == set(re.findall(r"^User=(\S+)$", units, re.MULTILINE)) == {"whisker", "whisker-base"}
    rule = (prefix / "lib/udev/rules.d/70-whisker.rules").read_text()
    assert set(re.findall(r'GROUP="(\S+)"', rule)) <= made


def test_udev_rule_names_the_bridge_and_its_unit(prefix):
    text = (prefix / "lib/udev/rules.d/70-whisker.rules").read_text()
    rules = [line for line in text.splitlines() if line and not line.startswith("#")]
    pair = re.compile(r'([A-Z]+(?:\{[A-Za-z_]+\})?)(==|\+=|=)"([^"]*)"')
    for rule in rules:
        parts = [part.strip() for part in rule.split(",")]
        assert all(pair.fullmatch(part) for part in parts), rule
        items = {pair.fullmatch(part)[1] + pair.fullmatch(part)[2]: pair.fullmatch(part)[3] for part in parts}
        assert items["ATTR{idVendor}=="] == f"{LIMITS['usb_vendor_id']:04x}"
        assert items["ATTR{idProduct}=="] == f"{LIMITS['usb_product_id']:04x}"
        assert f'"{items["ATTR{product}=="]}"' in (ROOT / "fpga/usb/descriptors.py").read_text()
        assert items["ENV{SYSTEMD_WANTS}+="] == "whiskerd.service"
        assert 'TAG+="uaccess"' in rule and items["GROUP="] == "whisker" and items["MODE="] == "0660"
    assert len(rules) == 1
    if "verify" in subprocess.run([tool("udevadm"), "--help"], capture_output=True, text=True).stdout:
        run("udevadm", "verify", prefix / "lib/udev/rules.d/70-whisker.rules")
