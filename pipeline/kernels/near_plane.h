#pragma once

#include <cstddef>

namespace grapnel::kernels {

/// Pixels with their inverse depths (1/m), and how far off a plane each may be (1/m).
struct InverseSamples {
  const float* u = nullptr;
  const float* v = nullptr;
  const float* inverse = nullptr;
  const float* tolerance = nullptr;
};

/// How many of `count` samples lie on the plane 1/z = a u + b v + c.
std::size_t count_near_plane(const InverseSamples& samples, std::size_t count, float a, float b,
                             float c) noexcept;

namespace reference {
std::size_t count_near_plane(const InverseSamples& samples, std::size_t count, float a, float b,
                             float c) noexcept;
}  // namespace reference

}  // namespace grapnel::kernels
