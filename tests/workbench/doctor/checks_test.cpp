#include "workbench/doctor/checks.h"

#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

/// A machine's USB tree as sysfs shows it.
class UsbTree {
 public:
  void add(const std::string& name, int bus, const std::string& vendor, const std::string& product,
           const std::string& speed, const std::string& control) {
    const std::filesystem::path folder = folder_ / ("sys/" + name);
    std::filesystem::create_directories(folder / "power");
    const auto write = [&](const char* file, const std::string& text) {
      std::ofstream(folder / file) << text << "\n";
    };
    write("idVendor", vendor);
    write("idProduct", product);
    write("speed", speed);
    write("busnum", std::to_string(bus));
    write("devnum", "7");
    write("serial", "A0" + name);
    write("power/control", control);
  }
  void make_node(const std::string& name) {
    const std::filesystem::path node = folder_ / ("dev/" + name);
    std::filesystem::create_directories(node.parent_path());
    std::ofstream(node) << "";
  }
  [[nodiscard]] SystemRoots roots() const {
    SystemRoots roots;
    roots.usb_devices = folder_ / "sys";
    roots.usb_nodes = folder_ / "dev";
    return roots;
  }

 private:
  test::TempFolder folder_;
};

Finding finding_of(const std::vector<Diagnosis>& found, const std::string& subject) {
  Finding worst = Finding::Well;
  bool seen = false;
  for (const Diagnosis& diagnosis : found) {
    if (diagnosis.subject != subject) continue;
    seen = true;
    worst = std::max(worst, diagnosis.finding);
    EXPECT_EQ(diagnosis.finding == Finding::Well, diagnosis.cure.empty()) << diagnosis.cause;
  }
  EXPECT_TRUE(seen) << subject;
  return worst;
}

TEST(Doctor, FindsNothingWrongWithAKinectThatIsWellConnected) {
  UsbTree tree;
  tree.add("1-1", 1, "045e", "02ae", "480", "on");
  tree.add("1-2", 1, "046d", "c31c", "1.5", "auto");  // a keyboard
  tree.make_node("001/007");
  const std::vector<Diagnosis> found = check_usb(tree.roots());
  EXPECT_EQ(found.size(), 3U);
  for (const char* subject : {"USB link", "permissions", "USB suspend"}) {
    EXPECT_EQ(finding_of(found, subject), Finding::Well);
  }
}

TEST(Doctor, NamesEachFaultOfAUsbConnection) {
  UsbTree tree;
  tree.add("1-1", 1, "045e", "02ae", "12", "auto");
  tree.add("1-2", 1, "1d27", "0601", "480", "on");
  const std::vector<Diagnosis> found = check_usb(tree.roots());
  EXPECT_EQ(finding_of(found, "USB link"), Finding::Bad);
  EXPECT_EQ(finding_of(found, "permissions"), Finding::Bad);
  EXPECT_EQ(finding_of(found, "USB suspend"), Finding::Warning);
  EXPECT_EQ(finding_of(found, "USB bandwidth"), Finding::Bad);
  EXPECT_EQ(finding_of(check_usb(UsbTree().roots()), "USB camera"), Finding::Warning);
}

TEST(Doctor, TellsAFolderThatIsNotThere) {
  const test::TempFolder folder;
  EXPECT_NE(check_disk(folder.path()).finding, Finding::Bad);
  EXPECT_EQ(check_disk(folder / "none").finding, Finding::Bad);
}

TEST(Doctor, TellsAClockThatCountsTicks) {
  const test::TempFolder folder;
  SystemRoots roots;
  roots.clock_source = folder / "source";
  std::ofstream(folder / "source") << "jiffies\n";
  EXPECT_EQ(check_clock(roots).finding, Finding::Bad);
  std::ofstream(folder / "source") << "tsc\n";
  EXPECT_EQ(check_clock(roots).finding, Finding::Well);
}

TEST(Doctor, TellsWhoListensAtThePort) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&at), size), 0);
  ASSERT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&at), &size), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  const int port = ntohs(at.sin_port);
  EXPECT_EQ(check_modbus("127.0.0.1", port).finding, Finding::Well);
  ::close(listener);
  EXPECT_EQ(check_modbus("127.0.0.1", port).finding, Finding::Warning);
  EXPECT_EQ(check_modbus("not an address", port).finding, Finding::Bad);
}

}  // namespace
}  // namespace grapnel
