/* libwhisker: from the bridge's USB interface to any number of reading processes. */
#ifndef WHISKER_H
#define WHISKER_H

#include "whisker/clock.h"
#include "whisker/device.h"
#include "whisker/errors.h"
#include "whisker/frame.h"
#include "whisker/gateware.h"
#include "whisker/ring.h"
#include "whisker/service.h"
#include "whisker/version.h"

#endif
