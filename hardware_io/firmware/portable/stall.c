#include "stall.h"

bool stall_step(struct stall *stall, int16_t duty, int16_t counts)
{
    const bool ahead = (duty >= STALL_DUTY) && (counts <= 0);
    const bool back = (duty <= -STALL_DUTY) && (counts >= 0);
    if (!ahead && !back) {
        stall->ticks = 0;
    } else if (stall->ticks < STALL_TICKS) {
        stall->ticks++;
    } else {
        /* It has been long enough. */
    }
    return stall->ticks >= STALL_TICKS;
}
