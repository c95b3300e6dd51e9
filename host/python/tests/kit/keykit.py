"""Certificates of an authority made for a test, and the configuration of zenoh that docs/zenoh.json5 gives for them."""

import subprocess
from pathlib import Path

import pytest

KEY = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")


def openssl(folder: Path, *words: str) -> None:
    subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)


def certificates(folder: Path, *names: str) -> None:
    """An authority, and a key and certificate of it for each name: the commands of docs/remote.md."""
    openssl(folder, "req", "-x509", *KEY, "-keyout", "ca.key", "-out", "ca.pem", "-days", "2", "-subj", "/CN=robot")
    (folder / "san").write_text("subjectAltName=DNS:localhost,IP:127.0.0.1\n")
    for name in names:
        openssl(folder, "req", *KEY, "-keyout", f"{name}.key", "-out", f"{name}.csr", "-subj", f"/CN={name}")
        signed = ("-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days", "2", "-extfile", "san")
        openssl(folder, "x509", "-req", "-in", f"{name}.csr", *signed, "-out", f"{name}.pem")


def documented(folder: Path, name: str) -> Path:
    """The configuration of docs/zenoh.json5 with this folder's certificates in place of those it names."""
    example = (Path(__file__).parents[4] / "docs/zenoh.json5").read_text()
    file = folder / f"{name}.json5"
    file.write_text(example.replace("/etc/whisker/own", str(folder / name)).replace("/etc/whisker", str(folder)))
    return file


@pytest.fixture(name="keys", scope="session")
def made_keys(tmp_path_factory):
    """Certificates of pilot, navigator and view."""
    folder = tmp_path_factory.mktemp("keys")
    certificates(folder, "pilot", "navigator", "view")
    return folder
