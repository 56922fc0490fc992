// Files that appear whole, and what else a path may lead to: links, devices, pipes, descriptors.
#include "core/files/atomic_file.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdarg>
#include <cstring>
#include <set>
#include <thread>
#include <utility>

#include "support/expect_error.h"
#include "support/file_size_limit.h"
#include "support/temp_folder.h"

namespace {

std::string linked_meanwhile;

}  // namespace

// In the place of the C library's: another program, which found out the name, puts a link to `linked_meanwhile` where
// the next unfinished file would be made.
extern "C" int open(const char* path, int flags, ...) {
  static const auto real = reinterpret_cast<int (*)(const char*, int, ...)>(dlsym(RTLD_NEXT, "open"));
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  if (!linked_meanwhile.empty() && std::strstr(path, ".part-") != nullptr) {
    EXPECT_EQ(symlink(std::exchange(linked_meanwhile, "").c_str(), path), 0) << path;
  }
  return real(path, flags, mode);
}

namespace {

namespace fs = std::filesystem;

class AtomicFile : public ::testing::Test {
 protected:
  static void write(const std::string& path, const std::string& text) {
    maq::AtomicFile file(path);
    file.append(text.data(), text.size());
    file.commit();
  }
  void expect_refused(const std::string& path, const std::string& part_of_text) {
    const size_t before = count();
    expect_error(MAQ_ERROR_UNWRITABLE, part_of_text, [&] { write(path, "new"); });
    EXPECT_EQ(count(), before) << path;
  }
  size_t count() const { return size_t(std::distance(fs::directory_iterator(folder_.path()), {})); }
  std::string file(const std::string& name) const { return folder_.file(name); }

  TempFolder folder_;
};

TEST_F(AtomicFile, ReplacesTheOldOneWithItsPermissionsWhenItIsWhole) {
  write_text(file("a"), "old");
  fs::permissions(file("a"), fs::perms(0600));
  {
    maq::AtomicFile unfinished(file("a"));
    unfinished.append("ne", 2);
  }
  EXPECT_EQ(read_text(file("a")), "old");
  write(file("a"), "new");
  EXPECT_EQ(read_text(file("a")), "new");
  EXPECT_EQ(fs::status(file("a")).permissions(), fs::perms(0600));
  EXPECT_EQ(count(), 1u);
}

TEST_F(AtomicFile, IsWrittenUnderANameThatNobodyKnowsBefore) {
  std::set<std::string> digits;
  for (int i = 0; i < 8; ++i) {
    const maq::AtomicFile one(file("a"), ".png");
    const std::string name = one.temporary_path();
    ASSERT_EQ(name.rfind(file("a.part-"), 0), 0u) << name;
    const std::string random = name.substr(file("a.part-").size(), 16);
    EXPECT_EQ(random.find_first_not_of("0123456789abcdef"), std::string::npos) << name;
    EXPECT_EQ(name, file("a.part-") + random + ".png");
    EXPECT_TRUE(digits.insert(random).second) << name;
  }
  const std::string longest(255, 'n');  // of a name
  write(file(longest), "new");
  EXPECT_EQ(read_text(file(longest)), "new");
}

TEST_F(AtomicFile, IsNotWrittenThroughALinkThatTookItsName) {
  write_text(file("other"), "of another user");
  linked_meanwhile = file("other");
  write(file("a"), "new");
  EXPECT_EQ(linked_meanwhile, "") << "the link was made";
  EXPECT_EQ(read_text(file("other")), "of another user");
  EXPECT_EQ(read_text(file("a")), "new");
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(file("a"))));
  EXPECT_EQ(count(), 3u) << "the link is not this program's to remove";
}

TEST_F(AtomicFile, KeepsALinkAndReplacesWhatItLeadsTo) {
  fs::create_directory(file("far"));
  write_text(file("far/a"), "old");
  fs::create_symlink("far/a", file("relative"));
  fs::create_symlink(file("relative"), file("chain"));
  fs::create_symlink("far/new", file("dangling"));
  for (const char* name : {"relative", "chain"}) {
    write(file(name), name);
    EXPECT_TRUE(fs::is_symlink(file(name)));
    EXPECT_EQ(read_text(file("far/a")), name);
  }
  write(file("dangling"), "made");
  EXPECT_TRUE(fs::is_symlink(file("dangling")));
  EXPECT_EQ(read_text(file("far/new")), "made");
  fs::create_symlink("loop", file("loop"));
  expect_refused(file("loop"), "cannot be made");
  EXPECT_EQ(count(), 5u);
}

TEST_F(AtomicFile, MakesNoFolder) {
  expect_refused(file("none/a"), "none/a cannot be made: No such file");
  EXPECT_FALSE(fs::exists(file("none")));
}

TEST_F(AtomicFile, WritesThroughToDevices) {
  fs::create_symlink("/dev/null", file("null"));
  write(file("null"), "new");
  EXPECT_TRUE(fs::is_symlink(file("null")));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  fs::create_symlink("/dev/full", file("full"));
  expect_refused(file("full"), "full cannot be written: No space left");
  EXPECT_EQ(count(), 2u);
}

TEST_F(AtomicFile, WritesThroughToAPipe) {
  ASSERT_EQ(mkfifo(file("pipe").c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = read_text(file("pipe")); });
  {
    maq::AtomicFile pipe(file("pipe"));
    const std::string text(300'000, 'n');  // more than a pipe holds
    pipe.append(text.data(), text.size());
    pipe.overwrite(1, "e", 1);
    pipe.commit();
  }
  reader.join();
  EXPECT_EQ(got.size(), 300'000u);
  EXPECT_EQ(got.substr(0, 4), "nenn");
  EXPECT_TRUE(fs::is_fifo(file("pipe")));
  EXPECT_EQ(count(), 1u);
}

TEST_F(AtomicFile, APipeThatNobodyReadsIsAnError) {
  ASSERT_EQ(mkfifo(file("pipe").c_str(), 0600), 0);
  expect_refused(file("pipe"), "pipe is a pipe that no program reads");
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  close(ends[0]);
  expect_refused("/dev/fd/" + std::to_string(ends[1]), "Broken pipe");  // and the process lives
  close(ends[1]);
}

TEST_F(AtomicFile, GoesOnWhereAnOpenDescriptorIs) {
  const int log = open(file("log").c_str(), O_WRONLY | O_CREAT, 0600);
  ASSERT_EQ(::write(log, "before ", 7), 7);
  fs::create_symlink("/proc/self/fd/" + std::to_string(log), file("link"));
  write("/dev/fd/" + std::to_string(log), "one ");
  write(file("link"), "two ");
  ASSERT_EQ(::write(log, "after", 5), 5);
  close(log);
  EXPECT_EQ(read_text(file("log")), "before one two after");
  expect_refused("/dev/fd/" + std::to_string(log), "cannot be made");
}

TEST_F(AtomicFile, IsNoFolderAndNoClipOnADevice) {
  expect_refused(folder_.path().string(), "is not a file");
  expect_error(MAQ_ERROR_UNWRITABLE, "is not a file", [] { maq::AtomicFile("/dev/null", ".mp4"); });
}

TEST_F(AtomicFile, ALimitOfFileSizesIsAnErrorAndNotTheEnd) {
  write_text(file("a"), "old");
  {
    const FileSizeLimit limit(2);
    expect_refused(file("a"), "a cannot be written: File too large");
  }
  EXPECT_EQ(read_text(file("a")), "old");
  // Signals that others sent or blocked are as before.
  sigset_t now;
  ASSERT_EQ(pthread_sigmask(SIG_SETMASK, nullptr, &now), 0);
  EXPECT_EQ(sigismember(&now, SIGXFSZ), 0);
}

TEST_F(AtomicFile, AProcessThatDiesLeavesTheOldOne) {
  write_text(file("a"), "old");
  const pid_t child = fork();
  if (child == 0) {
    maq::AtomicFile unfinished(file("a"));
    unfinished.append("new", 3);
    std::raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(read_text(file("a")), "old");
  EXPECT_EQ(count(), 2u) << "what it had written is beside it";
}

}  // namespace
