/* Both wheels: encoders in, motors out, once a tick. */
#ifndef WHEELS_H
#define WHEELS_H

#include <stdint.h>

#include "report.h"

void wheels_start(void);

/* Drive towards the speeds [mm/s] of both wheels, and tell how they move. */
void wheels_step(const int16_t speeds[2], struct motion *motion);

#endif
