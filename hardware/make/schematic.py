"""One sheet of KiCad 9 from a list of parts: symbols, stubs with labels or supply symbols at their pins, wires, notes."""

from dataclasses import dataclass, field
from pathlib import Path

from kicad_file import Word, child, children, identity, read, write

SUPPLIES = {"GND": -1, "+5V": 1, "+3V3": 1}
GRID = 2.54
STUB = 2.54


@dataclass
class Part:
    """A symbol on the sheet and a footprint on the board.

    at: sheet position in units of 2.54 mm; turn: degrees anticlockwise; nets: pin number -> net, None for a pin left
    open, "=NET" for a pin that a wire reaches; place: (x mm, y mm, degrees) on the board; sources: (maker, order code),
    best first; text: offset of the reference from `at` in units of 2.54 mm, None for the usual place.
    """

    ref: str
    symbol: str
    value: str
    footprint: str
    at: tuple[float, float]
    nets: dict[str, str | None]
    place: tuple[float, float, float] = (0, 0, 0)
    turn: int = 0
    sources: list[tuple[str, str]] = field(default_factory=list)
    what: str = ""
    in_bom: bool = True
    text: tuple[float, float] | None = None
    stubs: dict[str, float] = field(default_factory=dict)  # pin number -> length of its stub in units of 2.54 mm


@dataclass
class Sheet:
    """What a project is made of: parts, wires and notes in units of 2.54 mm, the board's outline in mm."""

    name: str
    title: str
    comments: list[str]
    parts: list[Part]
    wires: list[list[tuple[float, float]]] = field(default_factory=list)
    notes: list[tuple[float, float, str]] = field(default_factory=list)
    boxes: list[tuple[float, float, float, float, str]] = field(default_factory=list)
    flags: list[tuple[float, float, str]] = field(default_factory=list)
    labels: list[tuple[float, float, str, int]] = field(default_factory=list)
    rails: list[tuple[float, float, str]] = field(default_factory=list)
    paper: str = "A4"
    outline: tuple[float, float, float, float] = (0, 0, 0, 0)
    silk: list[tuple[float, float, float, str]] = field(default_factory=list)
    axis: tuple[float, float, float] | None = None
    power_nets: tuple[str, ...] = ("+5V", "+3V3")
    step: float = 0.127  # of the router's grid, mm


class Symbols:
    """Symbols of KiCad's libraries and of the project's own, flattened: a derived symbol gets its parent's drawing."""

    def __init__(self, folders: list[Path]):
        self.folders = folders
        self.files: dict[str, list] = {}

    def library(self, name: str) -> list:
        if name not in self.files:
            path = next(
                (folder / f"{name}.kicad_sym" for folder in self.folders if (folder / f"{name}.kicad_sym").exists()),
                None,
            )
            if path is None:
                raise SystemExit(f"make.py: no symbol library {name}: set KICAD9_SYMBOL_DIR to KiCad 9's symbols")
            self.files[name] = read(path)
        return self.files[name]

    def symbol(self, full: str) -> list:
        library, name = full.split(":")
        found = next((entry for entry in children(self.library(library), "symbol") if entry[1] == name), None)
        if found is None:
            raise SystemExit(f"make.py: library {library} has no symbol {name}")
        parent = child(found, "extends")
        if parent:
            base = self.symbol(f"{library}:{parent[1]}")
            own = {entry[1] for entry in children(found, "property")}
            kept = [part for part in base[2:] if not (part[0] == "property" and part[1] in own)]
            body = [part for part in found[2:] if part[0] != "extends"]
            units = [
                [Word("symbol"), part[1].replace(parent[1], name, 1), *part[2:]] if part[0] == "symbol" else part
                for part in kept
            ]
            return [Word("symbol"), full, *body, *units]
        return [Word("symbol"), full, *found[2:]]

    def pins(self, full: str) -> dict[str, tuple[float, float, int, bool]]:
        """Pin number -> (x, y upwards, direction in which the pin points into the body, hidden)."""
        result = {}
        for unit in children(self.symbol(full), "symbol"):
            for pin in children(unit, "pin"):
                x, y, angle = map(float, child(pin, "at")[1:4])
                result[child(pin, "number")[1]] = (x, y, int(angle), child(pin, "hide") == ["hide", "yes"])
        return result


def turned(x: float, y: float, degrees: int) -> tuple[float, float]:
    """A point of a symbol (y upwards), turned anticlockwise, as an offset on the sheet (y downwards)."""
    for _ in range(degrees % 360 // 90):
        x, y = -y, x
    return x, -y


class Drawing:
    """Collects the elements of one sheet."""

    def __init__(self, sheet: Sheet, symbols: Symbols):
        self.sheet, self.symbols = sheet, symbols
        self.root = identity(sheet.name)
        self.elements: list[list] = []
        self.used: dict[str, list] = {}
        self.wires: list[tuple] = []
        self.spots: set[tuple[float, float]] = set()
        self.power = 0

    def place(self, symbol, ref, value, x, y, turn, fields, texts, in_bom, on_board):
        self.used.setdefault(symbol, self.symbols.symbol(symbol))
        pins = self.symbols.pins(symbol)
        entry = [
            Word("symbol"), [Word("lib_id"), symbol], [Word("at"), x, y, turn], [Word("unit"), 1],
            [Word("exclude_from_sim"), Word("no")], [Word("in_bom"), Word("yes" if in_bom else "no")],
            [Word("on_board"), Word("yes" if on_board else "no")], [Word("dnp"), Word("no")],
            [Word("uuid"), identity(self.sheet.name, ref)],
        ]  # fmt: skip
        upright = 90 if turn in (90, 270) else 0
        for name, text in {"Reference": ref, "Value": value, **fields}.items():
            dx, dy, justify = texts.get(name, (0, 0, None))
            effects = [Word("effects"), [Word("font"), [Word("size"), 1.27, 1.27]]]
            if justify:
                effects.append([Word("justify"), Word(justify)])
            if name not in texts:
                effects.append([Word("hide"), Word("yes")])
            entry.append([Word("property"), name, text, [Word("at"), x + dx, y + dy, upright], effects])
        entry += [[Word("pin"), number, [Word("uuid"), identity(self.sheet.name, ref, number)]] for number in pins]
        path = [Word("path"), "/" + self.root, [Word("reference"), ref], [Word("unit"), 1]]
        entry.append([Word("instances"), [Word("project"), self.sheet.name, path]])
        self.elements.append(entry)

    def wire(self, *corners):
        points = [(round(x, 4), round(y, 4)) for x, y in corners]
        self.wires += zip(points, points[1:], strict=False)

    def join(self):
        """The wires, cut where another wire or a pin meets them, with a dot there: KiCad joins ends only."""
        ends: dict[tuple, int] = {}
        for point in (point for wire in self.wires for point in wire):
            ends[point] = ends.get(point, 0) + 1
        meets = sorted({*ends, *self.spots})
        dots = {point for point, count in ends.items() if count > 2}
        for a, b in self.wires:
            inside = [point for point in meets if point not in (a, b) and between(point, a, b)]
            dots |= set(inside)
            stops = sorted([a, *inside, b], key=lambda point, a=a: abs(point[0] - a[0]) + abs(point[1] - a[1]))
            for start, end in zip(stops, stops[1:], strict=False):
                self.elements.append([
                    Word("wire"), [Word("pts"), [Word("xy"), *start], [Word("xy"), *end]],
                    [Word("stroke"), [Word("width"), 0], [Word("type"), Word("default")]],
                    [Word("uuid"), identity(self.sheet.name, "wire", start, end)],
                ])  # fmt: skip
        for x, y in sorted(dots):
            self.elements.append(
                [
                    Word("junction"),
                    [Word("at"), x, y],
                    [Word("diameter"), 0],
                    [Word("color"), 0, 0, 0, 0],
                    [Word("uuid"), identity(self.sheet.name, "dot", x, y)],
                ]
            )

    def supply(self, net, x, y, dx=0):
        """A supply's symbol: upright, or lying in the direction dx (-1 left, 1 right)."""
        self.power += 1
        up = SUPPLIES[net] > 0
        turn = 0 if not dx else 90 if (dx < 0) == up else 270
        where = (
            (0, -3.556 if up else 3.81, None)
            if not dx
            else (dx * 3.3, 0, "left" if (dx > 0) != (turn == 90) else "right")
        )
        self.place("power:" + net, f"#PWR{self.power:03}", net, x, y, turn, {}, {"Value": where}, True, True)

    def flag(self, net, x, y):
        """A mark that the net is fed from outside, for the electrical check."""
        self.power += 1
        self.place(
            "power:PWR_FLAG", f"#FLG{self.power:03}", "PWR_FLAG", x, y, 0, {}, {"Value": (0, -3.81, None)}, True, True
        )
        self.wire((x, y), (x, y + STUB))
        self.supply(net, x, y + STUB) if SUPPLIES[net] < 0 else self.rail(net, x, y + STUB)

    def rail(self, net, x, y):
        self.wire((x, y), (x + STUB, y))
        self.supply(net, x + STUB, y)

    def label(self, net, x, y, dx):
        justify = [Word("justify"), Word("right" if dx < 0 else "left"), Word("bottom")]
        self.elements.append([
            Word("label"), net, [Word("at"), x, y, 180 if dx < 0 else 0],
            [Word("effects"), [Word("font"), [Word("size"), 1.27, 1.27]], justify],
            [Word("uuid"), identity(self.sheet.name, "label", net, x, y)],
        ])  # fmt: skip

    def pin(self, net, x, y, dx, dy, stub):
        """What hangs on a pin: a mark that it is open, a supply symbol, or a stub with the net's name."""
        if net is None:
            self.elements.append(
                [Word("no_connect"), [Word("at"), x, y], [Word("uuid"), identity(self.sheet.name, "open", x, y)]]
            )
            return
        if net in SUPPLIES and dy * SUPPLIES[net] < 0:
            self.supply(net, x, y)
            return
        end = (x + dx * stub, y + dy * stub)
        self.wire((x, y), end)
        if net in SUPPLIES:
            self.supply(net, *end, dx)
        else:
            self.label(net, *end, dx)

    def part(self, part: Part):
        x, y = part.at[0] * GRID, part.at[1] * GRID
        fields = {"Footprint": part.footprint, "Datasheet": "", "Description": part.what}
        for number, (maker, code) in enumerate(part.sources, 1):
            fields |= {f"Maker{number}": maker, f"OrderCode{number}": code}
        if part.text:
            tx, ty = part.text[0] * GRID, part.text[1] * GRID
            texts = {"Reference": (tx, ty, "left"), "Value": (tx, ty + 2.032, "left")}
        elif part.turn in (90, 270):
            texts = {"Reference": (0, -2.54, None), "Value": (0, 2.54, None)}
        else:
            texts = {"Reference": (2.54, -1.27, "left"), "Value": (2.54, 1.27, "left")}
        self.place(part.symbol, part.ref, part.value, x, y, part.turn, fields, texts, part.in_bom, True)
        pins = self.symbols.pins(part.symbol)
        missing = set(pins) ^ set(part.nets)
        if missing:
            raise SystemExit(f"make.py: {self.sheet.name}: {part.ref} has no net for, or no pin {sorted(missing)}")
        for number, (px, py, angle, hidden) in pins.items():
            net = part.nets[number]
            ox, oy = turned(px, py, part.turn)
            self.spots.add((round(x + ox, 4), round(y + oy, 4)))
            if hidden or (net or "").startswith("="):
                continue
            dx, dy = turned(*{0: (-1, 0), 90: (0, -1), 180: (1, 0), 270: (0, 1)}[angle], part.turn)
            self.pin(net, x + ox, y + oy, dx, dy, part.stubs.get(number, 1) * GRID)

    def note(self, x, y, text, size=1.27):
        self.elements.append([
            Word("text"), text, [Word("exclude_from_sim"), Word("no")], [Word("at"), x, y, 0],
            [Word("effects"), [Word("font"), [Word("size"), size, size]],
             [Word("justify"), Word("left"), Word("top")]],
            [Word("uuid"), identity(self.sheet.name, "text", x, y)],
        ])  # fmt: skip

    def box(self, x0, y0, x1, y1, title):
        self.elements.append([
            Word("rectangle"), [Word("start"), x0, y0], [Word("end"), x1, y1],
            [Word("stroke"), [Word("width"), 0.15], [Word("type"), Word("dash")]],
            [Word("fill"), [Word("type"), Word("none")]],
            [Word("uuid"), identity(self.sheet.name, "box", x0, y0)],
        ])  # fmt: skip
        self.note(x0 + 1.27, y0 + 1.27, title, 2.0)

    def file(self) -> str:
        sheet = self.sheet
        for part in sheet.parts:
            self.part(part)
        for points in sheet.wires:
            self.wire(*[(x * GRID, y * GRID) for x, y in points])
        for x, y, net, side in sheet.labels:
            self.label(net, x * GRID, y * GRID, side)
        for x, y, net in sheet.rails:
            self.supply(net, x * GRID, y * GRID)
            self.spots.add((round(x * GRID, 4), round(y * GRID, 4)))
        for x, y, net in sheet.flags:
            self.flag(net, x * GRID, y * GRID)
        for x, y, text in sheet.notes:
            self.note(x * GRID, y * GRID, text)
        for x0, y0, x1, y1, title in sheet.boxes:
            self.box(x0 * GRID, y0 * GRID, x1 * GRID, y1 * GRID, title)
        self.join()
        comments = [[Word("comment"), n, text] for n, text in enumerate(sheet.comments, 1)]
        return write([
            Word("kicad_sch"), [Word("version"), Word("20250114")], [Word("generator"), "eeschema"],
            [Word("generator_version"), "9.0"], [Word("uuid"), self.root], [Word("paper"), sheet.paper],
            [Word("title_block"), [Word("title"), sheet.title], [Word("rev"), "A"], [Word("company"), "CrunchBot"],
             *comments],
            [Word("lib_symbols"), *self.used.values()], *self.elements,
            [Word("sheet_instances"), [Word("path"), "/", [Word("page"), "1"]]], [Word("embedded_fonts"), Word("no")],
        ]) + "\n"  # fmt: skip


def between(p, a, b) -> bool:
    """A point lies on an upright or level piece of wire."""
    tiny = 1e-6
    return (
        min(a[0], b[0]) - tiny <= p[0] <= max(a[0], b[0]) + tiny
        and min(a[1], b[1]) - tiny <= p[1] <= max(a[1], b[1]) + tiny
        and (abs(a[0] - b[0]) < tiny or abs(a[1] - b[1]) < tiny)
    )
