"""The adapter for eight nodes: four 74LVC244 with series resistors, eight cables, two Pmod headers, fused 5 V."""

from node import CABLE, NOT_BUILT, R0603, R10K, R100K, capacitor
from schematic import Part, Sheet

LINES = ("SYNC", "SCK", "SELECT", "MOSI")
INPUTS = (("2", "4", "6", "8"), ("17", "15", "13", "11"))  # 1A0 to 1A3, 2A0 to 2A3
OUTPUTS = (("18", "16", "14", "12"), ("3", "5", "7", "9"))  # 1Y0 to 1Y3, 2Y0 to 2Y3
PITCH = 10.922
PACK = [("Bourns", "CAY16-470J4LF"), ("Panasonic", "EXB-38V470JV")]
BOX_2X6 = [("Adam Tech", "BHR-12-VUA"), ("Würth Elektronik", "61201221621")]
PMOD = "Connector_IDC:IDC-Header_2x06_P2.54mm_Vertical"


def buffer(k):
    """Buffer U(k+1) drives cables 2k+1 and 2k+2 through RN(2k+1) and RN(2k+2)."""
    x, y = 26 + (k % 2) * 58, 24 + (k // 2) * 31
    nets = {"1": "GND", "19": "GND", "10": "GND", "20": "+3V3"}
    parts, wires, labels = [], [], []
    for half in range(2):
        cable = 2 * k + half + 1
        top = y - 5 + 4 * half
        pack = (x + 12, top + 2)
        for n, line in enumerate(LINES):
            nets[INPUTS[half][n]] = line
            nets[OUTPUTS[half][n]] = f"={line}_{cable}_BUFFERED"
            wires.append([(x + 5, top + n), (x + 10, top + n)])
            labels.append((x + 5.25, top + n, f"{line}_B{cable}", 1))
        nets_pack = {str(1 + n): f"={LINES[n]}_B{cable}" for n in range(4)}
        nets_pack |= {str(8 - n): f"{LINES[n]}_{cable}" for n in range(4)}
        parts.append(Part(f"RN{cable}", "Device:R_Pack04", "4x47", "Resistor_SMD:R_Array_Convex_4x0603", pack, nets_pack,
                          (38.1, 6.35 + (cable - 1) * PITCH, 0), turn=270, sources=PACK,
                          what="four isolated resistors 47 ohm, 5 %", text=(-1, -4.2 if half == 0 else 3.2)))  # fmt: skip
    parts.append(Part(f"U{k + 1}", "74xx:74HC244", "74LVC244A", "Package_SO:SOIC-20W_7.5x12.8mm_P1.27mm", (x, y), nets,
                      (25.4, 11.43 + 2 * k * PITCH, 0), what="eight buffers, SO-20 wide", text=(2, -7.6),
                      sources=[("Texas Instruments", "SN74LVC244ADWR"), ("Nexperia", "74LVC244AD,118")]))  # fmt: skip
    parts.append(capacitor(f"C{k + 1}", (x - 9, y + 9), "+3V3", (25.4, 3.175 + 2 * k * PITCH, 0), f"VCC of U{k + 1}"))
    return parts, wires, labels


def cable(n):
    """Socket J(n) of a node's cable and the pull-up of its MISO."""
    x, y = 19 + ((n - 1) % 4) * 26, 82 + ((n - 1) // 4) * 12
    nets = {"1": f"SYNC_{n}", "2": "GND", "3": f"SCK_{n}", "4": "GND", "5": f"SELECT_{n}", "6": f"MOSI_{n}", "7": "GND",
            "8": f"MISO_{n}", "9": "GND", "10": "+5V"}  # fmt: skip
    return [
        Part(f"J{n}", "Connector_Generic:Conn_02x05_Odd_Even", "cable", "Connector_IDC:IDC-Header_2x05_P2.54mm_Vertical",
             (x, y), nets, (46.99, 7.62 + (n - 1) * PITCH, 90), sources=CABLE, stubs={"6": 3, "8": 3}, what="box header 2x5, 2.54 mm, upright",
             text=(-0.5, -4.4)),
        Part(f"R{n}", "Device:R", "10k", R0603, (x + 12, y - 1), {"1": "+3V3", "2": f"MISO_{n}"},
             (14.986, 30.48 + n * 2.54, 0), sources=R10K),
    ]  # fmt: skip


BUFFERS = [buffer(k) for k in range(4)]
PARTS = [part for parts, _, _ in BUFFERS for part in parts] + [part for n in range(1, 9) for part in cable(n)]
PARTS += [
    Part("J9", "Connector_Generic:Conn_02x06_Odd_Even", "bus", PMOD, (142, 22),
         {"1": "SYNC", "3": "SCK", "5": "SELECT", "7": "MOSI", "9": "GND", "11": "+3V3",
          "2": None, "4": None, "6": None, "8": None, "10": "GND", "12": "+3V3"},
         (5.588, 14.224, 0), what="box header 2x6, 2.54 mm, upright; odd pins are the Pmod's row 1 to 6", sources=BOX_2X6, text=(-0.5, -4.4)),
    Part("J10", "Connector_Generic:Conn_02x06_Odd_Even", "MISO", PMOD, (142, 40),
         {"1": "MISO_1", "3": "MISO_2", "5": "MISO_3", "7": "MISO_4", "9": "GND", "11": "+3V3",
          "2": "MISO_5", "4": "MISO_6", "6": "MISO_7", "8": "MISO_8", "10": "GND", "12": "+3V3"},
         (5.588, 40.64, 0), what="box header 2x6, 2.54 mm, upright", sources=BOX_2X6, text=(-0.5, -4.4)),
    Part("J11", "Connector:Screw_Terminal_01x02", "5 V in",
         "TerminalBlock_Phoenix:TerminalBlock_Phoenix_MKDS-1,5-2-5.08_1x02_P5.08mm_Horizontal", (132, 58),
         {"1": "=+5V_IN", "2": "GND"}, (6.35, 66.04, 270), sources=[("Phoenix Contact", "1715721"), ("On Shore Technology", "OSTTC022162")],
         what="screw terminal 2-way, 5.08 mm", text=(1, -1.4)),
    Part("F1", "Device:Polyfuse", "1.1A", "Fuse:Fuse_1812_4532Metric", (139, 57), {"1": "=+5V_IN", "2": "=+5V_FUSED"},
         (15.24, 61.468, 0), turn=90, sources=[("Bourns", "MF-MSMF110/16-2"), ("Littelfuse", "1812L110/16DR")],
         what="resettable fuse, holds 1.1 A, 16 V, 1812"),
    Part("D1", "Device:D_TVS", "SMBJ5.0CA", "Diode_SMD:D_SMB", (144, 58.5), {"1": "GND", "2": "=+5V_FUSED"},
         (8.128, 78.74, 0), turn=90, sources=[("Littelfuse", "SMBJ5.0CA"), ("Bourns", "SMBJ5.0CA")],
         what="clamps either way: 6.4 to 7 V, 9.2 V at most", text=(-0.8, 0.7)),
    Part("Q1", "Transistor_FET:AO3401A", "AO3401A", "Package_TO_SOT_SMD:SOT-23", (150, 58),
         {"1": "=GATE", "2": "=+5V", "3": "=+5V_FUSED"}, (15.748, 77.724, 0), turn=90,
         sources=[("Alpha & Omega Semiconductor", "AO3401A"), ("Infineon", "IRLML6402TRPBF")],
         what="no current when the wires are swapped; gate-source 12 V", text=(-2.5, -3)),
    Part("R9", "Device:R", "100k", R0603, (150, 62), {"1": "=GATE", "2": "GND"}, (15.748, 81.534, 0), sources=R100K,
         what="gate of Q1"),
    Part("C5", "Device:C_Polarized", "100u", "Capacitor_THT:CP_Radial_D6.3mm_P2.50mm", (156, 58.5),
         {"1": "=+5V", "2": "GND"}, (15.494, 68.58, 270), sources=[("Panasonic", "EEU-FR1E101"), ("Nichicon", "UVR1E101MED")],
         what="aluminium electrolytic, 25 V, 6.3 mm, lead spacing 2.5 mm"),
    *[Part(f"H{n}", "Mechanical:MountingHole", "M3", "MountingHole:MountingHole_3.2mm_M3", (125 + 6 * n, 84), {},
           place, in_bom=False, what="screw") for n, place in
      enumerate([(4, 4, 0), (67, 3.5, 0), (4, 91.5, 0), (67, 91.5, 0)], 1)],
]  # fmt: skip
SHEET = Sheet(
    "adapter", "Adapter for eight whisker nodes",
    [NOT_BUILT, "Cable, buffers, supply: docs/hardware.md"],
    PARTS,
    wires=[wire for _, wires, _ in BUFFERS for wire in wires]
    + [[(130, 58), (128, 58), (128, 55), (136, 55), (136, 57), (137.5, 57)], [(140.5, 57), (148, 57)], [(152, 57), (159, 57)], [(150, 60), (150, 60.5)]],
    labels=[label for _, _, labels in BUFFERS for label in labels] + [(129, 55, "+5V_IN", 1), (140.7, 57, "+5V_FUSED", 1), (150, 60.25, "GATE", 1)],
    rails=[(159, 57, "+5V")],
    flags=[(130, 75, "+3V3"), (138, 75, "GND"), (146, 75, "+5V")],
    boxes=[(6, 6, 122, 71, "Buffers: one output and one series resistor per cable and line"),
           (6, 73, 116, 102, "Cables: J1 to J8 go to nodes 1 to 8; a lane without a node reads ones"),
           (126, 6, 162, 49, "To the FPGA board: Pmod pattern, 3.3 V"),
           (126, 50, 162, 67, "5 V for eight nodes, not from USB"),
           (126, 68, 162, 89, "Fed from outside; screws M3")],
    notes=[(127, 45, "Odd pins are the Pmod's row 1 to 6, even pins its row 7 to 12.")],
    paper="A3",
    outline=(0, 0, 71.12, 95.25),
    silk=[(25, 93.5, 1.0, "CrunchBot adapter 8 rev A"), (36, 1.2, 0.8, "NOT YET BUILT")],
    power_nets=("+5V", "+3V3", "+5V_IN", "+5V_FUSED"),
    step=0.254,
)  # fmt: skip
