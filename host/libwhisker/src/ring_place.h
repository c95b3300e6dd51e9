/* Where rings lie, and whose rings a reader believes. */
#ifndef WHISKER_RING_PLACE_H
#define WHISKER_RING_PLACE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#define RING_NAME_MAX 200
#define RING_PATH_BYTES 512
#define RING_USER_BYTES 64

/* In the order in which readers look. */
enum ring_place {
    RING_PLACE_SERVICE, /* only the service's user can write there */
    RING_PLACE_SHARED,  /* everybody can: where shm_open keeps its names */
    RING_PLACES
};

/* The directories, and the service's user. Constant, but for tests, which put their own before the first use. */
extern const char *ring_directories[RING_PLACES];
extern const char *ring_service_user;

/* The path of a ring's file, or RING_NAME. */
int ring_path(const char *name, enum ring_place place, char path[RING_PATH_BYTES]);

/* Whether a ring of this user is believed: root's, the caller's own, the service's, and that of the user `named`. */
bool ring_owner_is_trusted(uid_t owner, uid_t named);

/* The user's name; its number where it has none. */
void ring_owner_name(uid_t owner, char name[RING_USER_BYTES]);

#endif
