#include "output_file.h"

#include <errno.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* Whether a file may be put there; errno says why not. */
static bool output_file_may(const char *path, bool overwrite)
{
    struct stat there;
    if (stat(path, &there) != 0) {
        return errno == ENOENT;
    }
    errno = EEXIST;
    return overwrite && S_ISREG(there.st_mode);
}

int output_file_open(struct output_file *out, const char *path, bool overwrite)
{
    struct stat there;
    *out = (struct output_file){.overwrite = overwrite};
    if (stat(path, &there) == 0 && S_ISCHR(there.st_mode)) {
        out->file = fopen(path, "we");
        return out->file ? 0 : -1;
    }
    if (!output_file_may(path, overwrite)) {
        return -1;
    }
    char *real = realpath(path, NULL); /* a link stays one */
    snprintf(out->path, sizeof out->path, "%s", real ? real : path);
    free(real);
    snprintf(out->beside, sizeof out->beside, "%s.%ld", out->path, (long)getpid());
    out->file = fopen(out->beside, "wxe");
    return out->file ? 0 : -1;
}

static int output_file_place(const struct output_file *out)
{
    return output_file_may(out->path, out->overwrite) ? rename(out->beside, out->path) : -1;
}

int output_file_close(struct output_file *out)
{
    bool is_whole = !ferror(out->file) && fflush(out->file) == 0;
    if (out->beside[0]) {
        is_whole = is_whole && fsync(fileno(out->file)) == 0;
    }
    is_whole = (fclose(out->file) == 0) && is_whole;
    out->file = NULL;
    if (out->beside[0] && !(is_whole && output_file_place(out) == 0)) {
        const int error = errno;
        unlink(out->beside);
        errno = error;
        return -1;
    }
    return is_whole ? 0 : -1;
}
