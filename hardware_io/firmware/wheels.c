#include "wheels.h"

#include "board/encoders.h"
#include "board/motors.h"
#include "portable/speed_loop.h"
#include "portable/stall.h"
#include "robot.h"

/* Periods over which a speed is reported: the counts of one are too few. */
#define WINDOW 8U

#define STALLED ((uint8_t)(FLAG_LEFT_STALLED | FLAG_RIGHT_STALLED))

static struct speed_loop loops[2];
static struct stall stalls[2];
static int16_t duties[2];
static int16_t recent[2][WINDOW];
static uint8_t at;

void wheels_start(void)
{
    motors_start();
    encoders_start();
}

bool wheels_are_cut_off(const struct motion *motion)
{
    return (motion->flags & STALLED) != 0U;
}

void wheels_release(struct motion *motion)
{
    motion->flags &= (uint8_t)~STALLED;
    stalls[0] = stalls[1] = (struct stall){0};
}

void wheels_step(const int16_t speeds[2], struct motion *motion)
{
    int32_t counts[2];
    encoders_read(counts);
    for (uint8_t k = 0; k < 2U; k++) {
        const int16_t turned = (int16_t)(counts[k] - motion->counts[k]);
        int32_t sum = 0;
        recent[k][at] = turned;
        for (uint8_t j = 0; j < WINDOW; j++) {
            sum += recent[k][j];
        }
        motion->counts[k] = counts[k];
        motion->speeds[k] =
            (int16_t)((sum * 1000000L) / (COUNTS_PER_METRE * (int32_t)(WINDOW * TICK_MS)));
        if (stall_step(&stalls[k], duties[k], turned)) {
            const uint8_t flag = (k == 0U) ? FLAG_LEFT_STALLED : FLAG_RIGHT_STALLED;
            motion->flags = (uint8_t)(motion->flags | flag);
        }
        duties[k] = speed_loop_step(&loops[k], speeds[k], turned);
    }
    if (wheels_are_cut_off(motion)) {
        for (uint8_t k = 0; k < 2U; k++) {
            duties[k] = speed_loop_step(&loops[k], 0, 0);
        }
    }
    at = (uint8_t)((at + 1U) % WINDOW);
    motors_set(duties[0], duties[1]);
    if (loops[0].saturated || loops[1].saturated) {
        motion->flags |= FLAG_SATURATED;
    } else {
        motion->flags &= (uint8_t)~FLAG_SATURATED;
    }
}
