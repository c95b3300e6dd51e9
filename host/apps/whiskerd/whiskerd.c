/* whiskerd: takes the frames of the bridge and publishes them in a ring, until it is asked to stop. */
#include <stdio.h>

#include "cli.h"
#include "daemon.h"
#include "daemon_log.h"
#include "whisker/errors.h"

#define LIST_MAX 32

/* One line per bridge: serial number, place, state. */
static int whiskerd_list_bridges(void)
{
    struct whisker_device_info list[LIST_MAX];
    const int count = whisker_device_list(list, LIST_MAX);
    if (count <= 0) {
        return cli_fail(DAEMON_PROGRAM, "bridge", count < 0 ? count : WHISKER_ERROR_DEVICE_MISSING);
    }
    for (int i = 0; i < count && i < LIST_MAX; i++) {
        printf("%s at %s: %s\n", list[i].serial[0] ? list[i].serial : "?", list[i].path,
               list[i].error ? whisker_error_text(list[i].error) : "can be opened");
    }
    return CLI_OK;
}

int main(int argc, char **argv)
{
    struct daemon_options options;
    const int parsed = daemon_options_parse(argc, argv, &options);
    if (parsed >= 0) {
        return cli_end(DAEMON_PROGRAM, parsed);
    }
    daemon_log_begin(options.verbose);
    cli_catch_signals();
    return options.list ? cli_end(DAEMON_PROGRAM, whiskerd_list_bridges()) : daemon_run(&options);
}
