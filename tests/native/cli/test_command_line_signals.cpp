// Ctrl-C, a closed terminal and a supervisor end the program while it waits for frames that do not come.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <list>
#include <string>

#include "support/program_run.h"
#include "support/temp_folder.h"
#include "support/wait_until.h"

namespace {

// The program in the background; killed with this.
class Running {
 public:
  Running(const TempFolder& folder, const std::string& arguments) : process_(fork()) {
    if (process_ != 0) return;
    const std::string command = "cd '" + folder.path().string() +
                                "' && exec env MAQ_BUNDLE='" MAQ_TEST_DATA "/tiny_bundle' " MAQ_TEST_EMULATOR
                                " '" MAQ_TEST_CLI "' " +
                                arguments + " >out.txt 2>err.txt";
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  ~Running() {
    if (process_ == 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  pid_t process() const { return process_; }
  void send(int number) const { kill(process_, number); }

  // The status of waitpid(); -1 when it goes on.
  int wait_for_end() {
    int status = -1;
    if (wait_until([&] { return waitpid(process_, &status, WNOHANG) == process_; })) process_ = 0;
    return status;
  }

 private:
  pid_t process_;
};

class CommandLineSignals : public ::testing::Test {
 protected:
  // Until then a signal would find it at work, and not in a wait that has to be ended.
  static bool waits_for_frames(const TempFolder& folder) {
    return wait_until([&] { return read_text(folder.file("err.txt")).find("no frame for") != std::string::npos; });
  }

  TempFolder folder_;
};

bool has_file_with(const TempFolder& folder, const std::string& part) {
  const std::filesystem::recursive_directory_iterator files(folder.path());
  return std::any_of(begin(files), end(files), [&](const auto& entry) {
    return entry.is_regular_file() && entry.path().filename().string().find(part) != std::string::npos;
  });
}

TEST_F(CommandLineSignals, EndAProgramThatWaitsForFramesWithWholeFiles) {
  struct Case {
    Case(int number_given, int times_given) : number(number_given), times(times_given) {}
    const int number, times;
    const TempFolder folder;
    Running program{folder, "densepose 'stub:people?size=64x48&stall=@2' --out o --overlay"};
  };
  std::list<Case> cases;  // at the same time, since each waits for a while
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    for (const int times : {1, 2}) cases.emplace_back(number, times);  // timeout(1) sends to process and group
  }
  for (Case& one : cases) {
    SCOPED_TRACE(std::string(strsignal(one.number)) + " " + std::to_string(one.times));
    ASSERT_TRUE(waits_for_frames(one.folder)) << read_text(one.folder.file("err.txt"));
    EXPECT_TRUE(wait_until([&] { return has_file_with(one.folder, ".json"); }));  // on a busy machine after the warning
    for (int i = 0; i < one.times; ++i) one.program.send(one.number);
    const int status = one.program.wait_for_end();
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 128 + one.number) << status;
    EXPECT_TRUE(has_file_with(one.folder, "_overlay.mp4"));
    EXPECT_FALSE(has_file_with(one.folder, ".part"));
  }
}

TEST_F(CommandLineSignals, GiveEachCommandTheExitCodeOfTheTable) {
  struct Case {
    Case(const char* arguments, int exit_code_given) : exit_code(exit_code_given), program(folder, arguments) {}
    const int exit_code;
    const TempFolder folder;
    Running program;
  };
  std::list<Case> cases;  // at the same time, since each waits for a while
  cases.emplace_back("record 'stub:pattern?size=16x16&stall=@3' a.maqrec", 0);
  cases.emplace_back("record 'stub:pattern?size=16x16&stall=@0' b.maqrec", 128 + SIGTERM);
  cases.emplace_back("edges 'stub:solids?size=64x48&stall=@2' --out o", 128 + SIGTERM);
  cases.emplace_back("health 'stub:pattern?size=64x48&stall=@2'", 0);
  cases.emplace_back("health 'stub:pattern?size=64x48&stall=@2' --max-frames 9", 128 + SIGTERM);
  cases.emplace_back("predict 'stub:pattern?size=64x48&stall=@2' --out p", 128 + SIGTERM);
  for (Case& one : cases) {
    const std::string said = one.folder.file("err.txt");
    ASSERT_TRUE(waits_for_frames(one.folder)) << read_text(said);
    one.program.send(SIGTERM);
    const int status = one.program.wait_for_end();
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == one.exit_code)
        << status << " instead of " << one.exit_code << ": " << read_text(said);
  }
}

TEST_F(CommandLineSignals, EndARecordingAsAWholeFile) {
  Running program(folder_, "record 'stub:pattern?size=16x16&stall=@3' a.maqrec");
  ASSERT_TRUE(waits_for_frames(folder_)) << read_text(folder_.file("err.txt"));
  EXPECT_GT(std::filesystem::file_size(folder_.file("a.maqrec")), 16u * 16 * 3);
  program.send(SIGHUP);
  const int status = program.wait_for_end();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_NE(read_text(folder_.file("out.txt")).find("To watch it: maquette play a.maqrec"), std::string::npos);
}

}  // namespace
