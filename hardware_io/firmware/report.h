/* What the robot tells the work station: telemetry and acknowledgements. */
#ifndef REPORT_H
#define REPORT_H

#include <stdint.h>

#include "portable/link.h"

/* Motion of the wheels, and what else `report_telemetry` has to know. */
struct motion {
    int32_t counts[2];
    int16_t speeds[2]; /* [mm/s] */
    uint8_t flags;
};

#define FLAG_LOW_BATTERY 1U
#define FLAG_WATCHDOG_RESET 2U
#define FLAG_SATURATED 4U
/* Both motors are off, until the robot is armed, since this wheel did not turn its way. */
#define FLAG_LEFT_STALLED 8U
#define FLAG_RIGHT_STALLED 16U

/* Report to a module's address, of XBEE_ADDRESS bytes; before, reports go to all. */
void report_to(const uint8_t *address);

void report_telemetry(const struct link *link, const struct motion *motion, uint16_t now);

void report_acknowledgement(const struct link *link, const struct frame *frame);

#endif
