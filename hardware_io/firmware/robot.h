/* The robot that this firmware drives: dimensions, limits and times. Measured on another robot,
 * these are the numbers to change; emulation/robot_body.py has the same in SI units. */
#ifndef ROBOT_H
#define ROBOT_H

#include <stdint.h>

/* Used where EEPROM byte 0 is blank. */
#ifndef ROBOT_ID
#define ROBOT_ID 1
#endif

/* Encoder: both edges of channel A, 816.3 a turn; wheel of 65 mm diameter. */
#define COUNTS_PER_METRE 3998L
/* Between the wheels' tracks [mm]. */
#define TRACK_WIDTH 160L
/* Fastest wheel that is asked for [mm/s]; beyond it a command is scaled down. */
#define TOP_WHEEL_SPEED 600L

/* Period of the wheel loops [ms]. */
#define TICK_MS 10U
/* Silence, and silence about this robot, after which the motors are cut [ms]. At 20 commands a
 * second two lost in a row pass unnoticed. */
#define LINK_TIMEOUT_MS 170U
/* Commands from poses older than this are heartbeats only [ms]. */
#define OLDEST_COMMAND_MS 300U
#define TELEMETRY_PERIOD_MS 200U

/* Sharp GP2Y0A41SK0F behind the rim: range [mm] = IR_SLOPE / (reading - IR_OFFSET) - IR_RECESS. */
#define IR_SLOPE 20760L
#define IR_OFFSET 11
#define IR_RECESS 40
#define IR_REACH 400

/* Divider 1:2 before a 5 V, 10 bit converter: [mV] = reading * 625 / 64. */
#define LOW_BATTERY_MV 6600U

#endif
