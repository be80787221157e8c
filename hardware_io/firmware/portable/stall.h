/* A wheel that gets power and does not turn its way: blocked, its encoder dead or reversed. */
#ifndef STALL_H
#define STALL_H

#include <stdbool.h>
#include <stdint.h>

/* Power from which on a wheel that is free turns, and for how many ticks it may not. */
#define STALL_DUTY 160
#define STALL_TICKS 10U

struct stall {
    uint8_t ticks;
};

/* Let a tick pass in which a wheel with this power turned by `counts`; true once it is to be cut
 * off. */
bool stall_step(struct stall *stall, int16_t duty, int16_t counts);

#endif
