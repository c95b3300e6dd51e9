// As much of Arduino, Adafruit_BusIO and Adafruit_Sensor as Adafruit_MLX90393 uses, on peer.h.
#pragma once
#include "peer.h"

#define SPI_BITORDER_MSBFIRST 0
#define SPI_MODE3 3
#define SENSOR_TYPE_MAGNETIC_FIELD 2

typedef bool boolean;
struct TwoWire {
};
struct SPIClass {
};
inline TwoWire Wire;
inline SPIClass SPI;

extern "C" void *memset(void *to, int value, size_t n);
extern "C" void *memcpy(void *to, const void *from, size_t n);

inline char *strncpy(char *to, const char *from, size_t n)
{
    for (size_t i = 0; i < n && (to[i] = from[i]) != '\0'; i++) {
    }
    return to;
}
inline void delay(unsigned long ms)
{
    peer_wait_ms(ms);
}
inline unsigned long millis()
{
    return 0;
}

struct sensors_event_t {
    int32_t version, sensor_id, type, reserved0, timestamp;
    struct {
        float x, y, z;
    } magnetic;
};
struct sensor_t {
    char name[12];
    int32_t version, sensor_id, type;
    float max_value, min_value, resolution;
    int32_t min_delay;
};
class Adafruit_Sensor
{
  public:
    virtual bool getEvent(sensors_event_t *) = 0;
    virtual void getSensor(sensor_t *) = 0;
};

class Adafruit_I2CDevice
{
  public:
    Adafruit_I2CDevice(uint8_t, TwoWire *)
    {
    }
    bool begin()
    {
        return false;
    }
    bool write(const uint8_t *, size_t)
    {
        return false;
    }
    bool read(uint8_t *, size_t)
    {
        return false;
    }
};
class Adafruit_SPIDevice
{
  public:
    Adafruit_SPIDevice(int, uint32_t, int, int, SPIClass *)
    {
    }
    bool begin()
    {
        return true;
    }
    bool write_then_read(const uint8_t *out, size_t written, uint8_t *in, size_t read, uint8_t fill)
    {
        uint8_t bytes[8];
        for (size_t i = 0; i < written + read; i++)
            bytes[i] = i < written ? out[i] : fill;
        peer_transfer(bytes, bytes, written + read, 1);
        memcpy(in, bytes + written, read);
        return true;
    }
};

inline void *operator new(size_t)
{
    static uint64_t place[4];
    return place;
}
inline void operator delete(void *, size_t) noexcept
{
}
extern "C" void __cxa_pure_virtual()
{
}
