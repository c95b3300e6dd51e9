// Adafruit's library for the MLX90393 by SPI, as its example reads it; FAST: without filter and oversampling.
#include "arduino_shim.h"

#include "Adafruit_MLX90393.cpp"

extern "C" void peer_main(void)
{
    Adafruit_MLX90393 sensor;
    sensors_event_t event;
    if (!sensor.begin_SPI(0))
        return;
#ifdef FAST
    sensor.setFilter(MLX90393_FILTER_0);
    sensor.setOversampling(MLX90393_OSR_0);
#endif
    while (sensor.getEvent(&event))
        peer_took(static_cast<int32_t>(event.magnetic.x));
}
