// Plays a recording of tests/web in the WebAssembly module: node replay.mjs MODULE TRACE. Prints the client's status,
// "frameMs" in it, and the bytes of memory that the module took.

import { readFileSync } from "node:fs";

const [, , file, recording] = process.argv;
const time = { now: 0 };
const { exports: module } = await WebAssembly.instantiate(new WebAssembly.Module(readFileSync(file)), {
  tandem: { clock_ms: () => performance.now(), log: () => {} },
});
module._initialize();
const self = module.tandem_create(77n, 1, 1);
module.tandem_connected(self);
const poll = () => {
  module.tandem_poll(self, time.now, time.now);
  let asked = false;
  while (module.tandem_next_message(self) > 0) asked = true;
  module.tandem_take_events(self);
  return asked;
};
const SNAPSHOT = 4;
const trace = readFileSync(recording);
for (let at = 0; at < trace.length; ) {
  const size = trace.readUInt32LE(at + 8);
  const message = trace.subarray(at + 12, at + 12 + size);
  time.now = Math.max(time.now, trace.readDoubleLE(at));
  if (message[0] === SNAPSHOT) do ++time.now; while (!poll());
  const input = module.tandem_input(self, size);
  new Uint8Array(module.memory.buffer, input, size).set(message);
  if (module.tandem_receive(self) !== 0) process.exit(1);
  poll();
  at += 12 + size;
}
const size = module.tandem_status(self);
const json = new TextDecoder().decode(new Uint8Array(module.memory.buffer, module.tandem_output(self), size));
console.log(JSON.stringify({ ...JSON.parse(json), memoryBytes: module.memory.buffer.byteLength }));
