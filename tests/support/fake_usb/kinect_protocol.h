#pragma once

#include <cstdint>
#include <vector>

namespace grapnel::test {

/// The fake Kinect's control transfers: commands are headed 'G' 'M', length, command and tag,
/// replies 'R' 'B' and the same.
class KinectProtocol {
 public:
  enum class Turn : std::uint8_t { Keep, On, Off };
  struct Switch {
    Turn depth = Turn::Keep;
    Turn color = Turn::Keep;
  };

  /// Takes a command and prepares its reply; what it does to the streams.
  Switch write_command(const std::uint8_t* data, int bytes);
  /// Returns the reply's length.
  int read_reply(std::uint8_t* data, int bytes);
  /// The accelerometer.
  static int read_motor(std::uint8_t request, std::uint8_t* data, int bytes);

 private:
  std::vector<std::uint8_t> reply_;
};

}  // namespace grapnel::test
