#!/bin/sed -Ef
# The headers' comments as Doxygen takes them: those before a declaration, and those behind one.
1s,^/\*($| ),/** @file\n *\1,
s,^( *)/\* cffi: .*,,
s,^( *)/\*($| ),\1/**\2,
s,([^ ] *)/\* ,\1/**< ,
/^ *#(ifdef|endif|else|if)/s,/\*\*<,/*,
/^#pragma/d
s,`([^`]+)`,<tt>\1</tt>,g
# Doxygen 1.9 takes the first of two such names for a part of the type.
s/^( *)((struct|enum) \w+) (\w+), (\w+);/\1\2 \4; \2 \5;/
