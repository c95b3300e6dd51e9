#include "sim_scene.h"

#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mech_floor.h"
#include "scene_text.h"
#include "sim_angle.h"
#include "whisker_constants.h"

struct reader {
    struct sim_text text;
    struct sim_scene *scene;
    size_t floor_rows;
    char floor[SIM_TILES_MAX]; /* letters, in the order of the file */
    bool has_start;
};

static int sim_scene_positive(struct sim_text *text, int count, double *values)
{
    if (sim_text_numbers(text, 1, count, values))
        return -1;
    for (int i = 0; i < count; i++)
        if (values[i] <= 0)
            return sim_text_refuse(text, "%s: %g; must be above 0", text->word[0], values[i]);
    return 0;
}

static int sim_scene_copy_name(struct sim_text *text, char *to)
{
    if (strlen(text->word[1]) >= SIM_NAME_SIZE)
        return sim_text_refuse(text, "%s: name '%s' is too long; use at most %d characters", text->word[0],
                               text->word[1], SIM_NAME_SIZE - 1);
    strcpy(to, text->word[1]);
    return 0;
}

static int sim_scene_full(struct sim_text *text, int limit)
{
    return sim_text_refuse(text, "%s: too many; at most %d fit", text->word[0], limit);
}

static int sim_scene_read_size(struct reader *reader)
{
    double size[2] = {0};
    if (sim_scene_positive(&reader->text, 2, size))
        return -1;
    reader->scene->size_x = size[0];
    reader->scene->size_y = size[1];
    return 0;
}

static int sim_scene_read_tile(struct reader *reader)
{
    return sim_scene_positive(&reader->text, 1, &reader->scene->tile_m);
}

static int sim_scene_read_texture(struct reader *reader)
{
    struct sim_scene *scene = reader->scene;
    const char *name = reader->text.word[1];
    if (scene->textures == SIM_TEXTURES_MAX)
        return sim_scene_full(&reader->text, SIM_TEXTURES_MAX);
    if (!mech_floor_texture(name))
        return sim_text_refuse(&reader->text, "texture: no floor is called '%s'; use a name of mech_floor.h", name);
    for (size_t i = 0; i < scene->textures; i++)
        if (scene->texture[i][0] == name[0])
            return sim_text_refuse(&reader->text, "texture: '%s' and '%s' start with the same letter; leave one out",
                                   scene->texture[i], name);
    return sim_scene_copy_name(&reader->text, scene->texture[scene->textures++]);
}

static int sim_scene_read_floor(struct reader *reader)
{
    struct sim_scene *scene = reader->scene;
    const char *row = reader->text.word[1];
    size_t length = strlen(row);
    if (reader->floor_rows == 0)
        scene->columns = length;
    if (length != scene->columns)
        return sim_text_refuse(&reader->text, "floor: a row of %zu tiles after rows of %zu; make them equal", length,
                               scene->columns);
    if ((reader->floor_rows + 1) * length > SIM_TILES_MAX)
        return sim_scene_full(&reader->text, SIM_TILES_MAX);
    memcpy(reader->floor + reader->floor_rows++ * length, row, length);
    return 0;
}

/* The texture of faces that this word names. Returns 0, or -1 if refused. */
static int sim_scene_read_surface(struct reader *reader, const char *name, const struct sim_floor_texture **surface)
{
    *surface = mech_floor_texture(name);
    return *surface ? 0
                    : sim_text_refuse(&reader->text, "%s: no texture is called '%s'; use a name of mech_floor.h",
                                      reader->text.word[0], name);
}

static int sim_scene_read_wall(struct reader *reader)
{
    return sim_scene_read_surface(reader, reader->text.word[1], &reader->scene->wall);
}

static int sim_scene_read_obstacle(struct reader *reader)
{
    struct sim_scene *scene = reader->scene;
    double v[4] = {0};
    if (scene->obstacles == SIM_OBSTACLES_MAX)
        return sim_scene_full(&reader->text, SIM_OBSTACLES_MAX);
    if (sim_text_numbers(&reader->text, 1, 4, v))
        return -1;
    if (v[0] >= v[2] || v[1] >= v[3])
        return sim_text_refuse(&reader->text, "obstacle: give its smallest corner first, then its largest");
    struct sim_box *box = &scene->obstacle[scene->obstacles++];
    *box = (struct sim_box){v[0], v[1], v[2], v[3], NULL};
    return reader->text.words == 6 ? sim_scene_read_surface(reader, reader->text.word[5], &box->surface) : 0;
}

static int sim_scene_read_radius(struct reader *reader)
{
    return sim_scene_positive(&reader->text, 1, &reader->scene->body_radius);
}

/* Adds a whisker with its name and role, or refuses. */
static int sim_scene_add_whisker(struct reader *reader, enum sim_role role, struct sim_whisker **whisker)
{
    struct sim_scene *scene = reader->scene;
    struct sim_text *text = &reader->text;
    if (scene->whiskers == SIM_WHISKERS_MAX)
        return sim_scene_full(text, SIM_WHISKERS_MAX);
    for (size_t i = 0; i < scene->whiskers; i++)
        if (strcmp(scene->whisker[i].name, text->word[1]) == 0)
            return sim_text_refuse(text, "%s: a second whisker called '%s'; rename one", text->word[0], text->word[1]);
    *whisker = &scene->whisker[scene->whiskers++];
    (*whisker)->role = role;
    return sim_scene_copy_name(text, (*whisker)->name);
}

static int sim_scene_read_texture_whisker(struct reader *reader)
{
    double v[2] = {0};
    struct sim_whisker *whisker;
    if (sim_scene_add_whisker(reader, SIM_TEXTURE_WHISKER, &whisker) || sim_text_numbers(&reader->text, 2, 2, v))
        return -1;
    whisker->x = v[0];
    whisker->y = v[1];
    return 0;
}

static int sim_scene_read_object_whisker(struct reader *reader)
{
    double v[4] = {0};
    struct sim_whisker *whisker;
    if (sim_scene_add_whisker(reader, SIM_OBJECT_WHISKER, &whisker) || sim_text_numbers(&reader->text, 2, 4, v))
        return -1;
    if (v[3] <= 0 || v[3] > SIM_WHISKER_OUTSIDE_M + 1e-9)
        return sim_text_refuse(&reader->text, "object_whisker: length %g m; must be above 0 and at most %g", v[3],
                               SIM_WHISKER_OUTSIDE_M);
    whisker->x = v[0];
    whisker->y = v[1];
    whisker->yaw = v[2];
    whisker->length_m = v[3];
    return 0;
}

static int sim_scene_read_pose(struct reader *reader, struct sim_pose *pose)
{
    double v[3] = {0};
    if (sim_text_numbers(&reader->text, 1, 3, v))
        return -1;
    *pose = (struct sim_pose){v[0], v[1], v[2]};
    return 0;
}

static int sim_scene_read_start(struct reader *reader)
{
    reader->has_start = true;
    return sim_scene_read_pose(reader, &reader->scene->start);
}

static int sim_scene_read_origin(struct reader *reader)
{
    return sim_scene_read_pose(reader, &reader->scene->origin);
}

/* Which of two words follows the key: 0 or 1; or -1, refused. */
static int sim_scene_choice(struct reader *reader, const char *first, const char *second)
{
    char **word = reader->text.word;
    if (strcmp(word[1], first) == 0)
        return 0;
    if (strcmp(word[1], second) == 0)
        return 1;
    return sim_text_refuse(&reader->text, "%s: '%s'; use %s or %s", word[0], word[1], first, second);
}

static int sim_scene_read_mechanics(struct reader *reader)
{
    const int choice = sim_scene_choice(reader, "static", "modes");
    reader->scene->mechanics = choice == 1 ? SIM_MECHANICS_MODES : SIM_MECHANICS_STATIC;
    return choice < 0 ? choice : 0;
}

static int sim_scene_read_sensor(struct reader *reader)
{
    const int choice = sim_scene_choice(reader, "mlx90333", "tmag5170");
    reader->scene->sensor = choice == 1 ? SIM_SENSOR_TMAG5170 : SIM_SENSOR_MLX90333;
    return choice < 0 ? choice : 0;
}

static int sim_scene_read_batch(struct reader *reader)
{
    double number = 0;
    if (sim_text_numbers(&reader->text, 1, 1, &number))
        return -1;
    if (!(number >= 0 && number <= UINT32_MAX && number == floor(number)))
        return sim_text_refuse(&reader->text, "batch: %g; give a whole number from 0 to %u", number, UINT32_MAX);
    reader->scene->batch = (uint32_t)number;
    return 0;
}

static const struct item {
    const char *key;
    int values, optional;
    int (*read)(struct reader *);
} ITEMS[] = {
    {"size_m", 2, 0, sim_scene_read_size},
    {"tile_m", 1, 0, sim_scene_read_tile},
    {"texture", 1, 0, sim_scene_read_texture},
    {"floor", 1, 0, sim_scene_read_floor},
    {"wall", 1, 0, sim_scene_read_wall},
    {"obstacle", 4, 1, sim_scene_read_obstacle},
    {"body_radius_m", 1, 0, sim_scene_read_radius},
    {"texture_whisker", 3, 0, sim_scene_read_texture_whisker},
    {"object_whisker", 5, 0, sim_scene_read_object_whisker},
    {"start", 3, 0, sim_scene_read_start},
    {"origin", 3, 0, sim_scene_read_origin},
    {"mechanics", 1, 0, sim_scene_read_mechanics},
    {"sensor", 1, 0, sim_scene_read_sensor},
    {"batch", 1, 0, sim_scene_read_batch},
};

static int sim_scene_read_item(struct reader *reader)
{
    struct sim_text *text = &reader->text;
    for (size_t i = 0; i < sizeof ITEMS / sizeof ITEMS[0]; i++) {
        if (strcmp(text->word[0], ITEMS[i].key) != 0)
            continue;
        int values = text->words - 1;
        if (values < ITEMS[i].values || values > ITEMS[i].values + ITEMS[i].optional)
            return sim_text_refuse(text, "%s: %d values; must be %d", ITEMS[i].key, values, ITEMS[i].values);
        return ITEMS[i].read(reader);
    }
    return sim_text_refuse(text, "unknown item '%s'; remove it or correct its spelling", text->word[0]);
}

/* Turns the rows of letters, largest y first, into texture indices, y = 0 first. */
static int sim_scene_lay_floor(struct reader *reader)
{
    struct sim_scene *scene = reader->scene;
    scene->rows = reader->floor_rows;
    for (size_t i = 0; i < scene->rows * scene->columns; i++) {
        char letter = reader->floor[i];
        size_t row = scene->rows - 1 - i / scene->columns;
        size_t texture = 0;
        while (texture < scene->textures && scene->texture[texture][0] != letter)
            texture++;
        if (texture == scene->textures)
            return sim_text_refuse(&reader->text, "floor: no texture starts with '%c'; declare it or change the tile",
                                   letter);
        scene->tile[row * scene->columns + i % scene->columns] = (unsigned char)texture;
    }
    return 0;
}

static bool sim_scene_covers(double size, double tile, size_t count)
{
    return fabs(ceil(size / tile - 1e-9) - (double)count) < 0.5;
}

static int sim_scene_missing(struct reader *reader)
{
    const struct sim_scene *scene = reader->scene;
    const char *key = scene->size_x <= 0        ? "size_m"
                      : scene->tile_m <= 0      ? "tile_m"
                      : scene->body_radius <= 0 ? "body_radius_m"
                      : !reader->has_start      ? "start"
                                                : NULL;
    return key ? sim_text_refuse(&reader->text, "%s is missing; add it", key) : 0;
}

static int sim_scene_finish(struct reader *reader)
{
    const struct sim_scene *scene = reader->scene;
    const struct sim_pose *start = &scene->start;
    reader->text.line = 0;
    if (sim_scene_missing(reader))
        return -1;
    if (!sim_scene_covers(scene->size_x, scene->tile_m, scene->columns) ||
        !sim_scene_covers(scene->size_y, scene->tile_m, reader->floor_rows))
        return sim_text_refuse(&reader->text, "floor: %zu rows of %zu tiles of %g m do not cover %g m x %g m",
                               reader->floor_rows, scene->columns, scene->tile_m, scene->size_x, scene->size_y);
    if (start->x < 0 || start->x > scene->size_x || start->y < 0 || start->y > scene->size_y)
        return sim_text_refuse(&reader->text, "start: (%g, %g) is outside the walls; move it", start->x, start->y);
    return sim_scene_lay_floor(reader);
}

struct sim_pose sim_scene_on_map(const struct sim_scene *scene, struct sim_pose pose)
{
    const struct sim_pose *origin = &scene->origin;
    double c = cos(origin->theta);
    double s = sin(origin->theta);
    return (struct sim_pose){origin->x + c * pose.x - s * pose.y, origin->y + s * pose.x + c * pose.y,
                             remainder(pose.theta + origin->theta, 2 * SIM_PI)};
}

int sim_scene_parse(const char *text, const char *source, struct sim_scene *scene, char *error, size_t error_size)
{
    struct reader reader = {
        .text = {.source = source, .rest = text, .error = error, .error_size = error_size},
        .scene = scene,
    };
    *scene = (struct sim_scene){0};
    int more;
    while ((more = sim_text_next(&reader.text)) > 0)
        if (sim_scene_read_item(&reader))
            return -1;
    return more < 0 ? -1 : sim_scene_finish(&reader);
}

int sim_scene_read(const char *path, struct sim_scene *scene, char *error, size_t error_size)
{
    char *text = sim_text_load(path);
    if (!text) {
        snprintf(error, error_size, "%s: cannot be read: %s; check the path", path, strerror(errno));
        return -1;
    }
    int result = sim_scene_parse(text, path, scene, error, error_size);
    free(text);
    return result;
}
