/*
 * Who gets a ring's name (src/ring/ring_file.c): rival writers, each killed at any point, over a ring whose writer is dead.
 * A writer that was given the name keeps it until it closes; two never have it at once; a dead writer's ring, or
 * a naming lock left by a process killed while it held it, holds nobody up.
 *
 * BUG 1: a naming lock is believed although its file has lost its name meanwhile
 * BUG 2: the old ring's writer is found dead before the naming lock is taken
 * BUG 3: a writer that closes lets go of its lock before it removes the name
 * BUG 4: no naming lock at all
 */
#ifndef BUG
#define BUG 0
#endif
#ifndef RIVALS
#define RIVALS 2
#endif
#ifndef KILLS
#define KILLS 1
#endif

/* File 0 is the dead writer's ring, file i + 1 rival i's. */
#define NONE 255
#define LOCK_FILES (RIVALS * 2 + 1)

byte name = 0;               /* the file that has the ring's name */
bool writer_lives[RIVALS + 1]; /* lock of byte 0 */
byte lock_name = NONE;       /* the file that has the naming lock's name */
byte lock_files;             /* files ever made for it */
byte holder[LOCK_FILES];     /* rival + 1 that has this file locked */
byte kills = KILLS;
byte winners;

/* Opens the naming lock, or makes it; opened or made by one system call each. */
inline open_lock()
{
    atomic {
        if
        :: lock_name == NONE -> lock_name = lock_files; lock_files++
        :: else
        fi;
        file = lock_name
    }
}

inline may_be_killed()
{
    if
    :: atomic { kills > 0 -> kills-- }; goto out
    :: true
    fi
}

/* Removes the name if it is still its own, and lets go; two system calls. */
inline close()
{
    atomic {
        winners--;
        won = false;
        if
        :: BUG == 3 -> writer_lives[me + 1] = false
        :: else
        fi
    };
    if
    :: name == me + 1 ->
        may_be_killed();
        assert(name == me + 1);
        name = NONE
    :: else
    fi
}

proctype rival(byte me)
{
    byte file = NONE, old;
    bool won;

    writer_lives[me + 1] = true;
    old = NONE;
    if
    :: BUG == 2 -> old = name
    :: else
    fi;
    if
    :: BUG == 2 && old != NONE && writer_lives[old] -> goto out
    :: else
    fi;
    may_be_killed();
    do
    :: BUG == 4 -> break
    :: BUG != 4 ->
        open_lock();
        if
        :: atomic { holder[file] == 0 -> holder[file] = me + 1 };
            if
            :: lock_name == file || BUG == 1 -> break
            :: else -> holder[file] = 0
            fi
        :: holder[file] != 0 && holder[file] != me + 1 /* tries again, or gives up after a time: RING_BUSY */
        :: goto out
        fi
    od;
    if
    :: BUG != 2 -> old = name
    :: else
    fi;
    may_be_killed();
    if
    :: old != NONE && BUG != 2 && writer_lives[old] -> goto leave
    :: else
    fi;
    may_be_killed();
    if
    :: old != NONE -> name = NONE /* unlink takes whatever has the name by now */
    :: else
    fi;
    may_be_killed();
    atomic { /* linkat */
        if
        :: name == NONE -> name = me + 1; won = true
        :: else
        fi
    };
    if
    :: won -> winners++; assert(winners <= 1)
    :: else
    fi;
leave:
    may_be_killed();
    if
    :: BUG != 4 -> lock_name = NONE; holder[file] = 0
    :: BUG == 4
    fi;
    may_be_killed();
    if
    :: won -> assert(name == me + 1)
    :: else
    fi;
    if
    :: won -> close()
    :: else
    fi;
out:
    atomic { /* the kernel ends the locks of a process that is gone */
        writer_lives[me + 1] = false;
        if
        :: won && name == me + 1 -> winners--
        :: else
        fi;
        if
        :: file != NONE && holder[file] == me + 1 -> holder[file] = 0
        :: else
        fi
    }
}

init {
    byte i;
    atomic {
        for (i : 0 .. RIVALS - 1) {
            run rival(i)
        }
    }
}
