/* What the robot's lamp tells whoever stands beside it. */
#ifndef BEACON_H
#define BEACON_H

#include <stdbool.h>
#include <stdint.h>

#include "link.h"

/* Whether the lamp is lit: driving, always; idle, half of each second; lost, twice a second for a
 * moment; disarmed, every two seconds for a moment; stopped, or its motors cut off, five times a
 * second: somebody has to look.
 *
 * now: [ms] modulo 65536. */
bool beacon_lit(uint8_t state, bool cut_off, uint16_t now);

#endif
