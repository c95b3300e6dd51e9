#include "usb.h"

#include "gen/usb_descriptors.h" // described
#include "memory.h"
#include "reports.h"
#include "rp2040.h"
#include "stream.h"
#include "whisker_protocol.h"

#define PACKET 64u
#define ENDPOINTS 3u
#define ADDRESSES 128u
#define SERIAL_DIGITS 16u
#define SERIAL_BYTES (2u + 2u * SERIAL_DIGITS)
#define FEATURE 3u /* type of a report, in the high byte of a request's value */
#define SETTLE "nop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop"

/* A request's first two bytes, bmRequestType lowest (USB 2.0, 9.4; HID 1.11, 7.2). */
#define REQUEST(type, request) ((type) | (request) << 8)

struct setup {
    uint16_t kind, value, index, length;
};

/* A control transfer: data to the host, or a report from it, or nothing; then its status. */
static const uint8_t *reply;
static uint32_t reply_left;
static bool reply_short; /* the reply ends with a packet that is not full */
static uint8_t answer[REPORTS_BYTES_MAX], incoming[PACKET];
static uint32_t incoming_wanted;
static uint8_t new_address;
static bool confirming; /* the status to the host is under way */

static uint8_t configuration, idle_rate;
static uint8_t toggle[ENDPOINTS];
static bool halted[ENDPOINTS], busy, suspended, leaving;
static uint32_t length; /* of the packet that lies in endpoint 1 */
static uint8_t serial[SERIAL_BYTES];

static void usb_buffer(uint32_t address, uint32_t value)
{
    REG(address) = value;
    __asm volatile(
        SETTLE); /* a cycle of the controller's clock between the rest and `available` (data sheet, 4.1.2.5.1) */
    REG(address) = value | BUFFER_AVAILABLE;
}

static void usb_arm(uint32_t endpoint, uint32_t bytes)
{
    usb_buffer(DPRAM_BUFFER_IN(endpoint), bytes | BUFFER_FULL | (toggle[endpoint] ? BUFFER_DATA1 : 0u));
}

static void usb_send(uint32_t endpoint, const uint8_t *bytes, uint32_t n)
{
    uint32_t aligned[PACKET / 4u];
    const uint32_t *from = (const uint32_t *)(const void *)bytes;
    volatile uint32_t *to = (volatile uint32_t *)(endpoint ? DPRAM_DATA(endpoint) : DPRAM_DATA0);
    if (((uintptr_t)bytes & 3u) != 0)
        from = memcpy(aligned, bytes, n);
    for (const volatile uint32_t *end = to + (n + 3u) / 4u; to < end;)
        *to++ = *from++;
    usb_arm(endpoint, n);
    toggle[endpoint] ^= 1u;
}

static void usb_stall(void)
{
    REG(USB_STALL_ARM) = 3;
    REG(DPRAM_BUFFER_IN(0)) = BUFFER_STALL;
    REG(DPRAM_BUFFER_OUT0) = BUFFER_STALL;
}

/* Data, or its status, from the host: always DATA1 here, one packet each. */
static void usb_take(void)
{
    usb_buffer(DPRAM_BUFFER_OUT0, PACKET | BUFFER_DATA1);
}

static void usb_confirm(void)
{
    confirming = true;
    usb_send(0, incoming, 0);
}

static void usb_reply_on(void)
{
    const uint32_t n = reply_left > PACKET ? PACKET : reply_left;
    usb_send(0, reply, n);
    reply += n;
    reply_left -= n;
    reply_short = reply_short && n == PACKET;
}

static bool usb_reply(const uint8_t *bytes, uint32_t n, uint32_t wanted)
{
    reply = bytes;
    reply_left = n < wanted ? n : wanted;
    reply_short = n < wanted;
    if (wanted == 0)
        usb_confirm();
    else
        usb_reply_on();
    return true;
}

static bool usb_reply_byte(uint32_t value, const struct setup *s)
{
    answer[0] = (uint8_t)value;
    answer[1] = 0;
    return usb_reply(answer, s->kind == REQUEST(0x80u, 8u) || s->kind >= REQUEST(0x81u, 2u) ? 1 : 2, s->length);
}

static bool usb_done(void)
{
    usb_confirm();
    return true;
}

void usb_stream(void)
{
    const uint8_t *bytes;
    if (busy || !configuration || halted[1])
        return;
    const int n = stream_next(&bytes);
    if (n >= 0) {
        busy = true;
        length = (uint32_t)n;
        usb_send(1, bytes, length);
    }
}

/* An endpoint's toggle begins anew; a packet that lies there unsent goes out with it. */
static void usb_fresh(uint32_t endpoint)
{
    halted[endpoint] = false;
    toggle[endpoint] = 0;
    REG(DPRAM_BUFFER_IN(endpoint)) = 0;
    if (endpoint == 1 && busy) {
        usb_arm(1, length);
        toggle[1] = 1;
    } else if (endpoint == 1) {
        usb_stream();
    }
}

static bool usb_describe(const struct setup *s)
{
    const uint8_t type = (uint8_t)(s->value >> 8), index = (uint8_t)s->value;
    const bool of_interface = (s->kind & 0xFFu) == 0x81u;
    if (type == USB_STRING && index == USB_SERIAL_INDEX && !of_interface)
        return usb_reply(serial, sizeof serial, s->length);
    for (uint32_t i = 0; i < sizeof described / sizeof described[0]; i++)
        if (described[i].type == type && described[i].index == index && described[i].of_interface == of_interface &&
            (!of_interface || s->index == WHISKER_LIMIT_USB_HID_INTERFACE))
            return usb_reply(described[i].bytes, described[i].length, s->length);
    return false;
}

/* Also of the same value, it ends the run: to a host by USB/IP it is all that a reset comes to. */
static bool usb_configure(uint8_t value)
{
    stream_halt();
    configuration = value;
    busy = false;
    usb_fresh(1);
    usb_fresh(2);
    return usb_done();
}

/* 1 or 2, if that is an endpoint of the present configuration; 0: the control endpoint; ENDPOINTS: none. */
static uint32_t usb_endpoint(uint16_t index)
{
    const uint32_t endpoint = index & 0x7Fu;
    if (endpoint == 0)
        return 0;
    return configuration && index & 0x80u && endpoint < ENDPOINTS ? endpoint : ENDPOINTS;
}

static bool usb_halt(const struct setup *s, bool on)
{
    const uint32_t endpoint = usb_endpoint(s->index);
    if (endpoint == ENDPOINTS || s->value != 0 || s->length != 0)
        return false;
    if (endpoint > 0 && on) {
        halted[endpoint] = true;
        REG(DPRAM_BUFFER_IN(endpoint)) = BUFFER_STALL;
    } else if (endpoint > 0) {
        usb_fresh(endpoint);
    }
    return usb_done();
}

static bool usb_is_interface(const struct setup *s)
{
    return configuration && s->index <= WHISKER_LIMIT_USB_HID_INTERFACE && s->value == 0;
}

static bool usb_standard(const struct setup *s)
{
    switch (s->kind) {
    case REQUEST(0x80u, 0u): /* GET_STATUS of the device, an interface, an endpoint */
        return s->value == 0 && s->index == 0 && usb_reply_byte(0, s);
    case REQUEST(0x81u, 0u):
        return usb_is_interface(s) && usb_reply_byte(0, s);
    case REQUEST(0x82u, 0u):
        return usb_endpoint(s->index) < ENDPOINTS && s->value == 0 && usb_reply_byte(halted[usb_endpoint(s->index)], s);
    case REQUEST(0x02u, 1u): /* CLEAR_FEATURE */
    case REQUEST(0x02u, 3u): /* SET_FEATURE */
        return usb_halt(s, s->kind == REQUEST(0x02u, 3u));
    case REQUEST(0x00u, 5u): /* SET_ADDRESS */
        new_address = (uint8_t)s->value;
        return s->value < ADDRESSES && s->index == 0 && s->length == 0 && !configuration && usb_done();
    case REQUEST(0x80u, 6u): /* GET_DESCRIPTOR */
    case REQUEST(0x81u, 6u):
        return usb_describe(s);
    case REQUEST(0x80u, 8u): /* GET_CONFIGURATION */
        return s->value == 0 && s->index == 0 && usb_reply_byte(configuration, s);
    case REQUEST(0x00u, 9u): /* SET_CONFIGURATION */
        return s->value <= 1 && s->index == 0 && s->length == 0 && REG(USB_ADDRESS) != 0 &&
               usb_configure((uint8_t)s->value);
    case REQUEST(0x81u, 10u): /* GET_INTERFACE */
        return usb_is_interface(s) && usb_reply_byte(0, s);
    case REQUEST(0x01u, 11u): /* SET_INTERFACE */
        if (!usb_is_interface(s) || s->length != 0)
            return false;
        usb_fresh(s->index + 1u);
        return usb_done();
    default:
        return false;
    }
}

static bool usb_class(const struct setup *s)
{
    if (!configuration || s->index != WHISKER_LIMIT_USB_HID_INTERFACE)
        return false;
    const uint8_t id = (uint8_t)s->value;
    const bool feature = s->value >> 8 == FEATURE;
    switch (s->kind) {
    case REQUEST(0xA1u, 1u): { /* GET_REPORT */
        const uint32_t n = feature && s->length != 0 ? reports_get(id, answer) : 0;
        return n != 0 && usb_reply(answer, n, s->length);
    }
    case REQUEST(0x21u, 9u): /* SET_REPORT */
        incoming_wanted = feature ? reports_writable(id) : 0;
        if (incoming_wanted == 0 || s->length != incoming_wanted)
            return false;
        usb_take();
        return true;
    case REQUEST(0xA1u, 2u): /* GET_IDLE */
        return usb_reply_byte(idle_rate, s);
    case REQUEST(0x21u, 10u): /* SET_IDLE */
        idle_rate = (uint8_t)(s->value >> 8);
        return s->length == 0 && usb_done();
    default:
        return false;
    }
}

static void usb_on_setup(void)
{
    struct setup s;
    const uint32_t low = REG(DPRAM_SETUP), high = REG(DPRAM_SETUP + 4u);
    s = (struct setup){(uint16_t)low, (uint16_t)(low >> 16), (uint16_t)high, (uint16_t)(high >> 16)};
    REG(DPRAM_BUFFER_IN(0)) = 0; /* what a transfer left that was given up */
    REG(DPRAM_BUFFER_OUT0) = 0;
    toggle[0] = 1;
    reply_left = incoming_wanted = new_address = 0;
    reply_short = confirming = false;
    const bool windows = s.kind == REQUEST(0xC0u, USB_WINDOWS_REQUEST) && s.index == USB_WINDOWS_INDEX;
    if (!(windows          ? usb_reply(usb_windows_set, sizeof usb_windows_set, s.length)
          : s.kind & 0x20u ? usb_class(&s)
                           : usb_standard(&s)))
        usb_stall();
}

static void usb_on_control_sent(void)
{
    if (confirming) {
        confirming = false;
        if (new_address != 0)
            REG(USB_ADDRESS) = new_address;
        leaving = reports_want_boot_drive();
    } else if (reply_left > 0 || reply_short) {
        usb_reply_on();
    } else {
        usb_take(); /* the host's status */
    }
}

static void usb_on_control_received(void)
{
    const uint32_t got = REG(DPRAM_BUFFER_OUT0) & BUFFER_LENGTH;
    if (incoming_wanted == 0)
        return; /* a status */
    for (uint32_t i = 0; i < PACKET / 4; i++)
        ((uint32_t *)(void *)incoming)[i] = REG(DPRAM_DATA0 + 4u * i);
    if (got == incoming_wanted && reports_set(incoming))
        usb_confirm();
    else
        usb_stall();
    incoming_wanted = 0;
}

static void usb_on_buffers(void)
{
    const uint32_t done = REG(USB_BUFF_STATUS);
    REG(USB_BUFF_STATUS) = done;
    if (done & 1u)
        usb_on_control_sent();
    if (done & 2u)
        usb_on_control_received();
    if (done & 4u && busy && !halted[1]) {
        busy = false;
        usb_stream();
    }
}

static void usb_on_reset(void)
{
    REG(USB_ADDRESS) = 0;
    configuration = idle_rate = 0;
    busy = suspended = false;
    for (uint32_t endpoint = 0; endpoint < ENDPOINTS; endpoint++) {
        toggle[endpoint] = halted[endpoint] = 0;
        REG(DPRAM_BUFFER_IN(endpoint)) = 0;
    }
    REG(DPRAM_BUFFER_OUT0) = 0;
    stream_halt();
}

void usb_on_interrupt(void)
{
    const uint32_t why = REG(USB_INTS);
    if (why & INT_RESET) {
        REG(USB_SIE_STATUS) = SIE_RESET;
        usb_on_reset();
    }
    if (why & INT_BUFFER)
        usb_on_buffers();
    if (why & INT_SETUP) {
        REG(USB_SIE_STATUS) = SIE_SETUP;
        usb_on_setup();
    }
    if (why & INT_SUSPEND) {
        REG(USB_SIE_STATUS) = SIE_SUSPENDED;
        suspended = true;
        stream_suspend(true);
    }
    if (why & INT_RESUME) {
        REG(USB_SIE_STATUS) = SIE_RESUME;
        suspended = false;
        stream_suspend(false);
    }
    if (why & INT_SOF) {
        stream_on_sof((uint16_t)REG(USB_SOF)); /* reading it clears the cause */
        suspended = false;
    }
}

static void usb_name(uint64_t number)
{
    serial[0] = SERIAL_BYTES;
    serial[1] = USB_STRING;
    for (uint32_t i = 0; i < SERIAL_DIGITS; i++)
        serial[2u + 2u * i] = (uint8_t) "0123456789ABCDEF"[(uint32_t)(number >> (60u - 4u * i)) & 0xFu];
}

void usb_start(uint64_t number)
{
    usb_name(number);
    for (uint32_t i = 0; i < 0x1000u; i += 4)
        REG(DPRAM + i) = 0;
    REG(USB_MUXING) = 1u << 0 | 1u << 3; /* to the PHY on the chip */
    REG(USB_POWER) = 1u << 2 | 1u << 3;  /* as if there were a supply from the bus: the board has no other */
    REG(USB_MAIN_CTRL) = 1;
    REG(DPRAM_CONTROL_IN(1)) = ENDPOINT_ON | ENDPOINT_BULK | (DPRAM_DATA(1) - DPRAM);
    REG(DPRAM_CONTROL_IN(2)) = ENDPOINT_ON | ENDPOINT_INTERRUPT | (DPRAM_DATA(2) - DPRAM);
    REG(USB_INTE) = INT_BUFFER | INT_RESET | INT_SUSPEND | INT_RESUME | INT_SETUP | INT_SOF;
    REG(USB_SIE_CTRL) = SIE_INTERRUPT_0 | SIE_PULL_UP;
}

bool usb_is_in_use(void)
{
    return configuration && !suspended;
}

bool usb_wants_boot_drive(void)
{
    return leaving;
}
