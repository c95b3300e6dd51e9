"""What a sample's status means, in words: causes and remedies from the wire format's definition."""

from whisker_protocol import DEFINITION, SENSOR_ERRORS, STATUS_CODE_SHIFT

_CODES = {entry["value"]: entry for entry in DEFINITION["codes"].values()}
_UNKNOWN = {"cause": "a code this package does not know", "remedy": "install host and bridge of one release"}


def explain(status: int) -> tuple[str, str]:
    """(cause, remedy) of a status other than 0: its code, or, when that is good, its lowest sensor error."""
    code = status >> STATUS_CODE_SHIFT
    entry = _CODES.get(code, _UNKNOWN)
    if code == 0:
        entry = next((e for e in SENSOR_ERRORS.values() if status >> e["bit"] & 1), entry)
    return entry["cause"], entry["remedy"]
