#include "speed_loop.h"

#include "robot.h"

/* Power per [counts / 256] in a period, in 256ths: of the speed that is asked for (a motor without
 * load reaches 0.9 m/s), of the error, and of its sum. They make a loop of about 60 ms. */
#define FORWARD 22L
#define PROPORTIONAL 9L
#define INTEGRAL 3L
/* The sum alone is never more than half of the power. */
#define MOST_SUM ((DUTY_TOP * 128L) / INTEGRAL)

int16_t speed_loop_step(struct speed_loop *loop, int16_t speed, int16_t counts)
{
    loop->saturated = false;
    if (speed == 0) {
        loop->sum = 0;
        return 0;
    }
    const int32_t target = ((int32_t)speed * (COUNTS_PER_METRE * TICK_MS * 256L / 1000L)) / 1000L;
    const int32_t error = target - ((int32_t)counts * 256L);
    loop->sum += error;
    if (loop->sum > MOST_SUM) {
        loop->sum = MOST_SUM;
    }
    if (loop->sum < -MOST_SUM) {
        loop->sum = -MOST_SUM;
    }
    const int32_t duty =
        ((FORWARD * target) + (PROPORTIONAL * error) + (INTEGRAL * loop->sum)) / 256L;
    if ((duty > DUTY_TOP) || (duty < -DUTY_TOP)) {
        loop->saturated = true;
        return (duty > 0) ? DUTY_TOP : -DUTY_TOP;
    }
    return (int16_t)duty;
}
