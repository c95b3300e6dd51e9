/*
 * The version of this release: of libwhisker, of libwhisker-nav and of libwhisker-create. CMake and the tests read it
 * here. While MAJOR is 0, another MINOR may change the binary interface: the libraries' soname is MAJOR.MINOR.
 */
#ifndef WHISKER_VERSION_H
#define WHISKER_VERSION_H

#define WHISKER_VERSION_MAJOR 0
#define WHISKER_VERSION_MINOR 1
#define WHISKER_VERSION_PATCH 0
#define WHISKER_VERSION "0.1.0"

/* Whether the headers are of this version or a later one, for #if. */
#define WHISKER_VERSION_AT_LEAST(major, minor, patch)                                                                  \
    (WHISKER_VERSION_MAJOR * 1000000 + WHISKER_VERSION_MINOR * 1000 + WHISKER_VERSION_PATCH >=                         \
     (major)*1000000 + (minor)*1000 + (patch))

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* WHISKER_VERSION of the library that is loaded, which may differ from that of the headers; never NULL. */
const char *whisker_version(void);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
