#include "drivers/modbus/modbus_config.h"

#include <array>
#include <string_view>

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 2> kWordOrders = {"ABCD", "CDAB"};
constexpr std::array<std::string_view, 3> kParities = {"none", "even", "odd"};

using C = ModbusConfig;

constexpr std::array kFields = {
    text_field<&C::listen_address>("listen_address",
                                   "IPv4 address to listen on; empty: no Modbus TCP"),
    number_field<&C::port>("port", "", 0, 65535, "TCP port; 0 takes any free one"),
    texts_field<&C::control_peers>("control_peers",
                                   "addresses or networks that may write the command block"),
    texts_field<&C::read_peers>("read_peers", "addresses or networks that may only read"),
    numbers_field<&C::unit_ids>("unit_ids", "", 0, 255, "unit ids that are ours"),
    bool_field<&C::strict_unit_id>("strict_unit_id",
                                   "answer exception 0x0B to other unit ids instead of serving"),
    number_field<&C::max_connections>("max_connections", "", 2, 64,
                                      "TCP connections at most; one is kept for control"),
    choice_field<&C::word_order>("word_order", kWordOrders,
                                 "order of the two registers of every 32-bit value"),
    number_field<&C::control_idle_limit_s>("control_idle_limit_s", "s", 0, 86400,
                                           "drop a silent control peer after this; 0 never"),
    number_field<&C::read_idle_limit_s>("read_idle_limit_s", "s", 0, 86400,
                                        "drop a silent read peer after this; 0 never"),
    text_field<&C::rtu_device>("rtu_device", "serial device; empty: no Modbus RTU"),
    number_field<&C::rtu_baud>("rtu_baud", "", 1200, 921600, "a standard serial rate"),
    choice_field<&C::rtu_parity>("rtu_parity", kParities, "serial parity"),
    number_field<&C::rtu_stop_bits>("rtu_stop_bits", "", 1, 2, "serial stop bits"),
    number_field<&C::rtu_slave_id>("rtu_slave_id", "", 1, 247, "our slave id on the serial line"),
    number_field<&C::rtu_silence_us>("rtu_silence_us", "us", 0, 100000,
                                     "silence that ends a frame; 0: 3.5 characters"),
};

}  // namespace

FieldTable modbus_fields() noexcept { return kFields; }

}  // namespace grapnel
