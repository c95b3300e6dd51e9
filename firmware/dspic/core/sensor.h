/* Which sensor this build reads: the MLX90333, or with -DSENSOR_MLX90316 its older sibling. */
#ifndef SENSOR_H
#define SENSOR_H

#include "mlx90333_datasheet.h" // both sensors have these times

#ifdef SENSOR_MLX90316
#include "mlx90316_datasheet.h"
#define SENSOR_FRAME_BYTES MLX90316_FRAME_BYTES
#define SENSOR_MASTER_START MLX90316_MASTER_START
#else
#define SENSOR_FRAME_BYTES MLX90333_FRAME_BYTES
#define SENSOR_MASTER_START MLX90333_MASTER_BYTE
#endif

#endif
