#include "drivers/synthetic/scene_keys.h"

#include <array>

namespace grapnel {
namespace {

constexpr double kMaxFrames = 1e6;
constexpr double kMaxStations = 1e4;
constexpr double kMaxSeed = 9e15;  // a whole number that TOML and double both hold
constexpr double kFar_m = 100.0;

}  // namespace

FieldTable scene_fields() noexcept {
  static constexpr std::array kFields = {
      text_field<&Scene::name>("name", "name for people"),
      number_field<&Scene::seed>("seed", "", 0, kMaxSeed, "of everything random"),
      number_field<&Scene::frames>("frames", "", 1, kMaxFrames, "length of a recording"),
      number_field<&Scene::rate_hz>("rate_hz", "Hz", 0.1, 1000, "frames per second"),
  };
  return kFields;
}

FieldTable scene_camera_fields() noexcept {
  using C = SceneCamera;
  static constexpr std::array kFields = {
      number_field<&C::width>("width", "px", 16, 4096, "columns of the depth image"),
      number_field<&C::height>("height", "px", 16, 4096, "rows of the depth image"),
      number_field<&C::fx>("fx", "px", 10, 10000, "focal length along the rows"),
      number_field<&C::fy>("fy", "px", 10, 10000, "focal length along the columns"),
      number_field<&C::cx>("cx", "px", -4096, 8192, "column of the principal point"),
      number_field<&C::cy>("cy", "px", -4096, 8192, "row of the principal point"),
      number_field<&C::baseline_m>("baseline_m", "m", 0.001, 1.0,
                                   "from the camera to its projector, along +u"),
      number_field<&C::metres_per_unit>("metres_per_unit", "m", 1e-6, 0.1, "depth of one count"),
      number_field<&C::x_m>("x_m", "m", -10, 10, "place along the belt"),
      number_field<&C::y_m>("y_m", "m", -10, 10, "place across the belt"),
      number_field<&C::height_m>("height_m", "m", 0.1, 10, "height above the belt"),
      number_field<&C::tilt_rad>("tilt_rad", "rad", -1.0, 1.0,
                                 "turned about the image's u axis; 0 looks straight down"),
      bool_field<&C::color>("color", "make colour images too"),
      text_field<&C::serial>("serial", "serial number that the camera gives"),
  };
  return kFields;
}

FieldTable belt_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&Belt::speed_m_s>("speed_m_s", "m/s", -5, 5, "speed of a belt without stations"),
      number_field<&Belt::pitch_m>("pitch_m", "m", 0, kFar_m,
                                   "distance of stations; 0: none, the belt runs on"),
      number_field<&Belt::dwell_frames>("dwell_frames", "", 1, kMaxFrames,
                                        "frames at rest per station"),
      number_field<&Belt::move_frames>("move_frames", "", 0, kMaxFrames,
                                       "frames in motion per station"),
      number_field<&Belt::stations>("stations", "", 1, kMaxStations,
                                    "stations until the first comes round again"),
      number_field<&Belt::albedo>("albedo", "", 0, 1, "infrared reflectance"),
  };
  return kFields;
}

FieldTable PartKeys::fields() noexcept {
  using P = PartKeys;
  static constexpr std::array kFields = {
      text_field<&P::name>("name", "name of this part; by default its kind and number"),
      text_field<&P::model>("model", "model it is an instance of; \"\" for clutter"),
      choice_field<&P::kind>("kind", kPartKindNames, "its shape"),
      numbers_field<&P::size_m>("size_m", "m", 0.005, 10.0,
                                "width, depth, height; by default the shipped model's"),
      number_field<&P::albedo>("albedo", "", 0, 1, "infrared reflectance; black rubber has 0.03"),
      number_field<&P::station>("station", "", 0, kMaxStations, "station it lies at"),
      number_field<&P::seed>("seed", "", 0, kMaxSeed, "of a sack's wrinkles"),
      text_field<&P::mesh>("mesh", "PLY file of kind \"mesh\", metres, relative to this file"),
  };
  return kFields;
}

FieldTable PlaceKeys::fields() noexcept {
  using P = PlaceKeys;
  static constexpr std::array kFields = {
      number_field<&P::x_m>("x_m", "m", -kFar_m, kFar_m, "along the belt, from the station"),
      number_field<&P::y_m>("y_m", "m", -kFar_m, kFar_m, "across the belt"),
      number_field<&P::yaw_rad>("yaw_rad", "rad", -7, 7, "turned about the vertical"),
      choice_field<&P::resting>("resting", kRestingNames, "which side it lies on"),
      numbers_field<&P::world_from_model>("world_from_model", "", -kFar_m, kFar_m,
                                          "16 numbers, row-major, instead of the four above"),
  };
  return kFields;
}

FieldTable RandomKeys::fields() noexcept {
  using R = RandomKeys;
  static constexpr std::array kFields = {
      number_field<&R::stations>("stations", "", 1, kMaxStations, "stations that get some"),
      number_field<&R::count>("count", "", 1, 100, "things at each of them"),
      numbers_field<&R::size_high_m>("size_high_m", "m", 0.005, 10.0,
                                     "largest size, size_m being the smallest; by default equal"),
      numbers_field<&R::region_m>("region_m", "m", -kFar_m, kFar_m,
                                  "x from, x to, y from, y to of their middles"),
      bool_field<&R::event>("event", "each is an event that expects \"accept\""),
  };
  return kFields;
}

FieldTable scene_event_fields() noexcept {
  using E = SceneEvent;
  static constexpr std::array kFields = {
      number_field<&E::station>("station", "", 0, kMaxStations, "whose dwell it is"),
      text_field<&E::kind>("kind", "what lies there, for people"),
      text_field<&E::model>("model", "model that the line asks for"),
      choice_field<&E::expected>("expected", kExpectationNames, "right answer"),
      text_field<&E::part>("part", "name of the part whose pose is the truth"),
  };
  return kFields;
}

FieldTable scene_fault_fields() noexcept {
  using F = SceneFault;
  static constexpr std::array kFields = {
      choice_field<&F::kind>("kind", kFaultKindNames, "what goes wrong"),
      number_field<&F::at_frame>("at_frame", "", 0, kMaxFrames, "first frame it happens to"),
      number_field<&F::frames>("frames", "", 0, kMaxFrames,
                               "frame times it lasts; 0: a sensor that went away stays away"),
  };
  return kFields;
}

std::span<const SceneSection> scene_sections() {
  static const Scene kScene;
  static const PartKeys kPart;
  static const PlaceKeys kPlace;
  static const RandomKeys kRandom;
  static const SceneEvent kEvent;
  static const SceneFault kFault;
  static const SceneSection kSections[] = {
      {"[scene]", scene_fields(), &kScene},
      {"[camera]", scene_camera_fields(), &kScene.camera},
      {"[belt]", belt_fields(), &kScene.belt},
      {"[sensor]", structured_light_fields(), &kScene.sensor},
      {"[[part]] and [[random]]", PartKeys::fields(), &kPart},
      {"[[part]]", PlaceKeys::fields(), &kPlace},
      {"[[random]]", RandomKeys::fields(), &kRandom},
      {"[[event]]", scene_event_fields(), &kEvent},
      {"[[fault]]", scene_fault_fields(), &kFault},
  };
  return kSections;
}

}  // namespace grapnel
