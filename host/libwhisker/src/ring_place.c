#include "ring_place.h"

#include <pthread.h>
#include <pwd.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "whisker/errors.h"
#include "whisker/ring.h"

/* What getpwnam_r wants for one user; a longer entry counts as none. */
#define USER_ENTRY_BYTES 4096

const char *ring_directories[RING_PLACES] = {WHISKER_RING_SERVICE_DIRECTORY, WHISKER_RING_DIRECTORY};
const char *ring_service_user = WHISKER_RING_SERVICE_USER;

static pthread_once_t service_once = PTHREAD_ONCE_INIT;
static uid_t service_owner = WHISKER_RING_NO_OWNER;

int ring_path(const char *name, enum ring_place place, char path[RING_PATH_BYTES])
{
    const size_t length = name ? strlen(name) : 0;
    if (length == 0 || length > RING_NAME_MAX || strchr(name, '/') || name[0] == '.') {
        return WHISKER_ERROR_RING_NAME;
    }
    const int written = snprintf(path, RING_PATH_BYTES, "%s/%s", ring_directories[place], name);
    return written < RING_PATH_BYTES ? WHISKER_OK : WHISKER_ERROR_RING_NAME;
}

static void ring_place_look_up_service(void)
{
    char text[USER_ENTRY_BYTES];
    struct passwd entry, *found = NULL;
    if (getpwnam_r(ring_service_user, &entry, text, sizeof text, &found) == 0 && found) {
        service_owner = found->pw_uid;
    }
}

bool ring_owner_is_trusted(uid_t owner, uid_t named)
{
    pthread_once(&service_once, ring_place_look_up_service);
    const bool is_service = service_owner != WHISKER_RING_NO_OWNER && owner == service_owner;
    const bool is_named = named != WHISKER_RING_NO_OWNER && owner == named;
    return owner == 0 || owner == geteuid() || is_service || is_named;
}

void ring_owner_name(uid_t owner, char name[RING_USER_BYTES])
{
    char text[USER_ENTRY_BYTES];
    struct passwd entry, *found = NULL;
    if (getpwuid_r(owner, &entry, text, sizeof text, &found) == 0 && found) {
        snprintf(name, RING_USER_BYTES, "%s", found->pw_name);
    } else {
        snprintf(name, RING_USER_BYTES, "%lu", (unsigned long)owner);
    }
}
