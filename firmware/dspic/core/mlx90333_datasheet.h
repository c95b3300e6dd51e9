/* MLX90333 on its serial interface: frame layout and timing.
 * Fast mode (20 MHz internal oscillator), angle mode (XYZ 0).
 *
 * Times are the data sheet's, in nanoseconds, at the nominal internal oscillator. Confidence: A vendor's document,
 * B drivers reported to work on the part, C recalled from the data sheet, D deduced. */
#ifndef MLX90333_DATASHEET_H
#define MLX90333_DATASHEET_H

#include <stdint.h>

/* Frame (B): least significant byte first, most significant bit first; the sum is that of bytes 1 to 6, low 8 bits. */
#define MLX90333_FRAME_BYTES 8u
#define MLX90333_FRAME_START 0u  /* byte offset; 0xFF */
#define MLX90333_FRAME_ALPHA 1u  /* byte offset; 16 bits */
#define MLX90333_FRAME_BETA 3u   /* byte offset; 16 bits */
#define MLX90333_FRAME_ERRORS 5u /* byte offset; 16 bits, zero means none */
#define MLX90333_FRAME_SUM 7u    /* byte offset; 8 bits */
#define MLX90333_START_BYTE 0xFFu
#define MLX90333_MASTER_START 0xFFu /* B: what the master sends in the start byte; on another the sensor is silent */
#define MLX90333_MASTER_BYTE 0xFFu  /* B: in the others: on the shared open-drain line a zero would destroy a bit */

#define MLX90333_T1_NS 2300u            /* C: clock period of a bit within a byte, minimum */
#define MLX90333_T2_NS 12500u           /* C: gap between any two data bytes, minimum */
#define MLX90333_T4_NS 2300u            /* C: last clock edge to /SS high, minimum */
#define MLX90333_T5_NS UINT32_C(300000) /* C: /SS high at least this long surely resynchronises; less is undefined */
#define MLX90333_T6_NS 2300u            /* C: /SS low to the first clock edge, minimum */
#define MLX90333_T7_NS 15000u           /* C: gap between the start byte and the next, minimum */
#define MLX90333_STARTUP_NS UINT32_C(16000000) /* A (its sibling), B: supply good to the first clock edge */

#define MLX90333_OSCILLATOR_PERCENT 10u /* D: a slow part stretches each of these times by up to this much */

#endif
