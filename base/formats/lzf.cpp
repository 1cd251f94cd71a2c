#include "base/formats/lzf.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace grapnel {
namespace {

constexpr std::size_t kMaxLiteral = 32;
constexpr std::size_t kMaxDistance = 8192;
constexpr std::size_t kMinMatch = 3;
constexpr std::size_t kMaxMatch = 264;
constexpr std::size_t kHashBits = 14;

std::uint32_t byte_at(std::span<const std::byte> bytes, std::size_t i) noexcept {
  return std::to_integer<std::uint32_t>(bytes[i]);
}

std::size_t hash3(std::span<const std::byte> in, std::size_t i) noexcept {
  const std::uint32_t word =
      byte_at(in, i) | (byte_at(in, i + 1) << 8) | (byte_at(in, i + 2) << 16);
  return (word * 2654435761u) >> (32 - kHashBits);
}

void flush_literals(std::span<const std::byte> in, std::size_t begin, std::size_t end,
                    std::vector<std::byte>& out) {
  while (begin < end) {
    const std::size_t count = std::min(end - begin, kMaxLiteral);
    out.push_back(static_cast<std::byte>(count - 1));
    for (std::size_t i = 0; i < count; ++i) out.push_back(in[begin + i]);
    begin += count;
  }
}

void emit_match(std::size_t length, std::size_t distance, std::vector<std::byte>& out) {
  const std::size_t back = distance - 1;
  const std::size_t code = length - 2;
  if (code < 7) {
    out.push_back(static_cast<std::byte>((code << 5) | (back >> 8)));
  } else {
    out.push_back(static_cast<std::byte>((std::size_t{7} << 5) | (back >> 8)));
    out.push_back(static_cast<std::byte>(code - 7));
  }
  out.push_back(static_cast<std::byte>(back & 0xff));
}

}  // namespace

bool lzf_decompress(std::span<const std::byte> in, std::span<std::byte> out) noexcept {
  std::size_t at = 0;
  std::size_t made = 0;
  while (at < in.size()) {
    const std::uint32_t control = byte_at(in, at++);
    if (control < kMaxLiteral) {
      const std::size_t count = control + 1;
      if (in.size() - at < count || out.size() - made < count) return false;
      std::copy_n(in.begin() + static_cast<std::ptrdiff_t>(at), count,
                  out.begin() + static_cast<std::ptrdiff_t>(made));
      at += count;
      made += count;
      continue;
    }
    std::size_t length = control >> 5;
    if (length == 7) {
      if (at >= in.size()) return false;
      length += byte_at(in, at++);
    }
    length += 2;
    if (at >= in.size()) return false;
    const std::size_t distance = (((control & 31u) << 8) | byte_at(in, at++)) + 1;
    if (distance > made || out.size() - made < length) return false;
    for (std::size_t i = 0; i < length; ++i) out[made + i] = out[made + i - distance];
    made += length;
  }
  return made == out.size();
}

std::vector<std::byte> lzf_compress(std::span<const std::byte> in) {
  std::vector<std::byte> out;
  out.reserve(in.size() + in.size() / kMaxLiteral + 1);
  std::vector<std::size_t> last(std::size_t{1} << kHashBits, in.size());
  std::size_t literals = 0;
  std::size_t at = 0;
  while (at + kMinMatch <= in.size()) {
    const std::size_t slot = hash3(in, at);
    const std::size_t candidate = last[slot];
    last[slot] = at;
    std::size_t length = 0;
    if (candidate < at && at - candidate <= kMaxDistance) {
      const std::size_t limit = std::min(kMaxMatch, in.size() - at);
      while (length < limit && in[candidate + length] == in[at + length]) ++length;
    }
    if (length < kMinMatch) {
      ++at;
      continue;
    }
    flush_literals(in, literals, at, out);
    emit_match(length, at - candidate, out);
    at += length;
    literals = at;
  }
  flush_literals(in, literals, in.size(), out);
  return out;
}

}  // namespace grapnel
