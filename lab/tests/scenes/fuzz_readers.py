"""Mutated files that a person may have written or a program left: scenes, faults, tables and models. Each is refused in one
line that names the file, or gives what can be worked with."""

import contextlib
import copy
import json
import tempfile
from pathlib import Path

import numpy as np
from models import LENGTH, model
from mutate import mutate
from PIL import Image

from crunchbot.errors import UserError
from crunchbot.nav.observations import read_observations
from crunchbot.occupancy import read_map
from crunchbot.scene import Scene, load, write
from crunchbot.touch.calibration import Rest, read_noise, write_rest
from crunchbot.touch.radial import model as radial
from crunchbot.touch.texture import model as texture
from crunchbot_lab import scenes
from crunchbot_lab.simulation.bridge import read_faults

FAULTS = b'[[fault]]\nt_s = 1.5\nlane = 2\nkind = "sensor_error"\nerror = "field_low"\n\n[[fault]]\ntick = 4\nkind = "nak_storm"\n'
NONSENSE = (
    -1,
    0,
    2**31,
    2**64,
    10**400,
    1e308,
    -1e308,
    float("nan"),
    float("inf"),
    "x",
    "",
    None,
    True,
    [],
    {},
    [[]],
    [-1],
)
PIECES = (
    b"-",
    b"0",
    b"9" * 5000,
    b"1e308",
    b"[",
    b"]",
    b"{",
    b'"',
    b",",
    b"\n",
    b"=",
    b"nan",
    b"inf",
    b"[" * 5000,
    b"\xef\xbb\xbf",
    b"\0",
)
MAP = b"image: map.{}\nresolution: 0.05\norigin: [1.0, -2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: scale\n"
SAMPLES = np.random.default_rng(1).normal(32768.0, 30.0, (4 * LENGTH, 2))


def places(content, at=()):
    """Where every value of a JSON document lies."""
    yield at
    for key in content if isinstance(content, dict) else range(len(content)) if isinstance(content, list) else ():
        yield from places(content[key], (*at, key))


def nonsense(text: bytes, rng: np.random.Generator) -> bytes:
    """A JSON document with one or two values that are something else, or gone."""
    content = json.loads(text)
    for _ in range(rng.integers(1, 3)):
        everywhere = [at for at in places(content) if at]
        *way, last = everywhere[rng.integers(len(everywhere))]
        inside = content
        for key in way:
            inside = inside[key]
        if rng.integers(6) == 0:
            del inside[last]
        else:
            inside[last] = copy.deepcopy(NONSENSE[rng.integers(len(NONSENSE))])
    return json.dumps(content).encode()


def garbled(text: bytes, rng: np.random.Generator) -> bytes:
    """One or two places of a text with something else put in, doubled or taken out: still text."""
    out = bytearray(text)
    for _ in range(rng.integers(1, 3)):
        at, length = int(rng.integers(len(out) + 1)), int(rng.integers(1, 12))
        match rng.integers(4):
            case 0:
                del out[at : at + length]
            case 1:
                out[at:at] = out[at : at + length]
            case 2:
                out[at:at] = PIECES[rng.integers(len(PIECES))]
            case 3:
                out[at : at + 1] = b"%d" % rng.integers(10)
    return bytes(out)


def broken(path: Path, data: bytes, rng: np.random.Generator) -> bytes:
    ways = (mutate, garbled, nonsense) if path.suffix == ".json" else (mutate, garbled, garbled)
    return ways[rng.integers(len(ways))](data, rng)


def report_texture(path: Path) -> None:
    found = texture.load(path)
    if found.channels == SAMPLES.shape[1]:
        for decision in texture.classify(found, np.arange(len(SAMPLES)) / 2000.0, SAMPLES):
            assert 0.0 <= decision.confidence <= 1.0


def report_radius(path: Path) -> None:
    found = radial.load(path)
    contact = radial.Contact(np.arange(len(SAMPLES)) / 2000.0, SAMPLES)
    with contextlib.suppress(ValueError):  # a model of other channels
        reported = radial.estimate(found, contact)
        assert np.isfinite(reported.radius_mm) and 0.0 <= reported.confidence <= 1.0


def seeds(folder: Path, made: Scene) -> list[tuple]:
    """(file, what it holds, what reads it)"""
    write(folder, made)
    keys = ["t_s", "odo_x_m", "odo_y_m", "odo_theta_rad"]
    keys += [f"{w.name}_{t}" for w in made.robot.of_role("texture") for t in made.arena.textures]
    keys += [f"{w.name}_mm" for w in made.robot.of_role("object")]
    rows = "\n".join([",".join(keys), *(",".join([f"0.{n}"] * len(keys)) for n in range(5))])
    (folder / "observations.csv").write_bytes(b"\xef\xbb\xbf" + rows.encode())
    (folder / "faults.toml").write_bytes(FAULTS)
    model().save(folder / "texture.json")
    texture.TextureModel.train({"A": [SAMPLES], "B": [SAMPLES * 2.0]}, bins=4).save(folder / "plain.json")
    radial.RadialModel(-0.011, 181.5, 2.5, 90.0, 138.0).save(folder / "radial.json")
    radii = np.linspace(90.0, 130.0, 9)
    radial.save(radial.CurveModel.fit(3e3 / radii, radii), folder / "curve.json")
    readers = {name: lambda _: load(folder) for name in ("arena.toml", "robot.toml", "prior.toml")}
    readers |= {"observations.csv": lambda path: read_observations(path, made)}
    readers |= {"faults.toml": lambda path: read_faults(path, 2000)}
    readers |= {"texture.json": report_texture, "plain.json": report_texture}
    readers |= {"radial.json": report_radius, "curve.json": report_radius}
    drawn = Image.fromarray(np.random.default_rng(2).choice([0, 205, 254], (20, 30)).astype(np.uint8))
    for kind in ("pgm", "png"):
        drawn.save(folder / f"map.{kind}")
        (folder / f"{kind}.yaml").write_bytes(MAP.replace(b"{}", kind.encode()))
        readers |= dict.fromkeys(
            (f"map.{kind}", f"{kind}.yaml"), lambda _, kind=kind: read_map(folder / f"{kind}.yaml")
        )
    write_rest(folder / "rest.toml", [Rest(3, np.ones(2), np.ones(2), 9, 1)], [f"lane{n}" for n in range(28)])
    readers["rest.toml"] = read_noise
    return [(folder / name, (folder / name).read_bytes(), read) for name, read in readers.items()]


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    rng, refused = np.random.default_rng(seed), 0
    with tempfile.TemporaryDirectory() as name, np.errstate(all="ignore"):
        files = seeds(Path(name), scenes.make("anchor", 4, rows=1).scene)
        for k in range(inputs):
            path, data, read = files[k % len(files)]
            path.write_bytes(broken(path, data, rng))
            try:
                read(path)
            except UserError as error:
                assert name in str(error) and "\n" not in str(error), str(error)
                refused += 1
            path.write_bytes(data)
    return {"refused in one line": refused}
