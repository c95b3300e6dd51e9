/* Configuration words, in the loader's program only: start on FRC, switching allowed, no crystal, watchdog under the
 * firmware's control, pins PGx2, no JTAG (its pins are the sensor's). Values as facts of the device's data sheet. */
#define CONFIG(name, at, value) const unsigned int __attribute__((space(prog), address(at), used)) name = (value)

CONFIG(config_fbs, 0xF80000, 0xCF);     /* no boot segment, no protection */
CONFIG(config_fgs, 0xF80004, 0x07);     /* no code protection */
CONFIG(config_foscsel, 0xF80006, 0x00); /* FNOSC: FRC; two-speed start off */
CONFIG(config_fosc, 0xF80008, 0x63);    /* switching on, monitor off; pin map locked once; OSC2 a pin; no primary */
CONFIG(config_fwdt, 0xF8000A, 0x47);    /* FWDTEN 0, not windowed, 1:32 of 32 kHz, 1:128: 128 ms */
CONFIG(config_fpor, 0xF8000C, 0xF7);    /* 128 ms power-up timer */
CONFIG(config_ficd, 0xF8000E, 0xC2);    /* PGx2, as on the header; JTAG off; bits 4 to 2 do not exist and read 0 */
