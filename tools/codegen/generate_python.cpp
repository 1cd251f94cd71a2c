#include "tools/codegen/generate.h"

namespace grapnel::codegen {
namespace {

constexpr const char* kTop =
    R"PY(#!/usr/bin/env python3
"""Grapnel over Modbus TCP, registers decoded by name. Standard library only.

Generated from drivers/modbus/register_map.toml by grapnel-codegen. Do not edit.
Usage: grapnel_client.py HOST[:PORT] [COUNT]     triggers COUNT times and prints each result
"""
import socket
import struct
import sys
import time

# block: (first address, registers, distance to the next of its kind, {name: (address, type, count, scale)})
)PY";

constexpr const char* kEnd = R"PY(

class Grapnel:
    def __init__(self, host, port=502, unit=1, word_order="ABCD", timeout=2.0):
        self.unit, self.low_first, self.transaction = unit, word_order == "CDAB", 0
        self.socket = socket.create_connection((host, port), timeout)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _receive(self, count):
        data = b""
        while len(data) < count:
            part = self.socket.recv(count - len(data))
            if not part:
                raise ConnectionError("connection closed by the device")
            data += part
        return data

    def request(self, pdu):
        self.transaction = (self.transaction + 1) & 0xFFFF
        self.socket.sendall(struct.pack(">HHHB", self.transaction, 0, len(pdu) + 1, self.unit) + pdu)
        transaction, _, length, _ = struct.unpack(">HHHB", self._receive(7))
        answer = self._receive(length - 1)
        if transaction != self.transaction:
            raise ConnectionError("answer to another request")
        if answer[0] & 0x80:
            raise IOError("Modbus exception %02d" % answer[1])
        return answer

    def read_words(self, address, count, function=4):
        answer = self.request(struct.pack(">BHH", function, address, count))
        return list(struct.unpack(">%dH" % count, answer[2:]))

    def write_words(self, address, words):
        head = struct.pack(">BHHB", 16, address, len(words), 2 * len(words))
        self.request(head + struct.pack(">%dH" % len(words), *words))

    def _value(self, words, kind, scale):
        if kind in ("u16", "bits"):
            raw = words[0]
        else:
            high, low = (words[1], words[0]) if self.low_first else (words[0], words[1])
            code = {"u32": ">I", "i32": ">i", "f32": ">f"}[kind]
            raw = struct.unpack(code, struct.pack(">HH", high, low))[0]
        if kind == "i32" and raw == -2**31:
            return float("nan")
        return raw if scale == 1 else raw * scale

    def decode(self, block, words):
        first, _, _, registers = BLOCKS[block]
        values = {}
        for name, (address, kind, count, scale) in registers.items():
            size = 1 if kind in ("u16", "bits") else 2
            at = [address - first + size * i for i in range(count)]
            scale = scale or POSE_SCALE.get(values.get("POSE_FORMAT"), 1)
            items = [self._value(words[i:i + size], kind, scale) for i in at]
            values[name] = items[0] if count == 1 else items
        return values

    def read(self, block, index=0):
        first, count, stride, _ = BLOCKS[block]
        function = 3 if block == "command" else 4
        return self.decode(block, self.read_words(first + stride * index, count, function))

    def result(self):
        """The result block and its objects, all of one result."""
        while True:
            words = self.read_words(BLOCKS["result"][0], BLOCKS["result"][1])
            result = self.decode("result", words)
            result["objects"] = [self.decode("object", words[OBJECT_1:OBJECT_1 + OBJECT_LENGTH])]
            numbers = {result["RES_NO_BEGIN"], result["RES_NO_END"]}
            for index in range(result["N_REPORTED"] - 1):
                first, count, stride, _ = BLOCKS["further_objects"]
                words = self.read_words(first + stride * index, stride)
                numbers |= {words[0], words[stride - 1]}
                result["objects"].append(self.decode("object", words[1:1 + OBJECT_LENGTH]))
            result["objects"] = result["objects"][:result["N_REPORTED"]]
            if len(numbers) == 1:
                return result

    def command(self, code, wait_done=True, timeout=10.0, **parameters):
        """Sends a command; returns (ACK_CODE, status). 32-bit parameters as in the table."""
        first, count, _, registers = BLOCKS["command"]
        words = self.read_words(first, count, 3)
        boot = self.read("status")["BOOT_ID"]
        parameters.update(CMD_CODE=code, CMD_SEQ=words[0] % 65535 + 1)
        for name, value in parameters.items():
            address, kind, _, _ = registers[name]
            pair = [value >> 16 & 0xFFFF, value & 0xFFFF]
            pair = pair[1:] if kind in ("u16", "bits") else pair[::-1] if self.low_first else pair
            words[address:address + len(pair)] = pair
        self.write_words(first, words)
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            status = self.read("status")
            if status["BOOT_ID"] != boot:
                raise ConnectionError("the device restarted")
            if status["ACK_SEQ"] == parameters["CMD_SEQ"]:
                if status["ACK_CODE"] != 3100 or not wait_done or status["FLAGS"] & 4:
                    return status["ACK_CODE"], status
            time.sleep(0.002)
        raise TimeoutError("no answer to command %d" % code)


if __name__ == "__main__":
    HOST, _, PORT = sys.argv[1].partition(":")
    DEVICE = Grapnel(HOST, int(PORT or 502))
    for _ in range(int(sys.argv[2]) if len(sys.argv) > 2 else 1):
        ANSWER, _ = DEVICE.command(20)
        print(DEVICE.result() if ANSWER == 3100 else "refused: %d" % ANSWER)
)PY";

std::string registers_text(const std::vector<RegisterRow>& rows) {
  std::string out;
  std::string line = "       ";
  for (const RegisterRow& row : rows) {
    const std::string item = " \"" + row.name + "\": (" + std::to_string(row.address) + ", \"" +
                             row.type + "\", " + std::to_string(row.count) + ", " +
                             scale_text(row.scale) + "),";
    if (line.size() + item.size() > 110) {
      out += line + "\n";
      line = "       ";
    }
    line += item;
  }
  return out + line + "\n    }),\n";
}

}  // namespace

std::string generate_python_client(const RegisterMap& map) {
  std::string out = kTop;
  out += "BLOCKS = {\n";
  for (const BlockRow& block : map.blocks) {
    const int length = block.stride != 0 ? block.stride : block.last - block.first + 1;
    out += "    \"" + block.id + "\": (" + std::to_string(block.first) + ", " +
           std::to_string(length) + ", " + std::to_string(block.stride) + ", {\n" +
           registers_text(block.registers);
  }
  out += "    \"" + map.record.id + "\": (0, " + std::to_string(map.record.length) + ", 0, {\n" +
         registers_text(map.record.registers) + "}\n";
  const BlockRow& result = map.block("result");
  out += "OBJECT_1 = " + std::to_string(result.record_first - result.first) + "\n";
  out += "OBJECT_LENGTH = " + std::to_string(map.record.length) + "\n";
  out += "POSE_SCALE = {";
  for (const PoseFormatRow& row : map.pose_formats) {
    out += (row.id == 1 ? "" : ", ") + std::to_string(row.id) + ": " + scale_text(row.scale);
  }
  return out + "}\n" + kEnd;
}

}  // namespace grapnel::codegen
