#include "node_pins.h"

#include <stdlib.h>

#define FS_PER_PS UINT64_C(1000)

struct node_pins {
    sim_node *node;
    uint64_t origin_fs;
    unsigned count, done; /* edges being played */
    const uint64_t *at_ps;
    const uint8_t *pin, *level;
    uint8_t *miso;
};

static uint64_t node_pins_time_of(const struct node_pins *pins, unsigned edge)
{
    return pins->origin_fs + pins->at_ps[edge] * FS_PER_PS;
}

static void node_pins_act(void *context)
{
    struct node_pins *pins = context;
    while (pins->done < pins->count && node_pins_time_of(pins, pins->done) <= sim_node_fs(pins->node)) {
        const unsigned i = pins->done++;
        sim_node_pin(pins->node, (enum sim_node_pin)pins->pin[i], pins->level[i] != 0, node_pins_time_of(pins, i));
        pins->miso[i] = sim_node_miso(pins->node);
    }
    if (pins->done < pins->count)
        sim_node_plan(pins->node, node_pins_time_of(pins, pins->done));
}

struct node_pins *node_pins_new(uint64_t seed, int32_t frc_ppm, unsigned prefetch, unsigned dma_cycles,
                                unsigned sensor_permille)
{
    struct node_pins *pins = calloc(1, sizeof *pins);
    struct sim_node_parameters parts;
    if (!pins)
        return NULL;
    sim_node_parameters_default(&parts, seed);
    parts.chip.frc_ppm = frc_ppm;
    parts.chip.slave_prefetch = (uint8_t)prefetch;
    parts.chip.dma_cycles = (uint8_t)dma_cycles;
    parts.sensor.slow_permille = (uint16_t)sensor_permille;
    pins->node = sim_node_new_as(&parts);
    if (!pins->node) {
        free(pins);
        return NULL;
    }
    sim_node_power_on(pins->node);
    sim_node_outside(pins->node, node_pins_act, pins);
    pins->origin_fs = sim_node_fs(pins->node);
    return pins;
}

void node_pins_free(struct node_pins *pins)
{
    if (pins)
        sim_node_free(pins->node);
    free(pins);
}

void node_pins_field(struct node_pins *pins, double alpha_deg, double beta_deg)
{
    sim_node_field(pins->node, (struct sim_field){alpha_deg, beta_deg});
}

void node_pins_fault(struct node_pins *pins, unsigned fault, unsigned argument)
{
    sim_node_sensor_fault(pins->node, (enum sim_sensor_fault)fault, argument);
}

void node_pins_play(struct node_pins *pins, unsigned count, const uint64_t *at_ps, const uint8_t *pin,
                    const uint8_t *level, uint8_t *miso)
{
    if (count == 0)
        return;
    pins->count = count;
    pins->done = 0;
    pins->at_ps = at_ps;
    pins->pin = pin;
    pins->level = level;
    pins->miso = miso;
    sim_node_plan(pins->node, node_pins_time_of(pins, 0));
    sim_node_until(pins->node, node_pins_time_of(pins, count - 1u));
}

uint32_t node_pins_violations(const struct node_pins *pins)
{
    return sim_node_violations(pins->node);
}
