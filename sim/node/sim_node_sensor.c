/* The sensor on the chip's wires, and its twin. While no fault has been near the sensor the twin would do the same: it
 * is left out, and the sensor stands for both. */
#include <string.h>

#include "sim_node_state.h"

/* The one that no fault befalls: it judges the master. */
static struct mlx90333 *sim_node_sensor_clean(struct sim_node *node)
{
    return node->apart ? &node->twin : &node->sensor;
}

static unsigned sim_node_sensor_position(const struct mlx90333 *sensor)
{
    return sensor->byte * 8u + sensor->bit;
}

static void sim_node_sensor_begin_frame(struct sim_node *node, uint64_t now_ns)
{
    const struct sampler *sampler = &node->board.node.sampler;
    node->begun = (struct sim_node_frame){.number = node->frame.number + 1u,
                                          .begun_fs = now_ns * DSPIC_FS_PER_NS,
                                          .slip = (uint8_t)(sim_node_sensor_position(&node->sensor) % 64u),
                                          .followed = sampler->followed,
                                          .alpha_before = sampler->alpha,
                                          .beta_before = sampler->beta};
}

void sim_node_sensor_end_frame(struct sim_node *node)
{
    node->frame = node->begun;
    node->frame.line = node->line;
    node->frame.sent = node->clean;
}

static void sim_node_sensor_join(struct sim_node *node)
{
    if (!node->apart || node->twin_stays || !mlx90333_equal(&node->sensor, &node->twin))
        return;
    memcpy(node->sensor.violations, node->twin.violations, sizeof node->sensor.violations);
    node->apart = false;
}

/* Returns what the chip sees. */
static bool sim_node_sensor_edge(struct sim_node *node, bool level, bool sent, uint64_t now_ns)
{
    const unsigned position = sim_node_sensor_position(sim_node_sensor_clean(node));
    if (level && position % 8u == 0)
        sim_node_sensor_join(node);
    if (level && position == 0)
        sim_node_sensor_begin_frame(node, now_ns);
    const bool seen = mlx90333_clock(&node->sensor, now_ns, level, sent);
    const bool clean = node->apart ? mlx90333_clock(&node->twin, now_ns, level, sent) : seen;
    if (!level) {
        node->line = node->line << 1 | seen;
        node->clean = node->clean << 1 | clean;
    }
    return seen;
}

/* The master's output stays off: whatever else drives its data pin low pulls the line. */
void sim_node_sensor_clock(struct sim_node *node, bool level, uint64_t now_ns)
{
    const bool sent = dspic_output(node->chip, PIN_SENSOR_DATA) != DSPIC_LOW;
    dspic_wire(node->chip, PIN_SENSOR_DATA, sim_node_sensor_edge(node, level, sent, now_ns));
}

/* Chance decides at this edge, and may have gone its own way with the sensor. */
void sim_node_sensor_select(struct sim_node *node, bool level, uint64_t now_ns)
{
    if (node->twin.random != node->sensor.random)
        sim_node_sensor_part(node);
    mlx90333_select(&node->sensor, now_ns, level);
    if (node->apart)
        mlx90333_select(&node->twin, now_ns, level);
    else
        node->twin.random = node->sensor.random;
}

void sim_node_sensor_part(struct sim_node *node)
{
    const uint64_t random = node->twin.random;
    if (node->apart)
        return;
    node->twin = node->sensor;
    node->twin.random = random;
    node->twin.sense.parameters = &node->twin.parameters;
    node->apart = true;
}

void sim_node_sensor_power_on(struct sim_node *node)
{
    mlx90333_power_on(&node->sensor, 0, &node->parameters.sensor);
    node->twin.random = node->sensor.random;
    node->apart = false;
    if (node->twin_stays)
        sim_node_sensor_part(node);
}

/* Both sensors lose their supply, or get it back. */
void sim_node_sensor_supply(struct sim_node *node, bool on)
{
    const uint64_t now_ns = dspic_now_fs(node->chip) / DSPIC_FS_PER_NS;
    sim_node_sensor_select(node, true, now_ns);
    mlx90333_supply(&node->sensor, now_ns, on);
    if (node->apart)
        mlx90333_supply(&node->twin, now_ns, on);
}

/* The sensor alone. */
void sim_node_sensor_switch(struct sim_node *node, bool on)
{
    sim_node_sensor_part(node);
    mlx90333_supply(&node->sensor, dspic_now_fs(node->chip) / DSPIC_FS_PER_NS, on);
}

void sim_node_sensor_set_field(struct mlx90333 *sensor, uint64_t since_fs, struct sim_field field)
{
    const struct mlx90333_field of = {
        .since_ns = since_fs / DSPIC_FS_PER_NS, .alpha_deg = field.alpha_deg, .beta_deg = field.beta_deg};
    mlx90333_set_field(sensor, &of);
}

void sim_node_sensor_set_fields(struct sim_node *node, uint64_t since_fs, struct sim_field field)
{
    sim_node_sensor_set_field(&node->sensor, since_fs, field);
    if (node->apart)
        sim_node_sensor_set_field(&node->twin, since_fs, field);
}

void sim_node_sensor_fault(sim_node *node, enum sim_sensor_fault fault, unsigned argument)
{
    if (fault != SIM_SENSOR_GOOD)
        sim_node_sensor_part(node);
    mlx90333_set_fault(&node->sensor, fault, argument);
}

/* A reset's own breaches are nobody's fault. */
void sim_node_sensor_note_releases(struct sim_node *node)
{
    node->releases = sim_node_sensor_clean(node)->violations[MLX90333_SELECT_HIGH];
}

void sim_node_sensor_forget_releases(struct sim_node *node)
{
    sim_node_sensor_clean(node)->violations[MLX90333_SELECT_HIGH] = node->releases;
}

uint32_t sim_node_sensor_violations(const struct sim_node *node)
{
    return mlx90333_violations(node->apart ? &node->twin : &node->sensor);
}

void sim_node_keep_twin(sim_node *node)
{
    node->twin_stays = true;
    sim_node_sensor_part(node);
}
