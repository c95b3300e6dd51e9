"""What the troubleshooting page says is printed, some program prints."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/troubleshooting.md"
SOURCES = ("host", "lab/crunchbot_lab")
JOINED = re.compile(r"\"\s*\\?\s*\n?\s*f?\"")  # between two literals that stand for one


def printed() -> list[str]:
    """The first cell of each row."""
    rows = [line for line in PAGE.read_text().splitlines() if line.startswith("| `")]
    return [re.match(r"\| `([^`]+)`", row)[1] for row in rows]


def texts() -> str:
    files = [file for place in SOURCES for kind in ("*.c", "*.h", "*.py") for file in (ROOT / place).rglob(kind)]
    return JOINED.sub("", "\n".join(file.read_text() for file in files if "tests" not in file.parts))


def test_thirty_symptoms_each_once():
    assert len(printed()) >= 30 and len(set(printed())) == len(printed())


def test_each_symptom_is_printed_by_some_program():
    text = texts()
    missing = [symptom for symptom in printed() if not all(part.strip() in text for part in symptom.split("..."))]
    assert missing == []
