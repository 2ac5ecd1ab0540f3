// Every pin of the bench. Arduino Uno (ATmega328P), L298N channel A, gauge sensors on the analogue inputs.
// hal_pump() in finger_rig.ino writes the ports directly: change a pin here and its port there together.
#pragma once
#include <Arduino.h>

#define PIN_PUMP_ENABLE 9   // L298N ENA, PWM of timer 1 (OC1A), 976 Hz; 10 kOhm to ground keeps the pump off in reset
#define PIN_PUMP_FORWARD 7  // L298N IN1
#define PIN_PUMP_REVERSE 8  // L298N IN2
#define PIN_FAULT_LED 13    // lit while a fault is latched

// Pressure inputs A0 to A3: right, left, right and left of a second finger; 100 kOhm to ground makes an open wire
// read as zero.
#define ADC_FIRST_CHANNEL 0

#define PUMP_ENABLE_PORT PORTB
#define PUMP_ENABLE_BIT PB1
#define PUMP_FORWARD_PORT PORTD
#define PUMP_FORWARD_BIT PD7
#define PUMP_REVERSE_PORT PORTB
#define PUMP_REVERSE_BIT PB0
