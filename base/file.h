#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace grapnel {

/// The whole file. Throws InputError when it can't be read or is larger than `max_bytes`.
[[nodiscard]] std::vector<std::byte> read_file(const std::filesystem::path& file,
                                               std::uintmax_t max_bytes);

/// Whether a finished write waits until it is on the medium (fsync of file and folder).
enum class WriteSync : std::uint8_t { None, Durable };

/// Writes the whole file: a temporary one in the same folder, renamed at the end, so that a reader
/// or a crash sees the old content or the new, never a part. Throws InputError when it can't.
void write_file(const std::filesystem::path& file, std::span<const std::byte> bytes,
                WriteSync sync = WriteSync::None);
void write_file(const std::filesystem::path& file, std::string_view text,
                WriteSync sync = WriteSync::None);

}  // namespace grapnel
