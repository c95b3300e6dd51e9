#ifndef CHIP_STDDEF_H
#define CHIP_STDDEF_H

typedef unsigned int size_t;

#define NULL ((void *)0)

#endif
