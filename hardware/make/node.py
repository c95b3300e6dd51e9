"""The node: MLX90333 at the follicle's axis, dsPIC33FJ128MC802, regulator, cable, programming header."""

from schematic import Part, Sheet

C0603 = "Capacitor_SMD:C_0603_1608Metric"
R0603 = "Resistor_SMD:R_0603_1608Metric"
C100N = [("KEMET", "C0603C104K5RACTU"), ("Murata", "GRM188R71H104KA93D")]
C1U = [("Murata", "GRM188R61E105KA12D"), ("Samsung Electro-Mechanics", "CL10A105KA8NNNC")]
R10K = [("Yageo", "RC0603FR-0710KL"), ("Vishay", "CRCW060310K0FKEA")]
R1K5 = [("Yageo", "RC0603FR-071K5L"), ("Vishay", "CRCW06031K50FKEAC")]
R100K = [("Yageo", "RC0603FR-07100KL"), ("Vishay", "CRCW0603100KFKEA")]
R1K = [("Yageo", "RC0603FR-071KL"), ("Vishay", "CRCW06031K00FKEA")]
R470 = [("Yageo", "RC0603FR-07470RL"), ("Vishay", "CRCW0603470RFKEA")]
C10U = [("Murata", "GRM21BR61C106KE15L"), ("Samsung Electro-Mechanics", "CL21A106KOQNNNE")]
ESD = [("Littelfuse", "SRV05-4HTG-D"), ("Bourns", "CDSOT23-SRV05-4")]
R33 = [("Yageo", "RC0603FR-0733RL"), ("Vishay", "CRCW060333R0FKEA")]
CABLE = [("Würth Elektronik", "61201021621"), ("3M", "30310-6002HB")]
NOT_BUILT = "Not yet built: no board has been made, soldered or measured"


def capacitor(ref, at, net, place, what, value="100n", sources=C100N, footprint=C0603):
    return Part(ref, "Device:C", value, footprint, at, {"1": net, "2": "GND"}, place, sources=sources, what=what)


def hole(ref, at, place):
    return Part(ref, "Mechanical:MountingHole", "M2", "MountingHole:MountingHole_2.2mm_M2", at, {}, place,
                in_bom=False, what="screw of the follicle")  # fmt: skip


def pull(ref, at, net, supply, x):
    """Keeps a line of the cable at rest while nothing drives it."""
    nets = {"1": supply, "2": net} if supply != "GND" else {"1": net, "2": supply}
    return Part(ref, "Device:R", "100k", R0603, at, nets, (x, 34.4, 90), sources=R100K, what=f"rest level of {net}")


def point(ref, at, net, place, turn=0):
    return Part(ref, "Connector:TestPoint", net, "TestPoint:TestPoint_Pad_D1.5mm", at, {"1": net}, place, turn=turn,
                in_bom=False, what="bare pad", text=(0.5, -1.6) if not turn else (0.6, 1.8))  # fmt: skip


def array(ref, at, nets, place, what):
    """Four lines to ground; its pin 5 stays open, else a line could feed the supply of a node without one."""
    return Part(ref, "Power_Protection:SRV05-4", "SRV05-4", "Package_TO_SOT_SMD:SOT-23-6", at,
                nets | {"2": "GND", "5": None}, place, sources=ESD, what=what, text=(3.4, -3.8))  # fmt: skip


OPEN = dict.fromkeys(["2", "3", "4", "5", "6", "7", "9", "10", "11", "12", "15"])
PARTS = [
    Part(
        "U1", "DSP_Microchip_DSPIC33:DSPIC33FJ64MC802-xSP", "dsPIC33FJ128MC802",
        "Package_SO:SOIC-28W_7.5x17.9mm_P1.27mm", (46, 42),
        OPEN | {
            "1": "=MCLR", "8": "GND", "13": "=+3V3", "14": "SELECT", "16": "SENSOR_SS",
            "17": "SENSOR_SCLK", "18": "SENSOR_DATA", "19": "GND", "20": "=VCAP", "21": "PGED2", "22": "PGEC2",
            "23": "SYNC", "24": "SCK", "25": "MOSI", "26": "=MISO_CHIP", "27": "GND", "28": "=+3V3",
        },
        (-2.0, 21.5, 270), sources=[("Microchip", "dsPIC33FJ128MC802-I/SO")],
        what="digital signal controller, SOIC-28; the same pins as SPDIP-28", text=(4, -12.6),
    ),
    Part(
        "U2", "crunchbot:MLX90333", "MLX90333", "Package_SO:SOIC-8_3.9x4.9mm_P1.27mm", (92, 24),
        {"1": "+5V", "2": "GND", "3": "=SENSOR_SS", "4": "=SENSOR_SCLK", "5": "=SENSOR_DATA", "6": "GND",
         "7": "=VDIG", "8": "GND"},
        (0, 0, 0), sources=[("Melexis", "MLX90333KDC-BCH-100-RE")], what="3D Hall sensor, SPI, SOIC-8",
        text=(1, -5.6),
    ),
    Part(
        "U3", "Regulator_Linear:MCP1703Ax-330xxTT", "MCP1702-3302", "Package_TO_SOT_SMD:SOT-23", (23, 14),
        {"1": "GND", "2": "=+3V3", "3": "=+5V"}, (10.6, 35.2, 90),
        sources=[("Microchip", "MCP1702T-3302E/CB"), ("Microchip", "MCP1703T-3302E/CB")],
        what="3.3 V regulator, SOT-23: 1 GND, 2 out, 3 in", text=(-2, -3.2),
    ),
    Part("C1", "Device:C", "10u", "Capacitor_SMD:C_0805_2012Metric", (24, 40.5), {"1": "=VCAP", "2": "GND"},
         (-3.6, 29.2, 180), sources=C10U,
         what="VCAP of U1, low ESR, within 6 mm of pin 20"),
    capacitor("C2", (41, 16), "+3V3", (-9.0, 13.7, 180), "VDD of U1, at pin 13"),
    capacitor("C3", (45.5, 16), "+3V3", (5.4, 28.9, 0), "AVDD of U1, at pin 28"),
    capacitor("C4", (50, 16), "+5V", (-5.4, -1.9, 90), "VDD of U2, at pin 1"),
    capacitor("C5", (105, 25.5), "=VDIG", (5.4, -0.7, 90), "VDIG of U2, at pin 7"),
    capacitor("C6", (54.5, 16), "+5V", (10.6, 46.6, 180), "5 V at the cable"),
    capacitor("C9", (17, 36.5), "=RESET", (4.6, 12.0, 90), "MCLR of U1"),
    capacitor("C10", (59, 16), "+5V", (10.4, 43.1, 180), "store at the cable's end", "10u", C10U, "Capacitor_SMD:C_0805_2012Metric"),
    capacitor("C7", (15, 15.5), "=+5V", (10.6, 39.4, 180), "into U3", "1u", C1U),
    capacitor("C8", (31, 15.5), "=+3V3", (10.6, 30.8, 0), "out of U3", "1u", C1U),
    Part("R1", "Device:R", "1k5", R0603, (80, 16.5), {"1": "+5V", "2": "=SENSOR_SS"}, (-1.2, 12.0, 90), sources=R1K5),
    Part("R2", "Device:R", "1k5", R0603, (77, 16.5), {"1": "+5V", "2": "=SENSOR_SCLK"}, (0.8, 12.0, 90), sources=R1K5),
    Part("R3", "Device:R", "1k5", R0603, (74, 16.5), {"1": "+5V", "2": "=SENSOR_DATA"}, (2.8, 12.0, 90), sources=R1K5),
    Part("R4", "Device:R", "10k", R0603, (20.5, 33.5), {"1": "+3V3", "2": "=RESET"}, (6.4, 12.0, 90), sources=R10K),
    Part("R11", "Device:R", "470", R0603, (25.5, 35), {"1": "=RESET", "2": "=MCLR"}, (8.0, 12.0, 90), turn=90,
         sources=R470, what="between C9 and the programmer's edges"),
    pull("R6", (11, 55), "SYNC", "GND", -2.6), pull("R7", (15.5, 55), "SCK", "GND", -0.8),
    pull("R8", (20, 55), "SELECT", "+3V3", 1.0), pull("R9", (25, 55), "MOSI", "GND", 2.8),
    array("U4", (122, 21), {"1": "SYNC", "3": "SCK", "4": "SELECT", "6": "MOSI"}, (-2.4, 38.4, 90),
          "ESD at the cable: four lines, SOT-23-6"),
    array("U5", (143, 21), {"1": "SENSOR_SCLK", "3": "SENSOR_SS", "4": "SENSOR_DATA", "6": "MISO"}, (-8.6, 30.4, 270),
          "ESD of the sensor's lines and MISO: four lines, SOT-23-6"),
    point("TP1", (118, 47), "+5V", (5.2, 38.4, 0), 180), point("TP2", (124, 47), "+3V3", (6.0, 34.4, 0), 180),
    point("TP3", (130, 47), "GND", (-9.0, 38.4, 0)), point("TP4", (136, 47), "SENSOR_SS", (-11.0, 34.6, 0)),
    point("TP5", (143, 47), "SENSOR_SCLK", (-8.2, 34.6, 0)), point("TP6", (150, 47), "SENSOR_DATA", (-5.4, 34.6, 0)),
    Part("R10", "Device:R", "1k", R0603, (118, 55.5), {"1": "+3V3", "2": "=LED"}, (10.8, 52.5, 0), sources=R1K),
    Part("D1", "Device:LED", "green", "LED_SMD:LED_0603_1608Metric", (118, 59.5), {"1": "GND", "2": "=LED"},
         (10.8, 49.6, 0), turn=90, sources=[("Würth Elektronik", "150060VS75000"), ("Lite-On", "LTST-C191KGKT")],
         what="3.3 V is there", text=(-1.2, -0.5)),
    Part("R5", "Device:R", "33", R0603, (69, 50), {"1": "=MISO_CHIP", "2": "MISO"}, (2.6, 29.3, 90), turn=90,
         sources=R33),
    Part("J1", "Connector_Generic:Conn_02x05_Odd_Even", "cable",
         "Connector_IDC:IDC-Header_2x05_P2.54mm_Vertical", (94, 45),
         {"1": "SYNC", "2": "GND", "3": "SCK", "4": "GND", "5": "SELECT", "6": "MOSI", "7": "GND", "8": "MISO",
          "9": "GND", "10": "+5V"},
         (-7.08, 47.0, 90), sources=CABLE, stubs={"6": 3, "8": 3}, what="box header 2x5, 2.54 mm, upright", text=(-0.5, -4.4)),
    Part("J2", "Connector_Generic:Conn_01x06", "programming",
         "Connector_PinHeader_2.54mm:PinHeader_1x06_P2.54mm_Vertical", (94, 59),
         {"1": "MCLR", "2": "+3V3", "3": "GND", "4": "PGED2", "5": "PGEC2", "6": None},
         (10.6, 13.6, 0), sources=[("Würth Elektronik", "61300611121"), ("Harwin", "M20-9990646")], stubs={"4": 3, "5": 3},
         what="pin header 1x6, 2.54 mm, upright", text=(-0.5, -4.4)),
    hole("H1", (16, 70), (-8, -8, 0)), hole("H2", (24, 70), (8, -8, 0)),
    hole("H3", (32, 70), (-8, 8, 0)), hole("H4", (40, 70), (8, 8, 0)),
]  # fmt: skip
SHEET = Sheet(
    "node", "Whisker node: MLX90333 and dsPIC33FJ128MC802",
    [NOT_BUILT, "Pins and connectors: docs/hardware.md"],
    PARTS,
    wires=[
        [(30, 35), (27, 35)], [(24, 35), (15, 35)],  # MCLR, RESET
        [(118, 57), (118, 58)],  # LED
        [(45, 29), (45, 28), (47, 28), (47, 29)],
        [(30, 39), (24, 39)],  # VCAP
        [(62, 50), (67.5, 50)],  # MISO before its resistor
        [(84, 22), (72, 22)], [(80, 18), (80, 22)],
        [(84, 24), (72, 24)], [(77, 18), (77, 24)],
        [(84, 26), (72, 26)], [(74, 18), (74, 26)],
        [(100, 24), (105, 24)],  # VDIG
        [(12, 14), (20, 14)], [(26, 14), (34, 14)],
    ],
    labels=[(27.2, 35, "MCLR", 1), (15, 35, "RESET", -1), (118, 57.5, "LED", 1), (27, 39, "VCAP", 1), (62.5, 50, "MISO_CHIP", 1), (72, 22, "SENSOR_SS", -1),
            (72, 24, "SENSOR_SCLK", -1), (72, 26, "SENSOR_DATA", -1), (100.5, 24, "VDIG", 1)],
    rails=[(12, 14, "+5V"), (34, 14, "+3V3"), (46, 28, "+3V3")],
    flags=[(55, 69, "+5V"), (61, 69, "GND")],
    boxes=[(8, 6, 37, 23, "Supply"), (39, 6, 62, 23, "Decoupling"), (63, 6, 111, 36.5, "Sensor"),
           (78, 37.5, 111, 53, "Cable to the bridge"), (78, 54, 111, 64.5, "Programming"),
           (8, 63, 48, 74, "Mechanics"), (50, 63, 67, 74, "Fed by the cable"), (7, 47, 29.5, 61.5, "Rest levels without a bridge"),
           (113, 6, 158, 36.5, "ESD: cable and sensor"), (113, 37.5, 158, 64.5, "Test points, and a light for 3.3 V")],
    notes=[(39.5, 20, "C2 at U1 pin 13, C3 at U1 pin 28,\nC4 at U2 pin 1, C6 and C10 at J1"),
           (64.5, 34, "U2: SPI, fast mode, angle output, filter 0, programmed before."),
           (79.5, 51, "At most 0.6 m of ribbon; every signal beside a ground."),
           (10, 72.2, "Screws of the follicle, 16 mm square about the sensor's centre")],
    paper="A3",
    outline=(-12.7, -11.5, 12.7, 55.0),
    silk=[(-2.2, 53.6, 1.0, "CrunchBot node rev A"), (0, -10.4, 0.8, "NOT YET BUILT")],
    axis=(0, 0, 20),
    power_nets=("+5V", "+3V3"),
)  # fmt: skip
