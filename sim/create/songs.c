/* Songs are taken and take their time; there is no sound. */
#include "sim_create_state.h"

enum { NOTES_MAX = 16, NOTE_UNITS_PER_S = 64 };

/* song: number, notes, then pitch and length of each. Notes beyond the sixteenth are not kept. */
void create_song_store(sim_create *create, const uint8_t *song)
{
    uint8_t number = song[0], notes = song[1] < NOTES_MAX ? song[1] : NOTES_MAX;
    if (number >= SONGS)
        return;
    create->songs.units[number] = 0;
    for (uint8_t i = 0; i < notes; i++)
        create->songs.units[number] += song[3 + 2 * i];
}

/* One song at a time: another is not begun. */
void create_song_play(sim_create *create, uint8_t number)
{
    if (number >= SONGS || create->ticks < create->songs.ends)
        return;
    create->songs.number = number;
    create->songs.ends = create->ticks + (uint64_t)create->songs.units[number] * TICKS_PER_S / NOTE_UNITS_PER_S;
}
