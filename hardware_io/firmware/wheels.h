/* Both wheels: encoders in, motors out, once a tick. */
#ifndef WHEELS_H
#define WHEELS_H

#include <stdbool.h>
#include <stdint.h>

#include "report.h"

void wheels_start(void);

/* Whether a wheel did not turn its way. */
bool wheels_are_cut_off(const struct motion *motion);

/* Let wheels that were cut off get power again. */
void wheels_release(struct motion *motion);

/* Drive towards the speeds [mm/s] of both wheels, and tell how they move. A wheel that gets power and
 * does not turn its way cuts both motors off. */
void wheels_step(const int16_t speeds[2], struct motion *motion);

#endif
