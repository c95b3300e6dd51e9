/* The large-deflection table, made once for a group of tests. */
#ifndef ONE_TABLE_H
#define ONE_TABLE_H

#include "mech_elastica.h"

static mech_table *table;

static int make_table(void **state)
{
    (void)state;
    table = mech_table_new();
    return table ? 0 : -1;
}

static int drop_table(void **state)
{
    (void)state;
    mech_table_free(table);
    return 0;
}

#endif
