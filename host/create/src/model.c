#include "create/model.h"

#include "create_oi.h"

#define PI 3.14159265358979323846

static const struct create_model_facts facts[] = {
    [CREATE_1] = {.name = "Create 1",
                  .baud = CREATE_OI_V2_BAUD,
                  .wheel_base_m = CREATE_OI_V2_WHEEL_BASE_MM * 1e-3,
                  .speed_step_m_s = 1e-3},
    [CREATE_2] = {.name = "Create 2",
                  .baud = CREATE_OI_V3_BAUD,
                  .wheel_base_m = CREATE_OI_V3_WHEEL_BASE_MM * 1e-3,
                  .count_m = PI * CREATE_OI_V3_WHEEL_DIAMETER_MM * 1e-3 / CREATE_OI_ENCODER_COUNTS_PER_TURN,
                  .speed_step_m_s = CREATE_OI_V3_SPEED_STEP_MM_S * 1e-3},
};

const struct create_model_facts *create_model_facts(enum create_model model)
{
    return &facts[model];
}
