/* The real firmware in simavr, stepped over a pipe.
 *
 * SPDX-License-Identifier: Apache-2.0
 * This source is Tubefoot's own. A program built from it links simavr, and is as a whole under simavr's licence, the
 * GPL-3: none is shipped, `make` builds it where it is used. The Tubefoot package only starts it as a process and
 * talks to it over stdin and stdout.
 *
 *   bridge FIRMWARE.elf [BOOTLOADER.hex]
 *
 * Each request runs the processor for a number of cycles; the answer tells what the pins did meanwhile.
 * Little-endian, packed:
 *   request  u32 cycles, u16 inputs_mv[4], u16 supply_mv, u8 operation, u8 0, u16 n, n bytes to the UART
 *   answer   u64 cycle, u32 enable_high_cycles, u8 direction, u8 enable, u8 state, u8 0, u16 n, n bytes from the UART
 * operation 0 runs; 1 presses the reset button first; 2 paints the free RAM; 3 answers with the RAM never touched in
 * enable_high_cycles; 4 switches the power off and on (RAM lost) first.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_hex.h>
#include <simavr/sim_time.h>

enum { RAM_START = 0x100, RAM_END = 0x8ff, MCUSR_AT = 0x54, EXTRF = 2, PORF = 1, BOOT_AT = 0x7c00, BOOT_SHIFT = 0x200, PAINT = 0xc5 };
enum { RUN, RESET, PAINT_RAM, MEASURE_RAM, POWER_CYCLE };
enum { QUEUE = 65536 };

typedef struct {
  avr_t *avr;
  avr_irq_t *uart_in, *adc;
  uint8_t in[QUEUE], out[QUEUE];
  unsigned in_head, in_tail, out_count;
  int blocked;            /* the UART's own queue is full */
  int enable;             /* level of D9, the L298N's enable */
  uint64_t enable_since, enable_high;
  unsigned painted_from;
  int boots;              /* starts in the boot loader */
} board_t;

static void feed_uart(board_t *board) {
  while (!board->blocked && board->in_head != board->in_tail)
    avr_raise_irq(board->uart_in, board->in[board->in_tail++ % QUEUE]);
}

static void on_uart_out(avr_irq_t *irq, uint32_t value, void *param) {
  board_t *board = param;
  if (board->out_count < QUEUE) board->out[board->out_count++] = value;
}

static void on_uart_ready(avr_irq_t *irq, uint32_t value, void *param) {
  ((board_t *)param)->blocked = 0;
  feed_uart(param);
}

static void on_uart_full(avr_irq_t *irq, uint32_t value, void *param) { ((board_t *)param)->blocked = 1; }

static void on_enable(avr_irq_t *irq, uint32_t value, void *param) {
  board_t *board = param;
  int level = value & 1;
  if (level == board->enable) return;
  if (level) board->enable_since = board->avr->cycle;
  else board->enable_high += board->avr->cycle - board->enable_since;
  board->enable = level;
}

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles) {}  /* virtual time: never wait */
static avr_cycle_count_t end_of_step(avr_t *avr, avr_cycle_count_t when, void *param) { return 0; }
static void quiet(avr_t *avr, const int level, const char *format, va_list arguments) {}

static void wire(board_t *board) {
  avr_t *avr = board->avr;
  avr->frequency = 16000000;
  avr->vcc = avr->avcc = avr->aref = 5000;
  avr->sleep = no_sleep;
  avr->log = LOG_NONE;
  avr->run_cycle_limit = 16000;  /* go on to the next timer or interrupt at once, not one instruction at a time */
  uint32_t flags = 0;
  avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
  flags &= ~(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  board->uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_uart_out, board);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), on_uart_ready, board);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), on_uart_full, board);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 1), on_enable, board);
  board->adc = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, 0);
  board->blocked = board->enable = 0;
  board->in_head = board->in_tail = 0;
  if (board->boots) avr->pc = avr->reset_pc = BOOT_AT;
}

/* A fresh core around the same flash (avr_reset() of simavr 1.6 leaves the watchdog dead for the next life);
 * the old one is leaked, 40 kB, because avr_terminate() frees twice after a boot loader was loaded. */
static void restart(board_t *board, int keep_ram) {
  avr_t *old = board->avr, *avr = avr_make_mcu_by_name("atmega328p");
  avr->cycle = old->cycle;
  avr_init(avr);
  memcpy(avr->flash, old->flash, old->flashend + 1);
  avr->codeend = old->codeend;
  if (keep_ram) memcpy(avr->data + RAM_START, old->data + RAM_START, RAM_END - RAM_START + 1);
  board->avr = avr;
  wire(board);
  avr->data[MCUSR_AT] = keep_ram ? EXTRF : PORF;
}

static int load(board_t *board, const char *firmware, const char *bootloader) {
  avr_t *avr = board->avr = avr_make_mcu_by_name("atmega328p");
  if (!avr) return 0;
  avr_init(avr);
  if (*firmware) {
    elf_firmware_t elf;
    memset(&elf, 0, sizeof elf);
    if (elf_read_firmware(firmware, &elf)) return 0;
    elf.frequency = 16000000;
    elf.vcc = elf.avcc = elf.aref = 5000;
    avr_load_firmware(avr, &elf);
    board->painted_from = RAM_START + elf.datasize + elf.bsssize + 16;  /* 16: .noinit lies behind .bss */
  }
  if (*bootloader) {
    ihex_chunk_p chunks;
    int count = read_ihex_chunks(bootloader, &chunks);
    if (count <= 0) return 0;
    /* Debian's optiboot has outgrown the Uno's boot section by 20 bytes; its code does not care where it lies, so
     * it goes to the next larger section, 0x7c00. */
    for (int i = 0; i < count; i++)
      memcpy(avr->flash + chunks[i].baseaddr - BOOT_SHIFT, chunks[i].data, chunks[i].size);
    board->boots = 1;
  }
  wire(board);
  avr->data[MCUSR_AT] = board->boots ? EXTRF : PORF;
  return 1;
}

static int step(board_t *board, uint32_t cycles) {
  avr_t *avr = board->avr;
  uint64_t end = avr->cycle + cycles;
  board->out_count = 0;
  board->enable_high = 0;
  if (board->enable) board->enable_since = avr->cycle;
  feed_uart(board);
  avr_cycle_timer_register(avr, cycles, end_of_step, board);  /* a sleeping core wakes at the end of the step */
  int state = avr->state;
  while (avr->cycle < end && state != cpu_Done && state != cpu_Crashed) state = avr_run(avr);
  if (board->enable) board->enable_high += avr->cycle - board->enable_since;
  return state;
}

static unsigned untouched_ram(board_t *board) {
  unsigned count = 0;
  while (board->painted_from + count <= RAM_END && board->avr->data[board->painted_from + count] == PAINT) count++;
  return count;
}

static uint8_t direction_pins(board_t *board) {  /* bit 0: D7, forward; bit 1: D8, reverse */
  enum { PORTB_AT = 0x25, PORTD_AT = 0x2b };
  return ((board->avr->data[PORTD_AT] >> 7) & 1) | (board->avr->data[PORTB_AT] & 1) << 1;
}

static int take(void *to, size_t size) { return size == 0 || fread(to, size, 1, stdin) == 1; }

int main(int argc, char **argv) {
  struct __attribute__((packed)) {
    uint32_t cycles;
    uint16_t inputs_mv[4], supply_mv;
    uint8_t operation, zero;
    uint16_t count;
  } request;
  struct __attribute__((packed)) {
    uint64_t cycle;
    uint32_t enable_high;
    uint8_t direction, enable, state, zero;
    uint16_t count;
  } answer = {0};
  static board_t board;
  static uint8_t bytes[QUEUE];
  avr_global_logger_set(quiet);
  if (!freopen("/dev/null", "w", stderr)) return 2;  /* simavr's hex reader warns of the start address record */
  if (argc < 2 || !load(&board, argv[1], argc > 2 ? argv[2] : "")) {
    return 2;
  }
  while (take(&request, sizeof request) && take(bytes, request.count)) {
    if (request.operation == RESET || request.operation == POWER_CYCLE) restart(&board, request.operation == RESET);
    if (request.operation == PAINT_RAM)
      memset(board.avr->data + board.painted_from, PAINT, RAM_END - 64 - board.painted_from);
    board.avr->vcc = board.avr->avcc = request.supply_mv;
    for (int i = 0; i < 4; i++) avr_raise_irq(board.adc + i, request.inputs_mv[i]);
    for (unsigned i = 0; i < request.count; i++) board.in[board.in_head++ % QUEUE] = bytes[i];
    answer.state = step(&board, request.cycles);
    answer.cycle = board.avr->cycle;
    answer.enable_high = request.operation == MEASURE_RAM ? untouched_ram(&board) : board.enable_high;
    answer.direction = direction_pins(&board);
    answer.enable = board.enable;
    answer.count = board.out_count;
    fwrite(&answer, sizeof answer, 1, stdout);
    fwrite(board.out, 1, board.out_count, stdout);
    fflush(stdout);
  }
  return 0;
}
