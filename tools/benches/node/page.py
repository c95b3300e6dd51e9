"""docs/results/node_faults.md: what the bench measured, and how the miss rates are derived."""

from crunchbot.protocol import LIMITS

FATES = {1: "the old image", 2: "the loader", 4: "the new image"}
CLASSES = {
    "FLIP_BIT": "one bit flipped",
    "FLIP_TWO": "two bits flipped",
    "NOISY": "each bit flipped with 1/64 to 1/4",
    "FLOATING": "line floats",
    "DEAD": "line dead",
    "STUCK_LOW": "line stuck low",
    "ERROR_BITS": "error bits set",
    "LOST_CLOCK": "one clock lost",
    "EXTRA_CLOCK": "one clock too many",
    "BEHIND": "frame begun one bit late",
    "AHEAD": "frame begun one bit early",
    "OTHER": "supplies, resets, two at once",
    "CUT": "1 to 64 clocks missing",
    "GLITCH": "select glitches",
    "REARMED": "armed anew amid it",
} | {f"FLIPS_{n}": f"{n} bit{'s' * (n > 1)} flipped" for n in range(1, 9)}

HEAD = """# What a node makes of faults

Made by `tools/benches node` on the register model of the chip and the model of the sensor, not on silicon.

## Fault matrix

From `sim/node/fault_matrix.c`, on six sets of parts (both prefetch depths; chip 2 % slow, nominal, quick; sensor 10 %
slow, nominal, quick). Each fault strikes tick n. Verdicts are on consecutive records, the first on the one that tick n's
transfer brings, which is that of the tick before; a good run ends them:
`.` good, `e` error bits, `S` starting, `R` resync, `L` late, `x` sensor_sum, `0` sensor_start, `a` sensor_absent, `j` step,
`P` `W` `T` reset_power, _watchdog, _trap, `O` overrun, `-` absent, `c` link_crc, `t` link_tick. A letter and a number: so
many of it. Empty: nothing is lost. Expected is a regular expression that all six must match; `make test` demands it, and that no
good sample is altered. Told: records until the first bad one (1: of the broken tick itself; 0: of the tick before, whose transfer was hit).
Counted: what the node's own counters hold at the end, each tick once, a reset once; it must be just what was told, and where the
node's view differs (a tick without SYNC is none to it, a doubled SYNC is two) what the row says. Letters as above, and
`C` order_crc, `M` order_missing, `F` link_overflow.

| Fault | Expected | Measured | Told | Counted | Ticks lost | Allowed | Cause of the cost |
|---|---|---|---|---|---|---|---|
"""

CUTS = """
## The supply fails during an update

From `sim/node/update_cuts.c`; three nodes each. Told: nobody drives the record after the cut. Ticks: from the supply's return to the
first record that is good, or that says `loader`. Then a second update succeeds, each time. `make test` also cuts at 150 random times and at
128 moments a word's writing apart around the end; `WHISKER_CUTS=n` makes more.

| Supply fails while | May run then | Ran | Told | Ticks | Remark |
|---|---|---|---|---|---|
"""

ODDS = """
## What passes the checks

A good sample that is not what the sensor measured must be one whose bytes pass every check by arithmetic. The storm (`sim/node/storm.c`) runs
random faults one to three at a time; `storm_log.c` notes which bits of which frame and record were hurt (a second sensor on the same wires,
spared every fault, shows what was sent), works each check out again on the bytes that came, and compares them with what the fault must have made of
them. {schedules} schedules, {ticks} ticks, {bad} records flagged:

| | |
|---|---|
| good samples hurt on the sensor's line that pass start byte, error word, sum and step by arithmetic | {missed_line} |
| good samples hurt on the link that pass CRC-8 and tick by arithmetic | {missed_link} |
| sound samples read up to 49 us before their tick (see below) | {displaced} |
| **hurt and good otherwise: unexplained** | **{unexplained}** |
| bits hurt otherwise than the log foresees | {unforeseen} |
| bad records without a fault | {spurious} |
| nodes that did not come back | {stuck} |
| breaches of a data sheet by the firmware, or words displaced where the log knows of no arming | {violations} |

Words of the link that its arming displaced amid a transfer at a wrong time: {overwritten}, each in a record that was re-armed (CRC or tick told).
Displaced: SYNC is doubled and the next one lost. The node then sees one SYNC and one order per tick, as always, and no check of bytes can tell; the time
between the two does. An order that ends more than 70 us after SYNC (by a clock up to 4 % off, told to 4 us: at most 79) is not that SYNC's, and what is
read says `late` until an order comes in time. At the slowest settings that the bridge allows an order ends 51 us after its SYNC: no false flag at any setting and clock
(test `node_slowest_link`). What is left: at the default settings, where it ends after 29 us, a stray pulse less than 49 us before the tick passes, and the
sample is early by so much; the sensor's own conversion is up to 385 us old.

Derivations, for bytes evenly spread:

- **Sum, one bit**: changes it by 2^k, never 0 modulo 256: none passes. Error word: a bit in it is told or refused.
- **Sum, two bits**: both among angles and sum, at the same place k of their bytes (10 pairs of 2016 for each k) and cancelling: for k = 7 always, else one time
  in two. (10 + 7 x 10 / 2) / 2016 = 2.2 %.
- **Sum, one clock lost, frames after it** (begun one bit late): the last bit of the frame before must be 1 (1/2), the last of beta 0, for it moves into the error word
  (1/2). All bytes are halved, and so is the sum: with n odd bytes and c carries it fits if floor(n / 2) = 128 (1 + n + c) modulo 256, that is n < 2 and c + n odd.
  At 16 bits n < 2 in 4 of 8 cases: 1/16. At the 12 bits of the sensor the low bytes are even, n < 2 always: 1/8. **The sum of a slipped frame of steady
  angles passes one time in eight, not in 256**: halving or doubling keeps a sum a sum.
- **Sum, one clock too many, frames after it** (begun one bit early): highest bits of alpha's first byte 1 for the start byte (1/2) and of the sum 0 (1/2); doubled, the
  sum fits if exactly one of the three other bytes had its highest bit set (3/8): 3/32.
- **Sum, byte slips** (not injected: they need eight lost clocks): another byte must be 0xFF at the start and others 0 in the error word: below 2^-16.
- **Struck frame of a lost or doubled clock**: the place is random; gone through for each frame, all 64.
- **Noise**: start byte and error word whole, changes of the other 40 bits cancel: from the product of the bits' transforms over Z/256, for each frame.
- **Step**: an angle may move by 30 degrees a tick; what passes the sum and jumps further is told as `step`. It sees nothing in a first frame.
- **CRC-8** (0x2F): all patterns of odd weight, of two bits, and of any burst up to eight bits are seen. Of the C(64, w) patterns of even weight w, those with
  syndrome zero that spare the tick are counted: 4 bits 0.46 %, 6 bits 0.34 %. They are good samples only if they spare the status, too.
- **CRC-8, words slipped**: a long burst is seen but for 1/256; a select glitch before bit 8 hurts the tick, one in the last 8 bits is a burst that is always
  seen: 48/63 of 1/256. Cut clocks are gone through for each record (the level of the last bit stays).

Per event; measured with its 95 % interval (Wilson). Derived for the two-bit, clock, noise and cut classes: mean over the events of each one's own probability. Frames
begun late or early follow one that passed, and the angles move little in a tick: they pass again more often than frames at random.

| Sensor's line | events | passes the sum: derived | measured | good sample: derived | measured |
|---|---|---|---|---|---|
"""

LINK_HEAD = """
| Link | events | passes the CRC: derived | measured | good sample: derived | measured |
|---|---|---|---|---|---|
"""

SETTINGS = """
A miss needs the fault first: at one struck frame in a million, a lost clock becomes a wrong good sample about once in 10^8 samples.

## Fastest link

No record lost or altered in {ticks} ticks on each of 36 kinds of parts (chip -4, 0, +4 %; sensor -10, 0, +10 %; prefetch of one word or two; DMA at once or 12 cycles
late). Cables are not in this model (see [hardware](../hardware.md)).

![Least gap between words at each SCK](../charts/node_link.svg)

| SCK divider | MHz | least word gap, cycles of 60 MHz | us | record's transfer, us |
|---|---|---|---|---|
"""


def _seen(runs: list[dict], key: str) -> str:
    seen = sorted({run[key] for run in runs}, key=lambda v: (len(v), v))
    return ", ".join(f"`{text}`" for text in seen if text)


def _spread(values: list[int]) -> str:
    return f"{min(values)}" if min(values) == max(values) else f"{min(values)} to {max(values)}"


def _fault(row: dict) -> str:
    runs = row["runs"]
    told = _spread([run["detected"] for run in runs]) if runs[0]["detected"] >= 0 else "-"
    lost = _spread([run["lost"] for run in runs])
    cells = [f"`{row['expected']}`", _seen(runs, "verdicts"), told, _seen(runs, "counted"), lost, row["most"]]
    return f"| {row['fault']} | {' | '.join(map(str, cells))} | {row['remark']} |\n"


def _cut(row: dict) -> str:
    runs = row["runs"]
    allowed = " or ".join(name for fate, name in FATES.items() if row["allowed"] & fate)
    ran = ", ".join(FATES[fate] for fate in sorted({run["fate"] for run in runs}))
    told = "yes" if all(run["told"] for run in runs) else "no"
    return f"| {row['step']} | {allowed} | {ran} | {told} | {_spread([r['ticks'] for r in runs])} | {row['remark']} |\n"


def _share(value: float | None) -> str:
    return "-" if value is None else "0" if value == 0 else f"{100 * value:.3g} %" if value > 1e-7 else f"{value:.1g}"


def _odds(name: str, row: dict) -> str:
    def cells(way: str) -> str:
        low, high = row[f"{way}_95"]
        derived, hits = row[f"{way}_derived"], row[way]
        share = _share(hits / row["events"]) if row["events"] else "-"
        return f"{_share(derived)} | {share} ({_share(low)} to {_share(high)}), {hits}"

    return f"| {CLASSES[name]} | {row['events']} | {cells('passed')} | {cells('good')} |\n"


def _link(divider: int, gap: int | None) -> str:
    mhz = LIMITS["clock_hz"] / divider / 1e6
    if gap is None:
        return f"| {divider} | {mhz:.2f} | none | | |\n"
    us = (64 * divider + 3 * gap) * 1e6 / LIMITS["clock_hz"]
    return f"| {divider} | {mhz:.2f} | {gap} | {gap * 1e6 / LIMITS['clock_hz']:.2f} | {us:.1f} |\n"


def _period(link: dict) -> str:
    cycles = link["period_cycles"]
    words = [f"{cycles[k]} cycles ({cycles[k] * 1e6 / LIMITS['clock_hz']:.0f} us) at the {k} settings" for k in cycles]
    return (
        f"\nThe bridge takes dividers from {LIMITS['sck_divider_min']} and gaps from {LIMITS['word_gap_min']}: at both "
        "limits nothing is lost. Least tick period that no node misses: "
        + ", ".join(words)
        + "; a frame of the sensor "
        "takes most of it, not the link.\n"
    )


def page(result: dict, faults: list[dict], cuts: list[dict]) -> str:
    """The whole page, in Markdown."""
    storm, link = result["storm"], result["link"]
    text = HEAD + "".join(_fault(row) for row in faults) + CUTS + "".join(_cut(row) for row in cuts)
    text += ODDS.format(**{name: f"{value:,}".replace(",", " ") for name, value in storm.items() if type(value) is int})
    text += "".join(_odds(name, row) for name, row in storm["lines"].items())
    text += LINK_HEAD + "".join(_odds(name, row) for name, row in storm["links"].items())
    text += SETTINGS.format(**link) + "".join(_link(int(d), gap) for d, gap in link["gap_cycles"].items())
    return text + _period(link)
