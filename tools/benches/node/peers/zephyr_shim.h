/* As much of Zephyr as its driver of the TMAG5170 uses, on peer.h. */
#ifndef ZEPHYR_SHIM_H
#define ZEPHYR_SHIM_H

#include <stdbool.h>

#include "peer.h"

#define CONFIG_TMAG5170_CRC 1
#define BIT(n) (1u << (n))
#define BIT_MASK(n) (BIT(n) - 1u)
#define EIO 5
#define ENODEV 19
#define ENOTSUP 134
#define LOG_MODULE_REGISTER(...)
#define LOG_ERR(...)
#define DEVICE_API(kind, name) const struct kind##_driver_api name
#define DT_INST_FOREACH_STATUS_OKAY(what)
#define K_MSEC(n) (n)
#define K_USEC(n) (((n) + 999u) / 1000u)
#define k_sleep(ms) peer_wait_ms(ms)

struct named {
    const char *name;
};
struct spi_dt_spec {
    const struct named *bus;
};
struct spi_buf {
    uint8_t *buf;
    size_t len;
};
struct spi_buf_set {
    const struct spi_buf *buffers;
    size_t count;
};
struct device {
    const void *config;
    void *data;
};
struct sensor_value {
    int32_t val1, val2;
};
enum sensor_channel {
    SENSOR_CHAN_MAGN_X,
    SENSOR_CHAN_MAGN_Y,
    SENSOR_CHAN_MAGN_Z,
    SENSOR_CHAN_MAGN_XYZ,
    SENSOR_CHAN_ROTATION,
    SENSOR_CHAN_AMBIENT_TEMP,
    SENSOR_CHAN_ALL
};
struct sensor_driver_api {
    int (*sample_fetch)(const struct device *device, enum sensor_channel channel);
    int (*channel_get)(const struct device *device, enum sensor_channel channel, struct sensor_value *value);
};

static inline bool spi_is_ready_dt(const struct spi_dt_spec *bus)
{
    (void)bus;
    return true;
}

static inline int spi_transceive_dt(const struct spi_dt_spec *bus, const struct spi_buf_set *out,
                                    const struct spi_buf_set *in)
{
    uint8_t nowhere[4];
    (void)bus;
    peer_transfer(out->buffers->buf, in->buffers->buf ? in->buffers->buf : nowhere, (uint32_t)out->buffers->len, 0);
    return 0;
}

/* x^4 + x + 1, a nibble at a time. */
static inline uint8_t crc4_ti(uint8_t crc, const uint8_t *bytes, size_t n)
{
    static const uint8_t AFTER[16] = {0, 3, 6, 5, 12, 15, 10, 9, 11, 8, 13, 14, 7, 4, 1, 2};
    for (size_t i = 0; i < n; i++) {
        crc = AFTER[crc ^ bytes[i] >> 4];
        crc = AFTER[crc ^ (bytes[i] & 0xFu)];
    }
    return crc;
}

#endif
