"""From the compiler's HEX to the chip: images, first programming by wire, what is missing is said; the chip's code compiles."""

import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools/firmware"))
import check_listing  # noqa: E402
import intel_hex  # noqa: E402
import make_image  # noqa: E402

FIRST = make_image.FIRST_ROW * 128
FIRMWARE = ROOT / "firmware/dspic"


def hex_file(path: Path, words: int, first: int = FIRST) -> Path:
    intel_hex.write(path, {2 * first + i: (7 * i + i // 4) % 251 if i % 4 != 3 else 0 for i in range(4 * words)})
    return path


def run(*words, **environment) -> subprocess.CompletedProcess:
    return subprocess.run(
        [str(word) for word in words], capture_output=True, text=True, cwd=ROOT, env=os.environ | environment
    )


def test_an_image_holds_the_code_and_nothing_of_the_phantom_bytes(tmp_path):
    source = hex_file(tmp_path / "app.hex", 100)
    image = make_image.make_image(source, 0x0102)
    memory = intel_hex.read(source)
    wanted = bytes(memory[2 * FIRST + i] for i in range(400) if i % 4 != 3)
    assert image[48 : 48 + 300] == wanted and set(image[348:]) == {0xFF}
    assert (len(image) - 48) % 192 == 0


@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda text: text.replace(":10", ":11", 1), "checksum is wrong"),
        (lambda text: text[: text.rindex(":00000001FF")], "cut short"),
        (lambda text: "hello\n" + text, "checksum is wrong"),
    ],
)
def test_a_damaged_hex_file_is_refused_in_one_line(tmp_path, spoil, message):
    source = hex_file(tmp_path / "app.hex", 100)
    source.write_text(spoil(source.read_text()))
    done = run(
        sys.executable, "tools/firmware/make_image.py", "image", source, tmp_path / "out.whex", "--version", "1.0"
    )
    assert done.returncode == 1 and message in done.stderr and done.stderr.count("\n") == 1


def test_code_in_the_others_place_is_refused(tmp_path):
    done = run(
        sys.executable,
        "tools/firmware/make_image.py",
        "image",
        hex_file(tmp_path / "a.hex", 9, 0x200),
        tmp_path / "o",
        "--version",
        "1.0",
    )
    assert done.returncode == 1 and "which is the loader's" in done.stderr
    done = run(
        sys.executable,
        "tools/firmware/make_image.py",
        "wire",
        hex_file(tmp_path / "b.hex", 9),
        tmp_path / "o",
        "--serial",
        "5",
    )
    assert done.returncode == 1 and "code in the application's rows" in done.stderr


def test_what_goes_by_wire_is_loader_header_application_and_number(tmp_path):
    loader, app = hex_file(tmp_path / "loader.hex", 50, 0x200), hex_file(tmp_path / "app.hex", 100)
    image = make_image.make_image(app, 1)
    memory = make_image.wire_memory(loader, image, 0x01020304)
    placed = make_image.flash_bytes(memory)
    assert bytes(placed[make_image.HEADER_ROW * 192 + i] for i in range(48)) == image[:48]
    assert bytes(placed[FIRST // 2 * 3 + i] for i in range(len(image) - 48)) == image[48:]
    assert [memory[make_image.FUID0 + 4 * i] for i in range(4)] == [4, 3, 2, 1]
    assert all(memory[a] == byte for a, byte in intel_hex.read(loader).items())


WANTED = {
    "ipecmd": "-P33FJ128MC802 -TPPPK3 -M -F{hex} -OL",
    "pk2cmd": "-PdsPIC33FJ128MC802 -M -F{hex} -Y -R",
    "picberry": "-f dspic33f -w {hex}",
}


def wire_file(folder: Path, chip: int = 0x0629, wire: int = make_image.WIRE_VERSION) -> Path:
    """What `make flash` programs: a loader and an application, of some bytes, with configuration words."""
    loader, app = hex_file(folder / "loader.hex", 50, 0), hex_file(folder / "app.hex", 100)
    image = make_image.make_image(app, 1, chip=chip, wire=wire)
    memory = make_image.wire_memory(loader, image, None) | {make_image.CONFIG: 0xCF, make_image.CONFIG + 1: 0}
    intel_hex.write(folder / "wire.hex", memory)
    return folder / "wire.hex"


def programmer(folder: Path, name: str, text: str) -> str:
    """A program of that name in `folder`; returns a PATH on which it comes first."""
    (folder / name).write_text(f"#!/bin/sh\n{text}\n")
    (folder / name).chmod(0o755)
    return f"{folder}:{os.environ['PATH']}"


# As picberry does: -w FILE and -r FILE; always 0, whatever it found. A chip is what is in the file chip.hex.
PICBERRY = """for word; do
    case $before in -w) sed "$SPOIL" "$word" >{folder}/chip.hex ;; -r) [ -n "$MUTE" ] || cp {folder}/chip.hex "$word" ;; esac
    before=$word
done"""


@pytest.mark.parametrize("tool", WANTED)
def test_programmers_are_called_as_they_want_it(tmp_path, tool):
    """A stand-in on PATH writes down its arguments."""
    source = wire_file(tmp_path)
    path = programmer(
        tmp_path, tool, f'echo "$@" >>{tmp_path}/called; for last; do :; done; cp {source} "$last" 2>&1; true'
    )
    words = ["tools/firmware/flash.sh", "--tool", tool, "--hex", source]
    done = run(*words, PATH=path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "called").read_text().splitlines()[0] == WANTED[tool].format(hex=source)
    (tmp_path / "called").unlink()
    done = run(*words, "--serial", 71, "--dry-run", PATH=path)
    assert done.stdout.split(" ", 1)[1].strip() == WANTED[tool].format(hex="build/firmware/node_71.hex")
    assert not (tmp_path / "called").exists()
    assert intel_hex.read(ROOT / "build/firmware/node_71.hex")[make_image.FUID0] == 71
    done = run(*words, PATH=programmer(tmp_path, tool, "exit 3"))
    assert done.returncode == 1 and "check supply" in done.stderr


@pytest.mark.parametrize(
    "environment, message",
    [
        ({}, ""),
        ({"SPOIL": "s/^:10001000.*/:1000100000000000000000000000000000000000E0/"}, "of the chip, not"),
        ({"SPOIL": "/^:020000000*CF/s/.*/:02000000EF000F/"}, "0xef at 0xf80000 of the chip, not 0xcf"),
        ({"MUTE": "yes"}, "read nothing back"),
    ],
)
def test_what_picberry_leaves_in_the_chip_is_read_back_and_compared(tmp_path, environment, message):
    """Its exit status is 0 even when its own comparison failed, and it compares no configuration words."""
    source = wire_file(tmp_path)
    path = programmer(tmp_path, "picberry", PICBERRY.format(folder=tmp_path))
    words = ["tools/firmware/flash.sh", "--tool", "picberry", "--hex", source, "--serial", 5]
    done = run(*words, **({"PATH": path, "SPOIL": "", "MUTE": ""} | environment))
    errors = done.stderr.splitlines()
    assert (done.returncode, len(errors)) == ((1, 1) if message else (0, 0)), done.stderr
    assert message in done.stderr and ("configuration words are right" in done.stdout) == (not message)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda folder: wire_file(folder, chip=0x062B), "for chip 0x062b, not 0x0629"),
        (lambda folder: wire_file(folder, wire=make_image.WIRE_VERSION + 1), "take image and host of one release"),
        (lambda folder: hex_file(folder / "app.hex", 100), "nothing at the reset vector"),
        (lambda folder: hex_file(folder / "loader.hex", 50, 0), "no application header"),
        (lambda folder: one_byte_changed(wire_file(folder)), "CRC-32 is wrong"),
    ],
)
def test_what_is_no_image_of_this_board_is_not_programmed(tmp_path, make, message):
    path = programmer(tmp_path, "ipecmd", f"touch {tmp_path}/called")
    done = run("tools/firmware/flash.sh", "--tool", "ipecmd", "--hex", make(tmp_path), "--serial", 3, PATH=path)
    assert done.returncode == 1 and message in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "called").exists()


def one_byte_changed(path: Path) -> Path:
    memory = intel_hex.read(path)
    memory[2 * FIRST] ^= 1
    intel_hex.write(path, memory)
    return path


@pytest.mark.parametrize(
    "words, message",
    [
        ([], "which programmer"),
        (["--tool", "stk500"], "use ipecmd, pk2cmd or picberry"),
        (["--tool", "ipecmd", "--hex", "none.hex", "--dry-run"], "a file of make firmware with HEX=FILE"),
        (["--tool", "ipecmd", "--hex", "none.hex"], "install MPLAB X with its IPE"),
        (["--tool", "ipecmd", "--serial", "x"], "whole number"),
        (["--hex", "README.md", "--tool"], "--tool: wants a value"),
        (["--tool", "ipecmd", "--hex", "README.md"], "install MPLAB X with its IPE"),
        (["--tool", "pk2cmd", "--hex", "README.md"], "install pk2cmd for the PICkit 2"),
        (["--tool", "picberry", "--hex", "README.md"], "install picberry"),
    ],
)
def test_what_is_missing_for_programming_is_said(words, message):
    done = run("tools/firmware/flash.sh", *words)
    assert done.returncode == 1 and message in done.stderr


def test_a_serial_number_that_means_none_is_refused_in_one_line(tmp_path):
    words = ["--tool", "pk2cmd", "--hex", wire_file(tmp_path), "--dry-run"]
    done = run("tools/firmware/flash.sh", *words, "--serial", 0xFFFFFFFF)
    assert done.returncode == 1 and "give a number from 1 to 4294967294" in done.stderr
    assert done.stderr.count("\n") == 1


def test_without_its_compiler_the_firmware_build_says_so(tmp_path):
    done = run("tools/firmware/build.sh", PATH="/usr/bin:/bin", PIC30="", OUT=str(tmp_path))
    assert done.returncode == 1 and "install MPLAB XC-DSC or XC16" in done.stderr
    (tmp_path / "cc1").touch()
    done = run("tools/firmware/build.sh", PIC30=str(tmp_path), OUT=str(tmp_path / "out"))
    assert done.returncode == 1 and f"PIC30={tmp_path}: no as in it" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize("define", ["-DNODE_APPLICATION", "-DNODE_LOADER"])
def test_the_code_for_the_chip_compiles(define):
    sources = [
        path for folder in ("core", "boot", "port_dspic", "port_dspic/chip") for path in FIRMWARE.glob(f"{folder}/*.c")
    ]
    includes = [f"-I{FIRMWARE / folder}" for folder in (".", "core", "port_dspic")] + [f"-I{ROOT}/protocol/gen"]
    stub = ["-include", FIRMWARE / "tests/xc16_stub.h"]
    flags = ["-std=gnu99", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-Wno-attributes", "-D__dsPIC33F__", define]
    done = run("cc", *flags, *stub, *includes, *sources)
    assert done.returncode == 0, done.stderr


SAMPLE_PATH = [f"core/{name}" for name in ("sensor_frame", "record", "sampler", "node", "service")]
SAMPLE_PATH += [f"port_dspic/{name}" for name in ("port", "sensor_spi", "link_spi")]


@pytest.mark.skipif(not shutil.which("avr-gcc"), reason="avr-gcc stands in for the chip's compiler")
@pytest.mark.parametrize("name", SAMPLE_PATH)
def test_the_sample_path_calls_no_library_where_int_has_16_bits(name):
    """Nor does a value lose bits unsaid. The one helper allowed multiplies 16 by 16 bits: one instruction on the dsPIC."""
    includes = [f"-I{FIRMWARE / folder}" for folder in (".", "core", "port_dspic")] + [f"-I{ROOT}/protocol/gen"]
    flags = ["-mmcu=atmega1284p", "-std=gnu99", "-O1", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wno-attributes"]
    stub = ["-D__dsPIC33F__", "-include", FIRMWARE / "tests/xc16_stub.h"]
    done = run("avr-gcc", *flags, *stub, *includes, "-S", FIRMWARE / f"{name}.c", "-o", "-")
    assert done.returncode == 0, done.stderr
    called = set(re.findall(r"\b(?:r?call|r?jmp)\s+(__\w+)", done.stdout))
    assert {helper for helper in called if not helper.startswith("__builtin_")} <= {"__umulhisi3"}


@pytest.mark.parametrize("name", SAMPLE_PATH)
def test_the_sample_path_has_no_initialised_data(tmp_path, name):
    """Nor any other of its own: all state is the caller's, in struct board."""
    includes = [f"-I{FIRMWARE / folder}" for folder in (".", "core", "port_dspic")]
    includes += [f"-I{ROOT / folder}" for folder in ("protocol/gen", "sim/dspic")]
    done = run("cc", "-std=c99", "-O1", *includes, "-c", FIRMWARE / f"{name}.c", "-o", tmp_path / "out.o")
    assert done.returncode == 0, done.stderr
    symbols = run("nm", tmp_path / "out.o").stdout
    assert " T " in symbols and not re.findall(r"^.* [bBcCdDsS] .*$", symbols, re.M)


def test_the_watchdogs_period_is_the_models():
    """LPRC runs at 32 kHz; the configuration words are the chip's, the parameter the model's."""
    words = dict(
        re.findall(r"CONFIG\(config_(\w+), 0x\w+,\s*0x(\w+)\)", (FIRMWARE / "port_dspic/chip/config.c").read_text())
    )
    fwdt = int(words["fwdt"], 16)
    period_ms = (128 if fwdt & 0x10 else 32) * 2 ** (fwdt & 15) / 32
    assert f".watchdog_ms = {period_ms:.0f}," in (ROOT / "sim/dspic/dspic.c").read_text()


@pytest.mark.parametrize("time", ["STARTUP", "T2", "T4", "T5", "T6", "T7"])
def test_waits_too_short_for_the_sensor_do_not_compile(tmp_path, time):
    """No wait has a factor of two to spare: with any of the data sheet's times doubled, one is too short."""
    core = shutil.copytree(FIRMWARE / "core", tmp_path / "core")
    call = ["cc", "-std=c99", "-fsyntax-only", f"-I{core}", f"-I{FIRMWARE}", f"-I{ROOT}/protocol/gen"]
    assert run(*call, core / "sampler.c").returncode == 0
    sheet = core / "mlx90333_datasheet.h"
    doubled, count = re.subn(rf"(#define MLX90333_{time}_NS) ", r"\1 2u * ", sheet.read_text())
    sheet.write_text(doubled)
    done = run(*call, core / "sampler.c")
    assert count == 1 and done.returncode != 0
    assert "a wait is shorter than the sensor may need" in done.stderr


STAND_IN = """#!{python}
import shutil, sys
from pathlib import Path
sys.path.insert(0, "{tools}")
import intel_hex
folder, name, words = Path("{folder}"), Path(sys.argv[0]).name, sys.argv[1:]
if name.endswith("gcc"):
    if "--version" in words:
        sys.exit(print("xc16-gcc, the stand-in"))
    if words[0].startswith("-print-prog-name="):
        sys.exit(print(folder / "bin/xc16-ld"))
    with open(folder / "called", "a") as called:
        print(*words, file=called)
    made = Path(words[words.index("-o") + 1] if "-o" in words else words[-1].split("-o,")[1].split(",")[0])
    made.touch()
    if script := [part for word in words for part in word.split(",") if part.startswith("--script=")]:
        shutil.copy(script[0].removeprefix("--script="), made.with_suffix(".script"))
elif name.endswith("bin2hex"):
    memory = intel_hex.read(folder / (Path(words[0]).stem + ".hex.in"))
    if ".reset" in Path(words[0]).with_suffix(".script").read_text():
        memory |= {{at: at for at in range(8)}}  # as the chip's linker makes it of a vendor's script: goto __reset
    intel_hex.write(Path(words[0]).with_suffix(".hex"), memory)
elif name.endswith("objdump"):
    print("00002300 <_node_on_sync>:")
elif name.endswith("ld"):
    print("--no-ivt")
"""


def stand_in_compiler(folder: Path) -> dict[str, str]:
    """xc16-gcc and its kin as a script that writes down its arguments and makes of the linker script what the linker does."""
    folder.mkdir(exist_ok=True)
    loader, app = hex_file(folder / "loader.hex.in", 50, 0x200), hex_file(folder / "application.hex.in", 100)
    assert loader != app
    (folder / "bin").mkdir()
    text = STAND_IN.format(python=sys.executable, tools=ROOT / "tools/firmware", folder=folder)
    for name in ("xc16-gcc", "xc16-bin2hex", "xc16-objdump", "xc16-ld"):
        (folder / "bin" / name).write_text(text)
        (folder / "bin" / name).chmod(0o755)
    (folder / "p33FJ128MC802.gld").write_text(
        "MEMORY {\n  program (xr)   : ORIGIN = 0x200,        LENGTH = 0x15600\n}\nSECTIONS {\n"
        "  .reset :\n  {\n    SHORT(ABSOLUTE(__reset));\n  } >reset\n"
        "  .ivt __IVT_BASE :\n  {\n    LONG(0);\n  } >ivt\n  .aivt __AIVT_BASE :\n  {\n    LONG(0);\n  } >aivt\n  .text : { } >program\n}\n"
    )
    return {"PATH": f"{folder}/bin:{os.environ['PATH']}", "OUT": str(folder / "out")}


def test_page_0_is_the_sources_and_the_stack_ends_below_the_dmas_memory(tmp_path):
    """No reset instruction and no vector table comes of a linker script: vectors.s and the jump table bring them."""
    done = run("tools/firmware/build.sh", **stand_in_compiler(tmp_path))
    assert done.returncode == 0, done.stderr
    calls = (tmp_path / "called").read_text().splitlines()
    assert all("-merrata=exch" in call for call in calls if "-c" in call.split())
    links = [call for call in calls if "--script=" in call]
    assert len(links) == 2 and all("--no-ivt" in link and "-nostartfiles" in link for link in links)
    assert "/vectors.o" in links[0] and "/jump_table.o" in links[1]
    for name, origin in (("loader", "0x200, LENGTH = 0x1E00"), ("application", "0x2280, LENGTH = 0x13580")):
        script = (tmp_path / "out" / f"{name}.gld").read_text()
        assert f"ORIGIN = {origin}" in script and "ivt" not in script and "@" not in script
        data = re.search(r"data +\(a!xr\) : ORIGIN = (0x\w+), +LENGTH = (0x\w+)", script)
        assert int(data.group(1), 16) + int(data.group(2), 16) == 0x4000 == dma_ram()
    out = tmp_path / "out"
    assert all((out / name).exists() for name in ("cycles.txt", "node.whex", "node_wire.hex"))
    assert min(intel_hex.read(out / "application.hex")) == 2 * FIRST


def dma_ram() -> int:
    text = (FIRMWARE / "port_dspic/dspic33fj128mc802.h").read_text()
    return int(re.search(r"#define DSPIC_DMA_RAM (0x\w+)u", text).group(1), 16)


def link_as_called(calls: list[str], folder: Path) -> subprocess.CompletedProcess:
    """The compiler's calls by the PC's own: the same sources and defines, the chip's instructions left out, linked into one."""
    objects = []
    for words in (call.split() for call in calls):
        flags = [word for word in words if word.startswith(("-I", "-D")) and "/libc" not in word]
        flags += ["-std=gnu99", "-O1", "-Wall", "-Wextra", "-Werror", "-Wno-attributes", "-D__dsPIC33F__"]
        source = next(word for word in words if word.endswith(".c"))
        done = run("cc", *flags, "-include", FIRMWARE / "tests/xc16_stub.h", "-S", source, "-o", "-")
        assert done.returncode == 0, done.stderr
        objects.append(folder / f"{Path(source).stem}.o")
        plain = re.sub(r"#APP.*?#NO_APP", "", done.stdout, flags=re.S)
        subprocess.run(["cc", "-x", "assembler", "-c", "-", "-o", objects[-1]], input=plain, text=True, check=True)
    return run("cc", "-r", "-nostdlib", *objects, "-o", folder / "all.o")


def test_the_firmware_links_and_names_itself_and_its_compiler(tmp_path):
    done = run("tools/firmware/build.sh", **stand_in_compiler(tmp_path))
    assert done.returncode == 0, done.stderr
    calls = [call for call in (tmp_path / "called").read_text().splitlines() if ".c " in call]
    for program in ("loader", "application"):
        of_it = [call for call in calls if f"/{program}/" in call]
        assert len(of_it) > 15
        linked = link_as_called(of_it, tmp_path)
        assert linked.returncode == 0, linked.stderr
        missing = set(run("nm", "-u", tmp_path / "all.o").stdout.split()) - {"U", "_GLOBAL_OFFSET_TABLE_"}
        assert all(name.startswith("__builtin_") for name in missing)
    assert make_image.IMAGE_HEADER.unpack((tmp_path / "out/node.whex").read_bytes())["options"] == 0x8000
    named = dict(line.split(": ", 1) for line in (tmp_path / "out/compiler.txt").read_text().splitlines())
    bin2hex = hashlib.sha256((tmp_path / "bin/xc16-bin2hex").read_bytes()).hexdigest()
    assert named["version"] == "xc16-gcc, the stand-in" and named["bin2hex"] == bin2hex
    assert all(re.fullmatch("[0-9a-f]{64}", named[name]) for name in ("cc1", "as", "ld"))


def test_both_tables_of_vectors_name_the_same_interrupts():
    tables = {}
    for name, keyword in (("jump_table.s", "goto"), ("vectors.s", ".pword")):
        found, lines = [], (FIRMWARE / "port_dspic/chip" / name).read_text().splitlines()
        for line in lines[[n for n, text in enumerate(lines) if "address(" in text][-1] :]:
            if entries := re.match(r"\s+unserved (\d+)", line):
                found += [None] * int(entries.group(1))
            elif entry := re.match(rf"\s+{re.escape(keyword)}\s+(?:paddr\()?__(?:Alt)?(\w+)", line):
                found.append(entry.group(1))
        tables[name] = found
    assert tables["jump_table.s"].pop(0) == "resetPRI"
    assert tables["jump_table.s"] == tables["vectors.s"] and len(tables["vectors.s"]) == 126
    interrupts = [name for name in tables["vectors.s"] if name]
    assert set(interrupts) == set(
        re.findall(r"HANDLER\((\w+)\)\(void\)", (FIRMWARE / "port_dspic/chip/main.c").read_text())
    )


def test_each_interrupt_runs_the_ports_body_for_it():
    source, header = (FIRMWARE / "port_dspic" / name for name in ("chip/main.c", "port.h"))
    handlers = re.findall(r"HANDLER\((\w+)\)\(void\)\n{\n    (\w+)\(&board\);\n}", source.read_text())
    for name, body in handlers:
        served = name.endswith("Interrupt")
        short = name.removesuffix("Interrupt").replace("Err", "_error").lower()
        assert body == (f"port_on_{short}" if served else "port_on_trap")
    assert {body for _, body in handlers} == set(re.findall(r"void (port_on_\w+)\(", header.read_text()))


def test_a_library_call_and_a_lost_flag_in_the_sample_path_are_found():
    good = "00002300 <_node_on_sync>:\n 2300: 07 00 00  rcall 0x2400 <_sampler_on_sync>\n"
    assert check_listing.findings(good) == []
    bad = good + " 2302: 02 00 00  call 0x3000 <___udivsi3>\n0x2400 <_main>:\n"
    assert check_listing.findings(bad) == ["_node_on_sync calls ___udivsi3"]
    flag = "00002400 <_port_on_t2>:\n 2400: 84 40 a9  bclr.b  0x84, #7\n"
    assert check_listing.findings(flag) == []
    for copy in ("mov.w  w0, 0x0084", "mov.w  #0x84, w1"):
        lost = flag + f" 2402: 20 00 00  {copy}\n"
        assert check_listing.findings(lost) == ["_port_on_t2 writes an interrupt flag register back as a whole"]
    outside = "00002300 <_loader_serve>:\n 2302: 02 00 00  call 0x3000 <___mulsi3>\n"
    assert check_listing.findings(outside) == []


def test_the_listing_reports_the_cycles_of_the_sample_path():
    listing = (
        "00002300 <_port_on_t2>:\n"
        " 2300: 84 40 a9  bclr.b  0x84, #7\n 2302: 00 9f be  mov.d  w0, [w15++]\n"
        " 2304: 02 00 00  call  0x2400 <_node_on_timer>\n 2308: 00 00 06  return\n"
        "00002400 <_main>:\n 2400: 00 00 00  nop\n"
    )
    assert check_listing.passes(listing) == {"_port_on_t2": (4, 8)}
