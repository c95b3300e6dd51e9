"""A two-layer board from the schematic's netlist: footprints, outline, tracks, ground planes, legend. Needs KiCad's pcbnew."""

import re
from pathlib import Path

import pcbnew
from kicad_file import child, children, identity, read, write
from router import Pad, Router, Rules, Task

SIGNAL, POWER = 0.25, 0.5
STITCH = 5.0
LAYERS = (pcbnew.F_Cu, pcbnew.B_Cu)
TEXT, TEXT_LINE = 0.8, 0.12
SORTED = {
    *("footprint", "segment", "via", "zone", "gr_line", "gr_text", "pad"),
    *("fp_line", "fp_text", "fp_circle", "fp_poly", "fp_rect", "fp_arc"),
}
# Where a reference may stand: distance from its part, slide along its side, degrees; the nearest first.
PLACES = sorted(
    (
        (distance / 5, slide / 5, degrees)
        for distance in range(1, 13)
        for slide in range(-30, 31, 2)
        for degrees in (0, 90)
    ),
    key=lambda place: (place[0] + abs(place[1]) / 2 + place[2] / 300, place),
)


def mm(value: float) -> int:
    return pcbnew.FromMM(value)


def spot(x: float, y: float) -> pcbnew.VECTOR2I:
    return pcbnew.VECTOR2I(mm(x), mm(y))


class Maker:
    """Builds one board; the sheet's origin lies at (100, 100) mm of KiCad's page."""

    ORIGIN = (100.0, 100.0)

    def __init__(self, sheet, netlist: Path, footprints: Path):
        self.sheet, self.footprints = sheet, footprints
        self.board = pcbnew.BOARD()
        self.netlist = read(netlist)
        self.board.SetCopperLayerCount(2)
        title = self.board.GetTitleBlock()
        title.SetTitle(sheet.title)
        title.SetRevision("A")
        title.SetCompany("CrunchBot")
        for number, text in enumerate(sheet.comments):
            title.SetComment(number, text)
        settings = self.board.GetDesignSettings()
        settings.m_TrackMinWidth = mm(0.2)
        settings.m_CopperEdgeClearance = mm(0.3)
        settings.m_MaxError = mm(0.03)  # arcs of the planes, drawn as straight pieces
        settings.SetAuxOrigin(spot(*self.page(sheet.outline[0], sheet.outline[3])))

    def page(self, x, y):
        return self.ORIGIN[0] + x, self.ORIGIN[1] + y

    def add_nets(self):
        self.nets, self.pins = {}, {}
        for net in children(child(self.netlist, "nets"), "net"):
            name = child(net, "name")[1]
            item = pcbnew.NETINFO_ITEM(self.board, name)
            self.board.Add(item)
            self.nets[name] = item
            for node in children(net, "node"):
                self.pins[child(node, "ref")[1], child(node, "pin")[1]] = item

    def add_parts(self):
        paths = {child(comp, "ref")[1]: child(comp, "tstamps")[1] for comp in
                 children(child(self.netlist, "components"), "comp")}  # fmt: skip
        for part in self.sheet.parts:
            library, name = part.footprint.split(":")
            item = pcbnew.FootprintLoad(str(self.footprints / f"{library}.pretty"), name)
            if item is None:
                raise SystemExit(
                    f"make.py: no footprint {part.footprint}: set KICAD9_FOOTPRINT_DIR to KiCad 9's footprints"
                )
            item.SetFPID(pcbnew.LIB_ID(library, name))
            item.SetReference(part.ref)
            item.SetValue(part.value)
            item.SetPath(pcbnew.KIID_PATH("/" + paths[part.ref]))
            item.SetExcludedFromBOM(not part.in_bom)
            item.SetPosition(spot(*self.page(*part.place[:2])))
            item.SetOrientationDegrees(part.place[2])
            for model in list(item.Models()):
                item.Models().pop()
                del model
            for pad in item.Pads():
                net = self.pins.get((part.ref, pad.GetNumber()))
                if net:
                    pad.SetNet(net)
            self.board.Add(item)

    def add_outline(self):
        x0, y0, x1, y1 = self.sheet.outline
        corners = [self.page(x0, y0), self.page(x1, y0), self.page(x1, y1), self.page(x0, y1)]
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            self.line(a, b, pcbnew.Edge_Cuts, 0.1)
        if self.sheet.axis:
            x, y, side = self.sheet.axis
            h = side / 2
            frame = [self.page(x + sx * h, y + sy * h) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            for a, b in zip(frame, frame[1:] + frame[:1], strict=True):
                self.line(a, b, pcbnew.F_Fab, 0.1)

    def line(self, a, b, layer, width):
        item = pcbnew.PCB_SHAPE(self.board, pcbnew.SHAPE_T_SEGMENT)
        item.SetStart(spot(*a))
        item.SetEnd(spot(*b))
        item.SetLayer(layer)
        item.SetWidth(mm(width))
        self.board.Add(item)

    def boxes(self):
        """Pads as the router wants them, and holes without copper."""
        pads, holes = [], []
        for pad in self.board.GetPads():
            position = pad.GetPosition()
            x, y = pcbnew.ToMM(position.x) - self.ORIGIN[0], pcbnew.ToMM(position.y) - self.ORIGIN[1]
            if pad.GetAttribute() == pcbnew.PAD_ATTRIB_NPTH:
                holes.append((x, y, pcbnew.ToMM(pad.GetDrillSize().x) / 2))
                continue
            frame = pad.GetBoundingBox()
            x0, y0 = pcbnew.ToMM(frame.GetX()) - self.ORIGIN[0], pcbnew.ToMM(frame.GetY()) - self.ORIGIN[1]
            box = (x0, y0, x0 + pcbnew.ToMM(frame.GetWidth()), y0 + pcbnew.ToMM(frame.GetHeight()))
            layers = tuple(n for n, layer in enumerate(LAYERS) if pad.IsOnLayer(layer))
            pads.append(Pad(pad.GetNetCode() or -1, x, y, box, layers))
        return pads, holes

    def route(self):
        pads, holes = self.boxes()
        names = {item.GetNetCode(): name for name, item in self.nets.items()}
        ground = self.nets["GND"].GetNetCode()
        tasks = []
        for code, name in names.items():
            mine = [pad for pad in pads if pad.net == code]
            if code == ground:
                mine = [pad for pad in mine if len(pad.layers) == 1]
                tasks.insert(0, Task(code, tuple(mine), SIGNAL, ground=True))
            elif len(mine) > 1:
                tasks.append(Task(code, tuple(mine), POWER if name in self.sheet.power_nets else SIGNAL))
        tasks.sort(key=lambda task: (not task.ground, names[task.net] in self.sheet.power_nets, spread(task.pads)))
        router = Router(self.sheet.outline, pads, holes, (SIGNAL, POWER), Rules(step=self.sheet.step))
        failed = router.route(tasks)
        if failed:
            raise SystemExit(f"make.py: {self.sheet.name}: no way found for {sorted({names[code] for code in failed})}")
        router.stitch(ground, STITCH)
        for code, layer, points, width in router.tracks:
            for a, b in zip(points, points[1:], strict=False):
                item = pcbnew.PCB_TRACK(self.board)
                item.SetStart(spot(*self.page(*a)))
                item.SetEnd(spot(*self.page(*b)))
                item.SetWidth(mm(width))
                item.SetLayer(LAYERS[layer])
                item.SetNetCode(code)
                self.board.Add(item)
        for code, x, y in router.vias:
            item = pcbnew.PCB_VIA(self.board)
            item.SetPosition(spot(*self.page(x, y)))
            item.SetWidth(pcbnew.PADSTACK.ALL_LAYERS, mm(Rules.via))
            item.SetDrill(mm(Rules.hole))
            item.SetNetCode(code)
            self.board.Add(item)

    def pour(self):
        x0, y0, x1, y1 = self.sheet.outline
        for layer in LAYERS:
            zone = pcbnew.ZONE(self.board)
            zone.SetLayer(layer)
            zone.SetNet(self.nets["GND"])
            inset = 0.4
            chain = pcbnew.SHAPE_LINE_CHAIN()
            for x, y in (
                (x0 + inset, y0 + inset),
                (x1 - inset, y0 + inset),
                (x1 - inset, y1 - inset),
                (x0 + inset, y1 - inset),
            ):
                point = spot(*self.page(x, y))
                chain.Append(point.x, point.y)
            chain.SetClosed(True)
            zone.AddPolygon(chain)
            zone.SetLocalClearance(mm(0.25))
            zone.SetMinThickness(mm(0.25))
            zone.SetThermalReliefGap(mm(0.3))
            zone.SetThermalReliefSpokeWidth(mm(0.4))
            zone.SetIslandRemovalMode(pcbnew.ISLAND_REMOVAL_MODE_ALWAYS)
            self.board.Add(zone)

    def text(self, x, y, size, words, layer=pcbnew.F_SilkS):
        item = pcbnew.PCB_TEXT(self.board)
        item.SetText(words)
        item.SetPosition(spot(*self.page(x, y)))
        item.SetTextSize(spot(size, size))
        item.SetTextThickness(mm(size * TEXT_LINE / TEXT))
        item.SetLayer(layer)
        if layer == pcbnew.B_SilkS:
            item.SetMirrored(True)
        self.board.Add(item)
        return item

    def legend(self):
        """Titles, then each reference at the first place beside its part where it covers nothing."""
        taken = [self.text(*entry).GetBoundingBox() for entry in self.sheet.silk]
        x0, _, x1, y1 = self.sheet.outline
        self.text((x0 + x1) / 2, y1 - 2, 1.0, "NOT YET BUILT", pcbnew.B_SilkS)
        for footprint in self.board.GetFootprints():
            for pad in footprint.Pads():
                frame = pad.GetBoundingBox()
                frame.Inflate(mm(0.15))
                taken.append(frame)
            for item in footprint.GraphicalItems():
                if item.GetLayer() == pcbnew.F_SilkS:
                    frame = item.GetBoundingBox()
                    frame.Inflate(mm(0.1))
                    taken.append(frame)
        edge = self.board.GetBoardEdgesBoundingBox()
        edge.Inflate(mm(-0.3))
        for footprint in self.board.GetFootprints():
            field = footprint.Reference()
            if footprint.GetReference().startswith("H"):
                field.SetVisible(False)
                continue
            field.SetTextSize(spot(TEXT, TEXT))
            field.SetTextThickness(mm(TEXT_LINE))
            field.SetKeepUpright(True)
            taken.append(self.settle(footprint, field, taken, edge))

    def settle(self, footprint, field, taken, edge):
        body = footprint.GetBoundingBox(False)
        others = [other.GetBoundingBox(False) for other in self.board.GetFootprints()
                  if other.GetReference() != footprint.GetReference()]  # fmt: skip
        taken = taken + others
        centre = body.GetCenter()
        for distance, slide, degrees in PLACES:
            field.SetTextAngleDegrees(degrees)
            frame = field.GetBoundingBox()
            dx = (body.GetWidth() + frame.GetWidth()) // 2 + mm(distance)
            dy = (body.GetHeight() + frame.GetHeight()) // 2 + mm(distance)
            shift = mm(slide)
            for x, y in ((shift, -dy), (shift, dy), (dx, shift), (-dx, shift)):
                field.SetPosition(pcbnew.VECTOR2I(centre.x + x, centre.y + y))
                frame = field.GetBoundingBox()
                if edge.Contains(frame) and not any(frame.Intersects(other) for other in taken):
                    return frame
        field.SetVisible(False)
        print(f"make.py: {self.sheet.name}: no room for the legend {footprint.GetReference()}")
        return field.GetBoundingBox()

    def make(self, path: Path):
        self.add_nets()
        self.add_parts()
        self.add_outline()
        self.route()
        self.legend()
        self.pour()
        pcbnew.SaveBoard(str(path), self.board, True)
        loaded = pcbnew.LoadBoard(str(path))  # the filler wants a board that belongs to a project
        pcbnew.ZONE_FILLER(loaded).Fill(loaded.Zones())
        pcbnew.SaveBoard(str(path), loaded, True)
        steady(path, self.sheet.name)


def spread(pads) -> float:
    """How far apart the pads of a net lie: short nets are routed first."""
    return max(p.x for p in pads) - min(p.x for p in pads) + max(p.y for p in pads) - min(p.y for p in pads)


def steady(path: Path, name: str):
    """KiCad draws UUIDs at random and sorts by them; sorted by content and numbered, two runs give the same file."""
    content = ordered(read(path))
    number_uuids(content, name, [0])
    path.write_text(write(content) + "\n", encoding="utf-8")


def ordered(node: list) -> list:
    """A list of the board file whose drawn items stand in the order of their content; all else stays where it is."""
    parts = [ordered(part) if isinstance(part, list) else part for part in node]
    places = [n for n, part in enumerate(parts) if isinstance(part, list) and part and part[0] in SORTED]
    for place, part in zip(places, sorted((parts[n] for n in places), key=bare), strict=True):
        parts[place] = part
    return parts


def bare(node: list) -> str:
    """Text of an item without its UUIDs."""
    return re.sub(r'\(uuid "[^"]*"\)', "", write(node))


def number_uuids(node: list, name: str, count: list[int]):
    """Gives each UUID of a board the one that belongs to its place in the file."""
    if node and node[0] == "uuid":
        count[0] += 1
        node[1] = identity(name, "board", count[0])
    for part in node:
        if isinstance(part, list):
            number_uuids(part, name, count)
