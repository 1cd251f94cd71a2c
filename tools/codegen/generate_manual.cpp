#include "tools/codegen/generate.h"

namespace grapnel::codegen {
namespace {

constexpr const char* kTop =
    R"(<!-- Generated from drivers/modbus/register_map.toml and base/codes.toml by grapnel-codegen. Do not edit. -->
# Register map for the PLC programmer

Grapnel is a Modbus server (slave); the PLC is the client (master). Functions 3, 4, 6, 16, 23 and 43/14.

- **Addresses** below are 0-based, as they travel on the wire. The 1-based reference of many PLC tools stands
  beside each: 3xxxx for functions 4, 4xxxx for functions 3, 6, 16, 23. Prove yours with the probe block.
- Input registers 100 to 911 can be read with function 3 at the same addresses. Gaps inside read 0; any other
  address answers exception 02. Only 0 to 31 can be written.
- **32-bit values** take two registers, high word first, bytes big-endian (ABCD). The setting
  `word_order = "CDAB"` puts the low word first, for all of them.
- A read of one block is never torn. Across several reads compare the numbers at the block's ends (…_BEGIN, …_END):
  if they differ, read again.
- **Exceptions are protocol errors only**: 01 function not served or write not authorised, 02 address, 03 count or
  structure, 04 internal, 0B unknown unit id (strict mode). Busy is not an exception: it is ACK_CODE 3002.
- One client owns the command block: the first control peer that writes. Others' writes answer exception 01. Ownership
  passes when its connection or its heartbeat dies. A connection that closes leaves job and result as they are, for the
  PLC that comes back; a heartbeat that dies ends both. Supervise the heartbeat where a dead PLC must stop the device.

## Handshake

Write the parameters and CMD_SEQ in one write (clients with function 6 only: CMD_SEQ last). A **change of CMD_SEQ to a
non-zero value** executes CMD_CODE, once; writing the same value again does nothing, so a repeated telegram is harmless.

*Counting style* (one write a cycle):
1. At start read ACK_SEQ and BOOT_ID; continue counting from ACK_SEQ, 1 to 65535, then 1 again (0 is left out).
2. Write CMD_CODE, parameters, CMD_SEQ = next number.
3. Wait for ACK_SEQ = CMD_SEQ. ACK_CODE 3100: accepted; 30xx: refused, the reason is the code.
4. Wait for FLAGS.DONE with RES_CMD_SEQ = CMD_SEQ. Read the result. RES_CODE is the outcome.

*Four-phase style* (0 and 1 only):
1. Write CMD_SEQ = 1. 2. Wait for ACK_SEQ = 1, then for FLAGS.DONE. 3. Read the result.
4. Write CMD_SEQ = 0. 5. Wait for ACK_SEQ = 0. Next.

The result stays until the next accepted command or command 31. **Act on a pose only when FLAGS.RESULT_VALID is 1 and
the object's DECISION is 1**: otherwise every pose register reads 0x80000000 (-2147483648) and every float NaN. Where the
preset turns surface grasps on, DECISION 2 and OBJ_CODE 1104 give the pose of a grasp on the top of an object that no model
fits (z into the surface, x along its length, PICK_POINT_ID 0): act on it only if the gripper may take an object anywhere.
A sensor that moved, warms up, is not the calibrated one or has lost its clock gives no pose: RES_CODE is then its 20xx.
REPLAY in FLAGS: the data is not live.

*Restarts.* A changed BOOT_ID voids every pending handshake: the device starts with token 0, so the first other token that
it is written executes. A PLC that writes the block every cycle writes CMD_SEQ = 0 until it has seen the new BOOT_ID. After
a restart of the PLC's own program a token equal to ACK_SEQ is no change and executes nothing: count on from ACK_SEQ, or
write 0 first.

*Encoder.* Write the count latched with the part sensor to ENC_TRIGGER together with the token. ENC_CAPTURE equals it, and
the belt has moved on by speed × CAPTURE_DELAY_US until the camera looked. If the PLC also streams the live count to
ENC_TRIGGER at 50 Hz or faster, in writes of these two registers and no other, ENC_CAPTURE is the count at mid-exposure,
interpolated between the counts received before and after it; where these are over 50 ms apart it equals ENC_TRIGGER. The
time of a count is that of its arrival. A write that covers more registers is never taken for a live count.

*Heartbeats.* HB_OUT advances every 100 ms while all threads of the device make progress. If HB_LIMIT_MS is not 0, HB_IN must
change within it; else the job is aborted, the result voided, STATUS_CODE is 3007 and command 10 is needed.
)";

std::string reference(int base, int address) { return std::to_string(base + address); }

std::string address_text(int first, int last) {
  return first == last ? std::to_string(first) : std::to_string(first) + "-" + std::to_string(last);
}

std::string register_row(const RegisterRow& row, bool writable, bool absolute) {
  std::string out = "| " + address_text(row.address, row.end() - 1) + " | ";
  if (absolute) {
    out += writable ? reference(40001, row.address)
                    : reference(30001, row.address) + " / " + reference(40001, row.address);
    out += " | ";
  }
  out += row.name + " | " + (row.count > 1 ? std::to_string(row.count) + " × " : "") + row.type +
         " | ";
  if (row.scale != 1.0) out += row.scale == 0.0 ? "by format" : scale_text(row.scale);
  if (!row.unit.empty()) out += (row.scale != 1.0 ? " " : "") + row.unit;
  out += " | " + row.meaning;
  if (!row.bits.empty()) {
    out += ":";
    for (const std::string& bit : row.bits) out += (bit == row.bits[0] ? " b" : ", b") + bit;
  }
  return out + " |\n";
}

std::string block_section(const BlockRow& block) {
  const bool writable = block.access != "read";
  std::string out = "\n## " + block.title + " — " + (writable ? "holding " : "input ") +
                    address_text(block.first, block.last) + ", " + block.access + "\n\n" +
                    block.note + "\n\n| address | " + (writable ? "4x" : "3x / 4x") +
                    " | name | type | scale, unit | meaning |\n"
                    "| --- | --- | --- | --- | --- | --- |\n";
  for (const RegisterRow& row : block.registers) out += register_row(row, writable, true);
  return out;
}

std::string record_section(const RecordRow& record) {
  std::string out = "\n## " + record.title + " — " + std::to_string(record.length) +
                    " registers, offsets\n\n" + record.note +
                    "\n\n| offset | name | type | scale, unit | meaning |\n"
                    "| --- | --- | --- | --- | --- |\n";
  for (const RegisterRow& row : record.registers) out += register_row(row, false, false);
  return out;
}

std::string format_section(const std::vector<PoseFormatRow>& formats) {
  std::string out =
      "\n## Pose formats\n\nPositions are um in every format. Frames are right-handed. At a "
      "singularity the last angle of formats 1, 5 and 6 (the first\nof format 2) is 0.\n\n"
      "| id | R1… | scale, unit | rotation | used by |\n| --- | --- | --- | --- | --- |\n";
  for (const PoseFormatRow& row : formats) {
    out += "| " + std::to_string(row.id) + " | " + row.parameters + " | " + scale_text(row.scale) +
           (row.unit.empty() ? "" : " " + row.unit) + " | " + row.rotation + " | " + row.brands +
           " |\n";
  }
  return out;
}

}  // namespace

std::string generate_register_manual(const RegisterMap& map, const std::vector<CodeRow>& codes) {
  std::string out = kTop;
  out += "\nMap version " + std::to_string(map.major) + "." + std::to_string(map.minor) +
         " (MAP_VERSION = " + std::to_string(map.major * 256 + map.minor) + ").\n";
  for (const BlockRow& block : map.blocks) {
    out += block_section(block);
    if (block.id == "result") out += record_section(map.record);
  }
  out += "\n## Commands\n\n| CMD_CODE | name | meaning |\n| --- | --- | --- |\n";
  for (const CommandRow& row : map.commands) {
    out += "| " + std::to_string(row.code) + " | " + row.name + " | " + row.meaning + " |\n";
  }
  out += format_section(map.pose_formats);
  out += "\n## Codes\n\nMeaning and remedy of each: [status-codes.md](status-codes.md).\n\n";
  std::string separator;
  for (const CodeRow& code : codes) {
    out += separator + std::to_string(code.number) + " " + code.text;
    separator = code.number / 1000 != (&code)[&code != &codes.back() ? 1 : 0].number / 1000 ? "\n\n"
                                                                                            : " · ";
  }
  return out + "\n";
}

}  // namespace grapnel::codegen
