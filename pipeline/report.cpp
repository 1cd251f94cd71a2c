#include "pipeline/report.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "base/code.h"

namespace grapnel {
namespace {

struct Wording {
  Code code;
  const char* what;
  const char* bound;  // "at least" or "at most"
  double scale;       // shown value = scale × stored value
  int decimals;
  const char* unit;
};

constexpr std::array kWordings = {
    Wording{Code::BelowFitness, "matched share of the visible model", "at least", 1.0, 2, ""},
    Wording{Code::TooFewPoints, "confirmed surface", "at least", 1e4, 1, " cm2"},
    Wording{Code::FreeSpaceViolated, "share of the model that the camera sees through", "at most",
            1.0, 3, ""},
    Wording{Code::TooMuchUnknown, "share of the visible model without reading", "at most", 1.0, 2,
            ""},
    Wording{Code::UnexplainedForeground, "measured surface the model does not explain", "at most",
            1.0, 2, ""},
    Wording{Code::ContourDisagrees, "share of the outline that meets a depth edge", "at least", 1.0,
            2, ""},
    Wording{Code::Ambiguous, "margin to the second-best distinct pose", "at least", 1.0, 3, ""},
    Wording{Code::NotObservable, "predicted deviation in the weakest required direction", "at most",
            1e3, 2, "e-3"},
    Wording{Code::OutsideVolume, "distance of the pose from the allowed volume", "at most", 1e3, 1,
            " mm"},
    Wording{Code::ImplausibleOnBelt, "distance of the part's lowest point from the belt", "at most",
            1e3, 1, " mm"},
    Wording{Code::RefinementDiverged, "deviation of the matched surface", "at most", 1e3, 2, " mm"},
    Wording{Code::HypothesesDisagree, "distance between two independent poses", "at most", 1e3, 1,
            " mm"},
};

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

std::size_t reason_text(const Reason& reason, char* text, std::size_t bytes) noexcept {
  Writer writer(text, bytes);
  const auto* wording = std::find_if(kWordings.begin(), kWordings.end(),
                                     [&](const Wording& w) { return w.code == reason.code; });
  if (wording == kWordings.end()) {
    for (const char c : describe(reason.code).text) writer.put(c);
    return writer.finish(bytes);
  }
  writer.put(wording->what);
  writer.put(' ');
  writer.put_number(reason.measured * wording->scale, wording->decimals);
  writer.put(wording->unit);
  writer.put(", ");
  writer.put(wording->bound);
  writer.put(' ');
  writer.put_number(reason.limit * wording->scale, wording->decimals);
  writer.put(wording->unit);
  writer.put(" is ");
  writer.put(std::strcmp(wording->bound, "at least") == 0 ? "required" : "allowed");
  return writer.finish(bytes);
}

}  // namespace grapnel
