"""What `cmake --install` puts down: a library others can build against, and files that systemd and udev understand."""

import re
import shutil
import subprocess
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest
from catkin_pkg.package import parse_package
from chainrun import BUILD, END_S, ROOT, running, simulation, write_flat_scene

import crunchbot
from crunchbot.bridge.ring import Reader
from crunchbot.programs import program
from whisker_protocol import LIMITS

EXAMPLES = ROOT / "host/examples"
VERSION = re.search(r'WHISKER_VERSION "(.*)"', (ROOT / "host/libwhisker/include/whisker/version.h").read_text())[1]
SONAME = VERSION.rpartition(".")[0]
# library: how its names begin
LIBRARIES = {"whisker": "whisker", "whisker-nav": "nav", "whisker-create": "create"}
PRINTING = {"printf", "puts", "putchar", "fwrite", "fputs", "fputc", "fprintf", "vfprintf", "perror", "syslog"}
ENDING = {"abort", "exit", "_exit", "__assert_fail"}
BUILD_S = 600  # for a whole build, on a machine at load 15
EXPOSURE_MAX = 1.5  # of 10, by systemd-analyze security


def run(*words, **options) -> str:
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=BUILD_S, **options)
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


def test_each_program_has_a_manual_page_of_its_help(prefix):
    tool("help2man")
    for name in ("whiskerd", "whisker-log", "whisker-flash", "whisker-base"):
        page = (prefix / f"share/man/man1/{name}.1").read_text().replace("\\-", "-")
        assert set(re.findall(r"^  (--[\w-]+)", run(program(name), "--help"), re.MULTILINE)) - {"--help"} <= set(
            re.findall(r"--[\w-]+", page)
        )


def test_pkg_config_and_plain_cc_build_the_example(prefix, tmp_path):
    environment = {"PATH": "/usr/bin:/bin", "PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
    for library in LIBRARIES:
        assert run("pkg-config", "--modversion", library, env=environment).strip() == VERSION
    for options in (["--cflags", "--libs"], ["--cflags", "--libs", "--static"]):
        flags = run("pkg-config", *options, "whisker", env=environment).split()
        run("cc", EXAMPLES / "read_ring.c", *flags, "-o", tmp_path / "read_ring", env=environment)
    words = [str(tmp_path / "read_ring"), "no-such-ring"]
    missing = subprocess.run(words, capture_output=True, text=True, env={"LD_LIBRARY_PATH": str(prefix / "lib")})
    assert missing.returncode == 1
    assert missing.stderr == "read_ring: no-such-ring: there is no ring of this name; start whiskerd with this --ring\n"


@pytest.mark.parametrize(
    ("example", "library", "answer"),
    [
        ("newest_sample.cpp", "whisker", "newest_sample: no-such-ring: there is no ring of this name; start whiskerd"),
        ("locate.cpp", "whisker-nav", r"at \(1.19, 1.38\), found at "),
    ],
)
def test_one_command_builds_a_client_in_cpp(prefix, tmp_path, example, library, answer):
    environment = {"PATH": "/usr/bin:/bin", "PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
    flags = run("pkg-config", "--cflags", "--libs", library, env=environment).split()
    strict = ["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    run("c++", *strict, EXAMPLES / example, *flags, "-o", tmp_path / "client", env=environment)
    words = [str(tmp_path / "client"), "no-such-ring"]
    done = subprocess.run(words, capture_output=True, text=True, env={"LD_LIBRARY_PATH": str(prefix / "lib")})
    assert re.match(answer, done.stdout + done.stderr)


def test_every_public_header_is_cpp_and_needs_no_other(prefix, tmp_path):
    include = prefix / "include"
    folders = (include / "whisker", include / "whisker-nav", include / "whisker-create/create")
    headers = [header for folder in folders for header in sorted(folder.glob("*.h"))]
    assert len(headers) > 35
    options = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"]
    options += [f"-I{include / folder}" for folder in (".", "whisker-nav", "whisker-create")]
    for language, standard in (("c++", "-std=c++17"), ("c", "-std=c11")):
        for header in headers:
            source = tmp_path / "client"
            source.write_text(f'#include "{header}"\n')
            run("cc", "-x", language, standard, *options, source)


def test_examples_of_filters_and_base_work(examples, tmp_path):
    run(examples / "uwb_range")
    run(examples / "locate")
    link = tmp_path / "create"
    with running([program("whisker-create-sim"), "--link", link], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        begun = time.monotonic()
        ahead = run(examples / "drive_base", link)
        seconds = time.monotonic() - begun
    # At 0.1 m/s for 2.01 s of frames, or longer where the machine is late; the base takes its time to speed up.
    assert 0.17 < float(ahead.split()[0]) < 0.21 * max(seconds / 2.02, 1.0), ahead


def test_a_plain_configure_builds_and_installs_the_host_without_python_cpp_and_cmocka(tmp_path):
    """What a packager does in a fresh clone; the files are those of git, so that no environment is there."""
    source, build, where = tmp_path / "source", tmp_path / "build", tmp_path / "usr"
    for name in run("git", "ls-files", cwd=ROOT).split("\n"):
        if name.startswith(("host/", "protocol/", "CMake")) and (ROOT / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, source / name)
    run("cmake", "-S", source, "-B", build, "-DBUILD_TESTING=OFF", "-DCMAKE_CXX_COMPILER=/nonexistent")
    run("cmake", "--build", build, "--parallel", "2")
    run("cmake", "--install", build, "--prefix", where)
    assert run(where / "bin/whiskerd", "--version") == f"whiskerd {VERSION}\n"
    assert not list(build.rglob("test_*"))


def test_every_version_is_the_same():
    for name in ("pyproject.toml", "lab/pyproject.toml"):
        text = (ROOT / name).read_text()
        assert all(
            found == VERSION
            for found in re.findall(r'^version = "(.*)"|crunchbot==([\d.]+)', text, re.M)
            for found in found
            if found
        )
    assert crunchbot.__version__ == VERSION


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
        Reader("whisker-install", wait_s=END_S).close()
        out = run(examples / "read_ring", "whisker-install")
        process.wait(END_S)
    ticks = [int(line.split()[1]) for line in out.splitlines()]
    assert ticks == list(range(ticks[0], 4000, 200)) and len(ticks) > 15
    assert re.fullmatch(r"tick \d+ at [\d.]+ s: alpha [-+][\d.]+ deg, beta [-+][\d.]+ deg", out.splitlines()[-1])


@pytest.mark.parametrize("name", LIBRARIES)
def test_library_exports_its_names_only_and_never_prints_or_ends(prefix, name):
    library = prefix / f"lib/lib{name}.so"
    assert Path(library).resolve().name == f"lib{name}.so.{VERSION}"
    assert f"SONAME               lib{name}.so.{SONAME}\n" in run("objdump", "-p", library)
    exported = [line.split()[-1] for line in run("nm", "-D", "--defined-only", library).splitlines()]
    assert exported and all(re.fullmatch(rf"{LIBRARIES[name]}_[a-z0-9_]+", one) for one in exported), exported
    used = {re.sub("^__(.*)_chk$", r"\1", one) for one in undefined(library)}
    assert not used & (PRINTING | ENDING)


def undefined(path: Path) -> set[str]:
    """Names that a program or library takes from others."""
    return {line.split()[-1].split("@")[0] for line in run("nm", "-D", "--undefined-only", path).splitlines()}


HARDENED = (
    "bin/whiskerd",
    "bin/whisker-log",
    "bin/whisker-flash",
    "bin/whisker-base",
    *(f"lib/lib{name}.so" for name in LIBRARIES),
)


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
    # The compiler sees the size of every buffer that the Create library hands to a function: no check is left to be made.
    checked = any(re.fullmatch("__.*_chk", one) for one in used)
    assert checked or name == "lib/libwhisker-create.so", "built without _FORTIFY_SOURCE"


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
    metainfo = ElementTree.parse(prefix / "share/metainfo/org.example.crunchbot.whiskerd.metainfo.xml")
    ids = f"v{LIMITS['usb_vendor_id']:04X}p{LIMITS['usb_product_id']:04X}"
    assert metainfo.findtext("provides/modalias") == f"usb:{ids}d*"
    if "verify" in subprocess.run([tool("udevadm"), "--help"], capture_output=True, text=True).stdout:
        # The group comes with the package, by sysusers; a machine that only builds has none of that name.
        run("udevadm", "verify", "--resolve-names=never", prefix / "lib/udev/rules.d/70-whisker.rules")


def test_the_package_of_messages_is_as_ros_needs_it(prefix):
    """Manifest and rules of names as colcon and rosidl have them; what the messages use is what manifest and build name."""
    package = prefix / "share/whisker_msgs"
    manifest = parse_package(str(package))
    manifest.validate()
    assert (manifest.name, manifest.version, manifest.get_build_type()) == ("whisker_msgs", VERSION, "ament_cmake")
    assert [group.name for group in manifest.member_of_groups] == ["rosidl_interface_packages"]
    messages = {path.stem: path.read_text() for path in (package / "msg").glob("*.msg")}
    assert messages.keys() >= {"Observation", "Belief", "Block"}
    fields = [line.partition("#")[0].split() for text in messages.values() for line in text.splitlines()]
    for kind, name, *_ in filter(None, fields):
        assert re.fullmatch(r"(?!.*__)[a-z][a-z0-9_]*(?<!_)|[A-Z]([A-Z0-9_]*[A-Z0-9])?=\d+", name), (kind, name)
    used = {kind.partition("/")[0] for kind, *_ in filter(None, fields) if "/" in kind}
    generators = {"rosidl_default_generators", "ament_cmake"}
    build = (package / "CMakeLists.txt").read_text()
    assert used == {depend.name for depend in manifest.build_depends}
    assert used == set(re.search(r"DEPENDENCIES ([\w ]+)\)", build)[1].split())
    assert used | generators == set(re.findall(r"find_package\((\w+) REQUIRED\)", build))
    assert generators == {depend.name for depend in manifest.buildtool_depends}
