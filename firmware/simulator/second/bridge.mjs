// The firmware in avr8js, behind the pipe of ../bridge.c:  node bridge.mjs FIRMWARE.elf   (reads FIRMWARE.hex)
// Only operation 0 (run) is offered; sleep is simulated as doing nothing, so this is slower than simavr.
import { readFileSync, readSync, writeSync } from 'node:fs';
import {
  CPU, AVRADC, AVRClock, AVRIOPort, AVRTimer, AVRUSART, AVRWatchdog, adcConfig, avrInstruction, clockConfig,
  portBConfig, portDConfig, timer0Config, timer1Config, timer2Config, usart0Config, watchdogConfig, PinState,
} from 'avr8js';

const HZ = 16e6;
const QUERY = 18, ANSWER = 18;

function loadHex(path) {
  const bytes = new Uint8Array(0x8000).fill(0xff);
  for (const line of readFileSync(path, 'ascii').split(/\r?\n/)) {
    if (!line.startsWith(':') || line.slice(7, 9) !== '00') continue;
    const count = parseInt(line.slice(1, 3), 16), address = parseInt(line.slice(3, 7), 16);
    for (let i = 0; i < count; i++) bytes[address + i] = parseInt(line.slice(9 + 2 * i, 11 + 2 * i), 16);
  }
  return new Uint16Array(bytes.buffer);
}

const cpu = new CPU(loadHex(process.argv[2].replace(/\.elf$/, '.hex')));
const portB = new AVRIOPort(cpu, portBConfig), portD = new AVRIOPort(cpu, portDConfig);
for (const config of [timer0Config, timer1Config, timer2Config]) new AVRTimer(cpu, config);
const adc = new AVRADC(cpu, adcConfig);
const usart = new AVRUSART(cpu, usart0Config, HZ);
new AVRWatchdog(cpu, watchdogConfig, new AVRClock(cpu, HZ, clockConfig));

let enable = false, since = 0, high = 0;
portB.addListener(() => {
  const level = portB.pinState(1) === PinState.High;
  if (level === enable) return;
  if (level) since = cpu.cycles;
  else high += cpu.cycles - since;
  enable = level;
});
const incoming = [], outgoing = [];
usart.onByteTransmit = (byte) => outgoing.push(byte);
const feed = () => { if (incoming.length && !usart.rxBusy && usart.rxEnable) usart.writeByte(incoming.shift()); };

function take(count) {
  const buffer = Buffer.alloc(count);
  for (let got = 0; got < count;) {
    const more = readSync(0, buffer, got, count - got, null);
    if (more === 0) process.exit(0);
    got += more;
  }
  return buffer;
}

for (;;) {
  const query = take(QUERY);
  const count = query.readUInt16LE(16);
  if (count) incoming.push(...take(count));
  adc.avcc = query.readUInt16LE(12) / 1000;
  for (let i = 0; i < 4; i++) adc.channelValues[i] = query.readUInt16LE(4 + 2 * i) / 1000;
  const end = cpu.cycles + query.readUInt32LE(0);
  high = 0;
  if (enable) since = cpu.cycles;
  while (cpu.cycles < end) {
    avrInstruction(cpu);
    cpu.tick();
    feed();
  }
  if (enable) high += cpu.cycles - since;
  const answer = Buffer.alloc(ANSWER);
  answer.writeBigUInt64LE(BigInt(cpu.cycles), 0);
  answer.writeUInt32LE(high, 8);
  const forward = portD.pinState(7) === PinState.High, reverse = portB.pinState(0) === PinState.High;
  answer.writeUInt8(Number(forward) | (Number(reverse) << 1), 12);
  answer.writeUInt8(Number(enable), 13);
  answer.writeUInt16LE(outgoing.length, 16);
  writeSync(1, Buffer.concat([answer, Buffer.from(outgoing.splice(0))]));
}
