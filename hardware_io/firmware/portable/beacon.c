#include "beacon.h"

/* How long the lamp is lit at the start of each period [ms]. Where the clock begins again, every
 * 65.5 s, one period is cut short. */
struct pattern {
    uint16_t lit;
    uint16_t period;
};

static const struct pattern PATTERNS[] = {
    [LINK_DISARMED] = {50, 2000}, [LINK_IDLE] = {500, 1000},  [LINK_DRIVING] = {1000, 1000},
    [LINK_LOST] = {50, 500},      [LINK_STOPPED] = {100, 200},
};

bool beacon_lit(uint8_t state, bool cut_off, uint16_t now)
{
    const struct pattern *pattern =
        &PATTERNS[(cut_off || (state > LINK_STOPPED)) ? (uint8_t)LINK_STOPPED : state];
    return (now % pattern->period) < pattern->lit;
}
