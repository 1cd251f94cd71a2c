#include "pipeline/report.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/code.h"

namespace grapnel {
namespace {

enum class Bound : std::uint8_t { AtLeast, AtMost };

struct Wording {
  const char* name;
  Code code;
  const char* what;
  Bound bound;
  double scale;  // shown value = scale × stored value
  int decimals;
  const char* unit;
};

constexpr double kDegrees = 57.29577951308232;

constexpr std::array<Wording, static_cast<std::size_t>(Check::kCount)> kWordings = {{
    {"matched_share", Code::BelowFitness, "matched share of the visible model", Bound::AtLeast, 1.0,
     2, ""},
    {"matched_area_m2", Code::TooFewPoints, "confirmed surface", Bound::AtLeast, 1e4, 1, " cm2"},
    {"seen_through", Code::FreeSpaceViolated, "share of the model that the camera sees through",
     Bound::AtMost, 1.0, 3, ""},
    {"hole_m2", Code::FreeSpaceViolated, "largest piece of the model that the camera sees through",
     Bound::AtMost, 1e4, 1, " cm2"},
    {"deviation_m", Code::RefinementDiverged, "deviation of the matched surface", Bound::AtMost,
     1e3, 2, " mm"},
    {"unknown", Code::TooMuchUnknown, "share of the visible model without reading", Bound::AtMost,
     1.0, 2, ""},
    {"outside", Code::TooMuchUnknown, "share of the visible model outside of the image",
     Bound::AtMost, 1.0, 3, ""},
    {"unexplained", Code::UnexplainedForeground,
     "measured surface that the model leaves over, per matched", Bound::AtMost, 1.0, 2, ""},
    {"explained", Code::UnexplainedForeground,
     "share of the measured object that the model explains", Bound::AtLeast, 1.0, 2, ""},
    {"outline_known", Code::ContourDisagrees,
     "share of the outline about which readings say anything", Bound::AtLeast, 1.0, 2, ""},
    {"outline", Code::ContourDisagrees, "share of the outline that meets a depth edge",
     Bound::AtLeast, 1.0, 2, ""},
    {"flat_proof", Code::ContourDisagrees,
     "only one flat face matches, and the share of it and its outline that is proven is",
     Bound::AtLeast, 1.0, 2, ""},
    {"overlap", Code::NoConsensus, "share of the views that overlaps", Bound::AtLeast, 1.0, 3, ""},
    {"margin", Code::Ambiguous, "margin to the second-best distinct pose", Bound::AtLeast, 1.0, 3,
     ""},
    {"sigma_m", Code::NotObservable, "predicted deviation along the weakest required direction",
     Bound::AtMost, 1e3, 2, " mm"},
    {"sigma_rad", Code::NotObservable, "predicted deviation about the weakest required axis",
     Bound::AtMost, kDegrees, 2, " degrees"},
    {"belt_known", Code::ImplausibleOnBelt, "planes known to be the belt", Bound::AtLeast, 1.0, 0,
     ""},
    {"belt_distance_m", Code::ImplausibleOnBelt,
     "distance of the part's lowest point from the belt", Bound::AtMost, 1e3, 1, " mm"},
    {"support_m", Code::ImplausibleOnBelt, "distance of the part's centre inside what it stands on",
     Bound::AtLeast, 1e3, 1, " mm"},
    {"size", Code::PartsTouch,
     "parts touch, or it is a larger one: the measured object's size in views of the part is",
     Bound::AtMost, 1.0, 2, ""},
    {"shared_space", Code::HypothesesDisagree, "share of the part inside of another one reported",
     Bound::AtMost, 1.0, 3, ""},
    {"grasp_whole", Code::NoSurfaceGrasp,
     "for a surface grasp, objects that the image's end cuts off", Bound::AtMost, 1.0, 0, ""},
    {"grasp_size", Code::NoSurfaceGrasp,
     "for a surface grasp, the object's size in views of the model", Bound::AtMost, 1.0, 2, ""},
    {"grasp_height_m", Code::NoSurfaceGrasp,
     "for a surface grasp, the object's height above the belt", Bound::AtMost, 1e3, 0, " mm"},
    {"grasp_patch", Code::NoSurfaceGrasp,
     "for a surface grasp, share of a level footprint that the object fills", Bound::AtLeast, 1.0,
     2, ""},
    {"grasp_flat_m", Code::NoSurfaceGrasp,
     "for a surface grasp, deviation of the flattest footprint", Bound::AtMost, 1e3, 1, " mm"},
    {"stray_m2", Code::UnexplainedForeground,
     "largest piece at a depth the part does not have there", Bound::AtMost, 1e4, 1, " cm2"},
    {"left_over_m2", Code::UnexplainedForeground,
     "largest piece of the measured object beside the part", Bound::AtMost, 1e4, 1, " cm2"},
    {"sunk_m", Code::ImplausibleOnBelt, "depth by which the part would reach into what it lies on",
     Bound::AtMost, 1e3, 1, " mm"},
    {"least_share", Code::BelowFitness,
     "matched share of the surface that confirms the least certain motion", Bound::AtLeast, 1.0, 2,
     ""},
    {"ground_m", Code::ImplausibleOnBelt,
     "distance of the part's underside from the ground that is seen beside it", Bound::AtMost, 1e3,
     1, " mm"},
    {"mirror_margin", Code::Ambiguous, "its mirror image fits as well: margin to it",
     Bound::AtLeast, 1.0, 3, ""},
    {"height_known", Code::ImplausibleOnBelt,
     "only one flat face matches, and the share of its outline beside which ground tells its "
     "height "
     "is",
     Bound::AtLeast, 1.0, 2, ""},
}};

const Wording& wording_of(Check check) noexcept {
  return kWordings[static_cast<std::size_t>(check)];
}

/// Writes into a bounded text, always terminated.
class Writer {
 public:
  Writer(char* text, std::size_t bytes) noexcept : text_(text), room_(bytes > 0 ? bytes - 1 : 0) {}
  void put(char c) noexcept {
    if (size_ < room_) text_[size_++] = c;
  }
  void put(const char* text) noexcept {
    for (; *text != '\0'; ++text) put(*text);
  }
  void put_number(double value, int decimals) noexcept {
    if (value < 0.0) {
      put('-');
      value = -value;
    }
    double scale = 1.0;
    for (int i = 0; i < decimals; ++i) scale *= 10.0;
    const double bounded = std::min(value * scale + 0.5, 9e15);
    auto rest = static_cast<std::uint64_t>(bounded == bounded ? bounded : 0.0);
    std::array<char, 24> digits{};
    std::size_t count = 0;
    do {
      digits[count++] = static_cast<char>('0' + rest % 10);
      rest /= 10;
    } while (rest > 0 || count <= static_cast<std::size_t>(decimals));
    while (count > 0) {
      put(digits[--count]);
      if (count == static_cast<std::size_t>(decimals) && decimals > 0) put('.');
    }
  }
  std::size_t finish(std::size_t bytes) noexcept {
    if (bytes > 0) text_[size_] = '\0';
    return size_;
  }

 private:
  char* text_;
  std::size_t room_;
  std::size_t size_ = 0;
};

}  // namespace

const char* name_of(Check check) noexcept { return wording_of(check).name; }

Code Reason::code() const noexcept { return wording_of(check).code; }

std::size_t reason_text(const Reason& reason, char* text, std::size_t bytes) noexcept {
  Writer writer(text, bytes);
  const Wording& wording = wording_of(reason.check);
  const bool at_least = wording.bound == Bound::AtLeast;
  writer.put(wording.what);
  writer.put(' ');
  writer.put_number(reason.measured * wording.scale, wording.decimals);
  writer.put(wording.unit);
  writer.put(at_least ? ", at least " : ", at most ");
  writer.put_number(reason.limit * wording.scale, wording.decimals);
  writer.put(wording.unit);
  writer.put(at_least ? " is required" : " is allowed");
  return writer.finish(bytes);
}

}  // namespace grapnel
