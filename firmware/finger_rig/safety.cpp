#include "safety.h"

#include <string.h>

#include "bench.h"

#define MAGIC 0x70bef007u
#define PRESSURE_FAULTS (FAULT_OVER_PRESSURE | FAULT_UNDER_PRESSURE)

static uint16_t low_limit[CHANNELS_MAX], high_limit[CHANNELS_MAX];
static uint8_t channels;
static uint8_t low_run[CHANNELS_MAX], high_run[CHANNELS_MAX];        // samples in a row outside the limits
static uint8_t open_run[CHANNELS_MAX], saturated_run[CHANNELS_MAX];
static uint8_t fault_channels;
static uint8_t forbidden;   // latched by pressure: bit 0 forward, bit 1 reverse
static uint8_t persisting;  // conditions seen in the last tick, low byte of Fault

static uint8_t check_sum() {
  const uint8_t *bytes = (const uint8_t *)&remembered;
  uint8_t sum = 0xa5;
  for (uint8_t i = 0; i < sizeof remembered - 1; i++) sum = (uint8_t)(sum << 1 | sum >> 7) ^ bytes[i];
  return sum;
}

static void seal() { remembered.check = check_sum(); }

void safety_start(bool watchdog) {
  bool kept = remembered.magic == MAGIC && remembered.check == check_sum();
  if (!kept) memset(&remembered, 0, sizeof remembered);
  remembered.magic = MAGIC;
  if (remembered.pumping) remembered.faults |= FAULT_RESET_WHILE_PUMPING;
  if (watchdog) remembered.faults |= FAULT_HUNG_LOOP;
  remembered.pumping = 0;
  remembered.faults &= FAULT_SILENCE | FAULT_HUNG_LOOP | FAULT_RESET_WHILE_PUMPING;  // the others are judged anew
  seal();
  memset(low_run, 0, sizeof low_run);
  memset(high_run, 0, sizeof high_run);
  memset(open_run, 0, sizeof open_run);
  memset(saturated_run, 0, sizeof saturated_run);
  fault_channels = forbidden = persisting = 0;
}

void safety_limit(const LimitsMessage &limits) {
  memcpy(low_limit, limits.low_counts, sizeof low_limit);
  memcpy(high_limit, limits.high_counts, sizeof high_limit);
  channels = limits.channels;
}

static bool in_a_row(uint8_t &run, bool outside) {
  if (!outside) run = 0;
  else if (run < TRIP_SAMPLES) run++;
  return run >= TRIP_SAMPLES;
}

void safety_judge(const uint16_t counts[CHANNELS_MAX]) {
  uint8_t found = 0, which = 0;
  for (uint8_t i = 0; i < channels; i++) {
    uint8_t here = 0;
    bool right = !(i & 1);
    if (in_a_row(open_run[i], counts[i] < SENSOR_LOW_COUNTS)) here |= FAULT_SENSOR_LOW;
    if (in_a_row(saturated_run[i], counts[i] > SENSOR_HIGH_COUNTS)) here |= FAULT_SENSOR_HIGH;
    if (in_a_row(high_run[i], counts[i] > high_limit[i]) && !here) {
      here |= FAULT_OVER_PRESSURE;
      forbidden |= right ? 1 : 2;
    }
    if (in_a_row(low_run[i], counts[i] < low_limit[i]) && !here) {
      here |= FAULT_UNDER_PRESSURE;
      forbidden |= right ? 2 : 1;
    }
    if (here) which |= 1 << i;
    found |= here;
  }
  persisting = found;
  if (!found) return;
  fault_channels |= which;
  safety_latch(found);
}

void safety_latch(uint16_t fault) {
  if ((remembered.faults & fault) == fault) return;
  remembered.faults |= fault;
  seal();
}

bool safety_clear() {
  if (persisting) return false;
  remembered.faults = 0;
  fault_channels = forbidden = 0;
  seal();
  return true;
}

bool safety_back_at_neutral() { return (remembered.faults & ~PRESSURE_FAULTS) != 0 && remembered.travel == 0; }

bool safety_allows(int8_t direction) {
  if (forbidden & (direction > 0 ? 1 : 2)) return false;
  if ((remembered.faults & ~PRESSURE_FAULTS) == 0) return true;
  return direction > 0 ? remembered.travel < 0 : remembered.travel > 0;
}

void safety_add_travel(int16_t amount) {
  int32_t before = remembered.travel;
  remembered.travel += amount;
  bool passed_neutral = (before > 0 && remembered.travel < 0) || (before < 0 && remembered.travel > 0);
  if (passed_neutral && (remembered.faults & ~PRESSURE_FAULTS)) remembered.travel = 0;
  seal();
}

void safety_set_neutral() {
  remembered.travel = 0;
  seal();
}

void safety_note_pumping(bool pumping) {
  remembered.pumping = pumping;
  seal();
}

uint16_t safety_faults() { return remembered.faults; }
uint8_t safety_fault_channels() { return fault_channels; }
