"""Manual pages and completion say what the programs say, and shells take them."""

import shutil
import subprocess

import pytest
from chainrun import BUILD, ROOT

MANUAL = ROOT / "host/manual"
PLACES = {
    "man": "share/man/man1",
    "bash": "share/bash-completion/completions",
    "zsh": "share/zsh/site-functions",
    "fish": "share/fish/vendor_completions.d",
}
SHELLS = {
    "bash": ("bash", "-n"),
    "zsh": ("zsh", "-n"),
    "fish": ("fish", "-n"),
    "man": ("groff", "-man", "-Tutf8", "-ww", "-z"),
}


@pytest.fixture(scope="module")
def programs():
    import sys

    sys.path.insert(0, str(ROOT / "tools"))
    try:
        from manual.programs import all_programs

        yield all_programs(BUILD)
    finally:
        sys.path.remove(str(ROOT / "tools"))


def run(*words, **options) -> subprocess.CompletedProcess:
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=60, **options)


def test_what_is_stored_is_what_the_programs_say(programs):
    from manual.__main__ import files

    stored = {path.relative_to(MANUAL).as_posix(): path.read_text() for path in MANUAL.rglob("*") if path.is_file()}
    made = files(BUILD)
    assert made.keys() == stored.keys()
    for name, text in made.items():
        assert text == stored[name], f"host/manual/{name}: run 'make manual'"


def test_every_option_of_every_program_is_in_its_page_and_completions(programs):
    assert len(programs) == 8
    count = 0
    for program in programs:
        texts = [(MANUAL / folder / name).read_text() for folder, name in
                 (("man", f"{program.name}.1"), ("bash", program.name), ("zsh", f"_{program.name}"))]  # fmt: skip
        page = texts[0].replace("\\-", "-")
        fish = (MANUAL / f"fish/{program.name}.fish").read_text()
        for one in program.walk():
            for option in one.options:
                count += 1
                assert f"\\fB{option.name}\\fR" in page
                if option.name.startswith("--"):
                    assert all(option.name in text for text in texts[1:]) and f"-l {option.name[2:]} " in fish
    assert count > 200


def test_the_help_of_a_program_in_c_is_read_whole(programs):
    daemon = next(program for program in programs if program.name == "whiskerd")
    options = {option.name: option for option in daemon.options}
    printed = run(next(BUILD.rglob("host/apps/whiskerd")), "--help").stdout
    assert [line.split()[0] for line in printed.splitlines() if line.startswith("  --")] == list(options)
    assert options["--tick-in"].text.endswith("a camera, a PPS")
    assert options["--wait"].value == "" and options["--ring"].value == "NAME"
    assert daemon.usage.splitlines() == ["whiskerd --ring NAME [OPTION...]", "whiskerd --list"]
    assert len(daemon.examples) == 2 and any(line.startswith("Exit code") for line in daemon.notes)
    base = next(program for program in programs if program.name == "whisker-base")
    assert next(o for o in base.options if o.name == "--mode").choices == ("safe", "full")


@pytest.mark.parametrize("kind", SHELLS)
def test_shells_and_groff_take_them(kind):
    if shutil.which(SHELLS[kind][0]) is None:
        pytest.skip(f"{SHELLS[kind][0]} is not on this machine")
    for path in sorted((MANUAL / kind).iterdir()):
        done = run(*SHELLS[kind], path)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", ""), path


def completed(*words: str) -> list[str]:
    """What bash offers for the last word."""
    line = " ".join(f"'{word}'" for word in words)
    script = f"""source {MANUAL}/bash/{words[0]}; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}
_{words[0].replace("-", "_")}; printf '%s\\n' "${{COMPREPLY[@]}}" """
    done = run("bash", "-c", script, cwd=MANUAL)
    assert done.stderr == ""
    return done.stdout.split()


def test_bash_offers_commands_options_choices_and_files():
    assert completed("whisker", "te") == ["texture"]
    assert completed("whisker", "texture", "") == ["train", "classify", "-h", "--help"]
    assert completed("whisker", "texture", "train", "--m") == ["--method"]
    assert completed("whisker", "texture", "train", "--method", "") == ["naive-bayes", "default"]
    assert completed("whisker", "texture", "train", "--out", "fi") == ["fish"]
    assert completed("whiskerd", "--once", "--tick-") == ["--tick-period", "--tick-in"]
    assert completed("whisker-base", "--mode", "f") == ["full"]
    assert completed("whiskerd", "--batch", "") == []


def test_fish_offers_the_same():
    if shutil.which("fish") is None:
        pytest.skip("fish is not on this machine")
    script = (
        f"source {MANUAL}/fish/whisker.fish; complete -C 'whisker te'; complete -C 'whisker texture train --method '"
    )
    offered = [line.split("\t")[0] for line in run("fish", "--no-config", "-c", script).stdout.splitlines()]
    assert offered[0] == "texture" and sorted(offered[-2:]) == ["default", "naive-bayes"]


def test_cmake_installs_them_where_shells_and_man_look(tmp_path):
    done = run("cmake", "--install", BUILD, "--prefix", tmp_path)
    assert done.returncode == 0, done.stderr
    for kind, place in PLACES.items():
        installed = {path.name: path.read_bytes() for path in (tmp_path / place).iterdir()}
        assert installed == {path.name: path.read_bytes() for path in (MANUAL / kind).iterdir()}
