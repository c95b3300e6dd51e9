/*
 * Waiting and waking (src/ring/ring_reader.c, readers_wait and commit of src/ring/ring_writer.c): no reader sleeps on while there is
 * something to read, whichever process is killed when. The writer asks the kernel once per tick of a clock whether readers wait;
 * a reader says so by a lock, sleeps briefly until two ticks have passed, and only then relies on being woken. Longer
 * sleeps end by themselves only when the writer is dead: the look every 100 ms, which is not to be needed otherwise.
 * A reader that sleeps for ever is an invalid end state.
 *
 * BUG 1: wakes before the head is stored
 * BUG 2: the signal does not change with a publication
 * BUG 3: a reader relies on being woken as soon as it has the lock
 * BUG 4: the writer looks at the clock before it stores the head
 * BUG 5: a reader looks before it notes the signal, and so may miss what comes between
 * BUG 6: nobody looks after a killed writer
 * BUG 7: readers count themselves in and out instead of holding a lock, so a killed one is never counted out
 */
#ifndef BUG
#define BUG 0
#endif
#ifndef FRAMES
#define FRAMES 2
#endif
#ifndef READERS
#define READERS 1
#endif
#ifndef KILLS
#define KILLS 1
#endif

byte left = FRAMES;                     /* still to be published */
bool closed, idle, writer_lives = true; /* idle: lives, but publishes no more */
byte alive = READERS, waiting;          /* waiting: how many hold the lock */
byte kills = KILLS;
bool asked;                             /* the writer has asked in this tick of the clock */
bool unread[READERS];                   /* head is not the reader's position */
bool fresh[READERS];                    /* the signal is still as the reader noted it */
bool asleep[READERS], brief[READERS], locks[READERS];
byte age[READERS];                      /* ticks since the reader has its lock; 2 for more */

#define FOR_ALL(what) atomic { for (w : 0 .. READERS - 1) { what }; w = 0 }

inline store_head()
{
    FOR_ALL(unread[w] = true)
}

inline raise_signal()
{
    FOR_ALL(fresh[w] = false)
}

inline wake_all()
{
    FOR_ALL(asleep[w] = false)
}

inline ask()
{
    if
    :: atomic { !asked -> asked = true };
        atomic { /* F_OFD_GETLK */
            wakes = (waiting > 0);
            assert(alive > 0 || !wakes)
        }
    :: asked
    fi
}

inline wake_who_waits()
{
    if
    :: wakes -> wake_all()
    :: else
    fi
}

proctype writer()
{
    byte w;
    bool wakes;

    do
    :: left > 0 ->
        left--;
#if BUG == 1
        ask(); wake_who_waits(); store_head(); raise_signal()
#elif BUG == 2
        store_head(); ask(); wake_who_waits()
#elif BUG == 4
        ask(); store_head(); raise_signal(); wake_who_waits()
#else
        store_head(); raise_signal(); ask(); wake_who_waits()
#endif
    :: left == 0 -> closed = true; raise_signal(); wake_all(); break
    :: left == 0 -> idle = true; goto quiet
    :: atomic { kills > 0 -> kills-- }; break
    od;
    writer_lives = false; /* the kernel ends its lock */
quiet:
    skip
}

inline take_lock()
{
    if
    :: !locks[me] -> atomic { locks[me] = true; waiting++; age[me] = 0 }
    :: locks[me]
    fi
}

proctype reader(byte me)
{
    bool done, killed;

    do
    ::
#if BUG != 5
        fresh[me] = true;
#endif
        done = closed;
        if
        :: unread[me] -> unread[me] = false
        :: !unread[me] && done -> break
        :: !unread[me] && !done ->
            if
            :: !writer_lives -> /* look once more */
                if
                :: !unread[me] -> break
                :: unread[me]
                fi
            :: writer_lives ->
                take_lock();
#if BUG == 5
                fresh[me] = true;
#endif
                atomic { /* FUTEX_WAIT */
                    asleep[me] = fresh[me];
                    brief[me] = (BUG != 3 && age[me] < 2)
                };
                if
                :: !asleep[me]
                :: asleep[me] && brief[me] -> asleep[me] = false
                :: asleep[me] && !writer_lives && !closed && BUG != 6 -> asleep[me] = false
                :: idle && !unread[me] -> goto gone /* sleeps on, and rightly so */
                :: atomic { kills > 0 -> kills-- }; killed = true; goto gone
                fi;
                brief[me] = false
            fi
        fi;
        done = false
    :: atomic { kills > 0 -> kills-- }; killed = true; goto gone
    od;
    assert(!unread[me]);
gone:
    atomic { /* the kernel ends its lock */
        alive--;
        asleep[me] = false; brief[me] = false; fresh[me] = false; unread[me] = false; age[me] = 0; done = false;
        if
        :: locks[me] && !(BUG == 7 && killed) -> locks[me] = false; waiting--
        :: else
        fi;
        killed = false
    }
}

proctype clock()
{
    byte w;

    do
    :: atomic { asked = false; FOR_ALL(age[w] = (locks[w] && age[w] < 2 -> age[w] + 1 : age[w])) }
    :: atomic { kills > 0 -> kills-- } /* nobody else is killed */
    :: break
    od
}

init {
    byte i;
    atomic {
        for (i : 0 .. READERS - 1) {
            run reader(i)
        };
        run writer();
        run clock();
        i = 0
    }
}
