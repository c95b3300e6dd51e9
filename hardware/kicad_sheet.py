"""KiCad's files as nested lists, and a sheet's netlist from its symbols, wires and labels, without KiCad."""

import re
from pathlib import Path

TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[()]|[^\s()]+')


def read(path: Path) -> list:
    """The file's outermost list: elements are str and lists of these."""
    stack: list[list] = [[]]
    for token in TOKEN.findall(path.read_text(encoding="utf-8")):
        if token == "(":
            stack.append([])
        elif token == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(re.sub(r"\\(.)", r"\1", token[1:-1]) if token.startswith('"') else token)
    return stack[0][0]


def child(node: list, name: str) -> list | None:
    """The first list within a list that begins with the name."""
    return next(iter(children(node, name)), None)


def children(node: list, name: str) -> list[list]:
    """All lists within a list that begin with the name."""
    return [part for part in node if isinstance(part, list) and part and part[0] == name]


def properties(node: list) -> dict[str, str]:
    return {entry[1]: entry[2] for entry in children(node, "property")}


def spot(node: list) -> tuple[float, float]:
    """Where an element lies, mm."""
    x, y = map(float, node[1:3])
    return round(x, 3), round(y, 3)


def pins_of(symbol: list) -> dict[str, tuple[str, float, float]]:
    """Number -> name and place in the symbol, whose y points upwards."""
    return {
        child(pin, "number")[1]: (child(pin, "name")[1], *map(float, child(pin, "at")[1:3]))
        for unit in children(symbol, "symbol")
        for pin in children(unit, "pin")
    }


def place(symbol: list, x: float, y: float) -> tuple[float, float]:
    """A pin's place on the sheet, whose y points downwards."""
    at = child(symbol, "at")
    for _ in range(int(at[3]) % 360 // 90):
        x, y = -y, x
    return round(float(at[1]) + x, 3), round(float(at[2]) - y, 3)


def on(point: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> bool:
    """A point lies on an upright or level piece of wire."""
    return all(min(p, q) <= at <= max(p, q) for at, p, q in zip(point, a, b, strict=True)) and (
        a[0] == b[0] or a[1] == b[1]
    )


class Sheet:
    """A sheet's parts, and its nets: pin (reference, number) -> net; a pin left open is on a net `unconnected-...`."""

    def __init__(self, path: Path):
        content = read(path)
        library = {symbol[1]: pins_of(symbol) for symbol in children(child(content, "lib_symbols"), "symbol")}
        self.fields, self.name, pins, names = {}, {}, {}, []
        for symbol in children(content, "symbol"):
            fields = properties(symbol)
            ref = fields["Reference"]
            for number, (name, x, y) in library[child(symbol, "lib_id")[1]].items():
                if ref.startswith("#PWR"):
                    names.append((fields["Value"], place(symbol, x, y)))
                elif not ref.startswith("#"):
                    pins[ref, number] = place(symbol, x, y)
                    self.name[ref, number] = name
            if not ref.startswith("#"):
                self.fields[ref] = fields
        self.value = {ref: fields["Value"] for ref, fields in self.fields.items()}
        names += [(label[1], spot(child(label, "at"))) for label in children(content, "label")]
        wires = [[spot(end) for end in children(child(wire, "pts"), "xy")] for wire in children(content, "wire")]
        self.net = nets_of(pins, names, wires)

    def refs(self, net: str) -> set[str]:
        return {ref for (ref, _), other in self.net.items() if other == net}

    def across(self, value: str, kind: str, net: str, other: str) -> list[str]:
        """Two-pin parts of a kind and value between two nets."""
        return [ref for ref in self.value if re.fullmatch(rf"{kind}\d+", ref) and self.value[ref] == value
                and {self.net[ref, "1"], self.net[ref, "2"]} == {net, other}]  # fmt: skip


def nets_of(pins: dict, names: list, wires: list) -> dict[tuple[str, str], str]:
    """Pin -> net, of what meets: places of pins, (name, place) of labels and supplies, ends of wires."""
    root: dict = {}

    def top(item):
        while root.setdefault(item, item) != item:
            item = root[item]
        return item

    points = {*pins.values(), *(at for _, at in names), *(end for wire in wires for end in wire)}
    for a, b in wires:
        for point in points:
            if on(point, a, b):
                root[top(point)] = top(a)
    for name, at in names:
        root[top(at)] = top(name)
    named = {top(name): name for name, _ in names}
    return {pin: named.get(top(at), f"unconnected-{pin[0]}-{pin[1]}") for pin, at in pins.items()}
