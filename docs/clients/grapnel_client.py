#!/usr/bin/env python3
"""Grapnel over Modbus TCP, registers decoded by name. Standard library only.

Generated from drivers/modbus/register_map.toml by grapnel-codegen. Do not edit.
Usage: grapnel_client.py HOST[:PORT] [COUNT]     triggers COUNT times and prints each result
"""
import socket
import struct
import sys
import time

# block: (first address, registers, distance to the next of its kind, {name: (address, type, count, scale)})
BLOCKS = {
    "command": (0, 32, 0, {
        "CMD_SEQ": (0, "u16", 1, 1), "CMD_CODE": (1, "u16", 1, 1), "PRESET_ID": (2, "u16", 1, 1),
        "MODEL_ID": (3, "u16", 1, 1), "MAX_OBJECTS": (4, "u16", 1, 1), "OPTIONS": (5, "bits", 1, 1),
        "TIMEOUT_MS": (6, "u16", 1, 1), "POSE_FORMAT": (7, "u16", 1, 1), "ENC_TRIGGER": (8, "u32", 1, 1),
        "PART_TAG": (10, "u32", 1, 1), "ROBOT_POSE": (12, "i32", 7, 1), "HB_IN": (26, "u16", 1, 1),
        "HB_LIMIT_MS": (27, "u16", 1, 1),
    }),
    "status": (100, 20, 0, {
        "MAP_VERSION": (100, "u16", 1, 1), "STATE": (101, "u16", 1, 1), "FLAGS": (102, "bits", 1, 1),
        "HB_OUT": (103, "u16", 1, 1), "ACK_SEQ": (104, "u16", 1, 1), "STATUS_CODE": (105, "u16", 1, 1),
        "STATUS_DETAIL": (106, "u16", 1, 1), "ACTIVE_PRESET": (107, "u16", 1, 1),
        "PRESET_REV": (108, "u16", 1, 1), "ERR_COUNT": (109, "u16", 1, 1), "UPTIME_S": (110, "u32", 1, 1),
        "FRAME_COUNT": (112, "u32", 1, 1), "BOOT_ID": (114, "u16", 1, 1), "ACK_CODE": (115, "u16", 1, 1),
        "RECORDING": (116, "u16", 1, 1),
    }),
    "result": (120, 60, 0, {
        "RES_NO_BEGIN": (120, "u16", 1, 1), "RES_CMD_SEQ": (121, "u16", 1, 1), "N_FOUND": (122, "u16", 1, 1),
        "N_REPORTED": (123, "u16", 1, 1), "FRAME_ID": (124, "u32", 1, 1), "ENC_CAPTURE": (126, "u32", 1, 1),
        "CAPTURE_DELAY_US": (128, "u32", 1, 1), "AGE_US": (130, "u32", 1, 1), "PART_TAG": (132, "u32", 1, 1),
        "RES_CODE": (166, "u16", 1, 1), "RETRIES": (167, "u16", 1, 1), "T_TOTAL_US": (168, "u32", 1, 1),
        "RES_PRESET": (170, "u16", 1, 1), "RES_PRESET_REV": (171, "u16", 1, 1),
        "RES_SEED": (172, "u32", 1, 1), "RES_NO_END": (179, "u16", 1, 1),
    }),
    "further_objects": (200, 40, 40, {
        "OBJ_NO_BEGIN": (200, "u16", 1, 1), "OBJ_NO_END": (239, "u16", 1, 1),
    }),
    "diagnostics": (600, 100, 0, {
        "FRAMES": (600, "u32", 1, 1), "DROPPED_FRAMES": (602, "u32", 1, 1),
        "LOST_PACKETS": (604, "u32", 1, 1), "RECONNECTS": (606, "u32", 1, 1), "JOBS": (608, "u32", 1, 1),
        "JOBS_ACCEPTED": (610, "u32", 1, 1), "JOBS_REJECTED": (612, "u32", 1, 1),
        "DEADLINES_MISSED": (614, "u32", 1, 1), "OVERRUNS": (616, "u32", 1, 1),
        "HEAP_CALLS": (618, "u32", 1, 1), "PAGE_FAULTS": (620, "u32", 1, 1), "CLIENTS": (622, "u32", 1, 1),
        "CONNECTIONS_REFUSED": (624, "u32", 1, 1), "REQUESTS_REFUSED": (626, "u32", 1, 1),
        "EXCEPTIONS_SENT": (628, "u32", 1, 1), "BYTES_DISCARDED": (630, "u32", 1, 1),
        "CONFIG_RELOADS": (632, "u32", 1, 1), "CONFIG_REFUSALS": (634, "u32", 1, 1),
        "BELT_RESIDUAL_UM": (636, "i32", 1, 1), "TILT": (638, "i32", 1, 0.001),
        "SERIAL_HASH": (640, "u32", 1, 1), "BUILD_HASH": (642, "u32", 1, 1),
        "WORST_JOB_US": (644, "u32", 1, 1), "RECORD_FRAMES": (646, "u32", 1, 1),
        "RECORD_MISSED": (648, "u32", 1, 1), "RECORD_DROPPED": (650, "u32", 1, 1),
        "STAGE_US": (660, "u32", 20, 1),
    }),
    "float_mirror": (700, 16, 16, {
        "FLT_NO_BEGIN": (700, "u16", 1, 1), "X_MM": (701, "f32", 1, 1), "Y_MM": (703, "f32", 1, 1),
        "Z_MM": (705, "f32", 1, 1), "R1_REAL": (707, "f32", 1, 1), "R2_REAL": (709, "f32", 1, 1),
        "R3_REAL": (711, "f32", 1, 1), "R4_REAL": (713, "f32", 1, 1), "FLT_NO_END": (715, "u16", 1, 1),
    }),
    "probe": (900, 12, 0, {
        "PROBE_U32": (900, "u32", 1, 1), "PROBE_I32": (902, "i32", 1, 1), "PROBE_F32": (904, "f32", 1, 1),
        "PROBE_AB": (906, "u16", 1, 1), "PROBE_COUNTER": (907, "u32", 1, 1),
    }),
    "object": (0, 32, 0, {
        "MODEL_ID": (0, "u16", 1, 1), "PICK_POINT_ID": (1, "u16", 1, 1), "POSE_FORMAT": (2, "u16", 1, 1),
        "FRAME": (3, "u16", 1, 1), "X": (4, "i32", 1, 0.001), "Y": (6, "i32", 1, 0.001),
        "Z": (8, "i32", 1, 0.001), "R1": (10, "i32", 1, 0), "R2": (12, "i32", 1, 0), "R3": (14, "i32", 1, 0),
        "R4": (16, "i32", 1, 0), "DECISION": (18, "u16", 1, 1), "FITNESS": (19, "u16", 1, 0.0001),
        "RMSE_UM": (20, "u16", 1, 1), "COVERAGE": (21, "u16", 1, 0.0001), "MARGIN": (22, "u16", 1, 0.0001),
        "FREE_SPACE_VIOL": (23, "u16", 1, 0.0001), "SIGMA_UM": (24, "u16", 1, 1),
        "SIGMA_MDEG": (25, "u16", 1, 0.001), "QUALITY": (26, "bits", 1, 1),
        "QUALITY_SCORE": (27, "u16", 1, 1), "OBJ_CODE": (28, "u16", 1, 1), "REASONS": (29, "u32", 1, 1),
    }),
}
OBJECT_1 = 14
OBJECT_LENGTH = 32
POSE_SCALE = {1: 0.001, 2: 0.001, 3: 0.000001, 4: 0.000001, 5: 0.001, 6: 0.001, 7: 0.001}


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
