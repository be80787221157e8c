/* One robot's ATmega2560 in simavr, and the wires from it to wheels, sensors and radio. */
#ifndef BOARD_H
#define BOARD_H

#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdbool.h>
#include <stdint.h>

#include "wheels_model.h"

#define SERIAL_ROOM 4096

struct bytes {
    uint8_t data[SERIAL_ROOM];
    int count;
};

struct encoder {
    struct board *board;
    int wheel;
    int sense;                 /* 1; -1 if it is reversed, 0 if it is dead */
    int64_t target;            /* quarter to be reached in this step */
    avr_cycle_count_t between; /* cycles between two quarters */
    avr_irq_t *a;
    avr_irq_t *b;
};

struct board {
    avr_t *avr;
    const struct body *body;
    struct rover rover;
    struct encoder encoders[2];
    avr_irq_t *serial_in;
    struct bytes to_robot; /* waiting for the wire */
    struct bytes from_robot;
    bool sending;                /* a byte is on the wire to the robot */
    avr_cycle_count_t last_step; /* when the wheels, and that wire, were last looked after */
    avr_cycle_count_t last_byte;
    double top_power;       /* largest power of a motor since it was last asked for */
    double still_since;     /* [s]; infinite while a wheel turns */
    double unpowered_since; /* [s]; infinite while a motor gets power */
};

/* Returns NULL where simavr does not know the processor. */
struct board *board_start(elf_firmware_t *program, const struct body *body, uint8_t id,
                          const double pose[3]);

/* Simulate up to a time [s] since the start; false once the processor has died. */
bool board_run(struct board *board, double until);

/* Bytes from the radio module, which drops what its full line has no room for, as a real one does. */
void board_receive(struct board *board, const uint8_t *bytes, int count);

/* Voltages [V] of the converter's inputs 0 to 4. */
void board_set_voltages(struct board *board, const double volts[5]);

/* Whether the board's lamp, on PB7, is lit. */
bool board_is_lit(const struct board *board);

/* What an encoder of the left (0) or right (1) wheel tells: 1 its way, -1 the other, 0 nothing. */
void board_set_encoder(struct board *board, int wheel, int sense);

/* Make the processor go on elsewhere, as a stray bit may. */
void board_jump(struct board *board, uint32_t address);

#endif
