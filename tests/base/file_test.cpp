#include "base/file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>

#include "base/input_error.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

std::string text_of(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = read_file(file, 1 << 20);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(File, IsReadAsItWasWritten) {
  const test::TempFolder folder;
  const std::string text("a\0b\n", 4);
  write_file(folder / "f", std::string_view(text), WriteSync::Durable);
  EXPECT_EQ(text_of(folder / "f"), text);
  write_file(folder / "f", std::string_view());
  EXPECT_EQ(text_of(folder / "f"), "");
}

TEST(File, LeavesTheOldContentAndNothingElseWhenItCantBeWritten) {
  const test::TempFolder folder;
  std::filesystem::create_directory(folder / "taken");
  EXPECT_THROW(write_file(folder / "taken", std::string_view("x")), InputError);
  EXPECT_TRUE(std::filesystem::is_directory(folder / "taken"));
  EXPECT_FALSE(std::filesystem::exists(folder / "taken.part"));
  EXPECT_THROW(write_file(folder / "absent/f", std::string_view("x")), InputError);
}

TEST(File, RefusesFoldersAbsentFilesAndTooLargeOnes) {
  const test::TempFolder folder;
  write_file(folder / "f", std::string_view("12345"));
  EXPECT_THROW((void)read_file(folder.path(), 100), InputError);
  EXPECT_THROW((void)read_file(folder / "absent", 100), InputError);
  EXPECT_THROW((void)read_file("/dev/null", 100), InputError);
  EXPECT_EQ(read_file(folder / "f", 5).size(), 5u);
  EXPECT_THROW((void)read_file(folder / "f", 4), InputError);
}

TEST(File, DoesNotWaitForTheWriterOfAPipe) {
  const test::TempFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THROW((void)read_file(folder / "pipe", 100), InputError);
}

TEST(File, IsNeverSeenHalfWritten) {
  const test::TempFolder folder;
  const std::string a(5000, 'a');
  const std::string b(9000, 'b');
  write_file(folder / "f", std::string_view(a));
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (int round = 0; round < 300; ++round) {
      write_file(folder / "f", std::string_view(round % 2 == 0 ? b : a));
    }
    done = true;
  });
  while (!done) {
    const std::string seen = text_of(folder / "f");
    EXPECT_TRUE(seen == a || seen == b) << seen.size();
  }
  writer.join();
}

}  // namespace
}  // namespace grapnel
