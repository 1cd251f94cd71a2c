#include "base/cloud_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/file.h"
#include "base/formats/lzf.h"
#include "base/input_error.h"
#include "base/rng.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

template <class T>
std::string raw(const T& value) {
  std::string text(sizeof value, '\0');
  std::memcpy(text.data(), &value, sizeof value);
  return text;
}

template <class T>
std::string reversed(const T& value) {
  const std::string text = raw(value);
  return {text.rbegin(), text.rend()};
}

CloudData pcd(const std::string& text) { return parse_pcd(bytes_of(text), "a.pcd"); }
CloudData ply(const std::string& text) { return parse_ply(bytes_of(text), "a.ply"); }

template <class Parse>
std::string message_of(Parse parse, const std::string& text) {
  try {
    (void)parse(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string pcd_header(const std::string& fields, const std::string& sizes,
                       const std::string& types, const std::string& grid, const std::string& data) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " + types +
         "\n" + grid + "\nDATA " + data + "\n";
}

TEST(Pcd, ReadsTextWithFieldsInAnyOrderAndLineEnds) {
  const CloudData cloud =
      pcd("# comment\r\nVERSION .7\r\nFIELDS intensity z y x\r\nSIZE 4 4 4 4\r\nTYPE F F F F\r\n"
          "COUNT 1 1 1 1\r\nWIDTH 2\r\nHEIGHT 1\r\nVIEWPOINT 0 0 0 1 0 0 0\r\nPOINTS 2\r\nDATA "
          "ascii\r\n"
          "0.5 3 2 1\r\n\r\n7 nan -1e-3 +4\r\n");
  ASSERT_EQ(cloud.size(), 2u);
  EXPECT_EQ(cloud.x[0], 1.0f);
  EXPECT_EQ(cloud.y[0], 2.0f);
  EXPECT_EQ(cloud.z[0], 3.0f);
  EXPECT_EQ(cloud.intensity, (std::vector<float>{0.5f, 7.0f}));
  EXPECT_TRUE(std::isnan(cloud.x[1]) && std::isnan(cloud.y[1]) && std::isnan(cloud.z[1]))
      << "a point without z has no reading at all";
  EXPECT_FALSE(cloud.organized());
}

TEST(Pcd, ReadsBinaryRecordsOfAnySizesAndSkipsWhatItDoesNotKnow) {
  std::string body;
  for (int i = 0; i < 2; ++i) {
    body += raw(std::uint16_t(300 + i));
    body += raw(1.5 + i) + raw(2.5) + raw(3.5);
    for (int k = 0; k < 3; ++k) body += raw(99.0f);
  }
  const std::string text =
      "FIELDS label x y z fpfh\nSIZE 2 8 8 8 4\nTYPE U F F F F\nCOUNT 1 1 1 1 3\nWIDTH 2\nHEIGHT "
      "1\nPOINTS 2\nDATA binary\n" +
      body;
  const CloudData cloud = pcd(text);
  EXPECT_EQ(cloud.x, (std::vector<float>{1.5f, 2.5f}));
  EXPECT_EQ(cloud.label, (std::vector<std::uint32_t>{300, 301}));
}

TEST(Pcd, UnpacksColourFromAnIntegerFromAFloatAndFromAFloatsText) {
  const std::uint32_t packed = 0xff0a141eu;
  const std::string grid = "WIDTH 1\nHEIGHT 1\nPOINTS 1";
  const std::string xyz = raw(1.0f) + raw(2.0f) + raw(3.0f);
  const Rgb8 expected{10, 20, 30};
  for (const char* type : {"F F F U", "F F F F"}) {
    const CloudData cloud =
        pcd(pcd_header("x y z rgba", "4 4 4 4", type, grid, "binary") + xyz + raw(packed));
    EXPECT_EQ(cloud.color.at(0), expected);
  }
  // 0x000a141e as a float's bits is 9.2557e-40, below the normal range.
  const CloudData text = pcd(pcd_header("x y z rgb", "4 4 4 4", "F F F F", grid, "ascii") +
                             "1 2 3 9.25571648671185e-40\n");
  EXPECT_EQ(text.color.at(0), expected);
  const CloudData whole =
      pcd(pcd_header("x y z rgb", "4 4 4 4", "F F F U", grid, "ascii") + "1 2 3 4278850590\n");
  EXPECT_EQ(whole.color.at(0), expected);
}

TEST(Pcd, ReadsCompressedDataFieldByField) {
  // x of both points, then y, then z: literals of LZF, 24 bytes in one run.
  const std::string columns = raw(1.0f) + raw(2.0f) + raw(3.0f) + raw(4.0f) + raw(5.0f) + raw(6.0f);
  const std::string packed = std::string(1, '\x17') + columns;
  const CloudData cloud = pcd(
      pcd_header("x y z", "4 4 4", "F F F", "WIDTH 2\nHEIGHT 1\nPOINTS 2", "binary_compressed") +
      raw(static_cast<std::uint32_t>(packed.size())) + raw(std::uint32_t{24}) + packed);
  EXPECT_EQ(cloud.x, (std::vector<float>{1.0f, 2.0f}));
  EXPECT_EQ(cloud.z, (std::vector<float>{5.0f, 6.0f}));
}

TEST(Pcd, KeepsAGridAndTakesOneColumnAsNone) {
  const std::string rows = "0 0 1\n0 0 2\n0 0 3\n0 0 4\n";
  const CloudData grid =
      pcd(pcd_header("x y z", "4 4 4", "F F F", "WIDTH 2\nHEIGHT 2", "ascii") + rows);
  EXPECT_TRUE(grid.organized());
  EXPECT_EQ(grid.width, 2);
  EXPECT_EQ(grid.height, 2);
  const CloudData column =
      pcd(pcd_header("x y z", "4 4 4", "F F F", "WIDTH 1\nHEIGHT 4", "ascii") + rows);
  EXPECT_FALSE(column.organized());
  EXPECT_EQ(column.width, 4);
}

TEST(Pcd, TakesTheViewpointAsTheSensorsPose) {
  const CloudData cloud = pcd(
      pcd_header("x y z", "4 4 4", "F F F", "WIDTH 1\nHEIGHT 1\nVIEWPOINT 1 2 3 0 1 0 0", "ascii") +
      "0 0 1\n");
  // Half a turn about x.
  const Vec3d moved = cloud.world_from_sensor * Vec3d(1.0, 1.0, 1.0);
  EXPECT_LT((moved - Vec3d(2.0, 1.0, 2.0)).norm(), 1e-12);
}

TEST(Pcd, NamesLineAndReasonOfWhatIsBroken) {
  // The header has nine lines, the last is DATA.
  const std::string grid = "WIDTH 2\nHEIGHT 1\nPOINTS 2";
  const std::string plain = pcd_header("x y z", "4 4 4", "F F F", grid, "ascii");
  EXPECT_EQ(message_of(pcd, plain + "1.0 2.0 3.0\n1.0 2.0\n"),
            "a.pcd:11: the point's line ends before its field \"z\"");
  EXPECT_EQ(message_of(pcd, plain + "1 2 3\n1 two 3\n"),
            "a.pcd:11: \"two\" in field \"y\" is not a number");
  EXPECT_EQ(message_of(pcd, plain + "1.00 2.00 3.00\n"),
            "a.pcd:10: 2 points are declared, but only 1 are there");
  EXPECT_EQ(message_of(pcd, "FIELDS x y z\nSIZE 4 4 4\n"),
            "a.pcd:2: the PCD header ends without a DATA line");
  EXPECT_EQ(message_of(pcd, "solid\n"), "a.pcd:1: unknown PCD header entry \"solid\"");
  EXPECT_EQ(message_of(pcd, pcd_header("x y", "4 4", "F F", grid, "ascii") + "1 2\n1 2\n"),
            "a.pcd:11: there is no field \"z\"");
  EXPECT_EQ(message_of(pcd, pcd_header("x y z", "4 4", "F F F", grid, "ascii")),
            "a.pcd:9: FIELDS, SIZE, TYPE and COUNT have different lengths");
  EXPECT_EQ(message_of(pcd, pcd_header("x y z", "4 4 3", "F F F", grid, "ascii")),
            "a.pcd:9: SIZE \"3\" of field \"z\" is not allowed; 1, 2, 4 or 8 is");
  EXPECT_NE(message_of(pcd, pcd_header("x y z", "4 4 2", "F F F", grid, "ascii"))
                .find("TYPE \"F\" of field \"z\" with SIZE 2 is not allowed"),
            std::string::npos);
  EXPECT_EQ(message_of(pcd, pcd_header("x y z", "4 4 4", "F F F", grid, "zip")),
            "a.pcd:9: DATA \"zip\" is not allowed; ascii, binary or binary_compressed is");
  EXPECT_EQ(message_of(
                pcd, pcd_header("x y z", "4 4 4", "F F F", "WIDTH 2\nHEIGHT 2\nPOINTS 5", "ascii")),
            "a.pcd:9: WIDTH 2 times HEIGHT 2 is not POINTS 5");
  EXPECT_EQ(message_of(pcd, pcd_header("x y z", "4 4 4", "F F F", "WIDTH -1", "ascii")),
            "a.pcd:6: WIDTH \"-1\" is not allowed; a whole number from 0 to 1073741824 is");
  EXPECT_EQ(message_of(pcd, pcd_header("x y z", "4 4 4", "F F F", grid, "binary") + "12345"),
            "a.pcd:9: the data is cut off: 5 of 24 bytes are there");
}

TEST(Pcd, RefusesAPointCountThatTheFileCantHold) {
  const std::string huge = "WIDTH 30000\nHEIGHT 30000";
  EXPECT_NE(message_of(pcd, pcd_header("x y z", "4 4 4", "F F F", huge, "ascii") + "1 2 3\n")
                .find("are declared, but only 6 bytes follow"),
            std::string::npos);
  const std::string sizes = raw(std::uint32_t{4}) + raw(std::uint32_t{2'000'000'000u});
  EXPECT_NE(message_of(pcd, pcd_header("x y z", "4 4 4", "F F F", huge, "binary_compressed") +
                                sizes + "abcd")
                .find("the header's points need 10800000000"),
            std::string::npos);
  EXPECT_EQ(message_of(pcd, pcd_header("x y z", "4 4 4", "F F F", "WIDTH 100\nHEIGHT 100",
                                       "binary_compressed") +
                                raw(std::uint32_t{4}) + raw(std::uint32_t{120000}) + "abcd"),
            "a.pcd:8: the compressed data is damaged");
}

TEST(Lzf, FollowsLiblzfsFormat) {
  // Three literals, then a copy of three from three back, then a long one of 9 from one back.
  const std::string packed(
      "\x02"
      "abc"
      "\x20\x02"
      "\xe0\x00\x00",
      9);
  std::vector<std::byte> out(15);
  ASSERT_TRUE(lzf_decompress(bytes_of(packed), out));
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(out.data()), out.size()), "abcabcccccccccc");
}

TEST(Lzf, RefusesCopiesFromBeforeTheStartAndWrongLengths) {
  std::vector<std::byte> out(6);
  EXPECT_FALSE(lzf_decompress(bytes_of({"\x02"
                                        "abc"
                                        "\x20\x03",
                                        6}),
                              out));
  EXPECT_FALSE(lzf_decompress(bytes_of({"\x02"
                                        "abc",
                                        4}),
                              out));
  EXPECT_FALSE(lzf_decompress(bytes_of({"\x09"
                                        "abc",
                                        4}),
                              out));
  EXPECT_FALSE(lzf_decompress(bytes_of({"\x02"
                                        "abc"
                                        "\x20",
                                        5}),
                              out));
  EXPECT_FALSE(lzf_decompress(bytes_of({"\x02"
                                        "abc"
                                        "\xe0",
                                        5}),
                              out));
}

TEST(Lzf, DecompressesWhatItCompressed) {
  Rng rng(7);
  for (const std::size_t size : {0u, 1u, 2u, 3u, 31u, 32u, 33u, 263u, 264u, 265u, 8191u, 30000u}) {
    for (const std::uint32_t alphabet : {1u, 2u, 5u, 256u}) {
      std::vector<std::byte> in(size);
      for (std::byte& byte : in) byte = static_cast<std::byte>(rng.below(alphabet));
      const std::vector<std::byte> packed = lzf_compress(in);
      std::vector<std::byte> out(size);
      ASSERT_TRUE(lzf_decompress(packed, out)) << size << " of " << alphabet;
      ASSERT_EQ(out, in);
      EXPECT_LE(packed.size(), size + size / 32 + 1);
      if (alphabet == 1 && size == 30000) {
        EXPECT_LT(packed.size(), 400u);
      }
    }
  }
}

constexpr const char* kPlyVertex =
    "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";

TEST(Ply, ReadsTextWithNormalsAndColours) {
  const CloudData cloud = ply(
      "ply\nformat ascii 1.0\ncomment by hand\nobj_info num_cols 2\nelement vertex 2\n"
      "property double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float "
      "ny\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property list uchar int tags\nelement range_grid 2\nproperty list uchar int vertex_indices\n"
      "end_header\n1 2 3 0 0 1 10 20 30 2 5 6\n4 5 inf 0 1 0 255 0 1 0\n0\n1 0\n");
  ASSERT_EQ(cloud.size(), 2u);
  EXPECT_EQ(cloud.z[0], 3.0f);
  EXPECT_TRUE(std::isnan(cloud.x[1]));
  EXPECT_EQ(cloud.ny[1], 1.0f);
  EXPECT_EQ(cloud.color[1], (Rgb8{255, 0, 1}));
}

TEST(Ply, ReadsBinaryOfEitherByteOrder) {
  const std::string properties =
      "element vertex 1\nproperty ushort tag\nproperty float x\nproperty double y\nproperty float "
      "z\nproperty float red\nproperty float green\nproperty float blue\nend_header\n";
  const std::string little = "ply\nformat binary_little_endian 1.0\n" + properties +
                             raw(std::uint16_t{9}) + raw(1.25f) + raw(-2.5) + raw(3.0f) +
                             raw(1.0f) + raw(0.5f) + raw(0.0f);
  const std::string big = "ply\nformat binary_big_endian 1.0\n" + properties +
                          reversed(std::uint16_t{9}) + reversed(1.25f) + reversed(-2.5) +
                          reversed(3.0f) + reversed(1.0f) + reversed(0.5f) + reversed(0.0f);
  for (const std::string& text : {little, big}) {
    const CloudData cloud = ply(text);
    EXPECT_EQ(cloud.x.at(0), 1.25f);
    EXPECT_EQ(cloud.y.at(0), -2.5f);
    EXPECT_EQ(cloud.z.at(0), 3.0f);
    EXPECT_EQ(cloud.color.at(0), (Rgb8{255, 128, 0}));
  }
}

TEST(Ply, CutsPolygonsIntoFans) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face 2\nproperty uchar flags\nproperty list uchar int vertex_index\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n7 4 0 1 2 3\n7 3 3 2 1\n";
  const MeshData mesh = parse_ply_mesh(bytes_of(text), "m.ply");
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles,
            (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}, {3, 2, 1}}));
}

TEST(Ply, NamesLineAndReasonOfWhatIsBroken) {
  const std::string head = std::string("ply\nformat ascii 1.0\n") + kPlyVertex;
  EXPECT_EQ(message_of(ply, head + "end_header\n1.0 2.0 3.0\n4.0 5.0\n"),
            "a.ply:9: the file ends before the last value");
  EXPECT_EQ(message_of(ply, head + "end_header\n1 2 3\n4 5 x\n"), "a.ply:9: \"x\" is not a number");
  EXPECT_EQ(message_of(ply, "plx\n"), "a.ply:1: a PLY file begins with the line \"ply\"");
  EXPECT_EQ(message_of(ply, std::string("ply\n") + kPlyVertex + "end_header\n1 2 3 4 5 6\n"),
            "a.ply:6: the PLY header has no format line");
  EXPECT_EQ(message_of(ply, head), "a.ply:6: the PLY header ends without end_header");
  EXPECT_NE(message_of(ply, "ply\nformat ascii 1.0\nelement vertex 1\nproperty flot x\n")
                .find("a.ply:4: \"flot\" is not a PLY type"),
            std::string::npos);
  EXPECT_EQ(message_of(ply,
                       "ply\nformat ascii 1.0\nelement vertex 0\nproperty float "
                       "x\nproperty float y\nend_header\n"),
            "a.ply:6: element \"vertex\" lacks one of the properties x, y, z");
  EXPECT_EQ(
      message_of(ply, "ply\nformat ascii 1.0\nelement face 0\nproperty float x\nend_header\n"),
      "a.ply:5: there is no element \"vertex\"");
  EXPECT_NE(message_of(ply,
                       "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float "
                       "x\nproperty float y\nproperty float z\nend_header\n1 2 3\n")
                .find("declares 4000000000 rows; only 6 bytes follow the header"),
            std::string::npos);
  EXPECT_NE(message_of(ply, "ply\nformat ascii 1.0\nelement vertex 9\nend_header\n")
                .find("element \"vertex\" has no property"),
            std::string::npos);
}

TEST(Ply, RefusesFacesThatNameNoVertex) {
  const auto mesh = [](const std::string& text) { return parse_ply_mesh(bytes_of(text), "m.ply"); };
  const std::string head = std::string("ply\nformat ascii 1.0\n") + kPlyVertex +
                           "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                           "0 0 0\n1 0 0\n";
  EXPECT_EQ(message_of(mesh, head + "3 0 1 2\n"),
            "m.ply:12: a face names a vertex outside 0 to 2 - 1");
  EXPECT_NE(message_of(mesh, head + "3 0 1 -1\n").find("names a vertex outside"),
            std::string::npos);
  EXPECT_NE(message_of(mesh, head + "200 0 1 1\n").find("a list is longer than the file"),
            std::string::npos);
  EXPECT_NE(message_of(mesh, head + "2 0 1\n").find("holds no face"), std::string::npos);
}

CloudData full_cloud() {
  CloudData cloud;
  Rng rng(3);
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 12; ++i) {
    const bool none = i == 5;
    cloud.x.push_back(none ? kNone : static_cast<float>(rng.normal()));
    cloud.y.push_back(none ? kNone : static_cast<float>(rng.normal() * 1e-20));
    cloud.z.push_back(none ? kNone : static_cast<float>(rng.normal() * 1e20));
    cloud.nx.push_back(0.0f);
    cloud.ny.push_back(static_cast<float>(rng.uniform()));
    cloud.nz.push_back(-1.0f);
    cloud.intensity.push_back(static_cast<float>(rng.uniform()));
    cloud.color.push_back({static_cast<std::uint8_t>(i), 255, static_cast<std::uint8_t>(9 * i)});
    cloud.label.push_back(0xfffffff0u + static_cast<std::uint32_t>(i));
  }
  cloud.width = 4;
  cloud.height = 3;
  cloud.world_from_sensor.translation() = Vec3d(0.1, -2.0, 3.0);
  return cloud;
}

void expect_same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(std::isnan(a[i]), std::isnan(b[i])) << i;
    if (std::isnan(a[i])) continue;
    EXPECT_EQ(std::bit_cast<std::uint32_t>(a[i]), std::bit_cast<std::uint32_t>(b[i])) << i;
  }
}

void expect_same(const CloudData& a, const CloudData& b) {
  expect_same_bits(a.x, b.x);
  expect_same_bits(a.y, b.y);
  expect_same_bits(a.z, b.z);
  expect_same_bits(a.nx, b.nx);
  expect_same_bits(a.ny, b.ny);
  expect_same_bits(a.nz, b.nz);
  expect_same_bits(a.intensity, b.intensity);
  EXPECT_EQ(a.color, b.color);
  EXPECT_EQ(a.label, b.label);
}

TEST(CloudFile, ReadsBackTheSameBitsFromEveryPcdEncoding) {
  const test::TempFolder folder;
  const CloudData cloud = full_cloud();
  for (const PcdEncoding encoding :
       {PcdEncoding::Ascii, PcdEncoding::Binary, PcdEncoding::BinaryCompressed}) {
    write_pcd(folder / "c.pcd", cloud, encoding);
    const CloudData read = read_cloud(folder / "c.pcd");
    expect_same(read, cloud);
    EXPECT_EQ(read.width, 4);
    EXPECT_EQ(read.height, 3);
    EXPECT_LT((read.world_from_sensor.matrix() - cloud.world_from_sensor.matrix()).norm(), 1e-15);
  }
}

TEST(CloudFile, ReadsBackTheSameBitsFromEveryPlyEncoding) {
  const test::TempFolder folder;
  for (const PlyEncoding encoding : {PlyEncoding::Ascii, PlyEncoding::BinaryLittleEndian}) {
    write_ply(folder / "c.ply", full_cloud(), encoding);
    expect_same(read_cloud(folder / "c.ply"), full_cloud());
  }
}

TEST(CloudFile, ReadsBackAMesh) {
  const test::TempFolder folder;
  MeshData mesh;
  mesh.vertices = {{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.5f}, {0.0f, 1.0f, 0.0f}};
  mesh.color = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
  for (const PlyEncoding encoding : {PlyEncoding::Ascii, PlyEncoding::BinaryLittleEndian}) {
    write_ply(folder / "m.ply", mesh, encoding);
    const MeshData read = read_mesh(folder / "m.ply");
    EXPECT_EQ(read.vertices, mesh.vertices);
    EXPECT_EQ(read.color, mesh.color);
    EXPECT_EQ(read.triangles, mesh.triangles);
  }
}

TEST(CloudFile, RefusesACutFileAtAnyByteOrReadsAWholePrefix) {
  const test::TempFolder folder;
  write_pcd(folder / "0", full_cloud(), PcdEncoding::Ascii);
  write_pcd(folder / "1", full_cloud(), PcdEncoding::Binary);
  write_pcd(folder / "2", full_cloud(), PcdEncoding::BinaryCompressed);
  write_ply(folder / "3", full_cloud(), PlyEncoding::Ascii);
  write_ply(folder / "4", full_cloud(), PlyEncoding::BinaryLittleEndian);
  for (const char* name : {"0", "1", "2", "3", "4"}) {
    const std::vector<std::byte> whole = read_file(folder / name, 1 << 20);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      try {
        const CloudData cloud = parse_cloud(std::span(whole).first(size), name);
        EXPECT_EQ(cloud.size(), 12u);
        EXPECT_GT(size + 11, whole.size()) << "only digits of the last number may be missing";
      } catch (const InputError&) {
        continue;
      }
    }
  }
}

TEST(CloudFile, TellsThatAFileIsNotThereOrOfNoKnownEnding) {
  EXPECT_THROW((void)read_cloud("no/such.pcd"), InputError);
  EXPECT_THROW(write_cloud("cloud.xyz", full_cloud()), InputError);
}

}  // namespace
}  // namespace grapnel
