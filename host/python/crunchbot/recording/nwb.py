"""A recording as a file of Neurodata Without Borders (NWB 2): a series of angles and one of states for each whisker."""

import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.lib.format import open_memmap
from pynwb import NWBHDF5IO, H5DataIO, NWBFile, TimeSeries
from pynwb.epoch import TimeIntervals

from .table import Table

ANGLES = "deflection about the first and the second axis; not a number where the sample is not good"
STATES = "0: good; else the sensor's errors and a code, as in the wire format"


def write(table: Table, path: Path, note: Callable[[int], None]) -> None:
    """note: called with the number of frames that are done. Columns go through a temporary file: a recording need not fit into
    memory."""
    known = table.recording.metadata
    file = NWBFile(
        session_description="whisker deflections, recorded by whisker record",
        identifier=f"{known.get('serial', 'bridge')}-{table.first_ns}",
        session_start_time=datetime.fromtimestamp(table.first_ns * 1e-9, UTC),
        notes="; ".join(f"{name}: {value}" for name, value in known.items()) or None,
    )
    about = {"description": known.get("firmware") or "unknown", "serial_number": known.get("serial")}
    file.create_device(name="whisker bridge", **about)
    with tempfile.TemporaryDirectory(prefix="whisker-", dir=path.parent) as place:
        times_s, deg, status = _columns(table, Path(place), note)
        times = _packed(times_s)
        for lane, angles, states in zip(table.names, deg, status, strict=True):
            series = TimeSeries(name=lane, description=ANGLES, data=_packed(angles), unit="degrees", timestamps=times)
            times = series if isinstance(times, H5DataIO) else times
            file.add_acquisition(series)
            state = {"description": STATES, "data": _packed(states), "unit": "code"}
            file.add_acquisition(TimeSeries(name=f"{lane}_status", timestamps=times, **state))
        _add_interruptions(file, table)
        with NWBHDF5IO(path, "w") as io:
            io.write(file)


def _columns(table: Table, place: Path, note: Callable[[int], None]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) in s from the first frame, angles (lanes, n, 2) and states (lanes, n), in files of this folder."""
    n, lanes = table.frames, len(table.names)
    times_s = open_memmap(place / "times", "w+", np.float64, (n,))
    deg = open_memmap(place / "deg", "w+", np.float32, (lanes, n, 2))
    status = open_memmap(place / "status", "w+", np.uint16, (lanes, n))
    row = 0
    for rows in table.rows(note):
        here = slice(row, row + len(rows.tick))
        times_s[here] = (rows.time_ns - table.first_ns) * 1e-9
        deg[:, here], status[:, here] = rows.deg.swapaxes(0, 1), rows.status.T
        row = here.stop
    return times_s, deg, status


def _packed(values: np.ndarray) -> H5DataIO:
    return H5DataIO(data=values, compression="gzip", compression_opts=4)


def _add_interruptions(file: NWBFile, table: Table) -> None:
    interruptions = TimeIntervals(name="interruptions", description="where the stream of frames is not whole")
    interruptions.add_column(name="what", description="missing, overrun, restarted or clock set; frames lost")
    for event in table.recording.events():
        at_s = (event.stamp_ns - table.first_ns) * 1e-9
        text = f"{event.kind}: {event.frames} frames" if event.frames else event.kind
        interruptions.add_interval(start_time=at_s, stop_time=at_s, what=text)
    if len(interruptions):
        file.add_time_intervals(interruptions)
