#include "drivers/modbus/modbus_config.h"

#include <gtest/gtest.h>

#include "base/config.h"

namespace grapnel {
namespace {

ModbusConfig read(const char* text) {
  const ConfigTable table = parse_config(text, "grapnel.toml");
  ModbusConfig config;
  ConfigReader reader(table);
  reader.take_fields(modbus_fields(), &config);
  reader.finish();
  return config;
}

TEST(ModbusConfig, ReadsEveryKindOfKey) {
  const ModbusConfig config = read(
      "port = 1502\nlisten_address = \"10.0.0.5\"\ncontrol_peers = [\"10.0.0.1\"]\n"
      "read_peers = [\"10.0.1.0/24\", \"10.0.2.2\"]\nunit_ids = [1, 17]\nword_order = \"CDAB\"\n"
      "rtu_parity = \"none\"\n");
  EXPECT_EQ(config.port, 1502);
  EXPECT_EQ(config.control_peers, (std::vector<std::string>{"10.0.0.1"}));
  EXPECT_EQ(config.read_peers.size(), 2u);
  EXPECT_EQ(config.unit_ids, (std::vector<double>{1, 17}));
  EXPECT_EQ(config.word_order, WordOrder::Cdab);
  EXPECT_EQ(config.rtu_parity, SerialParity::None);
}

TEST(ModbusConfig, RefusesValuesOutOfRangeWithTheirLine) {
  for (const char* text :
       {"\nport = 70000", "\nmax_connections = 1", "\nword_order = \"BADC\"", "\nunit_ids = [256]",
        "\nrtu_slave_id = 0", "\nprot = 1", "\ncontrol_peers = \"10.0.0.1\""}) {
    try {
      static_cast<void>(read(text));
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("grapnel.toml:2"), std::string::npos)
          << error.what();
    }
  }
}

TEST(ModbusConfig, ListensOnlyOnLoopbackAndLetsOnlyLoopbackInByDefault) {
  const ModbusConfig config;
  EXPECT_EQ(config.listen_address, "127.0.0.1");
  EXPECT_EQ(config.control_peers, (std::vector<std::string>{"127.0.0.1"}));
  EXPECT_TRUE(config.read_peers.empty());
}

}  // namespace
}  // namespace grapnel
