#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace grapnel {

/// Replaces `file` so that a power cut leaves the old content or the new one, never neither:
/// temporary file in the same folder, write, fsync, rename, fsync of the folder. Length and hash go
/// with the content. Throws InputError.
void write_durable(const std::filesystem::path& file, std::span<const std::byte> content);

/// What write_durable() wrote; nothing when there is no file. Throws InputError when it can't be
/// read or was damaged.
[[nodiscard]] std::optional<std::vector<std::byte>> read_durable(const std::filesystem::path& file);

}  // namespace grapnel
