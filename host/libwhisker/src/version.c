#include "whisker/version.h"

const char *whisker_version(void)
{
    return WHISKER_VERSION;
}
