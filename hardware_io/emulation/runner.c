/* Robots in lockstep with whoever writes to stdin: `runner robot.elf`.
 *
 * Requests, in the machine's own byte order:
 *   'b' 6 doubles              the body of the robots that follow (struct body)
 *   'r' u8 id, 3 doubles       a robot at a pose [m], [m], [rad]
 *   'u' u8 k, u16 n, n bytes   robot k's radio module sends bytes
 *   'v' u8 k, 5 doubles        voltages [V] at robot k's converter
 *   'p' u8 k, 3 doubles        robot k is put to a pose
 *   'e' u8 k, u8 wheel, i8     what an encoder tells (board_set_encoder)
 *   'j' u8 k, u32 address      robot k's processor jumps, with interrupts off
 *   'a' double t               simulate up to t [s] since the start, and answer
 *
 * The answer, for each robot: 9 doubles (x, y, heading, left and right wheel speed, largest power
 * since the last answer, still since, unpowered since, 1 while the processor lives), u16 n, and n
 * bytes for the radio module. The end of stdin ends the program. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "board.h"

#define MOST_ROBOTS 32

static struct board *boards[MOST_ROBOTS];
static int board_count;

static void die(const char *what)
{
    fprintf(stderr, "%s\n", what);
    exit(1);
}

/* simavr's remarks (of unaligned timers and the like) are none of the protocol. */
static void be_silent(avr_t *avr, const int level, const char *format, va_list arguments)
{
    (void)avr;
    if (level <= LOG_ERROR) {
        vfprintf(stderr, format, arguments);
    }
}

static void take(void *data, size_t size)
{
    if (fread(data, 1, size, stdin) != size) {
        exit(0);
    }
}

static struct board *take_board(void)
{
    uint8_t k;
    take(&k, 1);
    if (k >= board_count) {
        die("no such robot");
    }
    return boards[k];
}

static void answer(struct board *board, bool alive)
{
    const struct rover *rover = &board->rover;
    const double numbers[10] = {
        rover->x, rover->y, rover->heading, rover->wheels[0].speed, rover->wheels[1].speed,
        board->top_power, board->still_since, board->unpowered_since,
        board_is_lit(board) ? 1.0 : 0.0, alive ? 1.0 : 0.0,
    };
    const uint16_t count = (uint16_t)board->from_robot.count;
    fwrite(numbers, sizeof numbers, 1, stdout);
    fwrite(&count, sizeof count, 1, stdout);
    fwrite(board->from_robot.data, 1, count, stdout);
    board->from_robot.count = 0;
    board->top_power = 0.0;
}

static void advance(void)
{
    double until;
    take(&until, sizeof until);
    for (int k = 0; k < board_count; k++) {
        answer(boards[k], board_run(boards[k], until));
    }
    fflush(stdout);
}

static void add_robot(elf_firmware_t *program, const struct body *body)
{
    uint8_t id;
    double pose[3];
    take(&id, sizeof id);
    take(pose, sizeof pose);
    if (board_count == MOST_ROBOTS) {
        die("too many robots");
    }
    boards[board_count] = board_start(program, body, id, pose);
    if (!boards[board_count]) {
        die("simavr does not know the ATmega2560");
    }
    board_count++;
}

static void feed(void)
{
    struct board *board = take_board();
    uint16_t count;
    uint8_t bytes[SERIAL_ROOM];
    take(&count, sizeof count);
    if (count > sizeof bytes) {
        die("too many bytes at once");
    }
    take(bytes, count);
    board_receive(board, bytes, count);
}

static void place(void)
{
    struct rover *rover = &take_board()->rover;
    double pose[3];
    take(pose, sizeof pose);
    rover->x = pose[0];
    rover->y = pose[1];
    rover->heading = pose[2];
}

static void set_encoder(void)
{
    struct board *board = take_board();
    uint8_t wheel;
    int8_t sense;
    take(&wheel, sizeof wheel);
    take(&sense, sizeof sense);
    if (wheel > 1) {
        die("no such wheel");
    }
    board_set_encoder(board, wheel, sense);
}

int main(int argc, char **argv)
{
    static elf_firmware_t program;
    static struct body body;
    double volts[5];
    uint32_t address;
    avr_global_logger_set(be_silent);
    if (argc != 2 || elf_read_firmware(argv[1], &program) != 0) {
        die("usage: runner robot.elf");
    }
    for (;;) {
        struct board *board;
        char request;
        take(&request, 1);
        switch (request) {
        case 'b':
            take(&body, sizeof body);
            break;
        case 'r':
            add_robot(&program, &body);
            break;
        case 'u':
            feed();
            break;
        case 'v':
            board = take_board();
            take(volts, sizeof volts);
            board_set_voltages(board, volts);
            break;
        case 'p':
            place();
            break;
        case 'e':
            set_encoder();
            break;
        case 'j':
            board = take_board();
            take(&address, sizeof address);
            board_jump(board, address);
            break;
        case 'a':
            advance();
            break;
        default:
            die("unknown request");
        }
    }
}
