/* Zephyr's driver of the TMAG5170 as its application reads it: fetch, then get, of all three axes; CRC on. */
#include "zephyr_shim.h"

#include "tmag5170.c"

void peer_main(void)
{
    static struct tmag5170_data data;
    static const struct tmag5170_dev_config config = {.magnetic_channels = 7,
                                                      .x_range = 2,
                                                      .y_range = 2,
                                                      .z_range = 2,
                                                      .operating_mode = TMAG5170_ACTIVE_TRIGGER_MODE};
    const struct device device = {&config, &data};
    struct sensor_value values[3];
    if (tmag5170_init(&device) != 0)
        return;
    while (tmag5170_sample_fetch(&device, SENSOR_CHAN_MAGN_XYZ) == 0 &&
           tmag5170_channel_get(&device, SENSOR_CHAN_MAGN_XYZ, values) == 0)
        peer_took(values[0].val1);
}
