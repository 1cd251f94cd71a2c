// What udev does to a camera with our rule file, and with Debian's that open it to everybody.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace grapnel {
namespace {

using Properties = std::map<std::string, std::string>;

/// udev(7), as far as these files use it: matches (== and !=), assignments (= and, final, :=),
/// GOTO and LABEL, one rule a line.
class Udev {
 public:
  Properties device;  ///< keys that are matched
  Properties set;     ///< what was assigned

  void apply(const std::string& file) {
    std::ifstream stream(file);
    ASSERT_TRUE(stream.is_open()) << file;
    std::string skip_to;
    for (std::string line; std::getline(stream, line);) {
      if (line.empty() || line[0] == '#') continue;
      apply_line(line, skip_to);
    }
    EXPECT_EQ(skip_to, "") << "a label is missing";
  }
  void apply_line(const std::string& line, std::string& skip_to) {
    static const std::regex kToken(R"re(([A-Z]+(?:\{[^}]*\})?)\s*(==|!=|:=|=)\s*"([^"]*)")re");
    std::string go_to;
    for (std::sregex_iterator token(line.begin(), line.end(), kToken), end; token != end; ++token) {
      const std::string key = (*token)[1];
      const std::string how = (*token)[2];
      const std::string value = (*token)[3];
      if (key == "LABEL" && value == skip_to) skip_to.clear();
      if (!skip_to.empty() || key == "LABEL") return;
      if (how == "==" || how == "!=") {
        if (matches(key, value) != (how == "==")) return;
      } else if (key == "GOTO") {
        go_to = value;
      } else if (!final_.contains(key)) {
        set[key] = value;
        if (how == ":=") final_.insert(key);
      }
    }
    skip_to = go_to;
  }

 private:
  [[nodiscard]] bool matches(const std::string& key, const std::string& values) const {
    const auto found = device.find(key == "TEST" ? "TEST{" + values + "}" : key);
    if (found == device.end()) return false;
    if (key == "TEST") return true;
    std::stringstream alternatives(values);
    for (std::string value; std::getline(alternatives, value, '|');) {
      if (value == found->second) return true;
    }
    return false;
  }

  std::set<std::string> final_;
};

Udev plugged_in(const std::string& vendor, const std::string& product) {
  Udev udev;
  udev.device = {
      {"ACTION", "add"},          {"SUBSYSTEM", "usb"},         {"ENV{DEVTYPE}", "usb_device"},
      {"ATTR{idVendor}", vendor}, {"ATTR{idProduct}", product}, {"TEST{power/control}", ""}};
  return udev;
}

const std::string kRules = GRAPNEL_SOURCE_DIR "/systemd/60-grapnel-camera.rules";

TEST(UdevRule, GivesTheCamerasToTheirGroupAloneAndKeepsThemAwake) {
  const std::vector<std::pair<std::string, std::string>> cameras = {
      {"045e", "02ae"}, {"045e", "02b0"}, {"045e", "02ad"}, {"045e", "02bf"},
      {"045e", "02be"}, {"1d27", "0600"}, {"1d27", "0609"}};
  for (const auto& [vendor, product] : cameras) {
    Udev udev = plugged_in(vendor, product);
    udev.apply(kRules);
    EXPECT_EQ(udev.set["MODE"], "0660") << vendor << ':' << product;
    EXPECT_EQ(udev.set["GROUP"], "grapnel-camera");
    EXPECT_EQ(udev.set["ATTR{power/control}"], "on");
  }
}

TEST(UdevRule, LeavesOtherDevicesAlone) {
  Udev udev = plugged_in("046d", "c077");
  udev.apply(kRules);
  EXPECT_TRUE(udev.set.empty());
}

TEST(UdevRule, GuardsADeviceThatHasNoPowerSwitchToo) {
  Udev udev = plugged_in("045e", "02ae");
  udev.device.erase("TEST{power/control}");
  udev.apply(kRules);
  EXPECT_EQ(udev.set["MODE"], "0660");
}

TEST(UdevRule, IsNotUndoneByTheLibrariesOwnRules) {
  // udev reads rule files in the order of their names.
  EXPECT_LT(kRules.substr(kRules.rfind('/') + 1), "60-libfreenect0.5.rules");
  Udev udev = plugged_in("045e", "02ae");
  udev.apply(kRules);
  std::string skip;
  udev.apply_line(R"(SUBSYSTEM=="usb", GROUP="plugdev", MODE="0666")", skip);
  udev.apply_line(R"(SUBSYSTEM=="usb", MODE:="0666", OWNER:="root", GROUP:="video")", skip);
  EXPECT_EQ(udev.set["MODE"], "0660");
  EXPECT_EQ(udev.set["GROUP"], "grapnel-camera");
}

}  // namespace
}  // namespace grapnel
