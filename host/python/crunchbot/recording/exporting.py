"""A recording as a table that other tools read: CSV, Parquet or NWB, a row a tick, angles in degrees.

Columns: time_ns (host time since 1970), tick and sequence; then by lane alpha_deg, beta_deg (not a number where the sample is
not good) and status (0: good).
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..outputs import made
from ..progress import bar
from .table import AXES, ExportError, Table

SLOW_S = 2.0  # an export that takes longer shows how far it is
ROWS_MOST = 1 << 16  # of a row group


def export(table: Table, path: Path) -> None:
    """Write the whole file, or none, in the format that its name ends in. ExportError: it is none of FORMATS; OutputError: it cannot be written."""
    if path.suffix not in FORMATS:
        raise ExportError(f"{path}: not a format; end the name in {', '.join(FORMATS)}")
    with made(path) as part:
        FORMATS[path.suffix](table, part)


def _progress(table: Table) -> bar:
    return bar(total=table.frames, desc="export", unit=" frames", unit_scale=True, delay=SLOW_S, leave=False)


def _write_csv(table: Table, path: Path) -> None:
    with open(path, "w", newline="") as file, _progress(table) as progress:
        head = None
        for rows in table.rows(progress.update):
            columns = rows.columns(table.names)
            if head is None:
                head = file.write(",".join(columns) + "\n")
            texts = [_cells(values) for values in columns.values()]
            file.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))


def _cells(values: np.ndarray) -> list[str]:
    if values.dtype.kind != "f":
        return list(map(str, values.tolist()))
    return ["" if value != value else f"{value:.5f}" for value in values.tolist()]


def _write_parquet(table: Table, path: Path) -> None:
    import pyarrow as pa
    from pyarrow.parquet import ParquetWriter

    kinds = {"time_ns": pa.timestamp("ns", tz="UTC"), "tick": pa.uint64(), "sequence": pa.uint32()}
    for lane in table.names:
        kinds |= {f"{lane}_{axis}_deg": pa.float32() for axis in AXES} | {f"{lane}_status": pa.uint16()}
    schema = pa.schema(kinds.items(), metadata=table.recording.metadata)
    with ParquetWriter(path, schema, compression="zstd") as writer, _progress(table) as progress:
        waiting: list[pa.RecordBatch] = []
        for rows in table.rows(progress.update):
            columns = rows.columns(table.names).items()
            arrays = [pa.array(values, kinds[name], from_pandas=True) for name, values in columns]
            waiting.append(pa.record_batch(arrays, schema))
            if sum(map(len, waiting)) >= ROWS_MOST:
                writer.write_table(pa.Table.from_batches(waiting))
                waiting = []
        writer.write_table(pa.Table.from_batches(waiting, schema))


def _write_nwb(table: Table, path: Path) -> None:
    from .nwb import write

    with _progress(table) as progress:
        write(table, path, progress.update)


FORMATS: dict[str, Callable[[Table, Path], None]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".nwb": _write_nwb,
}
