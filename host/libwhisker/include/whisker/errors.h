/*
 * Every error of libwhisker, once: name, code, text, remedy. The enum and the strings both come from this list.
 * Threads: the functions are for any thread at any time; what they give is constant.
 */
#ifndef WHISKER_ERRORS_H
#define WHISKER_ERRORS_H

/* X(NAME, code, text, remedy) */
#define WHISKER_ERRORS(X)                                                                                              \
    X(ARGUMENT, -1, "an argument is outside its range", "see the comment of the function")                             \
    X(MEMORY, -2, "not enough memory", "free some memory, or ask for a smaller ring")                                  \
    X(SYSTEM, -3, "the operating system refused", "errno says why; whisker doctor looks for the cause")                \
    X(TRUNCATED, -10, "a frame is incomplete", "read on: the rest may come; check the USB cable")                      \
    X(MAGIC, -11, "a frame does not begin with its magic", "resynchronise on the next magic; check the USB cable")     \
    X(WIRE_VERSION, -12, "bridge and host speak different wire versions", "install gateware and host of one release")  \
    X(HEADER_CRC, -13, "the CRC of a frame's header is wrong", "check the USB cable")                                  \
    X(LANES, -14, "a frame has another number of lanes than this host", "install gateware and host of one release")    \
    X(RECORD_CRC, -15, "the CRC of a record in a frame is wrong", "check the USB cable")                               \
    X(RECORD_TICK, -16, "a record in a frame belongs to another tick", "install gateware and host of one release")     \
    X(RING_NAME, -20, "the name of a ring is empty, too long, has a slash, or begins with a dot",                      \
      "use letters, digits, dash and dot")                                                                             \
    X(RING_MISSING, -21, "there is no ring of this name", "start whiskerd with this --ring")                           \
    X(RING_BUSY, -22, "another writer holds this ring", "stop the other whiskerd, or choose another --ring")           \
    X(RING_LAYOUT, -23, "this shared memory is not a whisker ring", "choose another --ring, or remove the file")       \
    X(RING_VERSION, -24, "the ring has another layout version", "install whiskerd and reader of one release")          \
    X(TIMEOUT, -25, "no frame came in time", "wait again; check that the bridge runs")                                 \
    X(OVERRUN, -26, "the writer overtook this reader", "read faster, or use a larger ring")                            \
    X(CLOSED, -27, "the writer closed the ring: end of stream", "none needed")                                         \
    X(WRITER_DEAD, -28, "the writer died without closing the ring", "start whiskerd again; see its log")               \
    X(RESTARTED, -29, "a new writer has made a new ring of this name", "attach again")                                 \
    X(RING_LOST, -30, "another process has changed the ring's memory", "start whiskerd again, attach again")           \
    X(RING_ACCESS, -31, "this ring is another user's, who keeps it closed",                                            \
      "become that user, give its whiskerd the umask 022, or choose another --ring")                                   \
    X(RING_OWNER, -32, "this ring is another user's, whom this reader is not set to trust",                            \
      "name that user with --ring-owner, or choose another --ring")                                                    \
    X(RING_WRITER, -33, "the process that this ring names as its writer does not hold the ring",                       \
      "its writer may run in another container: stop it there, or choose another --ring")                              \
    X(RING_SHARED, -34, "the shared memory for rings is missing or cannot be written",                                 \
      "mount a tmpfs at /dev/shm that can be written")                                                                 \
    X(DEVICE_MISSING, -40, "no bridge is connected", "plug it in; check its power and cable")                          \
    X(DEVICE_ACCESS, -41, "no permission to open the bridge", "install the udev rule, or ask an administrator")        \
    X(DEVICE_BUSY, -42, "another process uses the bridge", "stop the other whiskerd")                                  \
    X(DEVICE_GONE, -43, "the bridge was unplugged", "plug it in again")                                                \
    X(DEVICE_USB, -44, "a USB transfer failed", "check the USB cable; plug the bridge in again")                       \
    X(DEVICE_CONTROL, -45, "the bridge's HID interface does not answer", "plug the bridge in again")                   \
    X(DEVICE_REFUSED, -46, "the bridge refused the settings", "keep every setting inside its limits")                  \
    X(DEVICE_IDENTITY, -47, "the bridge has other lanes or frames than this host",                                     \
      "install gateware and host of one release")                                                                      \
    X(DEVICE_DRAIN, -48, "the bridge did not send its last frame after a stop", "plug the bridge in again")            \
    X(DEVICE_SERIAL, -49, "no bridge of this serial number is connected", "see whiskerd --list for those there are")   \
    X(DEVICE_TWINS, -56, "several bridges have this serial number",                                                    \
      "unplug all but one; give each its own: make bitstream BOARD=... SERIAL=...")                                    \
    X(TICK_IN_SILENT, -52, "no edge comes at the bridge's pin tick_in, so there are no ticks",                         \
      "check the wire and that its source runs; or start without --tick-in")                                           \
    X(TICK_IN_FAST, -53, "edges come at tick_in less than 7/8 of the tick period after the last: they are left out",   \
      "slow the source down, or give its period with --tick-period; check the wire for noise")                         \
    X(TICK_IN_GAP, -54, "edges were missing at tick_in for two tick periods or more",                                  \
      "check the wire, or give the source's period with --tick-period")                                                \
    X(TICK_IN_UNEVEN, -55, "edges at tick_in come more than 1/64 of the tick period beside their time",                \
      "give the source's period with --tick-period, or use a steadier source")                                         \
    X(IMAGE, -51, "this is no firmware image, or it is damaged", "build it again, or fetch it again")                  \
    X(GATEWARE_IMAGE, -60, "this is no gateware image, or it is damaged", "make it again: make bitstream BOARD=...")   \
    X(GATEWARE_BOARD, -61, "the gateware image is for another board",                                                  \
      "make one for this board: make bitstream BOARD=...")                                                             \
    X(GATEWARE_LANES, -62, "the gateware image has another number of lanes than the bridge",                           \
      "make it with LANES=... as the bridge has, or load it with the board's programmer")                              \
    X(GATEWARE_OLDER, -63, "the gateware image is older than what the bridge runs", "--force loads it all the same")   \
    X(GATEWARE_NO_FLASH, -64, "this bridge cannot write its own flash",                                                \
      "load the bitstream with the board's programmer: docs/boards.md")                                                \
    X(GATEWARE_FALLBACK, -65, "the bridge's flash holds no image to fall back to",                                     \
      "write one once with the board's programmer: docs/boards.md")                                                    \
    X(GATEWARE_SPACE, -66, "the gateware image is longer than its place in the bridge's flash",                        \
      "load the bitstream with the board's programmer: docs/boards.md")                                                \
    X(FLASH_CHIP, -67, "the bridge's flash does not say what it is, or is too small",                                  \
      "load the bitstream with the board's programmer: docs/boards.md")                                                \
    X(FLASH_BUSY, -68, "the bridge's flash stays busy",                                                                \
      "take the board's power away and give it back, and begin again")                                                 \
    X(FLASH_VERIFY, -69, "the bridge's flash does not hold what was written",                                          \
      "begin again; if it stays so, the flash is worn out: replace the board")                                         \
    X(USB_ID, -70, "the environment's WHISKER_USB_ID is not four hexadecimal digits, a colon and four more",           \
      "give the numbers of the bridge, as 1209:0001, or unset it")                                                     \
    X(HOST_CLOCK, -50, "the host's clock was set or went backwards", "none needed; a time service avoids it")

enum whisker_error {
    WHISKER_OK = 0,
#define WHISKER_ERROR_ENTRY(name, code, text, remedy) WHISKER_ERROR_##name = (code),
    WHISKER_ERRORS(WHISKER_ERROR_ENTRY)
#undef WHISKER_ERROR_ENTRY
};

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)
/* cffi: begin */
/* What happened, as one line; never NULL. 0 gives "no error". */
const char *whisker_error_text(int error);
/* What a person can do about it; never NULL. */
const char *whisker_error_remedy(int error);
/* The name in the list, such as "RING_BUSY"; "OK" for 0; never NULL. */
const char *whisker_error_name(int error);
/* cffi: end */
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
