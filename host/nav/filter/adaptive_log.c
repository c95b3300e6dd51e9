#include "adaptive_log.h"

#include <stdlib.h>
#include <string.h>

int adaptive_log_init(struct adaptive_log *log, const struct nav_sensors *sensors)
{
    *log = (struct adaptive_log){.whiskers = (size_t)sensors->count, .sensors = sensors};
    log->offset = calloc(log->whiskers + 1, sizeof *log->offset);
    for (size_t w = 0; log->offset && w < log->whiskers; w++) {
        log->offset[w] = log->width;
        log->width += (size_t)sensors->model[w].values;
    }
    log->value = calloc(ADAPTIVE_ROWS_KEPT * log->width + 1, sizeof *log->value);
    log->weight = calloc(ADAPTIVE_ROWS_KEPT * log->whiskers + 1, sizeof *log->weight);
    log->unknown = calloc(ADAPTIVE_ROWS_KEPT * log->whiskers + 1, sizeof *log->unknown);
    log->reading = calloc(log->whiskers + 1, sizeof *log->reading);
    return log->offset && log->value && log->weight && log->unknown && log->reading ? 0 : -1;
}

void adaptive_log_free(struct adaptive_log *log)
{
    free(log->offset);
    free(log->value);
    free(log->weight);
    free(log->unknown);
    free(log->reading);
}

static size_t log_place(uint64_t row)
{
    return (size_t)(row % ADAPTIVE_ROWS_KEPT);
}

void adaptive_log_write(struct adaptive_log *log, struct nav_pose step, struct nav_noise noise,
                        const struct nav_evidence *evidence, const double *unknown)
{
    size_t n = log_place(log->head++);
    struct adaptive_entry *entry = &log->entry[n];
    *entry = (struct adaptive_entry){.step = step, .noise = noise};
    for (size_t w = 0; w < log->whiskers; w++) {
        const struct nav_model *model = &log->sensors->model[w];
        log->weight[n * log->whiskers + w] = evidence->weight[w];
        log->unknown[n * log->whiskers + w] = unknown[w];
        if (!(evidence->weight[w] > 0.0))
            continue;
        memcpy(log->value + n * log->width + log->offset[w], evidence->reading[w],
               (size_t)model->values * sizeof *log->value);
        entry->sharp = entry->sharp || model->kind->sharp(evidence->reading[w]);
    }
}

uint64_t adaptive_log_reach(const struct adaptive_log *log)
{
    return log->head > ADAPTIVE_ROWS_BEHIND ? log->head - ADAPTIVE_ROWS_BEHIND : 0;
}

struct adaptive_entry *adaptive_log_entry(struct adaptive_log *log, uint64_t row)
{
    return &log->entry[log_place(row)];
}

struct nav_evidence adaptive_log_replay(struct adaptive_log *log, uint64_t row)
{
    for (size_t w = 0; w < log->whiskers; w++)
        log->reading[w] = log->value + log_place(row) * log->width + log->offset[w];
    return (struct nav_evidence){.reading = log->reading,
                                 .weight = log->weight + log_place(row) * log->whiskers,
                                 .unknown = log->unknown + log_place(row) * log->whiskers};
}

struct nav_pending adaptive_log_since(const struct adaptive_log *log, uint64_t from)
{
    struct nav_pending moved = {.step = {0.0, 0.0, 0.0}};
    for (uint64_t row = from; row < log->head; row++)
        nav_pending_add(&moved, log->entry[log_place(row)].step, log->entry[log_place(row)].noise);
    return moved;
}

size_t adaptive_log_bytes(const struct adaptive_log *log)
{
    return sizeof *log + ADAPTIVE_ROWS_KEPT * (log->width + 2 * log->whiskers) * sizeof *log->value;
}
