"""The node: MLX90333 at the follicle's axis, dsPIC33FJ128MC802, regulator, cable, programming header."""

from schematic import Part, Sheet

C0603 = "Capacitor_SMD:C_0603_1608Metric"
R0603 = "Resistor_SMD:R_0603_1608Metric"
C100N = [("KEMET", "C0603C104K5RACTU"), ("Murata", "GRM188R71H104KA93D")]
C1U = [("Murata", "GRM188R61E105KA12D"), ("Samsung Electro-Mechanics", "CL10A105KA8NNNC")]
R10K = [("Yageo", "RC0603FR-0710KL"), ("Vishay", "CRCW060310K0FKEA")]
R1K5 = [("Yageo", "RC0603FR-071K5L"), ("Vishay", "CRCW06031K50FKEAC")]
R33 = [("Yageo", "RC0603FR-0733RL"), ("Vishay", "CRCW060333R0FKEA")]
CABLE = [("Würth Elektronik", "61201021621"), ("3M", "30310-6002HB")]
NOT_BUILT = "Not yet built: no board has been made, soldered or measured"


def capacitor(ref, at, net, place, what, value="100n", sources=C100N, footprint=C0603):
    return Part(ref, "Device:C", value, footprint, at, {"1": net, "2": "GND"}, place, sources=sources, what=what)


def hole(ref, at, place):
    return Part(ref, "Mechanical:MountingHole", "M2", "MountingHole:MountingHole_2.2mm_M2", at, {}, place,
                in_bom=False, what="screw of the follicle")  # fmt: skip


OPEN = dict.fromkeys(["2", "3", "4", "5", "6", "7", "9", "10", "11", "12"])
PARTS = [
    Part(
        "U1", "DSP_Microchip_DSPIC33:DSPIC33FJ64MC802-xSP", "dsPIC33FJ128MC802",
        "Package_SO:SOIC-28W_7.5x17.9mm_P1.27mm", (46, 42),
        OPEN | {
            "1": "=MCLR", "8": "GND", "13": "=+3V3", "14": "SELECT", "15": "SENSOR_SEND", "16": "SENSOR_SS",
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
        sources=[("Microchip", "MCP1702T-3302E/CB"), ("Torex", "XC6206P332MR-G")],
        what="3.3 V regulator, SOT-23: 1 GND, 2 out, 3 in", text=(-2, -3.2),
    ),
    Part("C1", "Device:C", "10u", "Capacitor_SMD:C_0805_2012Metric", (24, 40.5), {"1": "=VCAP", "2": "GND"},
         (-3.6, 29.2, 180), sources=[("Murata", "GRM21BR61C106KE15L"), ("Samsung Electro-Mechanics", "CL21A106KOQNNNE")],
         what="VCAP of U1, low ESR, within 6 mm of pin 20"),
    capacitor("C2", (42, 16), "+3V3", (-9.0, 13.7, 180), "VDD of U1, at pin 13"),
    capacitor("C3", (47, 16), "+3V3", (5.4, 28.9, 0), "AVDD of U1, at pin 28"),
    capacitor("C4", (52, 16), "+5V", (-5.4, -1.9, 90), "VDD of U2, at pin 1"),
    capacitor("C5", (105, 25.5), "=VDIG", (5.4, -0.7, 90), "VDIG of U2, at pin 7"),
    capacitor("C6", (57, 16), "+5V", (10.9, 43.4, 90), "5 V at the cable"),
    capacitor("C7", (15, 15.5), "=+5V", (10.6, 39.4, 180), "into U3", "1u", C1U),
    capacitor("C8", (31, 15.5), "=+3V3", (10.6, 30.8, 0), "out of U3", "1u", C1U),
    Part("R1", "Device:R", "1k5", R0603, (80, 16.5), {"1": "+5V", "2": "=SENSOR_SS"}, (-1.2, 12.0, 90), sources=R1K5),
    Part("R2", "Device:R", "1k5", R0603, (77, 16.5), {"1": "+5V", "2": "=SENSOR_SCLK"}, (0.8, 12.0, 90), sources=R1K5),
    Part("R3", "Device:R", "1k5", R0603, (74, 16.5), {"1": "+5V", "2": "=SENSOR_DATA"}, (2.8, 12.0, 90), sources=R1K5),
    Part("R4", "Device:R", "10k", R0603, (24, 33.5), {"1": "+3V3", "2": "=MCLR"}, (6.4, 12.0, 90), sources=R10K),
    Part("R5", "Device:R", "33", R0603, (69, 50), {"1": "=MISO_CHIP", "2": "MISO"}, (2.6, 29.3, 90), turn=90,
         sources=R33),
    Part("J1", "Connector_Generic:Conn_02x05_Odd_Even", "cable",
         "Connector_IDC:IDC-Header_2x05_P2.54mm_Vertical", (94, 45),
         {"1": "SYNC", "2": "GND", "3": "SCK", "4": "GND", "5": "SELECT", "6": "MOSI", "7": "GND", "8": "MISO",
          "9": "GND", "10": "+5V"},
         (-7.08, 38.3, 90), sources=CABLE, stubs={"6": 3, "8": 3}, what="box header 2x5, 2.54 mm, upright", text=(-0.5, -4.4)),
    Part("J2", "Connector_Generic:Conn_01x06", "programming",
         "Connector_PinHeader_2.54mm:PinHeader_1x06_P2.54mm_Vertical", (94, 59),
         {"1": "MCLR", "2": "+3V3", "3": "GND", "4": "PGED2", "5": "PGEC2", "6": None},
         (10.6, 13.6, 0), sources=[("Würth Elektronik", "61300611121"), ("Harwin", "M20-9990646")], stubs={"4": 3, "5": 3},
         what="pin header 1x6, 2.54 mm, upright", text=(-0.5, -4.4)),
    Part("JP1", "Jumper:SolderJumper_2_Open", "MLX90316", "Jumper:SolderJumper-2_P1.3mm_Open_RoundedPad1.0x1.5mm",
         (73, 31), {"1": "SENSOR_SEND", "2": "SENSOR_DATA"}, (-8.6, 28.9, 0), in_bom=False,
         what="closed for the MLX90316 build only", text=(-1.5, -2.6)),
    hole("H1", (16, 70), (-8, -8, 0)), hole("H2", (24, 70), (8, -8, 0)),
    hole("H3", (32, 70), (-8, 8, 0)), hole("H4", (40, 70), (8, 8, 0)),
]  # fmt: skip
SHEET = Sheet(
    "node", "Whisker node: MLX90333 and dsPIC33FJ128MC802",
    [NOT_BUILT, "Pins and connectors: docs/hardware.md", "Made by hardware/make/make.py"],
    PARTS,
    wires=[
        [(30, 35), (20, 35)],  # MCLR, with R4
        [(45, 29), (45, 28), (47, 28), (47, 29)],
        [(30, 39), (24, 39)],  # VCAP
        [(62, 50), (67.5, 50)],  # MISO before its resistor
        [(84, 22), (72, 22)], [(80, 18), (80, 22)],
        [(84, 24), (72, 24)], [(77, 18), (77, 24)],
        [(84, 26), (72, 26)], [(74, 18), (74, 26)],
        [(100, 24), (105, 24)],  # VDIG
        [(12, 14), (20, 14)], [(26, 14), (34, 14)],
    ],
    labels=[(20, 35, "MCLR", -1), (27, 39, "VCAP", 1), (62.5, 50, "MISO_CHIP", 1), (72, 22, "SENSOR_SS", -1),
            (72, 24, "SENSOR_SCLK", -1), (72, 26, "SENSOR_DATA", -1), (100.5, 24, "VDIG", 1)],
    rails=[(12, 14, "+5V"), (34, 14, "+3V3"), (46, 28, "+3V3")],
    flags=[(55, 69, "+5V"), (61, 69, "GND")],
    boxes=[(8, 6, 37, 23, "Supply"), (39, 6, 62, 23, "Decoupling"), (63, 6, 111, 36.5, "Sensor"),
           (78, 37.5, 111, 53, "Cable to the bridge"), (78, 54, 111, 64.5, "Programming"),
           (8, 63, 48, 74, "Mechanics"), (50, 63, 67, 74, "Fed by the cable")],
    notes=[(39.5, 20, "C2 at U1 pin 13, C3 at U1 pin 28,\nC4 at U2 pin 1, C6 at J1"),
           (64.5, 34, "JP1 closed for the MLX90316 build only. U2: SPI, fast mode, angle output, filter 0, programmed before."),
           (79.5, 51, "At most 0.6 m of ribbon; every signal beside a ground."),
           (10, 72.2, "Screws of the follicle, 16 mm square about the sensor's centre")],
    outline=(-12.7, -11.5, 12.7, 46.0),
    silk=[(-2.2, 44.6, 1.0, "CrunchBot node rev A"), (0, -10.4, 0.8, "NOT YET BUILT")],
    axis=(0, 0, 20),
    power_nets=("+5V", "+3V3"),
)  # fmt: skip
