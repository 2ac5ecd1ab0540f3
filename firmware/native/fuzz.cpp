// Feeds damaged command frames to the portable part and counts those executed as something that was never sent.
//
//   fuzz COUNT [SEED]     exit code 1 when any was executed wrongly
//
// Built from the very sources of the board; bench.cpp is included so that the whole state can be compared.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../finger_rig/bench.cpp"

Remembered remembered;

void hal_pump(int8_t, uint8_t) {}
uint8_t hal_transmit_room() { return 63; }
void hal_transmit(const uint8_t *, uint8_t) {}
uint8_t hal_lock() { return 0; }
void hal_unlock(uint8_t) {}
void hal_hang(bool) {}

static uint64_t random_state;

static uint32_t random_bits() {  // xorshift64*, Vigna 2016
  random_state ^= random_state >> 12;
  random_state ^= random_state << 25;
  random_state ^= random_state >> 27;
  return (random_state * 0x2545f4914f6cdd1dull) >> 32;
}

static uint32_t below(uint32_t limit) { return (uint64_t(random_bits()) * limit) >> 32; }

struct Command {
  uint8_t id, sequence, length;
  uint8_t payload[8];
};

static Command random_command(uint8_t sequence) {
  Command command = {MSG_PULSE, sequence, 0, {0}};
  switch (below(6)) {
    case 0: {
      StreamMessage m = {uint8_t(5 + below(246))};
      command.id = MSG_STREAM;
      memcpy(command.payload, &m, command.length = sizeof m);
      return command;
    }
    case 1: {
      LimitPumpMessage m = {uint8_t(1 + below(255)), uint16_t(1 + below(10000)), uint16_t(50 + below(401)),
                            uint8_t(below(2) ? 2 : 4)};
      command.id = MSG_LIMIT_PUMP;
      memcpy(command.payload, &m, command.length = sizeof m);
      return command;
    }
    case 2: {
      uint16_t low = 41 + below(400);
      LimitPressureMessage m = {uint8_t(below(4)), low, uint16_t(low + 1 + below(982 - low))};
      command.id = MSG_LIMIT_PRESSURE;
      memcpy(command.payload, &m, command.length = sizeof m);
      return command;
    }
    default: {
      PulseMessage m = {int8_t(below(2) ? 1 : -1), uint8_t(1 + below(255)), uint16_t(1 + below(DEFAULT_PULSE_MS))};
      memcpy(command.payload, &m, command.length = sizeof m);
      return command;
    }
  }
}

// Everything a command can change.
struct State {
  int8_t direction;
  uint8_t duty, stream_period;
  uint16_t left_ms;
  LimitsMessage limits;
};

static State state_now() {
  State s;
  memset(&s, 0, sizeof s);
  s.direction = direction;
  s.duty = duty;
  s.stream_period = stream_period;
  s.left_ms = left_ms;
  s.limits = limits;
  return s;
}

static State fresh(uint8_t sequence) {
  memset(&remembered, 0, sizeof remembered);
  bench_start(0, false);
  in_session = true;
  last_sequence = sequence - 1;
  return state_now();
}

static State after(State s, const Command &command) {
  if (command.id == MSG_PULSE) {
    PulseMessage m;
    memcpy(&m, command.payload, sizeof m);
    s.direction = m.direction;
    s.duty = m.duty;
    s.left_ms = m.duration_ms;
  } else if (command.id == MSG_STREAM) {
    s.stream_period = command.payload[0];
  } else if (command.id == MSG_LIMIT_PUMP) {
    LimitPumpMessage m;
    memcpy(&m, command.payload, sizeof m);
    s.limits.max_duty = m.max_duty;
    s.limits.max_pulse_ms = m.max_pulse_ms;
    s.limits.silence_ms = m.silence_ms;
    s.limits.channels = m.channels;
  } else {
    LimitPressureMessage m;
    memcpy(&m, command.payload, sizeof m);
    s.limits.low_counts[m.channel] = m.low_counts;
    s.limits.high_counts[m.channel] = m.high_counts;
  }
  return s;
}

// Whether the board answered this very command and its state is what the command asks for.
static bool executed(const Command &command, const State &before) {
  State now = state_now(), wanted = after(before, command);
  return ack.command == command.id && ack_sequence == command.sequence && !memcmp(&now, &wanted, sizeof now);
}

enum { FLIP, DROP, INSERT, CUT, BURST, SPLICE, REPEAT, NOISE, KINDS };
static const char *const KIND_NAMES[KINDS] = {"bits flipped", "byte dropped", "byte inserted", "cut short",
                                              "burst overwritten", "spliced with another", "part repeated", "noise"};

static unsigned damage(uint8_t kind, uint8_t *bytes, unsigned length, const Command &other) {
  unsigned at = below(length);
  switch (kind) {
    case FLIP:
      for (unsigned n = 1 + below(8); n; n--) bytes[below(length)] ^= 1 << below(8);
      return length;
    case DROP: memmove(bytes + at, bytes + at + 1, length - at - 1); return length - 1;
    case INSERT:
      memmove(bytes + at + 1, bytes + at, length - at);
      bytes[at] = random_bits();
      return length + 1;
    case CUT: return at;
    case BURST:
      for (unsigned n = 1 + below(12); n && at < length; n--) bytes[at++] = random_bits();
      return length;
    case SPLICE: {
      uint8_t more[FRAME_BYTES_MAX];
      unsigned size = frame_encode(other.id, other.sequence, other.payload, other.length, more);
      for (unsigned i = at; i < size; i++) bytes[i] = more[i];
      return at < size ? size : at;
    }
    case REPEAT: {
      unsigned count = 1 + below(length - at);
      memmove(bytes + at + count, bytes + at, length - at);
      return length + count;
    }
    default:
      length = 8 + below(14);
      for (unsigned i = 0; i < length; i++) bytes[i] = random_bits();
      bytes[0] = bytes[length - 1] = 0;
      return length;
  }
}

int main(int argc, char **argv) {
  unsigned long count = argc > 1 ? strtoul(argv[1], 0, 10) : 1000000;
  random_state = 0x9e3779b97f4a7c15ull ^ (argc > 2 ? strtoull(argv[2], 0, 10) : 1);
  unsigned long as_sent[KINDS] = {0}, wrong[KINDS] = {0}, total[KINDS] = {0}, all_wrong = 0;
  for (unsigned long n = 0; n < count; n++) {
    uint8_t kind = below(KINDS), sequence = random_bits();
    Command command = random_command(sequence), other = random_command(sequence);
    uint8_t bytes[3 * FRAME_BYTES_MAX], untouched[FRAME_BYTES_MAX];
    unsigned length = frame_encode(command.id, command.sequence, command.payload, command.length, bytes);
    memcpy(untouched, bytes, length);
    unsigned before_length = length;
    length = damage(kind, bytes, length, other);
    if (length == before_length && !memcmp(bytes, untouched, length)) continue;  // no damage done
    State before = fresh(sequence);
    for (unsigned i = 0; i < length; i++) bench_receive(bytes[i]);
    bench_receive(0);  // whatever follows on the line begins with a delimiter
    total[kind]++;
    if (!ack_due) continue;
    bool sent = executed(command, before) || (kind == SPLICE && executed(other, before));
    if (sent) as_sent[kind]++;
    else wrong[kind]++, all_wrong++;
  }
  unsigned long frames = 0;
  for (int kind = 0; kind < KINDS; kind++) {
    printf("%-22s %10lu damaged, %9lu executed as sent, %lu executed wrongly\n", KIND_NAMES[kind], total[kind],
           as_sent[kind], wrong[kind]);
    frames += total[kind];
  }
  printf("total %lu wrong %lu\n", frames, all_wrong);
  return all_wrong != 0;
}
