/*
 * The ring's publish/read protocol (src/ring/ring_writer.c, src/ring/ring_reader.c): no frame that advance or intact vouches for
 * is torn, of another index, or of another ring; a writer may be killed before any store, and the next one makes a new
 * ring. A frame is two words. Memory is weaker than spin's own: stores between which the code has no fence happen here
 * in either order, and so do loads. Readers store nothing, so killing one is the same as never running it again.
 *
 * BUG 1: the head may become visible before the frame     (commit stores it without release)
 * BUG 2: the frame may become visible before the claim    (reserve without its fence)
 * BUG 3: the claim may be looked at before the frame is   (is_overwritten without its fence)
 * BUG 4: the reader believes the head instead of the claim
 * BUG 5: a new writer goes on in the old writer's memory
 */
#ifndef BUG
#define BUG 0
#endif
#ifndef CAPACITY
#define CAPACITY 2
#endif
#ifndef BATCH
#define BATCH 1
#endif
#ifndef FRAMES
#define FRAMES 4
#endif
#ifndef READERS
#define READERS 1
#endif
#ifndef RINGS
#define RINGS 2
#endif

#define WORD(ring, frame, half) word[((ring) * CAPACITY + (frame) % CAPACITY) * 2 + (half)]
#define VALUE(ring, frame) ((ring) * 32 + (frame) + 1)

byte head[RINGS], claim[RINGS], word[RINGS * CAPACITY * 2];
byte current = 0;       /* the ring that has the name */
bool ended[RINGS];      /* its writer is dead */

proctype writer()
{
    byte ring = 0, mine = 0, frame, n, done, k;
    bool claimed, published;

    do
    :: frame < FRAMES ->
        if
        :: n = 1
        :: BATCH > 1 && frame + 2 <= FRAMES -> n = 2
        fi;
        claimed = false; published = false; done = 0;
        do
        :: !claimed -> claim[mine] = frame + n; claimed = true
        :: !claimed && CAPACITY >= 4 -> claim[mine] = frame + n + 1; claimed = true /* it may run ahead */
        :: (claimed || BUG == 2) && done != (1 << (2 * n)) - 1 ->
            select(k : 0 .. 2 * n - 1); /* any word that is still to be written */
            if
            :: done & (1 << k)
            :: else ->
                atomic { WORD(mine, frame + k / 2, k % 2) = VALUE(ring, frame + k / 2); done = done | (1 << k) }
            fi
        :: !published && ((claimed && done == (1 << (2 * n)) - 1) || BUG == 1) ->
            head[mine] = frame + n; published = true
        :: claimed && published && done == (1 << (2 * n)) - 1 -> break
        :: ring + 1 < RINGS -> goto killed
        od;
        frame = frame + n
    :: frame == FRAMES -> goto killed
    :: ring + 1 < RINGS -> /* killed: the next writer begins */
killed:
        ended[ring] = true;
        ring++;
        if
        :: ring == RINGS -> break
        :: else
        fi;
        if
        :: BUG == 5 -> atomic { head[mine] = 0; claim[mine] = 0 }
        :: else -> mine = ring
        fi;
        current = mine;
        frame = 0
    od
}

inline skip_lost()
{
    if
    :: top > position + CAPACITY / 2 -> position = top - CAPACITY / 2
    :: else
    fi
}

proctype reader()
{
    byte ring, position, top, bound, use, a, b;
    bool got_a, got_b, looked;

    ring = current;
    bound = claim[ring];
    position = (bound > CAPACITY -> bound - CAPACITY : 0);
    do
    :: top = head[ring];
        if
        :: top < position -> /* cannot be; the code takes it for an overrun */
            assert(BUG == 5); break
        :: top == position ->
            if
            :: ended[ring] && head[ring] == position && current != ring -> /* RESTARTED */
                ring = current;
                bound = claim[ring];
                position = (bound > CAPACITY -> bound - CAPACITY : 0)
            :: ended[ring] && head[ring] == position && current == ring -> break
            :: else
            fi
        :: top > position && top - position > CAPACITY ->
            skip_lost()
        :: top > position && top - position <= CAPACITY ->
            use = position;
            do /* one of the frames that peek gives */
            :: use + 1 < top -> use++
            :: break
            od;
            got_a = false; got_b = false; looked = false;
            do
            :: !got_a -> a = WORD(ring, use, 0); got_a = true
            :: !got_b -> b = WORD(ring, use, 1); got_b = true
            :: !looked && ((got_a && got_b) || BUG == 3) ->
                bound = (BUG == 4 -> head[ring] : claim[ring]); looked = true
            :: got_a && got_b && looked -> break
            od;
            if
            :: bound - position > CAPACITY -> top = head[ring]; skip_lost()
            :: else ->
                assert(a == VALUE(ring, use));
                assert(b == VALUE(ring, use));
                position = use + 1
            fi
        fi
    od
}

init {
    byte i;
    atomic {
        run writer();
        for (i : 1 .. READERS) {
            run reader()
        }
    }
}
