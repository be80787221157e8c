/* What the robot makes of the frames it hears: whose commands count, which are old, whether the
 * motors may run. */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "frames.h"

enum link_state {
    LINK_DISARMED = 0, /* since reset */
    LINK_IDLE = 1,     /* armed, without a fresh command */
    LINK_DRIVING = 2,  /* follows a fresh command: the one state in which motors get power */
    LINK_LOST = 3,     /* armed, and hears nothing */
    LINK_STOPPED = 4   /* emergency stop, until armed */
};

struct link {
    uint8_t robot;
    uint8_t state;
    bool has_session;
    uint16_t session;
    uint16_t sequence;
    bool heard_fresh;
    uint16_t heard; /* when, [ms] modulo 65536: the last frame that was taken */
    bool command_fresh;
    uint16_t commanded; /* when: the last command to this robot */
    uint8_t form;
    int16_t first;
    int16_t second;
    uint16_t taken;
    uint16_t refused;
};

void link_reset(struct link *link, uint8_t robot);

/* Take a decoded frame; true if it is a stop or an arm that the robot has taken, and that is to be
 * acknowledged. */
bool link_take(struct link *link, const struct frame *frame, uint16_t now);

/* Count bytes that were no frame. */
void link_refuse(struct link *link);

/* Let time pass; call it more often than twice in 65 s. */
void link_tick(struct link *link, uint16_t now);

/* The speeds to follow, as left and right wheel [mm/s]; zero unless driving. */
void link_wheel_speeds(const struct link *link, int16_t speeds[2]);

#endif
