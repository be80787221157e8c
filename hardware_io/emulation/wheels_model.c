#include "wheels_model.h"

#include <math.h>

/* tau v' = power * top_speed - v - friction * sign(v), over dt with the solution in closed form. A
 * wheel at rest starts when the power overcomes friction; one that comes to rest stays there. */
static double next_speed(const struct wheel *wheel, const struct body *body, bool coasting,
                         double dt)
{
    const double pull = coasting ? 0.0 : wheel->power * body->top_speed;
    const double tau = coasting ? body->coasting_constant : body->time_constant;
    if (wheel->speed == 0.0 && fabs(pull) <= body->friction) {
        return 0.0;
    }
    const double direction = wheel->speed != 0.0 ? wheel->speed : pull;
    const double limit = pull - copysign(body->friction, direction);
    const double speed = limit + (wheel->speed - limit) * exp(-dt / tau);
    return speed * direction > 0.0 ? speed : 0.0;
}

void rover_step(struct rover *rover, const struct body *body, bool coasting, double dt)
{
    double ways[2];
    for (int k = 0; k < 2; k++) {
        struct wheel *wheel = &rover->wheels[k];
        const double before = wheel->speed;
        wheel->speed = next_speed(wheel, body, coasting, dt);
        ways[k] = 0.5 * (before + wheel->speed) * dt;
        wheel->way += ways[k];
    }
    const double turn = (ways[1] - ways[0]) / body->track_width;
    const double way = 0.5 * (ways[0] + ways[1]);
    rover->x += way * cos(rover->heading + 0.5 * turn);
    rover->y += way * sin(rover->heading + 0.5 * turn);
    rover->heading += turn;
}

int64_t wheel_quarter(const struct wheel *wheel, const struct body *body)
{
    return (int64_t)floor(2.0 * body->counts_per_metre * wheel->way);
}

bool encoder_a(int64_t quarter)
{
    const int64_t phase = quarter & 3;
    return phase == 1 || phase == 2;
}

bool encoder_b(int64_t quarter)
{
    return (quarter & 2) != 0;
}
