/* What the firmware's pins do to a differential-drive robot: motors, wheels, pose, encoders. */
#ifndef WHEELS_MODEL_H
#define WHEELS_MODEL_H

#include <stdbool.h>
#include <stdint.h>

/* Of the robot; robot_body.py explains the fields. */
struct body {
    double track_width;       /* [m] */
    double counts_per_metre;  /* edges of channel A [1/m] */
    double top_speed;         /* of a wheel at full power, without friction [m/s] */
    double friction;          /* speed that friction takes [m/s] */
    double time_constant;     /* powered or braked [s] */
    double coasting_constant; /* without power [s] */
};

struct wheel {
    double power;    /* -1 to 1 */
    double speed;    /* [m/s] */
    double way;      /* driven, forward positive [m] */
    int64_t quarter; /* of an encoder's cycle of four, as its pins show it */
};

struct rover {
    double x, y, heading; /* [m], [m], [rad] */
    struct wheel wheels[2];
};

/* Let dt [s] pass with the wheels' powers held; a coasting wheel's motor is not connected. */
void rover_step(struct rover *rover, const struct body *body, bool coasting, double dt);

/* Quarter of an encoder's cycle that belongs to the way a wheel has driven. */
int64_t wheel_quarter(const struct wheel *wheel, const struct body *body);

/* Pins in a quarter; driving forward, B follows A. */
bool encoder_a(int64_t quarter);
bool encoder_b(int64_t quarter);

#endif
