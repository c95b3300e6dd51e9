/* whisker-base: drives an iRobot Create and serves it on a Unix socket, until it is asked to stop. */
#include "cli.h"
#include "daemon_log.h"
#include "whisker_base_guard.h"
#include "whisker_base_options.h"

int main(int argc, char **argv)
{
    struct base_options options;
    const int parsed = base_options_parse(argc, argv, &options);
    if (parsed >= 0) {
        return cli_end(DAEMON_PROGRAM, parsed);
    }
    daemon_log_begin(options.verbose);
    cli_catch_signals();
    return base_guard_run(&options);
}
