/* Timer 3: a tick every TICK_MS, and the time in between. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdbool.h>
#include <stdint.h>

void clock_start(void);

/* True once for every tick that has passed. */
bool clock_take_tick(void);

bool clock_tick_waits(void);

/* [ms] since the start, modulo 65536. */
uint16_t clock_ms(void);

#endif
