"""The paper's Fig. 4: both floor whiskers over a tile of rough carpet, one of vinyl, one of rough carpet."""

import numpy as np

from crunchbot.touch.texture.model import TextureModel
from crunchbot.touch.texture.train import train

from .scores import METHODS, WINDOW, decide
from .trials import TICK_S, drives, strip_over

SEED, SPEED_M_S = 6200, 0.15
BLOCK = 40  # samples of the trace that are drawn as one, 20 ms
SURFACES = ("ROUGH", "VINYL")  # the paper's two


def course() -> dict:
    """Each whisker's trace and each method's answers along the course; the models know the two surfaces only."""
    recordings = drives(SEED, SEED, surfaces=SURFACES)
    known = dict(zip(METHODS, (TextureModel.train(recordings), train(recordings, 2000.0)), strict=True))
    tiles = ["ROUGH", "VINYL", "ROUGH"]
    out = {"surfaces": list(SURFACES), "tiles": tiles, "whiskers": []}
    for strip in strip_over(tiles, SEED, SEED, SPEED_M_S):
        about = np.abs(strip.counts - np.median(strip.counts[:WINDOW], axis=0)) * 180.0 / 65536.0
        trace = np.hypot(*about.T)[: len(about) // BLOCK * BLOCK].reshape(-1, BLOCK).max(axis=1)
        met, left = strip.borders()
        answers = {
            name: [
                (d.end * TICK_S, d.number, d.best, round(float(d.confidence), 4), bool(d.border))
                for d in decide(model, strip.counts)
            ]
            for name, model in known.items()
        }
        out["whiskers"].append(
            {
                "met_s": (met * TICK_S).tolist(),
                "left_s": (left * TICK_S).tolist(),
                "trace_deg": trace.round(3).tolist(),
                "answers": answers,
            }
        )
    return out
