/* Of the C library's header what the firmware uses, for a compiler that comes without one: int has 16 bits. */
#ifndef CHIP_STDINT_H
#define CHIP_STDINT_H

typedef signed char int8_t;
typedef unsigned char uint8_t;
typedef int int16_t;
typedef unsigned int uint16_t;
typedef long int32_t;
typedef unsigned long uint32_t;
typedef long long int64_t;
typedef unsigned long long uint64_t;
typedef unsigned int uintptr_t;

#define UINT16_MAX 0xFFFFu
#define UINT32_MAX 0xFFFFFFFFul
#define UINT32_C(value) value##ul
#define UINT64_C(value) value##ull

#endif
