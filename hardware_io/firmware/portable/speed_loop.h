/* The speed of one wheel: feed-forward and PI, in whole numbers. */
#ifndef SPEED_LOOP_H
#define SPEED_LOOP_H

#include <stdbool.h>
#include <stdint.h>

/* Power of a motor goes from -DUTY_TOP to DUTY_TOP. */
#define DUTY_TOP 800

struct speed_loop {
    int32_t sum; /* of the errors, [counts / 256] */
    bool saturated;
};

/* Power that takes a wheel which turned `counts` in the last period to `speed` [mm/s]. A speed of
 * zero is power zero at once: the motor then brakes itself. */
int16_t speed_loop_step(struct speed_loop *loop, int16_t speed, int16_t counts);

#endif
