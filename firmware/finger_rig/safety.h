// The safety rules: which faults are latched, and which direction of the pump they still allow.
//
// The loop is closed: what forward presses into a right chamber it draws out of the left one. So a right branch
// above its limit (or a left one below) forbids forward and allows reverse, and the other way round. Any other
// latched fault says nothing about direction: then only the way back to neutral is allowed, by the travel counted
// since, and no further.
#pragma once
#include <stdint.h>
#include "messages.h"

void safety_start(bool watchdog);                          // takes over what a restart left behind
void safety_limit(const LimitsMessage &limits);
void safety_judge(const uint16_t counts[CHANNELS_MAX]);    // every 1 ms: latches pressure and sensor faults
void safety_latch(uint16_t fault);
bool safety_clear();                                       // false while a cause persists
bool safety_allows(int8_t direction);
bool safety_back_at_neutral();
void safety_add_travel(int16_t amount);
void safety_set_neutral();
void safety_note_pumping(bool pumping);
uint16_t safety_faults();
uint8_t safety_fault_channels();
