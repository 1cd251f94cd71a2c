#pragma once

namespace grapnel::test {

/// Whether a sanitizer watches the program: it runs several times slower and takes memory of its
/// own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace grapnel::test
