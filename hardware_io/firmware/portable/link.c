#include "link.h"

#include "robot.h"

void link_reset(struct link *link, uint8_t robot)
{
    *link = (struct link){0};
    link->robot = robot;
}

/* Sequence numbers go round: newer is up to 32767 ahead. */
static bool is_newer(uint16_t sequence, uint16_t than)
{
    const uint16_t ahead = (uint16_t)(sequence - than);
    return (ahead != 0U) && (ahead < 0x8000U);
}

static bool is_armed(const struct link *link)
{
    return (link->state == (uint8_t)LINK_IDLE) || (link->state == (uint8_t)LINK_DRIVING) ||
           (link->state == (uint8_t)LINK_LOST);
}

static bool is_of_session(const struct link *link, const struct frame *frame)
{
    return link->has_session && (frame->session == link->session);
}

static void note(struct link *link, const struct frame *frame, uint16_t now)
{
    link->has_session = true;
    link->session = frame->session;
    link->sequence = frame->sequence;
    link->heard = now;
    link->heard_fresh = true;
    link->taken++;
}

static void forget_command(struct link *link)
{
    link->command_fresh = false;
    link->first = 0;
    link->second = 0;
}

static void follow(struct link *link, const struct frame *frame, uint16_t now)
{
    if (!is_armed(link) || (frame->age > OLDEST_COMMAND_MS)) {
        return;
    }
    for (uint8_t k = 0; k < frame->count; k++) {
        if (frame->entries[k].robot == link->robot) {
            link->form = frame->form;
            link->first = frame->entries[k].first;
            link->second = frame->entries[k].second;
            link->commanded = now;
            link->command_fresh = true;
            link->state = LINK_DRIVING;
        }
    }
}

bool link_take(struct link *link, const struct frame *frame, uint16_t now)
{
    const bool ours = is_of_session(link, frame);
    const bool newer = ours && is_newer(frame->sequence, link->sequence);
    const bool addressed = (frame->robot == link->robot) || (frame->robot == FRAME_EVERYONE);
    switch (frame->kind) {
    case FRAME_STOP:
        if (!addressed) {
            return false;
        }
        /* A stop is never too old and never a stranger's. */
        if (newer || !ours) {
            note(link, frame, now);
        }
        link->state = LINK_STOPPED;
        forget_command(link);
        return true;
    case FRAME_ARM:
        /* One that was overtaken by a stop of its session is old. */
        if (!addressed || (ours && !newer)) {
            return false;
        }
        note(link, frame, now);
        link->state = LINK_IDLE;
        forget_command(link);
        return true;
    case FRAME_HEARTBEAT:
    case FRAME_COMMAND:
        if (!newer) {
            return false;
        }
        note(link, frame, now);
        if (frame->kind == (uint8_t)FRAME_COMMAND) {
            follow(link, frame, now);
        }
        return false;
    default:
        return false;
    }
}

void link_refuse(struct link *link)
{
    link->refused++;
}

void link_tick(struct link *link, uint16_t now)
{
    /* What is stale stays so until a frame comes: the clock's going round must not revive it. */
    if ((uint16_t)(now - link->heard) >= LINK_TIMEOUT_MS) {
        link->heard_fresh = false;
    }
    if ((uint16_t)(now - link->commanded) >= LINK_TIMEOUT_MS) {
        forget_command(link);
    }
    if (!is_armed(link)) {
        return;
    }
    if (!link->heard_fresh) {
        link->state = LINK_LOST;
    } else {
        link->state = link->command_fresh ? (uint8_t)LINK_DRIVING : (uint8_t)LINK_IDLE;
    }
}

void link_wheel_speeds(const struct link *link, int16_t speeds[2])
{
    speeds[0] = 0;
    speeds[1] = 0;
    if (link->state != (uint8_t)LINK_DRIVING) {
        return;
    }
    int32_t left = link->first;
    int32_t right = link->second;
    if (link->form == (uint8_t)FORM_TWIST) {
        const int32_t across = ((int32_t)link->second * TRACK_WIDTH) / 2000L;
        left = link->first - across;
        right = link->first + across;
    }
    /* Both are scaled, so that the robot still turns about the same point. */
    const int32_t left_size = (left < 0) ? -left : left;
    const int32_t right_size = (right < 0) ? -right : right;
    const int32_t top = (left_size > right_size) ? left_size : right_size;
    if (top > TOP_WHEEL_SPEED) {
        left = (left * TOP_WHEEL_SPEED) / top;
        right = (right * TOP_WHEEL_SPEED) / top;
    }
    speeds[0] = (int16_t)left;
    speeds[1] = (int16_t)right;
}
