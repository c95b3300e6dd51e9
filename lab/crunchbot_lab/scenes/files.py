"""Observations as observations.csv (docs/formats.md). What is written reads back bit by bit as the same arrays."""

from pathlib import Path

import numpy as np

from crunchbot.nav.observations import Observations
from crunchbot.observation import ODOMETRY, TIME, TRUTH, Quantity
from crunchbot.outputs import put
from crunchbot.scene import OBSERVATIONS, Scene, write

DECIMALS = 6  # m, rad, nats; distances are rounded in mm to three


def rounded(observations: Observations) -> Observations:
    """Rounds observations to the digits that the file keeps."""
    truth = observations.truth
    return Observations(
        np.round(observations.t_s, DECIMALS),
        [f"{t:.10g}" for t in np.round(observations.t_s, DECIMALS)],
        np.round(observations.odometry, DECIMALS),
        np.round(observations.texture, DECIMALS),
        np.round(observations.radial_m * 1000.0, 3) / 1000.0,
        None if truth is None else np.round(truth, DECIMALS),
        *(
            None if a is None else np.round(a, DECIMALS)
            for a in (observations.own, observations.normal, observations.point)
        ),
    )


def write_scene(path: str | Path, scene: Scene, observations: Observations) -> None:
    """The whole folder; observations as `rounded` gave them."""
    write(path, scene)
    layout = scene.layout
    header = [TIME, *ODOMETRY, *layout.of(Quantity.TEXTURE), *layout.of(Quantity.DISTANCE)]
    columns = [observations.t_text, *_numbers(observations.odometry)]
    columns += _cells(observations.texture.reshape(len(observations.t_s), -1), {"nan": "", "-inf": "inf"})
    columns += _cells(np.round(observations.radial_m * 1000.0, 3), {"inf": ""})
    if observations.own is not None:
        header += layout.of(Quantity.READING)
        columns += _cells(observations.own, {"nan": ""})
    for quantity, values in ((Quantity.NORMAL, observations.normal), (Quantity.POINT, observations.point)):
        if values is not None:
            header += layout.of(quantity)
            columns += _cells(values.reshape(len(observations.t_s), -1), {"nan": ""})
    if observations.truth is not None:
        header += TRUTH
        columns += _numbers(observations.truth)
    lines = [",".join(header), *map(",".join, zip(*columns, strict=True))]
    put(Path(path) / OBSERVATIONS, "\n".join(lines) + "\n")


def _numbers(values: np.ndarray) -> list[list[str]]:
    return [list(map(repr, column)) for column in values.T.tolist()]


def _cells(values: np.ndarray, names: dict[str, str]) -> list[list[str]]:
    """Columns of text, with the cells that are no numbers as docs/formats.md has them."""
    return [[names.get(text, text) for text in column] for column in _numbers(values)]
