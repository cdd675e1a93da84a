// Reads an MCAP file with nothing but what it says about itself, and prints a summary as JSON:
//   node read.mjs FILE
import { readFileSync } from "node:fs";
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader } from "@foxglove/omgidl-serialization";
import { McapStreamReader } from "@mcap/core";

const stream = new McapStreamReader();
stream.append(readFileSync(process.argv[2]));
const schemas = new Map();
const channels = new Map();
const out = { messages: [] };
for (let record; (record = stream.nextRecord()); ) {
  switch (record.type) {
    case "Header":
      out.profile = record.profile;
      out.library = record.library;
      break;
    case "Schema":
      if (record.encoding !== "omgidl") throw new Error(`schema encoding ${record.encoding}`);
      schemas.set(
        record.id,
        new MessageReader(record.name, parseIDL(new TextDecoder().decode(record.data))),
      );
      break;
    case "Channel":
      if (record.messageEncoding !== "cdr") throw new Error(`message encoding ${record.messageEncoding}`);
      channels.set(record.id, record);
      break;
    case "Message": {
      const channel = channels.get(record.channelId);
      out.messages.push({
        topic: channel.topic,
        logTime: record.logTime,
        publishTime: record.publishTime,
        content: schemas.get(channel.schemaId).readMessage(record.data),
      });
      break;
    }
    case "Statistics":
      out.statistics = { messages: record.messageCount, channels: record.channelCount };
      break;
  }
}
if (!stream.done()) throw new Error("the file has no proper end");
const plain = (key, value) => {
  if (typeof value === "bigint") return value.toString();
  if (value instanceof Uint8Array) return Buffer.from(value).toString("hex");
  if (ArrayBuffer.isView(value)) return Array.from(value, (each) => plain("", each));
  return value;
};
console.log(JSON.stringify(out, plain));
