/* MLX90316 on its serial interface: what differs from its successor (mlx90333_datasheet.h). Its times are the same.
 * All A: vendor's document. */
#ifndef MLX90316_DATASHEET_H
#define MLX90316_DATASHEET_H

#define MLX90316_FRAME_BYTES 10u
#define MLX90316_MASTER_START 0xAAu /* without it the sensor sends nothing */
#define MLX90316_FRAME_DATA 2u      /* byte offset; 16 bits, most significant byte first, then the same inverted */
#define MLX90316_FRAME_INVERTED 4u

#define MLX90316_KIND_MASK 0x0003u /* low bits of the data */
#define MLX90316_KIND_ANGLE 0x0001u
#define MLX90316_KIND_ERROR 0x0002u
#define MLX90316_ANGLE_MASK 0xFFFCu /* 14 bits: a full turn unless programmed otherwise */

/* Error word: bits that serial mode can set. */
#define MLX90316_F_ADCMONITOR 0x0004u
#define MLX90316_F_ADCSATURA 0x0008u
#define MLX90316_F_RGTOOLOW 0x0010u
#define MLX90316_F_MAGTOOLOW 0x0020u
#define MLX90316_F_MAGTOOHIGH 0x0040u
#define MLX90316_F_RGTOOHIGH 0x0080u
#define MLX90316_F_ROCLAMP 0x0200u
#define MLX90316_F_MT7V 0x0400u /* supply above 7 V */

#endif
