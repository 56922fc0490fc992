#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "core/files/file.h"
#include "core/files/file_reader.h"
#include "support/expect_error.h"
#include "support/pipe_writer.h"
#include "support/temp_folder.h"

namespace {

constexpr uint64_t kMaxBytes = 1 << 20;

std::string read(const std::string& path, uint64_t max_bytes = kMaxBytes) {
  const std::vector<uint8_t> bytes = maq::read_file(path, max_bytes);
  return {bytes.begin(), bytes.end()};
}

std::string made_pipe(const TempFolder& folder) {
  const std::string path = folder.file("pipe");
  EXPECT_EQ(mkfifo(path.c_str(), 0600), 0);
  return path;
}

TEST(FileReading, AFileOfUpToTheLimitIsReadWhole) {
  const TempFolder folder;
  std::string text(200000, 'a');
  text += "end";
  write_text(folder.file("a"), text);
  EXPECT_EQ(read(folder.file("a")), text);
  EXPECT_EQ(read(folder.file("a"), text.size()), text);
  expect_error(MAQ_ERROR_UNREADABLE, "is over 200002 bytes", [&] { read(folder.file("a"), text.size() - 1); });
  write_text(folder.file("empty"), "");
  EXPECT_EQ(read(folder.file("empty"), 0), "");
}

TEST(FileReading, AFileWithoutASizeIsBoundedByWhatIsRead) {
  EXPECT_GT(read("/proc/self/maps").size(), 1000u);  // stat() says 0
  expect_error(MAQ_ERROR_UNREADABLE, "is over 1000 bytes", [] { read("/proc/self/maps", 1000); });
}

TEST(FileReading, DevicesFoldersAndLinksToThemAreNoFiles) {
  const TempFolder folder;
  for (const char* device : {"/dev/zero", "/dev/null", "/dev/urandom"}) {
    expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a device", [&] { read(device); });
    expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a device", [&] { maq::open_file(device); });
  }
  std::filesystem::create_symlink("/dev/zero", folder.file("link"));
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a device", [&] { read(folder.file("link")); });
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a folder", [&] { read(folder.path().string()); });
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist", [&] { read(folder.file("none")); });
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist", [&] { read("/dev/null/none"); });
}

TEST(FileReading, APipeIsReadToItsEnd) {
  const TempFolder folder;
  const std::string path = made_pipe(folder);
  const std::string text(300000, 'b');
  const PipeWriter writer(path, text);
  EXPECT_EQ(read(path), text);
}

TEST(FileReading, APipeMayComeSlowlyOrBeEmpty) {
  const TempFolder folder;
  const std::string path = made_pipe(folder);
  {
    const PipeWriter writer(path, "abc", 100000);
    EXPECT_EQ(read(path), "abc");
  }
  const PipeWriter writer(path, "");
  EXPECT_EQ(read(path), "");
}

TEST(FileReading, AnEndlessPipeStopsAtTheLimit) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  std::thread writer([end = ends[1]] {
    const maq::UniqueFd pipe(end);
    const std::string zeros(1 << 16, 0);
    while (::write(pipe.get(), zeros.data(), zeros.size()) > 0) {
    }
  });
  signal(SIGPIPE, SIG_IGN);
  {
    const maq::UniqueFd reading_end(ends[0]);
    expect_error(MAQ_ERROR_UNREADABLE, "is over 1 MiB",
                 [&] { read("/proc/self/fd/" + std::to_string(reading_end.get())); });
  }
  writer.join();
}

TEST(FileReading, APipeWithoutAWriterIsRefused) {
  const TempFolder folder;
  const std::string path = made_pipe(folder);
  expect_error(MAQ_ERROR_UNREADABLE, "that no program opened to write", [&] { read(path); });
}

TEST(FileReading, APipeWhoseWriterSaysNothingIsRefused) {
  const TempFolder folder;
  const std::string path = made_pipe(folder);
  const maq::UniqueFd writer(::open(path.c_str(), O_RDWR));
  expect_error(MAQ_ERROR_UNREADABLE, "nothing was written for 10 s", [&] { read(path); });
}

TEST(FileReading, WhatIsReadBackAndForthIsNoPipe) {
  const TempFolder folder;
  const std::string path = made_pipe(folder);
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a pipe", [&] { maq::open_file(path); });
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a pipe", [&] { maq::FileReader reader(path); });
}

TEST(FileReading, TheStartIsCheckedBeforeTheRestIsRead) {
  const TempFolder folder;
  write_text(folder.file("long"), std::string(500000, 'a'));
  write_text(folder.file("short"), "abc");
  for (const auto& [name, size] : {std::pair("long", 65536), std::pair("short", 3)}) {
    std::vector<size_t> sizes;
    maq::read_file(folder.file(name), kMaxBytes, [&](const auto& start) { sizes.push_back(start.size()); });
    EXPECT_EQ(sizes, std::vector<size_t>{size_t(size)}) << name;
  }
  const auto refuse = [](const std::vector<uint8_t>&) { throw maq::Error(MAQ_ERROR_UNSUPPORTED, "not that"); };
  expect_error(MAQ_ERROR_UNSUPPORTED, "not that", [&] { maq::read_file(folder.file("long"), kMaxBytes, refuse); });
}

}  // namespace
