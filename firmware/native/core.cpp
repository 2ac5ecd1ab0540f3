// The firmware's portable part on this computer, stepped like the simulated board but a hundred times faster.
//
// The machine around it is reduced to what a bench can see: a serial line at the chip's true rate, the converter,
// the pump's pins, the 1 kHz tick. No instruction is simulated: no hang, no watchdog, no RAM to measure.
// Requests and answers are those of simulator/bridge.c; one load of this library is one board.
#include <string.h>

#include "../finger_rig/bench.h"
#include "../finger_rig/hal.h"

Remembered remembered;

enum { CYCLES_PER_TICK = 16000, CYCLES_PER_BYTE = 1360 };  // 16 MHz / 8 / 17: what the Uno makes of 115200 baud
enum { ROOM = 63, QUEUE = 65536, REFERENCE_MV = 1100 };
enum Operation : uint8_t { RUN, RESET, POWER_CYCLE = 4 };
enum { EXTRF = 2, PORF = 1 };

struct __attribute__((packed)) Request {
  uint32_t cycles;
  uint16_t inputs_mv[4], supply_mv;
  uint8_t operation, zero;
  uint16_t count;
};

struct __attribute__((packed)) Answer {
  uint64_t cycle;
  uint32_t enable_high_cycles;
  uint8_t direction, enable, state, zero;
  uint16_t count;
};

struct Line {
  uint8_t bytes[QUEUE];
  uint16_t head, tail;  // 16 bits: they wrap with the queue
  uint64_t due;         // cycle at which the next byte has passed

  bool busy() const { return head != tail; }
  uint16_t waiting() const { return head - tail; }
  void put(uint8_t byte, uint64_t now) {
    if (!busy()) due = now + CYCLES_PER_BYTE;
    bytes[head++] = byte;
  }
  uint8_t take() {
    due += CYCLES_PER_BYTE;
    return bytes[tail++];
  }
};

static Line to_board, to_host;
static uint64_t now, next_tick;
static double enable_high;
static int8_t pump_direction;
static double pump_share;

void hal_pump(int8_t direction, uint8_t duty) {
  bool on = direction != DIRECTION_OFF && duty != 0;
  pump_direction = on ? direction : int8_t(DIRECTION_OFF);
  pump_share = !on ? 0 : duty == 255 ? 1 : (duty + 1) / 256.0;  // fast PWM: the pin is high for OCR1A + 1 of 256
}

uint8_t hal_transmit_room() { return to_host.waiting() < ROOM ? ROOM - to_host.waiting() : 0; }

void hal_transmit(const uint8_t *bytes, uint8_t length) {
  for (uint8_t i = 0; i < length; i++) to_host.put(bytes[i], now);
}

uint8_t hal_lock() { return 0; }
void hal_unlock(uint8_t) {}
void hal_hang(bool) {}

static void start(uint8_t cause) {
  if (cause == PORF) memset(&remembered, 0, sizeof remembered);
  to_board.tail = to_board.head;
  to_host.tail = to_host.head;
  next_tick = now + CYCLES_PER_TICK;
  bench_start(cause, false);
}

static uint16_t counts_of(uint32_t millivolts, uint32_t supply_mv) {
  uint32_t counts = supply_mv ? millivolts * 1024 / supply_mv : 1023;
  return counts > 1023 ? 1023 : counts;
}

static void tick(const Request &request) {
  uint16_t counts[CHANNELS_MAX];
  for (uint8_t i = 0; i < CHANNELS_MAX; i++) counts[i] = counts_of(request.inputs_mv[i], request.supply_mv);
  bench_tick(counts, counts_of(REFERENCE_MV, request.supply_mv));
}

static void pass_until(uint64_t moment) {
  enable_high += pump_share * double(moment - now);
  now = moment;
}

#define PUBLIC extern "C" __attribute__((visibility("default")))

PUBLIC void core_power_up() {
  now = 0;
  start(PORF);
}

// Runs one request; `bytes` holds what goes to the board, and takes what came from it.
PUBLIC uint16_t core_step(const Request *request, Answer *answer, uint8_t *bytes) {
  if (request->operation == RESET) start(EXTRF);
  if (request->operation == POWER_CYCLE) start(PORF);
  for (uint16_t i = 0; i < request->count; i++) to_board.put(bytes[i], now);
  uint64_t end = now + request->cycles;
  uint16_t sent = 0;
  enable_high = 0;
  for (;;) {
    uint64_t moment = end;
    if (next_tick < moment) moment = next_tick;
    if (to_board.busy() && to_board.due < moment) moment = to_board.due;
    if (to_host.busy() && to_host.due < moment) moment = to_host.due;
    pass_until(moment);
    if (to_host.busy() && to_host.due <= now) bytes[sent++] = to_host.take();
    else if (to_board.busy() && to_board.due <= now) bench_receive(to_board.take()), bench_poll();
    else if (next_tick <= now) next_tick += CYCLES_PER_TICK, tick(*request), bench_poll();
    else break;
  }
  answer->cycle = now;
  answer->enable_high_cycles = uint32_t(enable_high + 0.5);
  answer->direction = pump_direction == DIRECTION_FORWARD ? 1 : pump_direction == DIRECTION_REVERSE ? 2 : 0;
  answer->enable = pump_share > 0;
  answer->state = answer->zero = 0;
  answer->count = sent;
  return sent;
}
