// Reads an MCAP file with the libraries that Foxglove reads it with, through its index, and prints what is in it.
import { open } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader as OneReader } from "@foxglove/rosmsg-serialization";
import { MessageReader as TwoReader } from "@foxglove/rosmsg2-serialization";

const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const buffer = new Uint8Array(Number(length));
    await file.read(buffer, 0, buffer.length, Number(offset));
    return buffer;
  },
};
const reader = await McapIndexedReader.Initialize({ readable });
const readers = new Map();
const properties = {};
for (const [id, { name, encoding, data }] of reader.schemasById) {
  if (encoding === "jsonschema") {
    const schema = JSON.parse(new TextDecoder().decode(data));
    if (schema.type !== "object") throw new Error(`${name} is described as ${schema.type}`);
    properties[name] = schema.properties;
    continue;
  }
  const ros2 = encoding === "ros2msg";
  const definitions = parse(new TextDecoder().decode(data), { ros2 });
  readers.set(id, ros2 ? new TwoReader(definitions) : new OneReader(definitions));
  if (!ros2 && encoding !== "ros1msg") throw new Error(`${name} is described as ${encoding}`);
}
const messages = [];
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  if (channel.messageEncoding === "json") {
    const data = JSON.parse(new TextDecoder().decode(message.data));
    messages.push({ topic: channel.topic, time: String(message.logTime), sequence: message.sequence, data, label: null });
    continue;
  }
  const value = readers.get(channel.schemaId).readMessage(message.data);
  const data = typeof value.data === "string" ? value.data : [...value.data];
  const label = value.layout?.dim[0].label ?? null;
  messages.push({ topic: channel.topic, time: String(message.logTime), sequence: message.sequence, data, label });
}
await file.close();
console.log(JSON.stringify({ profile: reader.header.profile, messages, properties }));
