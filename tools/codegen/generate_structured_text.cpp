#include "base/input_error.h"
#include "tools/codegen/generate.h"

namespace grapnel::codegen {
namespace {

constexpr const char* kTop =
    R"ST((* Generated from drivers/modbus/register_map.toml by grapnel-codegen. Do not edit. *)
(* CODESYS / IEC 61131-3. Map the Modbus master's channels to the two arrays:
   function 4, input registers 100 to 179, cyclic  -> aStatus
   function 16, holding registers 0 to 31, cyclic  <- aCommand
   A rising edge of xExecute runs one job. A pose is valid only while xAccepted is TRUE. *)
FUNCTION_BLOCK GRAPNEL
VAR_INPUT
    xExecute      : BOOL;
    uiCommand     : UINT := 20;        (* CMD_CODE *)
    uiPreset      : UINT := 0;         (* 0 = keep *)
    uiPoseFormat  : UINT := 0;         (* 0 = preset value *)
    udiEncoder    : UDINT := 0;
    udiPartTag    : UDINT := 0;
    uiHeartbeatMs : UINT := 0;         (* 0 = not supervised *)
    tLimit        : TIME := T#10S;
    xLowWordFirst : BOOL := FALSE;     (* word_order = CDAB *)
    aStatus       : ARRAY[100..179] OF WORD;
END_VAR
VAR_OUTPUT
    aCommand  : ARRAY[0..31] OF WORD;
    xBusy     : BOOL;
    xDone     : BOOL;                  (* the job ended; uiCode is its outcome *)
    xAccepted : BOOL;                  (* object 1 accepted: the pose may be used *)
    xError    : BOOL;                  (* refused, timed out, or the device restarted *)
    uiCode    : UINT;                  (* RES_CODE, or ACK_CODE when refused; 0 = time-out *)
    uiModel   : UINT;
    uiFormat  : UINT;
    aPose     : ARRAY[0..6] OF DINT;   (* X Y Z in um, R1 to R4 scaled by uiFormat *)
    rFitness  : REAL;
    xLive     : BOOL;                  (* HB_OUT moved within one second *)
END_VAR
VAR
    fbEdge  : R_TRIG;
    fbLimit : TON;
    fbBeat  : TON;
    iStep   : INT := 0;
    uiToken : UINT;
    uiBoot  : UINT;
    uiBeat  : UINT;
    i       : INT;
END_VAR
VAR CONSTANT
)ST";

constexpr const char* kBody = R"ST(END_VAR

fbEdge(CLK := xExecute);
fbLimit(IN := iStep > 0, PT := tLimit);
fbBeat(IN := uiBeat = WORD_TO_UINT(aStatus[cHB_OUT]), PT := T#1S);
uiBeat := WORD_TO_UINT(aStatus[cHB_OUT]);
xLive := NOT fbBeat.Q;
aCommand[cHB_IN] := UINT_TO_WORD(WORD_TO_UINT(aCommand[cHB_IN]) + 1);
aCommand[cHB_LIMIT_MS] := UINT_TO_WORD(uiHeartbeatMs);

CASE iStep OF
0:  (* idle *)
    IF fbEdge.Q THEN
        uiToken := WORD_TO_UINT(aCommand[cCMD_SEQ]);
        IF uiToken = 0 THEN uiToken := WORD_TO_UINT(aStatus[cACK_SEQ]); END_IF
        IF uiToken = 65535 THEN uiToken := 1; ELSE uiToken := uiToken + 1; END_IF
        uiBoot := WORD_TO_UINT(aStatus[cBOOT_ID]);
        aCommand[cCMD_CODE] := UINT_TO_WORD(uiCommand);
        aCommand[cPRESET_ID] := UINT_TO_WORD(uiPreset);
        aCommand[cPOSE_FORMAT_IN] := UINT_TO_WORD(uiPoseFormat);
        PutDword(cENC_TRIGGER, UDINT_TO_DWORD(udiEncoder));
        PutDword(cPART_TAG_IN, UDINT_TO_DWORD(udiPartTag));
        aCommand[cCMD_SEQ] := UINT_TO_WORD(uiToken);
        xBusy := TRUE; xDone := FALSE; xAccepted := FALSE; xError := FALSE; uiCode := 0;
        iStep := 10;
    END_IF
10: (* accepted or refused? *)
    IF WORD_TO_UINT(aStatus[cACK_SEQ]) = uiToken THEN
        IF WORD_TO_UINT(aStatus[cACK_CODE]) = 3100 THEN
            iStep := 20;
        ELSE
            uiCode := WORD_TO_UINT(aStatus[cACK_CODE]);
            xError := TRUE;
        END_IF
    END_IF
20: (* finished? *)
    IF aStatus[cFLAGS].2 AND WORD_TO_UINT(aStatus[cRES_CMD_SEQ]) = uiToken
            AND aStatus[cRES_NO_BEGIN] = aStatus[cRES_NO_END] THEN
        uiCode := WORD_TO_UINT(aStatus[cRES_CODE]);
        xAccepted := aStatus[cFLAGS].3 AND aStatus[cOBJECT + cDECISION] = 1;
        uiModel := WORD_TO_UINT(aStatus[cOBJECT + cMODEL_ID]);
        uiFormat := WORD_TO_UINT(aStatus[cOBJECT + cPOSE_FORMAT]);
        rFitness := UINT_TO_REAL(WORD_TO_UINT(aStatus[cOBJECT + cFITNESS])) * 0.0001;
        FOR i := 0 TO 6 DO
            aPose[i] := DWORD_TO_DINT(GetDword(cOBJECT + cX + 2 * i));
        END_FOR
        xDone := TRUE;
    END_IF
END_CASE

IF iStep > 0 AND (fbLimit.Q OR WORD_TO_UINT(aStatus[cBOOT_ID]) <> uiBoot) THEN xError := TRUE; END_IF
IF xError OR xDone THEN xBusy := FALSE; iStep := 0; END_IF

METHOD PRIVATE GetDword : DWORD
VAR_INPUT iAt : INT; END_VAR
IF xLowWordFirst THEN
    GetDword := SHL(WORD_TO_DWORD(aStatus[iAt + 1]), 16) OR WORD_TO_DWORD(aStatus[iAt]);
ELSE
    GetDword := SHL(WORD_TO_DWORD(aStatus[iAt]), 16) OR WORD_TO_DWORD(aStatus[iAt + 1]);
END_IF
END_METHOD

METHOD PRIVATE PutDword
VAR_INPUT iAt : INT; dwValue : DWORD; END_VAR
IF xLowWordFirst THEN
    aCommand[iAt] := DWORD_TO_WORD(dwValue); aCommand[iAt + 1] := DWORD_TO_WORD(SHR(dwValue, 16));
ELSE
    aCommand[iAt] := DWORD_TO_WORD(SHR(dwValue, 16)); aCommand[iAt + 1] := DWORD_TO_WORD(dwValue);
END_IF
END_METHOD
END_FUNCTION_BLOCK
)ST";

std::uint16_t address_of(const std::vector<RegisterRow>& rows, const std::string& name) {
  for (const RegisterRow& row : rows) {
    if (row.name == name) return row.address;
  }
  throw InputError("register map: register \"" + name + "\" is missing");
}

std::string constant(const std::string& name, int value) {
  return "    c" + name + " : INT := " + std::to_string(value) + ";\n";
}

}  // namespace

std::string generate_structured_text(const RegisterMap& map) {
  std::string out = kTop;
  const auto& command = map.block("command").registers;
  for (const char* name :
       {"CMD_SEQ", "CMD_CODE", "PRESET_ID", "ENC_TRIGGER", "HB_IN", "HB_LIMIT_MS"}) {
    out += constant(name, address_of(command, name));
  }
  out += constant("POSE_FORMAT_IN", address_of(command, "POSE_FORMAT"));
  out += constant("PART_TAG_IN", address_of(command, "PART_TAG"));
  const auto& status = map.block("status").registers;
  for (const char* name : {"FLAGS", "HB_OUT", "ACK_SEQ", "BOOT_ID", "ACK_CODE"}) {
    out += constant(name, address_of(status, name));
  }
  const BlockRow& result = map.block("result");
  for (const char* name : {"RES_NO_BEGIN", "RES_CMD_SEQ", "RES_CODE", "RES_NO_END"}) {
    out += constant(name, address_of(result.registers, name));
  }
  out += constant("OBJECT", result.record_first);
  for (const char* name : {"MODEL_ID", "POSE_FORMAT", "X", "DECISION", "FITNESS"}) {
    out += constant(name, address_of(map.record.registers, name));
  }
  return out + kBody;
}

}  // namespace grapnel::codegen
