// grapnel-make-oni FILE FRAMES [unclosed]: the genuine OpenNI records the fake sensor. A program of
// its own, since OpenNI's recorder can deadlock; it stops the streams before it closes the file.
#include <OpenNI.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

int main(int count, char** arguments) {
  if (count < 3) return 2;
  const int wanted = std::atoi(arguments[2]);
  const bool unclosed = count > 3 && std::strcmp(arguments[3], "unclosed") == 0;
  if (openni::OpenNI::initialize() != openni::STATUS_OK) ::_exit(3);
  // Left to the end of the process.
  auto& device = *new openni::Device;
  auto& depth = *new openni::VideoStream;
  auto& color = *new openni::VideoStream;
  auto& recorder = *new openni::Recorder;
  if (device.open(openni::ANY_DEVICE) != openni::STATUS_OK) ::_exit(4);
  if (depth.create(device, openni::SENSOR_DEPTH) != openni::STATUS_OK) ::_exit(5);
  const bool has_color = device.hasSensor(openni::SENSOR_COLOR) &&
                         color.create(device, openni::SENSOR_COLOR) == openni::STATUS_OK;
  depth.setMirroringEnabled(false);
  if (has_color) color.setMirroringEnabled(false);
  if (recorder.create(arguments[1]) != openni::STATUS_OK) ::_exit(6);
  recorder.attach(depth);
  if (has_color) recorder.attach(color, false);
  depth.start();
  if (has_color) color.start();
  if (recorder.start() != openni::STATUS_OK) ::_exit(7);
  std::array<openni::VideoStream*, 2> streams = {&depth, &color};
  int frames = 0;
  int silent = 0;
  while (frames < wanted && silent < 5) {
    int ready = -1;
    if (openni::OpenNI::waitForAnyStream(streams.data(), has_color ? 2 : 1, &ready, 1000) !=
        openni::STATUS_OK) {
      ++silent;
      continue;
    }
    openni::VideoFrameRef frame;
    if (streams[static_cast<std::size_t>(ready)]->readFrame(&frame) == openni::STATUS_OK &&
        ready == 0) {
      ++frames;
    }
  }
  if (unclosed) ::_exit(0);
  depth.stop();
  if (has_color) color.stop();
  recorder.stop();
  recorder.destroy();
  ::_exit(frames == wanted ? 0 : 8);
}
