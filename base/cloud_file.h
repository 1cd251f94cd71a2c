#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "base/cloud.h"

namespace grapnel {

/// Largest cloud file that is read at all.
inline constexpr std::uintmax_t kMaxCloudFileBytes = std::uintmax_t{1} << 31;

/// Reads a cloud: PCD (ascii, binary, binary_compressed) or PLY (ascii, binary), told apart by
/// content. A point with any coordinate that is not finite has no reading. A grid of one column
/// counts as unorganised. Throws InputError with file, line or byte, and what is wrong. O(n).
[[nodiscard]] CloudData read_cloud(const std::filesystem::path& file);

/// Reads a PLY's vertices and faces; polygons are cut into fans. Throws InputError, also when there
/// is no face.
[[nodiscard]] MeshData read_mesh(const std::filesystem::path& file);

/// The same from bytes in memory; `name` stands for the file in messages.
[[nodiscard]] CloudData parse_cloud(std::span<const std::byte> bytes, const std::string& name);
[[nodiscard]] CloudData parse_pcd(std::span<const std::byte> bytes, const std::string& name);
[[nodiscard]] CloudData parse_ply(std::span<const std::byte> bytes, const std::string& name);
[[nodiscard]] MeshData parse_ply_mesh(std::span<const std::byte> bytes, const std::string& name);

enum class PcdEncoding : std::uint8_t { Ascii, Binary, BinaryCompressed };
enum class PlyEncoding : std::uint8_t { Ascii, BinaryLittleEndian };

/// Write a cloud with every array it has. Throw InputError when the file can't be written.
void write_pcd(const std::filesystem::path& file, const CloudData& cloud,
               PcdEncoding encoding = PcdEncoding::Binary);
void write_ply(const std::filesystem::path& file, const CloudData& cloud,
               PlyEncoding encoding = PlyEncoding::BinaryLittleEndian);
void write_ply(const std::filesystem::path& file, const MeshData& mesh,
               PlyEncoding encoding = PlyEncoding::BinaryLittleEndian);
/// By the file's ending: .pcd or .ply, both binary. Throws InputError for another one.
void write_cloud(const std::filesystem::path& file, const CloudData& cloud);

}  // namespace grapnel
