#include "board.h"

#include <math.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_cycle_timers.h>
#include <stdlib.h>
#include <string.h>

#define FREQUENCY 16000000
#define STEP_CYCLES 16000 /* of the wheels: 1 ms */
/* A byte of 10 bits takes 2800 at 57143 baud; simavr counts 11 and would choke on less. */
#define BYTE_CYCLES 3100

/* Data addresses of the ATmega2560's registers. */
enum {
    PIN_A = 0x20, DDR_A = 0x21, PORT_A = 0x22, DDR_B = 0x24, PORT_B = 0x25,
    TCCR1_A = 0x80, ICR1_LOW = 0x86, OCR1_A = 0x88, OCR1_B = 0x8A
};

static double now_of(const struct board *board)
{
    return (double)board->avr->cycle / FREQUENCY;
}

static int word_at(const avr_t *avr, int address)
{
    return avr->data[address] | (avr->data[address + 1] << 8);
}

/* Power of a motor as the driver's inputs have it: PWM from timer 1 and two direction pins. */
static double motor_power(const avr_t *avr, int connected_bit, int compare, int ahead_bit)
{
    const uint8_t pins = avr->data[PORT_A] & avr->data[DDR_A];
    const bool ahead = (pins >> ahead_bit) & 1;
    const bool back = (pins >> (ahead_bit + 1)) & 1;
    if (ahead == back || !((avr->data[TCCR1_A] >> connected_bit) & 1)) {
        return 0.0;
    }
    const double power = (word_at(avr, compare) + 1.0) / (word_at(avr, ICR1_LOW) + 1.0);
    return ahead ? power : -power;
}

static avr_cycle_count_t next_quarter(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct encoder *encoder = param;
    struct wheel *wheel = &encoder->board->rover.wheels[encoder->wheel];
    if (wheel->quarter == encoder->target) {
        return 0;
    }
    (void)avr;
    wheel->quarter += encoder->target > wheel->quarter ? 1 : -1;
    const int64_t shown = encoder->sense * wheel->quarter;
    avr_raise_irq(encoder->a, encoder_a(shown));
    avr_raise_irq(encoder->b, encoder_b(shown));
    return when + encoder->between;
}

/* The encoders turn evenly through the step after the one in which the wheels did. */
static void start_encoder(struct encoder *encoder)
{
    struct board *board = encoder->board;
    struct wheel *wheel = &board->rover.wheels[encoder->wheel];
    avr_cycle_timer_cancel(board->avr, next_quarter, encoder);
    encoder->target = wheel_quarter(wheel, board->body);
    const int64_t quarters = llabs(encoder->target - wheel->quarter);
    if (quarters > 0) {
        encoder->between = STEP_CYCLES / (quarters + 1);
        avr_cycle_timer_register(board->avr, encoder->between, next_quarter, encoder);
    }
}

static avr_cycle_count_t step_wheels(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct board *board = param;
    struct wheel *wheels = board->rover.wheels;
    board->last_step = when;
    const bool standby = !((avr->data[PORT_A] & avr->data[DDR_A]) >> 6 & 1);
    const double now = now_of(board);
    wheels[0].power = standby ? 0.0 : motor_power(avr, 7, OCR1_A, 2);
    wheels[1].power = standby ? 0.0 : motor_power(avr, 5, OCR1_B, 4);
    rover_step(&board->rover, board->body, standby, (double)STEP_CYCLES / FREQUENCY);
    start_encoder(&board->encoders[0]);
    start_encoder(&board->encoders[1]);

    const double power = fmax(fabs(wheels[0].power), fabs(wheels[1].power));
    board->top_power = fmax(board->top_power, power);
    if (power > 0.0) {
        board->unpowered_since = INFINITY;
    } else if (isinf(board->unpowered_since)) {
        board->unpowered_since = now;
    }
    if (wheels[0].speed != 0.0 || wheels[1].speed != 0.0) {
        board->still_since = INFINITY;
    } else if (isinf(board->still_since)) {
        board->still_since = now;
    }
    return when + STEP_CYCLES;
}

static avr_cycle_count_t next_byte(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct board *board = param;
    (void)avr;
    board->last_byte = when;
    if (board->to_robot.count == 0) {
        board->sending = false;
        return 0;
    }
    avr_raise_irq(board->serial_in, board->to_robot.data[0]);
    board->to_robot.count--;
    memmove(board->to_robot.data, board->to_robot.data + 1, (size_t)board->to_robot.count);
    return when + BYTE_CYCLES;
}

static void take_byte(struct avr_irq_t *irq, uint32_t value, void *param)
{
    struct bytes *from = &((struct board *)param)->from_robot;
    (void)irq;
    if (from->count < SERIAL_ROOM) {
        from->data[from->count++] = (uint8_t)value;
    }
}

/* A reset by the watchdog takes all timers with it; the world does not stop for it. */
static void keep_time(struct board *board)
{
    avr_t *avr = board->avr;
    if (avr->cycle > board->last_step + 2 * STEP_CYCLES) {
        board->last_step = avr->cycle;
        avr_cycle_timer_register(avr, STEP_CYCLES, step_wheels, board);
    }
    if (board->sending && avr->cycle > board->last_byte + 2 * BYTE_CYCLES) {
        board->last_byte = avr->cycle;
        avr_cycle_timer_register(avr, BYTE_CYCLES, next_byte, board);
    }
}

/* The processor sleeps on simulated time only. */
static void do_not_wait(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr;
    (void)cycles;
}

struct board *board_start(elf_firmware_t *program, const struct body *body, uint8_t id,
                          const double pose[3])
{
    struct board *board = calloc(1, sizeof *board);
    avr_t *avr = avr_make_mcu_by_name("atmega2560");
    if (!board || !avr) {
        free(board);
        return NULL;
    }
    avr_init(avr);
    avr_load_firmware(avr, program);
    avr->frequency = FREQUENCY;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->sleep = do_not_wait;
    board->avr = avr;
    board->body = body;
    board->rover = (struct rover){.x = pose[0], .y = pose[1], .heading = pose[2]};
    avr_eeprom_desc_t byte = {.ee = &id, .offset = 0, .size = 1};
    avr_ioctl(avr, AVR_IOCTL_EEPROM_SET, &byte);
    for (int k = 0; k < 2; k++) {
        board->encoders[k] = (struct encoder){
            .board = board,
            .wheel = k,
            .sense = 1,
            .a = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('E'), 4 + k),
            .b = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('A'), k),
        };
    }
    uint32_t flags = 0; /* neither print what is sent nor sleep for it */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    board->serial_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
                            take_byte, board);
    avr_cycle_timer_register(avr, STEP_CYCLES, step_wheels, board);
    return board;
}

bool board_run(struct board *board, double until)
{
    const avr_cycle_count_t end = (avr_cycle_count_t)llround(until * FREQUENCY);
    avr_t *avr = board->avr;
    while (avr->cycle < end && avr->state != cpu_Done && avr->state != cpu_Crashed) {
        const avr_cycle_count_t check = avr->cycle + STEP_CYCLES;
        while (avr->cycle < check && avr->cycle < end && avr->state != cpu_Done &&
               avr->state != cpu_Crashed) {
            avr_run(avr);
        }
        keep_time(board);
    }
    return avr->state != cpu_Done && avr->state != cpu_Crashed;
}

void board_receive(struct board *board, const uint8_t *bytes, int count)
{
    if (board->to_robot.count + count > SERIAL_ROOM) {
        return;
    }
    memcpy(board->to_robot.data + board->to_robot.count, bytes, (size_t)count);
    board->to_robot.count += count;
    if (!board->sending) {
        board->sending = true;
        board->last_byte = board->avr->cycle;
        avr_cycle_timer_register(board->avr, BYTE_CYCLES, next_byte, board);
    }
}

void board_set_voltages(struct board *board, const double volts[5])
{
    for (int k = 0; k < 5; k++) {
        avr_raise_irq(avr_io_getirq(board->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + k),
                      (uint32_t)lround(1000.0 * volts[k]));
    }
}

bool board_is_lit(const struct board *board)
{
    const uint8_t *data = board->avr->data;
    return ((data[PORT_B] & data[DDR_B]) >> 7 & 1) != 0;
}

void board_set_encoder(struct board *board, int wheel, int sense)
{
    board->encoders[wheel].sense = sense;
}

void board_jump(struct board *board, uint32_t address)
{
    board->avr->pc = address;
    board->avr->sreg[S_I] = 0;
    board->avr->state = cpu_Running;
}
